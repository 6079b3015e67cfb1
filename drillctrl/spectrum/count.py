"""Count the characteristic roots right of a line by the argument principle.

Independent of how the roots were found: only det Δ is evaluated, on the line itself, through
the delayed signals (`drillctrl.delay.reduced`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.reduced import ReducedLoops, reduced
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.characteristic import magnitude_bound
from drillctrl.spectrum.parts import parts

IntArray = npt.NDArray[np.int64]
_LARGEST_STEP = 1.2
_LARGEST_SURPRISE = 0.5
_MAX_POINTS = 400_000
_TOGETHER = 20_000
# What stands for no count in an array of counts.
UNDECIDED = -1
# Up to so many states and bound · τ Δ itself costs less than its reduction.
_SMALL, _FEW_TURNS = 6, 150.0
# The line is followed to so many times the bound, where the end costs no eigenvalues.
_NEAR, _FAR = 2.1, 4.0


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


@checks_kinds
def count_right_of(system: DelaySystem, line: float) -> RootCount:
    """Count the roots with Re s > ``line``.

    Where the modulus of s exceeds k times the Perron bound all eigenvalues μ of
    (A0 + Σ Ai e^(−sτi))/s lie in a disc of radius 1/k, so each factor 1 − μ of det Δ(s)/sⁿ
    turns by less than asin (1/k) and the contour closes at infinity without further
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

    Raises
    ------
    InputError
        If ``line`` is no number.
    """
    if math.isnan(line):
        raise InputError("line", line, "a number")
    bound = magnitude_bound(system, line)
    small = is_small(system.order, bound * system.max_delay)
    result = follow(_SmallLoop(system) if small else reduced(system), line, bound).result
    if result.count is not None:
        return result
    # What cannot be followed as a whole may be in its parts.
    every = parts(system)
    if len(every) == 1:
        return result
    counts = [count_right_of(part, line).count for part in every]
    known = [count for count in counts if count is not None]
    return replace(result, count=sum(known)) if len(known) == len(counts) else result


def is_small(order: int, turns: float) -> bool:
    """Whether Δ itself costs less than its reduction, for so many states and bound · τ."""
    return order <= _SMALL and turns < _FEW_TURNS


class _SmallLoop:
    """A single loop of few states by Δ itself: what `follow` asks of it, without overhead."""

    count = 1

    def __init__(self, system: DelaySystem) -> None:
        self.system = system.balanced
        self.order = system.order
        self.delays = np.array([system.delays])

    def phase_and_slope(self, s: ComplexArray) -> tuple[FloatArray, ComplexArray]:
        """Return arg det Δ and (det Δ)'/det Δ; infinite or NaN where Δ is singular."""
        delta, change = characteristic.matrix_and_derivative(self.system, s)
        # Where Δ is singular some versions of numpy warn.
        with np.errstate(divide="ignore", invalid="ignore"):
            sign, _ = np.linalg.slogdet(delta)
        return np.arctan2(sign.imag, sign.real), characteristic.trace_ratio(delta, change)


_Loops = ReducedLoops | _SmallLoop


def follow(loops: _Loops, line: float, bound: float) -> Followed:
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
    limit = np.array([bound * 1.001 + 1e-9])
    traced = _traced(loops, line, limit)
    count = None
    if not traced.undecided[0]:
        turn = np.array([traced.turn.sum()])
        total = _total(loops, line, traced.omega[-1:], traced.phase[-1:], turn)
        whole = round(float(total[0])) if np.isfinite(total[0]) else -1
        count = whole if abs(float(total[0]) - whole) < 1e-3 and whole >= 0 else None
    result = RootCount(line, count, float(limit[0]), traced.omega.size)
    return Followed(result, traced.omega, traced.slope)


def count_many(loops: ReducedLoops, line: float, bounds: FloatArray) -> IntArray:
    """Count the roots right of a line of many loops at once, (N,).

    Parameters
    ----------
    loops : ReducedLoops
        N loops.
    line : float
        Re s of the line.
    bounds : array, (N,)
        As in `follow`.

    Returns
    -------
    int array, (N,)
        `UNDECIDED` where they cannot be counted.
    """
    limit = bounds * 1.001 + 1e-9
    turns = limit * loops.delays.max(axis=1, initial=0.0)
    # As many loops together as make some ten thousand points, if the copies are small.
    ends = np.cumsum(np.minimum(turns, _MAX_POINTS) + 200.0)
    piece = np.floor(ends / (_TOGETHER if loops.order <= _SMALL else 1.0)).astype(int)
    counts = np.full(loops.count, UNDECIDED, dtype=np.int64)
    for key in np.unique(piece):
        index = np.flatnonzero(piece == key)
        some = loops.take(index)
        counts[index] = _counts(some, line, _traced(some, line, limit[index]))
    return counts


@dataclass(frozen=True, eq=False)
class _Traced:
    """arg det Δ and (det Δ)'/det Δ up the line for many loops, row after row."""

    rows: npt.NDArray[np.intp]
    omega: FloatArray
    phase: FloatArray
    slope: ComplexArray
    turn: FloatArray
    undecided: npt.NDArray[np.bool_]


def _up(line: float, omega: FloatArray) -> ComplexArray:
    return np.asarray(line + 1j * omega, dtype=np.complex128)


def _first_places(loops: _Loops, limit: float, turns: float) -> FloatArray:
    n = loops.order
    # Denser towards the bottom, where det Δ is far from its asymptote.
    if n <= _SMALL:
        return np.asarray(_NEAR * limit * np.linspace(0.0, 1.0, 32 + int(3.0 * turns)) ** 2)
    omega = limit * np.linspace(0.0, 1.0, 40 + int(2.0 * turns) + 2 * n) ** 2
    return np.append(omega, limit * np.geomspace(1.0, _FAR, 2 * n)[1:])


def _traced(loops: _Loops, line: float, limits: FloatArray) -> _Traced:
    turns = limits * loops.delays.max(axis=1, initial=0.0)
    undecided = ~(turns < 0.5 * _MAX_POINTS)
    turns[undecided] = 0.0
    limits = np.where(undecided, 1.0, limits)
    places = [
        _first_places(loops, b, t) for b, t in zip(limits.tolist(), turns.tolist(), strict=True)
    ]
    rows = np.repeat(np.arange(loops.count), [place.size for place in places])
    omega = np.concatenate(places)
    phase, slope = _phase_and_slope(loops, rows, _up(line, omega))
    while True:
        infinite = ~np.isfinite(slope)
        if infinite.any():
            undecided[rows[infinite]] = True
        width, turn = omega[1:] - omega[:-1], phase[1:] - phase[:-1]
        turn -= 2 * math.pi * np.rint(turn / (2 * math.pi))
        # arg det Δ(line + iω) changes at the rate Re (det Δ)'/det Δ.
        rate, speed = slope.real, np.abs(slope)
        expected = 0.5 * width * (rate[1:] + rate[:-1])
        coarse = width * np.maximum(speed[1:], speed[:-1]) > _LARGEST_STEP
        coarse |= np.abs(turn - expected) > _LARGEST_SURPRISE
        where = np.flatnonzero(coarse)
        where = where[rows[where] == rows[where + 1]]
        if where.size:
            ends = rows[where]
            undecided[ends[width[where] < 1e-13 * limits[ends]]] = True
            where = where[~undecided[ends]]
        if where.size == 0:
            return _Traced(rows, omega, phase, slope, turn, undecided)
        if omega.size > _MAX_POINTS:
            undecided[rows[where]] = True
            return _Traced(rows, omega, phase, slope, turn, undecided)
        middle = 0.5 * (omega[where] + omega[where + 1])
        new_phase, new_slope = _phase_and_slope(loops, rows[where], _up(line, middle))
        order = np.argsort(np.concatenate([np.arange(omega.size), where + 0.5]), kind="stable")
        rows, omega, phase, slope = (
            np.concatenate(pair)[order]
            for pair in (
                (rows, rows[where]),
                (omega, middle),
                (phase, new_phase),
                (slope, new_slope),
            )
        )


def _counts(loops: ReducedLoops, line: float, traced: _Traced) -> IntArray:
    """Return the number of roots that the turn of the argument says, for each loop."""
    rows = traced.rows
    last = np.searchsorted(rows, np.arange(loops.count), side="right") - 1
    inner = rows[1:] == rows[:-1]
    turn = np.zeros(loops.count)
    np.add.at(turn, rows[1:][inner], traced.turn[inner])
    total = _total(loops, line, traced.omega[last], traced.phase[last], turn)
    sure = ~traced.undecided & np.isfinite(total)
    total = np.where(sure, total, 0.5)
    whole = np.rint(total)
    sure &= (np.abs(total - whole) < 1e-3) & (whole >= 0)
    return np.asarray(np.where(sure, whole, UNDECIDED).astype(np.int64))


def _total(
    loops: _Loops,
    line: float,
    omega: FloatArray,
    phase: FloatArray,
    turn: FloatArray,
) -> FloatArray:
    """Return the count of each loop from the turn of arg det Δ up to the top."""
    n, end = loops.order, np.arctan2(omega, line)
    beyond = phase - n * end
    # The branch that vanishes at infinity.
    beyond += 2 * math.pi * np.rint((_argument_beyond(loops, line, omega) - beyond) / (2 * math.pi))
    return np.asarray(n / 2 - (turn + n * (math.pi / 2 - end) - beyond) / math.pi)


def _argument_beyond(loops: _Loops, line: float, omega: FloatArray) -> FloatArray:
    """Return arg (det Δ(s)/sⁿ) = Σ arg (1 − μ), over the eigenvalues μ, to within π."""
    if isinstance(loops, _SmallLoop) or loops.order <= _SMALL:
        # Each is below asin (1/k) with k = _NEAR.
        return np.zeros(loops.count)
    s = _up(line, omega)
    # With |μ| below 1/4 three terms of the logarithm suffice for hundreds of states. Far to the
    # left numbers may be too large for that: what is NaN counts nothing.
    with np.errstate(over="ignore", invalid="ignore"):
        share = np.eye(loops.order) - loops.matrices(s[:, None])[:, 0] / s[:, None, None]
        square = share @ share
        powers = np.trace(share, axis1=1, axis2=2) + np.trace(square, axis1=1, axis2=2) / 2.0
        powers = powers + np.einsum("nij,nji->n", square, share) / 3.0
    return np.asarray(-powers.imag)


def _phase_and_slope(
    loops: _Loops, rows: npt.NDArray[np.intp], s: ComplexArray
) -> tuple[FloatArray, ComplexArray]:
    """Return arg det Δ and (det Δ)'/det Δ of a loop at each place; NaN where Δ is singular."""
    if isinstance(loops, _SmallLoop):
        return loops.phase_and_slope(s)
    if loops.count == 1:
        sign, size, slope = (part[0] for part in loops.evaluate(s[None]))
    else:
        sign, size, slope = (part[:, 0] for part in loops.take(rows).evaluate(s[:, None]))
    return np.angle(sign), np.where(np.isfinite(size), slope, np.nan)
