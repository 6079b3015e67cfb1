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
from drillctrl.spectrum.characteristic import magnitude_bound

_LARGEST_STEP = 1.2
_LARGEST_SURPRISE = 0.5
_MAX_POINTS = 400_000
# Up to so many states and bound · τ Δ itself costs less than its reduction.
_SMALL, _FEW_TURNS = 6, 150.0
# More states are followed to so many times the bound: the end then costs no eigenvalues.
_FAR = 4.0


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
        Beyond this |Im s| no root lies right of the line, by a norm bound.
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

    Where the modulus of s exceeds k times the Perron bound all eigenvalues μ of
    (A0 + Σ Ai e^(−sτi))/s lie in a disc of radius 1/k, so each factor 1 − μ of det Δ(s)/sⁿ
    stays in the right half-plane and the contour closes at infinity without further
    evaluation. Below, steps are halved until the logarithmic derivative of det Δ, at both
    ends, limits the turn, and the turn is what it predicts. Roots close to the line, several
    of them too, make the derivative large on either side and so cannot slip through between
    two points.

    Parameters
    ----------
    system : DelaySystem
        Any.
    line : float
        Re s of the line.
    """
    bound = magnitude_bound(system, line)
    small = is_small(system.order, bound * system.max_delay)
    return follow(reduced(system, plain=small), line, bound).result


def is_small(order: int, turns: float) -> bool:
    """Whether Δ itself costs less than its reduction, for so many states and bound · τ."""
    return order <= _SMALL and turns < _FEW_TURNS


def follow(loops: ReducedLoops, line: float, bound: float) -> Followed:
    """Follow det Δ up a line; see `count_right_of`.

    Parameters
    ----------
    loops : ReducedLoops
        A single loop.
    line : float
        Re s of the line.
    bound : float
        What |s| of roots right of the line does not exceed: a Perron root.
    """
    bound = bound * 1.001 + 1e-9
    n, turns = loops.order, bound * float(loops.delays.max(initial=0.0))
    if not turns < 0.5 * _MAX_POINTS:
        return Followed(RootCount(line, None, bound, 0), np.zeros(0), np.zeros(0, complex))
    small = n <= _SMALL
    # Denser towards the bottom, where det Δ is far from its asymptote.
    first = 40 + int(2.0 * turns) + (0 if small else 2 * n)
    omega = bound * np.linspace(0.0, 1.0, first) ** 2
    if not small:
        omega = np.concatenate([omega, bound * np.geomspace(1.0, _FAR, 2 * n)[1:]])
    phase, slope = _phase_and_slope(loops, line, omega)
    while True:
        undecided = RootCount(line, None, bound, omega.size)
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
        if omega.size > _MAX_POINTS or width[coarse].min() < 1e-13 * bound:
            return Followed(undecided, omega, slope)
        middle = 0.5 * (omega[coarse] + omega[coarse + 1])
        new_phase, new_slope = _phase_and_slope(loops, line, middle)
        omega = np.insert(omega, coarse + 1, middle)
        phase = np.insert(phase, coarse + 1, new_phase)
        slope = np.insert(slope, coarse + 1, new_slope)
    top = complex(line, omega[-1])
    end = math.atan2(top.imag, top.real)
    beyond = phase[-1] - n * end
    # The branch that vanishes at infinity.
    beyond += 2 * math.pi * round((_argument_beyond(loops, top) - beyond) / (2 * math.pi))
    total = n / 2 - (turn.sum() + n * (math.pi / 2 - end) - beyond) / math.pi
    whole = round(float(total))
    count = whole if abs(total - whole) < 1e-3 else None
    return Followed(RootCount(line, count, bound, omega.size), omega, slope)


def _argument_beyond(loops: ReducedLoops, s: complex) -> float:
    """Return arg (det Δ(s)/sⁿ) to within 1, from Σ arg (1 − μ) over the eigenvalues μ."""
    share = np.eye(loops.order) - loops.matrices(np.array([[s]]))[0, 0] / s
    if loops.order <= _SMALL:
        return float(np.angle(1.0 - np.linalg.eigvals(share)).sum())
    # With |μ| below 1/4 three terms of the logarithm suffice for hundreds of states.
    square = share @ share
    powers = np.trace(share) + np.trace(square) / 2.0 + (square * share.T).sum() / 3.0
    return -float(powers.imag)


def _phase_and_slope(
    loops: ReducedLoops, line: float, omega: FloatArray
) -> tuple[FloatArray, ComplexArray]:
    """Return arg det Δ and (det Δ)'/det Δ at line + iω; NaN where Δ is singular."""
    sign, size, slope = (part[0] for part in loops.evaluate((line + 1j * omega)[None]))
    return np.angle(sign), np.where(np.isfinite(size), slope, np.nan)
