"""Count the characteristic roots right of a line by the argument principle.

Independent of how the roots were found: only det Δ is evaluated, on the line itself, through
the delayed signals (`drillctrl.delay.reduced`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.reduced import ReducedLoops, reduced
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.characteristic import magnitude_bound

_LARGEST_STEP = 1.2
_LARGEST_SURPRISE = 0.5
_MAX_POINTS = 400_000
# Up to so many states and points Δ itself costs less than its reduction.
_SMALL, _FEW = 6, 400


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


@dataclass(frozen=True, eq=False)
class Followed:
    """det Δ along the upper half of a vertical line.

    Attributes
    ----------
    result : RootCount
        What the turn of its argument says.
    omega : array, (k,)
        Im s of the points, increasing from 0 to the height.
    slope : array, (k,)
        (det Δ)'/det Δ there.
    """

    result: RootCount
    omega: FloatArray
    slope: ComplexArray


def count_right_of(system: DelaySystem, line: float) -> RootCount:
    """Count the roots with Re s > ``line``.

    Where the modulus of s exceeds the Perron bound all eigenvalues μ of (A0 + Σ Ai e^(−sτi))/s
    lie in the unit disc, so each factor 1 − μ of det Δ(s)/sⁿ stays in the right half-plane and
    the contour closes at infinity without further evaluation. Below, steps are halved until
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
    return follow(system, line).result


def follow(system: DelaySystem, line: float, loops: ReducedLoops | None = None) -> Followed:
    """Follow det Δ up a line; see `count_right_of`.

    Parameters
    ----------
    system : DelaySystem
        The system.
    line : float
        Re s of the line.
    loops : ReducedLoops, optional
        The same, reduced, where that is at hand.
    """
    height = magnitude_bound(system, line) * 1.001 + 1e-9
    turns = height * system.max_delay
    if not turns < 0.5 * _MAX_POINTS:
        return Followed(RootCount(line, None, height, 0), np.zeros(0), np.zeros(0, complex))
    # Denser towards the bottom, where det Δ is far from its asymptote.
    omega = height * np.linspace(0.0, 1.0, 40 + int(2.0 * turns)) ** 2
    if loops is None and (system.order > _SMALL or omega.size > _FEW):
        loops = reduced(system)
    phase, slope = _phase_and_slope(system, loops, line, omega)
    while True:
        undecided = RootCount(line, None, height, omega.size)
        if not np.isfinite(slope).all():
            return Followed(undecided, omega, slope)
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
        if omega.size > _MAX_POINTS or width[coarse].min() < 1e-13 * height:
            return Followed(undecided, omega, slope)
        middle = 0.5 * (omega[coarse] + omega[coarse + 1])
        new_phase, new_slope = _phase_and_slope(system, loops, line, middle)
        omega = np.insert(omega, coarse + 1, middle)
        phase = np.insert(phase, coarse + 1, new_phase)
        slope = np.insert(slope, coarse + 1, new_slope)
    beyond = _argument_beyond(system, complex(line, omega[-1]))
    total = system.order / 2 - (turn.sum() - beyond) / math.pi
    total -= system.order * (0.5 - math.atan2(omega[-1], line) / math.pi)
    whole = round(float(total))
    count = whole if abs(total - whole) < 1e-3 else None
    return Followed(RootCount(line, count, height, omega.size), omega, slope)


def _argument_beyond(system: DelaySystem, s: complex) -> float:
    """Return arg (det Δ(s)/sⁿ), the branch that vanishes at infinity."""
    matrix = characteristic.matrix(system, s)
    share = np.eye(system.order) - matrix / s
    return float(np.angle(1.0 - np.linalg.eigvals(share)).sum())


def _phase_and_slope(
    system: DelaySystem, loops: ReducedLoops | None, line: float, omega: FloatArray
) -> tuple[FloatArray, ComplexArray]:
    """Return arg det Δ and (det Δ)'/det Δ at line + iω; NaN where Δ is singular."""
    s = line + 1j * omega
    if loops is None:
        delta, change = characteristic.matrix_and_derivative(system, s)
        unit, amount = np.linalg.slogdet(delta)
        ratio = characteristic.trace_ratio(delta, change)
        return np.angle(unit), np.where(np.isfinite(amount), ratio, np.nan)
    sign, size, slope = loops.evaluate(s[None])
    return np.angle(sign[0]), np.where(np.isfinite(size[0]), slope[0], np.nan)
