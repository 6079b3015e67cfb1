"""Gain and phase margins of a loop broken at its input."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import elementwise

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.robustness.transfer import frequency_grid, loop_transfer

# Gain margins beyond its inverse are infinite.
_SMALL = 1e-4
Transfer = Callable[[FloatArray], ComplexArray]


@dataclass(frozen=True)
class LoopMargins:
    """Margins of the loop broken at the plant input.

    Attributes
    ----------
    gain_up, gain_down : float
        Nearest factors above and below 1 of the loop gain that destabilise; inf and 0 where
        there is none.
    phase : float
        Smallest phase change that destabilises, degrees; inf if there is none.
    sensitivity : float
        Largest |1/(1 + L(iω))|.
    """

    gain_up: float
    gain_down: float
    phase: float
    sensitivity: float


def loop_margins(
    plant: DelaySystem, structure: FeedbackStructure, K1: FloatArray, K2: FloatArray
) -> LoopMargins:
    """Read gain and phase margins and the peak of the sensitivity from exact data.

    Parameters
    ----------
    plant : DelaySystem
        The plant.
    structure, K1, K2 : FeedbackStructure and arrays
        Feedback to one input that stabilises it.

    Notes
    -----
    Each crossing of the negative real axis, and of the unit circle, is found between two
    frequencies of a grid on which L turns little, and sharpened.
    """

    def transfer(omega: FloatArray) -> ComplexArray:
        data = loop_transfer(plant, structure, K1, K2, omega)
        return np.asarray(data[0, 0])

    closed = close_loop(plant, structure, K1, K2)
    omega = frequency_grid(closed, response=transfer, small=_SMALL)
    loop = transfer(omega)
    crossings = _zeros(lambda w: transfer(w).imag, omega, loop.imag)
    real = transfer(crossings).real if crossings.size else np.zeros(0)
    factors = -1.0 / np.append(real[real < 0.0], _at_zero(transfer))
    factors = factors[np.isfinite(factors) & (factors > 0.0)]
    unit = _zeros(lambda w: np.abs(transfer(w)) - 1.0, omega, np.abs(loop) - 1.0)
    phases = np.abs(np.angle(-transfer(unit))) if unit.size else np.zeros(0)
    return LoopMargins(
        float(factors[factors > 1.0].min(initial=math.inf)),
        float(factors[factors < 1.0].max(initial=0.0)),
        float(np.degrees(phases).min(initial=math.inf)),
        float((1.0 / np.abs(1.0 + loop)).max()),
    )


def _at_zero(transfer: Transfer) -> FloatArray:
    """Return L(0) where it lies on the negative real axis."""
    value = transfer(np.zeros(1)).real
    return np.asarray(value[value < 0.0])


def _zeros(
    function: Callable[[FloatArray], FloatArray], omega: FloatArray, values: FloatArray
) -> FloatArray:
    """Return where a function changes sign between the points of a grid."""
    change = np.flatnonzero(np.signbit(values[1:]) != np.signbit(values[:-1]))
    if not change.size:
        return np.zeros(0)
    return np.asarray(elementwise.find_root(function, (omega[change], omega[change + 1])).x)
