"""Scan along a parameter in which the characteristic equation is affine.

δ0, ψ, ξ, κ, every gain and the rate of penetration enter det Δ = a(s) + t b(s) that way, with t
from 0 to 1 over the range. A root lies at s = σ + iω for a real t exactly where Im(a b*) = 0,
and then t = −Re(a b*)/|b|²; the real root s = σ gives one more t. Frequencies are found on a
grid that resolves exp(−sτ) and the resonances of a and b, up to the bound beyond which no root
can lie.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.optimize import elementwise

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.charts.counting_scan import LoopMatrices, Matrices, count_right
from drillctrl.charts.scan import IntArray, ScanLine
from drillctrl.delay.reduced import ReducedLoops, reduced_matrices
from drillctrl.spectrum.characteristic import perron_bounds

_PHASE_STEP = 0.4
_CHUNK = 400_000
# Turn of a and b from one frequency to the next on the lines that shape the grid.
_GRID_TURN = 1.0
_GRID_LINES = 3
_GRID_ROUNDS = 12
# |a + t b| over |a| where s is taken for a root.
_AT_ROOT = 0.1
_SHARP = {"xatol": 1e-12, "xrtol": 1e-12}


class LinesOfLoops(Protocol):
    """Lines along which a characteristic function is a + t b, with t from 0 to 1."""

    @property
    def count(self) -> int:
        """Number of lines."""

    def take(self, index: IntArray) -> LinesOfLoops:
        """Return the lines at the given places."""

    def values(self, omega: FloatArray, line: float) -> tuple[ComplexArray, ComplexArray]:
        """Return a and b at s = line + iω, of the shape of ``omega``, (N,) or (N, G)."""

    def values_and_slopes(
        self, omega: FloatArray, line: float
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """Return a, da/ds, b and db/ds likewise."""


@dataclass(frozen=True, eq=False)
class AffineLoops:
    """det Δ = a + t b for many lines at once.

    Attributes
    ----------
    low, high : ReducedLoops
        The loops at t = 0 and at t = 1.
    reach : array, (N,)
        No root right of the line has |s| above this, for any t in [0, 1].
    """

    low: ReducedLoops
    high: ReducedLoops
    reach: FloatArray

    @property
    def count(self) -> int:
        """Number of lines."""
        return int(self.reach.size)

    @property
    def delays(self) -> FloatArray:
        """τ of each line, 0 if nothing is delayed."""
        return np.asarray(self.low.delays.max(axis=1, initial=0.0))

    def take(self, index: np.ndarray) -> AffineLoops:
        """Return the lines at the given places."""
        return AffineLoops(self.low.take(index), self.high.take(index), self.reach[index])

    def values(self, omega: FloatArray, line: float) -> tuple[ComplexArray, ComplexArray]:
        """Return a and b at s = line + iω, each of the shape of ``omega``.

        Both are divided by the same positive number at each point, lest they overflow.
        """
        a, _, b, _ = self._evaluated(omega, line, with_slope=False)
        return a, b

    def values_and_slopes(
        self, omega: FloatArray, line: float
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """Return a, da/ds, b and db/ds likewise."""
        return self._evaluated(omega, line, with_slope=True)

    def _evaluated(
        self, omega: FloatArray, line: float, *, with_slope: bool
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        s = np.asarray(line + 1j * omega, dtype=np.complex128).reshape(len(omega), -1)
        ends = [end.evaluate(s, with_slope=with_slope) for end in (self.low, self.high)]
        scale = np.maximum(ends[0][1], ends[1][1])
        scale = np.where(np.isfinite(scale), scale, 0.0)
        a, last = (sign * np.exp(size - scale) for sign, size, _ in ends)
        slope_a, slope_last = a * ends[0][2], last * ends[1][2]
        parts = (a, slope_a, last - a, slope_last - slope_a)
        first, second, third, fourth = (part.reshape(omega.shape) for part in parts)
        return first, second, third, fourth


def affine_loops(start: LoopMatrices, stop: LoopMatrices, line: float = 0.0) -> AffineLoops:
    """Return the lines between loops at either end.

    Parameters
    ----------
    start, stop : tuple of array
        A0 (N, n, n), A1 (N, n, n) and τ (N,) at t = 0 and at t = 1.
    line : float
        σ, for the bound on the roots.
    """
    # Entries are affine in t, so the larger end bounds them in between.
    reach = perron_bounds(
        np.maximum(np.abs(start[0]), np.abs(stop[0])),
        np.maximum(np.abs(start[1]), np.abs(stop[1])),
        start[2],
        line,
    )
    return AffineLoops(reduced_matrices(*start), reduced_matrices(*stop), reach)


def frequency_grid(loops: AffineLoops, line: float) -> FloatArray:
    """Return frequencies that resolve every line of a group, shape (G,)."""
    inner = float(loops.reach.max()) * 1.001
    spacing = min(_PHASE_STEP / max(float(loops.delays.max()), 1e-9), inner / 100.0)
    grid = np.linspace(0.0, inner, 2 + int(inner / spacing))
    some = loops.take(np.unique(np.linspace(0, loops.reach.size - 1, _GRID_LINES).astype(int)))
    turn = _turns(some, grid, line)
    for _ in range(_GRID_ROUNDS):
        width = np.diff(grid)
        size = width * np.maximum(turn[:, 1:], turn[:, :-1]).max(axis=0)
        coarse = np.flatnonzero((size > _GRID_TURN) & (width > 1e-9 * inner))
        if not coarse.size:
            break
        middle = 0.5 * (grid[coarse] + grid[coarse + 1])
        turn = np.insert(turn, coarse + 1, _turns(some, middle, line), axis=1)
        grid = np.insert(grid, coarse + 1, middle)
    return grid


def _turns(loops: AffineLoops, grid: FloatArray, line: float) -> FloatArray:
    """Return how fast a and b turn along the line, the faster of them."""
    omega = np.broadcast_to(grid, (loops.reach.size, grid.size))
    a, slope_a, b, slope_b = loops.values_and_slopes(omega, line)
    with np.errstate(divide="ignore", invalid="ignore"):
        fast = np.fmax(np.abs(slope_a / a), np.abs(slope_b / b))
    return np.asarray(np.nan_to_num(fast, nan=0.0, posinf=0.0))


def scan_affine(
    matrices: Matrices, positions: FloatArray, low: float, high: float, line: float = 0.0
) -> list[ScanLine]:
    """Scan many lines along the affine parameter.

    Parameters
    ----------
    matrices : callable
        Returns A0, A1 and τ at (positions, places along the lines).
    positions : array, (N,)
        The parameter that is held.
    low, high : float
        Limits of the affine parameter.
    line : float
        σ: roots right of it are counted.
    """
    start, stop = (matrices(positions, np.full(positions.size, end)) for end in (low, high))
    loops = affine_loops(start, stop, line)
    found = [np.zeros(0)] * 4
    # Lines with similar delays share a grid.
    group = np.floor(2.0 * np.log2(np.maximum(loops.delays, 1e-6))).astype(int)
    for key in np.unique(group):
        members = np.flatnonzero(group == key)
        grid = frequency_grid(loops.take(members), line)
        new = find_crossings(loops, line, grid, members)
        found = [np.concatenate(pair) for pair in zip(found, new, strict=True)]

    def count(shares: FloatArray) -> IntArray:
        return count_right(matrices(positions, low + shares * (high - low)), line)

    return affine_lines(positions, found, count, low, high)


def find_crossings(
    loops: LinesOfLoops,
    line: float,
    grid: FloatArray,
    members: IntArray,
    margin: float = np.inf,
) -> list[FloatArray]:
    """Return line, ω, t and change of the count of every crossing of some lines.

    Parameters
    ----------
    loops : LinesOfLoops
        All lines.
    line : float
        σ.
    grid : array, (G,)
        Frequencies that resolve a and b of these lines.
    members : array of int, (k,)
        The lines.
    margin : float
        Crossings with t beyond [−margin, 1 + margin] need not be found.
    """
    found = [np.zeros(0)] * 4
    for part in np.array_split(members, max(1, members.size * grid.size // _CHUNK)):
        rows, *rest = _scan_group(loops.take(part), line, grid, margin)
        new = (part[rows], *rest)
        found = [np.concatenate(pair) for pair in zip(found, new, strict=True)]
    return found


def affine_lines(
    positions: FloatArray,
    found: list[FloatArray],
    count: Callable[[FloatArray], IntArray],
    low: float,
    high: float,
) -> list[ScanLine]:
    """Return scan lines from what `find_crossings` says of all of them.

    Parameters
    ----------
    positions : array, (N,)
        The parameter that is held.
    found : list of array
        Line, ω, t and change of the count.
    count : callable
        t of one place on each line, (N,) → number of roots right of σ there.
    low, high : float
        Limits of the affine parameter.
    """
    rows, frequency, t, jump = found
    inside = (t > 0.0) & (t < 1.0) & (jump != 0)
    rows, frequency, t, jump = rows[inside], frequency[inside], t[inside], jump[inside]
    order = np.lexsort((t, rows))
    rows, frequency, t = rows[order], frequency[order], t[order]
    jump = jump[order].astype(np.int64)
    bounds = np.searchsorted(rows, np.arange(positions.size + 1))
    segments = [slice(bounds[i], bounds[i + 1]) for i in range(positions.size)]
    # Count where the roots are farthest from the line: amid the widest gap.
    probes = np.empty(positions.size)
    places = np.empty(positions.size, dtype=int)
    for i, segment in enumerate(segments):
        edges = np.concatenate([[0.0], t[segment], [1.0]])
        places[i] = int(np.argmax(np.diff(edges)))
        probes[i] = 0.5 * (edges[places[i]] + edges[places[i] + 1])
    known = count(probes)
    lines = []
    for i, segment in enumerate(segments):
        steps = np.concatenate([[0], np.cumsum(jump[segment])])
        lines.append(
            ScanLine(
                float(positions[i]),
                low + t[segment] * (high - low),
                frequency[segment],
                jump[segment],
                known[i] + steps - steps[places[i]],
                low,
                high,
                low,
                low,
            )
        )
    return lines


def _scan_group(
    loops: LinesOfLoops, line: float, grid: FloatArray, margin: float
) -> tuple[np.ndarray, FloatArray, FloatArray, np.ndarray]:
    """Return (line, ω, t, change of the count) of every crossing."""
    count = loops.count
    a, b = loops.values(np.broadcast_to(grid, (count, grid.size)), line)
    rows, frequency = _zeros(loops, (a, b), grid, line, margin)
    at, jump = _crossings(loops, rows, frequency, line)
    # A real root at s = σ: one root changes sides, not a pair.
    with np.errstate(divide="ignore", invalid="ignore"):
        real = -(a[:, 0] / b[:, 0]).real
    crossing = np.flatnonzero(np.isfinite(real))
    _, real_jump = _crossings(loops, crossing, np.zeros(crossing.size), line, real[crossing])
    return (
        np.concatenate([rows, crossing]),
        np.concatenate([frequency, np.zeros(crossing.size)]),
        np.concatenate([at, real[crossing]]),
        np.concatenate([jump, real_jump // 2]),
    )


def _zeros(
    loops: LinesOfLoops,
    values: tuple[ComplexArray, ComplexArray],
    grid: FloatArray,
    line: float,
    margin: float,
) -> tuple[np.ndarray, FloatArray]:
    """Find the sign changes of Im(a b*) in ω > 0; return (row, ω)."""
    product = values[0] * values[1].conj()
    g = product.imag
    change = np.signbit(g[:, 1:]) != np.signbit(g[:, :-1])
    change[:, 0] = False
    # At ω = 0 the function vanishes by symmetry: compare its slope there.
    change[:, 0] = np.signbit(g[:, 1]) != np.signbit(_near_zero(loops, grid, line))
    if np.isfinite(margin):
        # Both ends on the same side, far off: what lies between is not on the line either.
        with np.errstate(divide="ignore", invalid="ignore"):
            t = -product.real / np.abs(values[1]) ** 2
        low, high = np.fmin(t[:, 1:], t[:, :-1]), np.fmax(t[:, 1:], t[:, :-1])
        change &= (high > -margin) & (low < 1.0 + margin)
    rows, columns = np.nonzero(change)
    left, right = grid[columns].copy(), grid[columns + 1].copy()
    left[columns == 0] = 1e-3 * grid[1]
    more_rows, more_left, more_right = _dips(loops, g, grid, line)
    rows = np.concatenate([rows, more_rows])
    left, right = np.concatenate([left, more_left]), np.concatenate([right, more_right])
    chosen = loops.take(rows)

    def evaluate(omega: FloatArray, index: np.ndarray) -> FloatArray:
        a, b = chosen.take(index).values(omega, line)
        return np.asarray((a * b.conj()).imag)

    found = elementwise.find_root(
        evaluate, (left, right), args=(np.arange(rows.size),), tolerances=_SHARP
    )
    return rows, found.x


def _near_zero(loops: LinesOfLoops, grid: FloatArray, line: float) -> FloatArray:
    omega = np.full(loops.count, 1e-3 * grid[1])
    a, b = loops.values(omega, line)
    return np.asarray((a * b.conj()).imag)


def _dips(
    loops: LinesOfLoops, g: FloatArray, grid: FloatArray, line: float
) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Split intervals in which a parabola through three samples crosses zero twice."""
    empty = np.zeros(0, dtype=int), np.zeros(0), np.zeros(0)
    if grid.size < 4:
        return empty
    left, middle, right = g[:, 1:-2], g[:, 2:-1], g[:, 3:]
    same = (np.signbit(left) == np.signbit(middle)) & (np.signbit(middle) == np.signbit(right))
    dip = same & (np.abs(middle) < np.abs(left)) & (np.abs(middle) < np.abs(right))
    rows, columns = np.nonzero(dip)
    columns = columns + 2
    if not rows.size:
        return empty
    x0, x1, x2 = grid[columns - 1], grid[columns], grid[columns + 1]
    y0, y1, y2 = g[rows, columns - 1], g[rows, columns], g[rows, columns + 1]
    d1, d2 = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)
    curve = (d2 - d1) / (x2 - x0)
    with np.errstate(divide="ignore", invalid="ignore"):
        vertex = 0.5 * (x0 + x1) - 0.5 * d1 / curve
        bottom = y1 + d1 * (vertex - x1) + curve * (vertex - x0) * (vertex - x1)
    # Worth a look where the parabola comes near zero, on either side.
    look = np.isfinite(vertex) & (vertex > x0) & (vertex < x2)
    look &= np.abs(bottom) < 0.3 * np.abs(y1) + 0.05 * np.maximum(np.abs(y0), np.abs(y2))
    look |= np.isfinite(vertex) & (np.signbit(bottom) != np.signbit(y1))
    rows, vertex, x0, x2, y1 = rows[look], vertex[look], x0[look], x2[look], y1[look]
    if not rows.size:
        return empty
    a, b = loops.take(rows).values(vertex, line)
    value = (a * b.conj()).imag
    hit = (np.signbit(value) != np.signbit(y1)) & (vertex > x0) & (vertex < x2)
    rows, vertex, x0, x2 = rows[hit], vertex[hit], x0[hit], x2[hit]
    return (
        np.concatenate([rows, rows]),
        np.concatenate([x0, vertex]),
        np.concatenate([vertex, x2]),
    )


def _crossings(
    loops: LinesOfLoops,
    rows: np.ndarray,
    omega: FloatArray,
    line: float,
    at: FloatArray | None = None,
) -> tuple[FloatArray, np.ndarray]:
    """Return t and the change of the count (±2 for a pair) at each crossing."""
    if not rows.size:
        return np.zeros(0), np.zeros(0, dtype=np.int64)
    a, slope_a, b, slope_b = loops.take(rows).values_and_slopes(omega, line)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = -(a * b.conj()).real / np.abs(b) ** 2 if at is None else at
        # Where b vanishes to rounding, as at 1 = E, no t makes a root.
        t = np.where(np.abs(a + t * b) < _AT_ROOT * np.abs(a), t, np.inf)
        motion = (-b / (slope_a + t * slope_b)).real
    jump = np.where(np.isfinite(motion), 2 * np.sign(motion), 0).astype(np.int64)
    return np.asarray(np.nan_to_num(t, nan=np.inf)), jump
