"""A python-control plant with delays as a DelaySystem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem

if TYPE_CHECKING:
    import control


@checks_kinds
def from_control(
    plant: control.StateSpace,
    input_delay: float | Sequence[float] = 0.0,
    *,
    output_delay: float | Sequence[float] = 0.0,
    delayed: Mapping[float, npt.ArrayLike] | None = None,
    feedback_delay: float | None = None,
) -> DelaySystem:
    """Return a continuous python-control plant with delays as a `DelaySystem`.

    Parameters
    ----------
    plant : control.StateSpace
        X' = A X + B u, Y = C X; names are kept.
    input_delay, output_delay : float or sequence of float
        How late inputs act and outputs are seen, of all or of each.
    delayed : mapping of float to array_like, (n, n), optional
        τi → Ai in X' = A X(t) + Σ Ai X(t − τi) + B u.
    feedback_delay : float, optional
        τ of K2 Y(t − τ), counted from when Y is seen; by default the largest of ``delayed``.

    Raises
    ------
    InputError
        If the plant is no state-space system, is sampled, feeds its input through, or shapes do
        not fit.
    """
    parts = ("A", "B", "C", "D", "dt", "state_labels", "input_labels", "output_labels")
    if not all(hasattr(plant, name) for name in parts):
        raise InputError("plant", type(plant).__name__, "a state-space system: control.ss(plant)")
    if plant.dt:
        raise InputError("plant", f"sampled every {plant.dt}", "in continuous time")
    if np.any(plant.D):
        raise InputError("plant", "with direct feedthrough D", "with D = 0")
    terms = {} if delayed is None else dict(delayed)
    b, c = np.asarray(plant.B, dtype=float), np.asarray(plant.C, dtype=float)
    return DelaySystem(
        np.asarray(plant.A, dtype=float),
        tuple(np.asarray(matrix, dtype=float) for matrix in terms.values()),
        tuple(terms),
        b,
        c,
        state_names=tuple(plant.state_labels),
        input_names=tuple(plant.input_labels),
        output_names=tuple(plant.output_labels),
        input_delays=_of_each(input_delay, b.shape[1]),
        output_delays=_of_each(output_delay, len(c)),
        feedback_delay=feedback_delay,  # type: ignore[arg-type]
    )


def _of_each(delay: float | Sequence[float], count: int) -> tuple[float, ...]:
    given = np.asarray(delay, dtype=float)
    return tuple(given.tolist()) if given.ndim else (float(given),) * count
