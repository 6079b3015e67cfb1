"""Close the loop around a system, and what it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem


def gain_matrices(
    feedback: FeedbackStructure, K1: npt.ArrayLike, K2: npt.ArrayLike | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return K1 and K2 as (m, p) arrays from flat lists, checked against the structure.

    Gains outside the structure's bounds are permitted; they bind the design only.

    Raises
    ------
    InputError
        If a gain is missing, not finite, or not zero where the structure has none.
    """
    shape = feedback.K1_lower.shape
    matrices = []
    for name, given in (("K1", K1), ("K2", K2)):
        try:
            flat = np.atleast_1d(np.asarray(0.0 if given is None else given, dtype=float)).ravel()
        except (TypeError, ValueError):
            raise InputError(name, repr(given), "a list of numbers") from None
        if given is None:
            flat = np.zeros(shape).ravel()
        if flat.size != shape[0] * shape[1]:
            count = shape[0] * shape[1]
            raise InputError(name, flat.tolist(), f"{count} gain(s), one for each output")
        if not np.isfinite(flat).all():
            raise InputError(name, flat.tolist(), "finite")
        matrices.append(flat.reshape(shape))
    unused = (feedback.K2_lower.ravel() == 0.0) & (feedback.K2_upper.ravel() == 0.0)
    if matrices[1].ravel()[unused].any():
        raise InputError("K2", matrices[1].ravel().tolist(), f"0 for structure {feedback.name}")
    return matrices[0], matrices[1]


@checks_kinds
def close_loop(
    system: DelaySystem,
    feedback: FeedbackStructure,
    K1: npt.ArrayLike,
    K2: npt.ArrayLike | None = None,
    delay: float | None = None,
) -> DelaySystem:
    """Close the loop: A0 + B K1 C and Aτ + B K2 C (Eq. 40).

    A delayed input or output makes a delayed term of each gain, with nothing approximated.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    feedback : FeedbackStructure
        Names the outputs and the inputs.
    K1, K2 : array_like, (m, p) or flat
        Gains on Y(t) and on Y(t − delay).
    delay : float, optional
        Delay of the fed-back signals; by default the system's own ``feedback_delay``.

    Returns
    -------
    DelaySystem
        The same states, inputs and outputs; u is what is added to the feedback.
    """
    gains = np.array(gain_matrices(feedback, K1, K2))
    return with_terms(
        system, *loop_channels(system, feedback), gains, feedback_lags(system, feedback, delay)
    )


def with_terms(
    system: DelaySystem, drive: FloatArray, measure: FloatArray, gains: FloatArray, lags: FloatArray
) -> DelaySystem:
    """Add the terms of gains that act through lags.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    drive, measure : array, (n, m) and (p, n)
        Columns of B and rows of C.
    gains, lags : array, (2, m, p)
        K1 and K2, and the delay of each entry.
    """
    matrices = {0.0: system.A0, **dict(zip(system.delays, system.delayed, strict=True))}
    for lag in set(lags[gains != 0.0].tolist()):
        term = drive @ ((lags == lag) * gains).sum(axis=0) @ measure
        matrices[lag] = matrices[lag] + term if lag in matrices else term
    delays = tuple(sorted(matrices))[1:]
    return system.with_matrices(matrices[0.0], [matrices[tau] for tau in delays], delays)


def feedback_lags(
    system: DelaySystem, feedback: FeedbackStructure, delay: float | None = None
) -> FloatArray:
    """Return the delay through which each entry of K1 and K2 acts, (2, m, p).

    It is that of the input and of the output together, and that of the feedback for K2.

    Parameters
    ----------
    system, feedback : DelaySystem and FeedbackStructure
        The plant, and its inputs and outputs that are used.
    delay : float, optional
        As for `close_loop`.
    """
    late = system.feedback_delay if delay is None else checked_number("delay", delay, 0.0)
    acts = [system.input_delays[system.input_names.index(name)] for name in feedback.inputs]
    seen = [system.output_delays[system.output_names.index(name)] for name in feedback.outputs]
    channels = np.array(acts)[:, None] + seen
    return np.stack([channels, channels + late])


def with_channels(
    system: DelaySystem, inputs: Sequence[str] = (), outputs: Sequence[str] = ()
) -> DelaySystem:
    """Return the system with some of its inputs and outputs; all where none are named.

    Raises
    ------
    InputError
        If there is no such input or output.
    """
    columns = _indices(system.input_names, inputs or system.input_names, "input")
    rows = _indices(system.output_names, outputs or system.output_names, "output")
    return replace(
        system,
        B=system.B[:, columns],
        C=system.C[rows],
        input_names=tuple(system.input_names[i] for i in columns),
        output_names=tuple(system.output_names[i] for i in rows),
        input_delays=tuple(system.input_delays[i] for i in columns),
        output_delays=tuple(system.output_delays[i] for i in rows),
    )


def loop_channels(
    system: DelaySystem, feedback: FeedbackStructure
) -> tuple[FloatArray, FloatArray]:
    """Return the columns of B and the rows of C that a structure uses.

    Raises
    ------
    InputError
        If the plant has no such input or output.
    """
    columns = _indices(system.input_names, feedback.inputs, "input")
    return system.B[:, columns], system.C[_indices(system.output_names, feedback.outputs, "output")]


def _indices(names: Sequence[str], wanted: Sequence[str], kind: str) -> list[int]:
    for name in wanted:
        if name not in names:
            raise InputError(kind, name, f"one of {', '.join(names)}")
    return [names.index(name) for name in wanted]
