"""Delayed output feedback as sampled python-control systems."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.extras import required
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.closing import gain_matrices
from drillctrl.delay.structure import FeedbackStructure

if TYPE_CHECKING:
    import control

Gains = Callable[[float, float, float], tuple[FloatArray, FloatArray]]


def _memory(delay: float, period: float) -> int:
    """Return how many past samples a delayed output needs."""
    return math.floor(delay / period + 1e-9) + 1


def _tap(delay: float, period: float) -> tuple[int, float]:
    """Return k and f: the delayed output is (1 − f) y(i − k) + f y(i − k − 1)."""
    k = math.floor(delay / period + 1e-9)
    return k, max(delay / period - k, 0.0)


@checks_kinds
def controller_system(
    structure: FeedbackStructure,
    K1: npt.ArrayLike,
    K2: npt.ArrayLike | None,
    delay: float,
    period: float,
) -> control.StateSpace:
    """Return u = K1 Y(t) + K2 Y(t − τ), sampled, as a linear python-control system.

    Parameters
    ----------
    structure, K1, K2 : FeedbackStructure and gains
        As in `close_loop`. The sign is that of the gains: connect it with positive feedback.
    delay : float
        τ; between two samples the delayed outputs are interpolated linearly.
    period : float
        Sampling period.

    Returns
    -------
    control.StateSpace
        Inputs are the outputs of the plant, outputs are its inputs; the states are the past
        samples of each output, latest first.
    """
    control = required("control", "control")

    now, past = gain_matrices(structure, K1, K2)
    step = checked_number("period", period, 0.0, open_low=True)
    lag = checked_number("delay", delay, 0.0)
    p = len(structure.outputs)
    size = _memory(lag, step) if past.any() else 0
    shift = np.eye(size, k=-1)
    enter = np.eye(size, 1)
    taps, direct = np.zeros((1, size)), 0.0
    if size:
        k, fraction = _tap(lag, step)
        # Sample i − j stands at place j − 1; the present one goes straight through.
        for back, weight in ((k, 1.0 - fraction), (k + 1, fraction)):
            if back == 0:
                direct += weight
            elif weight:
                taps[0, back - 1] += weight
    unit = np.eye(p)
    return control.ss(
        np.kron(unit, shift),
        np.kron(unit, enter),
        past @ np.kron(unit, taps),
        now + direct * past,
        step,
        inputs=list(structure.outputs),
        outputs=list(structure.inputs),
        states=[f"{name}[-{k + 1}]" for name in structure.outputs for k in range(size)],
    )


@checks_kinds
def scheduled_controller(
    structure: FeedbackStructure,
    gains: Gains,
    blades: int,
    slowest: float,
    period: float,
    limit: float | None = None,
) -> control.NonlinearIOSystem:
    """Return a sampled controller whose gains and delay follow the operating point.

    Parameters
    ----------
    structure : FeedbackStructure
        Names the outputs and inputs.
    gains : callable
        (ω0, δ0, ψ) → K1, K2, each (m, p) or flat: `GainTable.gains_at`, for example.
    blades : int
        n: the delay is 2π/(n ω0).
    slowest : float
        Lowest ω0; lower ones are taken for it. It sets the length of the memory.
    period : float
        Sampling period.
    limit : float, optional
        Largest absolute command.

    Returns
    -------
    control.NonlinearIOSystem
        Inputs are the plant's outputs, then ``omega0``, ``delta0``, ``psi``.
    """
    control = required("control", "control")

    lowest = checked_number("slowest", slowest, 0.0, open_low=True)
    step = checked_number("period", period, 0.0, open_low=True)
    most = None if limit is None else checked_number("limit", limit, 0.0, open_low=True)
    if blades < 1:
        raise InputError("blades", blades, "at least 1")
    p = len(structure.outputs)
    size = _memory(2.0 * math.pi / (blades * lowest), step)

    def update(t: float, x: FloatArray, inputs: FloatArray, params: Any) -> FloatArray:
        memory = x.reshape(p, size)
        return np.hstack([inputs[:p, None], memory[:, :-1]]).ravel()

    def output(t: float, x: FloatArray, inputs: FloatArray, params: Any) -> FloatArray:
        omega0, delta0, psi = (float(value) for value in inputs[p:])
        omega0 = max(omega0, lowest)
        samples = np.hstack([inputs[:p, None], x.reshape(p, size)])
        k, fraction = _tap(2.0 * math.pi / (blades * omega0), step)
        late = (1.0 - fraction) * samples[:, k] + fraction * samples[:, min(k + 1, size)]
        K1, K2 = (np.reshape(K, (-1, p)) for K in gains(omega0, delta0, psi))
        command = K1 @ samples[:, 0] + K2 @ late
        return command if most is None else np.clip(command, -most, most)

    return control.nlsys(
        update,
        output,
        inputs=[*structure.outputs, "omega0", "delta0", "psi"],
        outputs=list(structure.inputs),
        states=[f"{name}[-{k + 1}]" for name in structure.outputs for k in range(size)],
        dt=step,
    )
