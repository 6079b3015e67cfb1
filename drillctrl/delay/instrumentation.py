"""Sensors and actuators between a system and its controller, as further states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem


@checks_kinds
def with_filter(
    system: DelaySystem, outputs: Sequence[str], time_constant: float, delay: float = 0.0
) -> DelaySystem:
    """Return a system whose named outputs are measured late and through a first-order filter.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    outputs : sequence of str
        Those that are filtered: T yf'(t) = y(t − delay) − yf(t).
    time_constant : float
        T > 0.
    delay : float
        Age of what enters the filter; 0 for none.

    Returns
    -------
    DelaySystem
        With further states and outputs ``NAME_filtered``; all others stay.

    Raises
    ------
    InputError
        If there is no such output, or a number is out of range.
    """
    constant = checked_number("time_constant", time_constant, 0.0, 1e9, open_low=True)
    age = checked_number("delay", delay, 0.0, 1e9)
    rows = [_index(system.output_names, name, "output") for name in outputs]
    n, more = system.order, len(rows)
    measured = system.C[rows] / constant
    zero = np.zeros((n + more, n + more))
    now = zero.copy()
    now[:n, :n] = system.A0
    now[n:, n:] = -np.eye(more) / constant
    late = dict(zip(system.delays, system.delayed, strict=True))
    matrices = {}
    for tau, matrix in late.items():
        matrices[tau] = zero.copy()
        matrices[tau][:n, :n] = matrix
    for i, row in enumerate(rows):
        old = age + system.output_delays[row]
        entering = now if old == 0.0 else matrices.setdefault(old, zero.copy())
        entering[n + i, :n] += measured[i]
    seen = np.zeros((len(system.C) + more, n + more))
    seen[: len(system.C), :n] = system.C
    seen[len(system.C) :, n:] = np.eye(more)
    added = tuple(f"{name}_filtered" for name in outputs)
    return replace(
        system,
        A0=now,
        delayed=tuple(matrices[tau] for tau in sorted(matrices)),
        delays=tuple(sorted(matrices)),
        B=np.vstack([system.B, np.zeros((more, system.B.shape[1]))]),
        C=seen,
        state_names=(*system.state_names, *added),
        output_names=(*system.output_names, *added),
        output_delays=(*system.output_delays, *[0.0] * more),
    )


@checks_kinds
def with_late_output(
    system: DelaySystem, name: str, delay: float, late_name: str | None = None
) -> DelaySystem:
    """Return a system with one more output: one that there is, seen later.

    So a controller may use one signal with several delays.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    name : str
        The output.
    delay : float
        How much later, ≥ 0.
    late_name : str, optional
        Of the further output; ``NAME_late`` without it.

    Raises
    ------
    InputError
        If there is no such output, the name is taken, or the delay is out of range.
    """
    row = _index(system.output_names, name, "output")
    later = system.output_delays[row] + checked_number("delay", delay, 0.0, 1e9)
    return replace(
        system,
        C=np.vstack([system.C, system.C[row]]),
        output_names=(*system.output_names, late_name or f"{name}_late"),
        output_delays=(*system.output_delays, later),
    )


@checks_kinds
def with_actuator_lag(system: DelaySystem, name: str, time_constant: float) -> DelaySystem:
    """Return a system one of whose inputs acts through a first-order lag.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    name : str
        The input: T a' = u − a, and a is what acts.
    time_constant : float
        T > 0.

    Returns
    -------
    DelaySystem
        With a further state ``NAME_acting``.

    Raises
    ------
    InputError
        If there is no such input, or T is out of range.
    """
    constant = checked_number("time_constant", time_constant, 0.0, 1e9, open_low=True)
    column = _index(system.input_names, name, "input")
    n = system.order
    grown = np.zeros((n + 1, n + 1))
    grown[:n, :n] = system.A0
    grown[:n, n] = system.B[:, column]
    grown[n, n] = -1.0 / constant
    drive = np.vstack([system.B, np.zeros(system.B.shape[1])])
    drive[:, column] = 0.0
    drive[n, column] = 1.0 / constant
    return replace(
        system,
        A0=grown,
        delayed=tuple(np.pad(matrix, (0, 1)) for matrix in system.delayed),
        B=drive,
        C=np.hstack([system.C, np.zeros((len(system.C), 1))]),
        state_names=(*system.state_names, f"{name}_acting"),
    )


def _index(names: Sequence[str], name: str, kind: str) -> int:
    if name not in names:
        raise InputError(kind, name, f"one of {', '.join(names)}")
    return names.index(name)
