"""Count the characteristic roots right of a line by the argument principle.

Independent of how the roots were found: only det Δ is evaluated, on the line itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.characteristic import magnitude_bound

_LARGEST_STEP = 1.2
_LARGEST_SURPRISE = 0.5
_MAX_POINTS = 200_000


@dataclass(frozen=True)
class RootCount:
    """Number of characteristic roots right of a line.

    Attributes
    ----------
    line : float
        Re s of the line.
    count : int or None
        Roots right of it, with multiplicity, conjugates counted; None if undecided.
    height : float
        The line was followed up to this |Im s|; beyond it the norm bound decides.
    points : int
        Evaluations of det Δ.
    """

    line: float
    count: int | None
    height: float
    points: int


def count_right_of(system: DelaySystem, line: float) -> RootCount:
    """Count the roots with Re s > ``line``.

    Where r, the modulus of s, exceeds the Perron bound ρ, each eigenvalue of I − M(s)/s turns
    by less than asin(ρ/r), so det Δ(s)/sⁿ stays in the right half-plane beyond ρ/sin(π/2n) and the
    contour closes at infinity without further evaluation. Below, steps are halved until
    the logarithmic derivative of det Δ, at both ends, limits the turn, and the turn is what
    it predicts. Roots close to the line, several of them too, make the derivative large on
    either side and so cannot slip through between two points.

    Parameters
    ----------
    system : DelaySystem
        Any.
    line : float
        Re s of the line.
    """
    n = system.order
    height = magnitude_bound(system, line) / math.sin(math.pi / (2 * n)) * 1.001 + 1e-9
    first = 32 + int(2.0 * height * system.max_delay)
    if first > _MAX_POINTS:
        return RootCount(line, None, height, 0)
    # Denser towards the bottom, where det Δ is far from its asymptote.
    omega = height * np.linspace(0.0, 1.0, first) ** 2
    phase, slope = _phase_and_slope(system, line, omega)
    points = first
    while True:
        if not np.isfinite(slope).all():
            return RootCount(line, None, height, points)
        width = np.diff(omega)
        turn = np.remainder(np.diff(phase) + math.pi, 2 * math.pi) - math.pi
        # arg det Δ(line + iω) changes at the rate Re (det Δ)'/det Δ.
        expected = 0.5 * width * (slope.real[1:] + slope.real[:-1])
        size = width * np.maximum(np.abs(slope[1:]), np.abs(slope[:-1]))
        coarse = np.flatnonzero(
            (size > _LARGEST_STEP) | (np.abs(turn - expected) > _LARGEST_SURPRISE)
        )
        if coarse.size == 0:
            break
        if points > _MAX_POINTS or width[coarse].min() < 1e-13 * height:
            return RootCount(line, None, height, points)
        middle = 0.5 * (omega[coarse] + omega[coarse + 1])
        new_phase, new_slope = _phase_and_slope(system, line, middle)
        omega = np.insert(omega, coarse + 1, middle)
        phase = np.insert(phase, coarse + 1, new_phase)
        slope = np.insert(slope, coarse + 1, new_slope)
        points += middle.size
    end = math.atan2(omega[-1], line)
    rest = n * (math.pi / 2 - end)
    beyond = np.remainder(phase[-1] - n * end + math.pi, 2 * math.pi) - math.pi
    count = n / 2 - (turn.sum() + rest - beyond) / math.pi
    whole = round(float(count))
    return RootCount(line, whole if abs(count - whole) < 1e-3 else None, height, points)


def _phase_and_slope(
    system: DelaySystem, line: float, omega: FloatArray
) -> tuple[FloatArray, ComplexArray]:
    """Return arg det Δ and (det Δ)'/det Δ at line + iω; NaN where Δ is singular."""
    s = line + 1j * omega
    sign, size = np.linalg.slogdet(characteristic.matrix(system, s))
    slope = characteristic.log_derivative(system, s)
    return np.angle(sign), np.where(np.isfinite(size), slope, np.nan)
