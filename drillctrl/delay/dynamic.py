"""Controllers with states, as further states of the plant: static gains then close the loop.

Every function returns the plant with the controller's states and the structure of its gains,
which `design`, `analyze` and `close_loop` take as any other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.closing import with_channels
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem

Controlled = tuple[DelaySystem, FeedbackStructure]

_MOST_STATES = 20


@checks_kinds
def pid_control(
    system: DelaySystem,
    input_name: str,
    output_name: str,
    *,
    proportional: float = 10.0,
    integral: float = 10.0,
    derivative: float = 0.0,
    filter_time: float = 0.0,
) -> Controlled:
    """Return u = Kp y + Ki ∫y dt + Kd s/(T s + 1) y, PI by default.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    input_name, output_name : str
        u and y. A late y is late in all three terms.
    proportional, integral, derivative : float
        Largest absolute gains; a term with 0 is left out.
    filter_time : float
        T > 0, needed where there is a derivative.

    Returns
    -------
    DelaySystem, FeedbackStructure
        With outputs ``NAME_integral`` and ``NAME_rate``; K1 = (Kp, Ki, Kd) as far as they are
        there.

    Raises
    ------
    InputError
        If there is no such input or output, or a number is out of range.
    """
    limits = {"": proportional, "_integral": integral, "_rate": derivative}
    for name, limit in zip(
        ("proportional", "integral", "derivative"), limits.values(), strict=True
    ):
        checked_number(name, limit, 0.0, 1e9)
    used = [suffix for suffix, limit in limits.items() if limit]
    if not used:
        raise InputError("proportional, integral, derivative", (0.0, 0.0, 0.0), "not all 0")
    measured = with_channels(system, (input_name,), (output_name,))
    row = measured.C
    n = system.order
    states: list[tuple[str, FloatArray, float]] = []
    if integral:
        states.append((f"{output_name}_integral", row, 0.0))
    if derivative:
        constant = checked_number("filter_time", filter_time, 0.0, 1e9, open_low=True)
        states.append((f"{output_name}_filter", row / constant, -1.0 / constant))
    k = len(states)
    seen = [np.pad(row, ((0, 0), (0, k)))] if proportional else []
    if integral:
        seen.append(np.eye(1, n + k, n))
    if derivative:
        seen.append((np.pad(row, ((0, 0), (0, k))) - np.eye(1, n + k, n + k - 1)) / constant)
    a0 = np.pad(system.A0, (0, k))
    for i, (_, drive, own) in enumerate(states):
        a0[n + i, :n], a0[n + i, n + i] = drive, own
    names = tuple(f"{output_name}{suffix}" for suffix in used)
    old = [i for i, name in enumerate(system.output_names) if name not in names]
    grown = replace(
        system,
        A0=a0,
        delayed=tuple(np.pad(matrix, (0, k)) for matrix in system.delayed),
        B=np.pad(system.B, ((0, k), (0, 0))),
        C=np.vstack([*seen, np.pad(system.C[old], ((0, 0), (0, k)))]),
        state_names=(*system.state_names, *(name for name, _, _ in states)),
        output_names=(*names, *(system.output_names[i] for i in old)),
        output_delays=(
            *measured.output_delays * len(names),
            *(system.output_delays[i] for i in old),
        ),
    )
    most = np.array([[limits[suffix] for suffix in used]])
    zero = np.zeros_like(most)
    return grown, FeedbackStructure("pid", names, -most, most, zero, zero, (input_name,))


@checks_kinds
def dynamic_control(
    system: DelaySystem,
    inputs: Sequence[str],
    outputs: Sequence[str],
    order: int,
    bound: float = 10.0,
) -> Controlled:
    """Return a controller of any order: z' = E z + F y, u = G z + H y.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    inputs, outputs : sequence of str
        u and y.
    order : int
        Number of z, 1 to 20.
    bound : float
        Largest absolute value of every free entry.

    Returns
    -------
    DelaySystem, FeedbackStructure
        K1 = [[H, G], [F, E]] on (y, z), all free; with one input and one output in the form of
        a chain, zi' = z(i+1), whose last row of E, G and H are free and which loses nothing.

    Raises
    ------
    InputError
        If there is no such input or output, or a number is out of range.
    """
    k = checked_integer("order", order, 1, _MOST_STATES)
    limit = checked_number("bound", bound, 0.0, 1e9, open_low=True)
    chosen = with_channels(system, inputs, outputs)
    m, p = chosen.B.shape[1], len(chosen.C)
    n = system.order
    names = tuple(f"z{i + 1}" for i in range(k))
    rates = tuple(f"{name}_rate" for name in names)
    grown = replace(
        chosen,
        A0=np.pad(system.A0, (0, k)),
        delayed=tuple(np.pad(matrix, (0, k)) for matrix in system.delayed),
        B=np.block([[chosen.B, np.zeros((n, k))], [np.zeros((k, m)), np.eye(k)]]),
        C=np.block([[chosen.C, np.zeros((p, k))], [np.zeros((k, n)), np.eye(k)]]),
        state_names=(*system.state_names, *names),
        input_names=(*chosen.input_names, *rates),
        output_names=(*chosen.output_names, *names),
        input_delays=(*chosen.input_delays, *[0.0] * k),
        output_delays=(*chosen.output_delays, *[0.0] * k),
    )
    lower, upper = np.full((m + k, p + k), -limit), np.full((m + k, p + k), limit)
    if m == p == 1:
        chain = np.eye(k, k + 1, 2)
        chain[-1, 0] = 1.0
        lower[m:], upper[m:] = chain, chain
        lower[-1, p:], upper[-1, p:] = -limit, limit
    zero = np.zeros_like(lower)
    structure = FeedbackStructure(
        f"dynamic-{k}", grown.output_names, lower, upper, zero, zero, grown.input_names
    )
    return grown, structure


@checks_kinds
def observer_control(
    system: DelaySystem,
    inputs: Sequence[str],
    outputs: Sequence[str],
    feedback: float = 10.0,
    correction: float = 10.0,
) -> Controlled:
    """Return feedback of an observed state: u = K x̂ with x̂ a copy of the plant, corrected by L.

    x̂' = A0 x̂ + Σ Ai x̂(t − τi) + B u + L (y − C x̂), late inputs and outputs in the copy as well.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    inputs, outputs : sequence of str
        u and y.
    feedback, correction : float
        Largest absolute entries of K and of L.

    Returns
    -------
    DelaySystem, FeedbackStructure
        K1 = [[K, 0], [0, L]] on (x̂, y − C x̂). The roots of the loop are those of A0 + B K with
        the delayed terms, and those of A0 − L C.

    Raises
    ------
    InputError
        If there is no such input or output, or a number is out of range.
    """
    chosen = with_channels(system, inputs, outputs)
    sizes = [
        checked_number(name, value, 0.0, 1e9, open_low=True)
        for name, value in (("feedback", feedback), ("correction", correction))
    ]
    n, m, p = system.order, chosen.B.shape[1], len(chosen.C)
    eye, nothing = np.eye(n), np.zeros((n, n))

    def twice(matrix: FloatArray) -> FloatArray:
        return np.asarray(np.block([[matrix, nothing], [nothing, matrix]]))

    observed = tuple(f"{name}_observed" for name in system.state_names)
    errors = tuple(f"{name}_error" for name in chosen.output_names)
    grown = replace(
        chosen,
        A0=twice(system.A0),
        delayed=tuple(twice(matrix) for matrix in system.delayed),
        B=np.block([[chosen.B, nothing], [chosen.B, eye]]),
        C=np.block([[nothing, eye], [chosen.C, -chosen.C]]),
        state_names=(*system.state_names, *observed),
        input_names=(*chosen.input_names, *(f"{name}_rate" for name in observed)),
        output_names=(*observed, *errors),
        input_delays=(*chosen.input_delays, *[0.0] * n),
        output_delays=(*[0.0] * n, *chosen.output_delays),
    )
    most = np.zeros((m + n, n + p))
    most[:m, :n], most[m:, n:] = sizes
    zero = np.zeros_like(most)
    structure = FeedbackStructure(
        "observer", grown.output_names, -most, most, zero, zero, grown.input_names
    )
    return grown, structure
