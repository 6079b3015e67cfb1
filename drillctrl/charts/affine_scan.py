"""Scan along a parameter in which the characteristic equation is affine.

δ0, ψ, ξ, κ, every gain and the rate of penetration enter f = a(s) + y b(s) that way. A root
lies at s = σ + iω for a real y exactly where Im(a b*) = 0, and then y = −Re(a b*)/|b|²; the
real root s = σ gives one more y. Frequencies are found on a grid that resolves exp(−sτ)
and the resonances of a and b, up to the bound beyond which no root can lie.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.charts.scan import ScanLine
from drillctrl.spectrum.quasipolynomial import Quasipolynomials, from_matrices, perron_bounds

_PHASE_STEP = 0.4
_LARGEST_TURN = 1.0
_CHUNK = 400_000


@dataclass(frozen=True, eq=False)
class AffineLoops:
    """f = a + y b for many lines at once.

    Attributes
    ----------
    a, b : Quasipolynomials
        Coefficients at y = 0 and per unit of y, with common delays.
    reach : array, (N,)
        No root right of the line has |s| above this, for any y in the range.
    """

    a: Quasipolynomials
    b: Quasipolynomials
    reach: FloatArray

    def take(self, index: np.ndarray) -> AffineLoops:
        """Return the lines at the given places."""
        return AffineLoops(self.a.take(index), self.b.take(index), self.reach[index])

    def values(
        self, omega: FloatArray, line: float
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """Return a, b and da/ds, db/ds at s = line + iω, each of the shape of ``omega``.

        All are multiplied by exp(rστ) where σ < 0, so that nothing overflows.
        """
        s = line + 1j * omega
        delays = self.a.delays.reshape(-1, *[1] * (s.ndim - 1))
        degree = self.a.coefficients.shape[2] - 1
        top = degree if line < 0.0 else 0
        e = np.exp(-1j * omega * delays)
        results = []
        for part in (self.a, self.b):
            p, slope = part.polynomials(s)
            value = np.zeros(s.shape, dtype=complex)
            derivative = np.zeros(s.shape, dtype=complex)
            power = np.ones(s.shape, dtype=complex)
            for k in range(degree + 1):
                weight = np.exp((top - k) * line * delays) * power
                value += p[k] * weight
                derivative += (slope[k] - k * delays * p[k]) * weight
                power = power * e
            results += [value, derivative]
        return results[0], results[2], results[1], results[3]


def frequency_grid(loops: AffineLoops, line: float) -> FloatArray:
    """Return frequencies that resolve every line of a group, shape (G,)."""
    order = loops.a.coefficients.shape[1] - 1
    top = float(loops.reach.max()) / math.sin(math.pi / (2 * order)) * 1.001
    inner = float(loops.reach.max()) * 1.001
    spacing = min(_PHASE_STEP / max(float(loops.a.delays.max()), 1e-9), inner / 100.0)
    grids = [np.linspace(0.0, inner, 2 + int(inner / spacing))]
    # Beyond the roots only the argument is followed, and it is nearly that of s^n.
    grids.append(np.linspace(inner, top, 2 + int((top - inner) / (2 * spacing))))
    fan = np.tan(np.linspace(-1.45, 1.45, 25))
    for part in (loops.a, loops.b):
        for c in part.coefficients[:: max(1, part.coefficients.shape[0] // 3)]:
            for column in c.T:
                if np.count_nonzero(column) < 2:
                    continue
                for root in np.roots(np.trim_zeros(column, "b")[::-1]):
                    width = max(abs(root.real - line), 1e-6)
                    if 0.0 < root.imag < inner and width < 3 * spacing:
                        grids.append(root.imag + width * fan)
    grid = np.concatenate(grids)
    return np.unique(grid[(grid >= 0.0) & (grid <= top)])


def scan_affine(
    loops: AffineLoops, positions: FloatArray, low: float, high: float, line: float = 0.0
) -> list[ScanLine]:
    """Scan many lines along the affine parameter.

    Parameters
    ----------
    loops : AffineLoops
        One for each line.
    positions : array, (N,)
        The parameter that is held.
    low, high : float
        Limits of the affine parameter.
    line : float
        σ: roots right of it are counted.
    """
    result: list[ScanLine | None] = [None] * positions.size
    # Lines with similar delays share a grid.
    group = np.floor(2.0 * np.log2(np.maximum(loops.a.delays, 1e-6))).astype(int)
    for key in np.unique(group):
        members = np.flatnonzero(group == key)
        grid = frequency_grid(loops.take(members), line)
        for part in np.array_split(members, max(1, members.size * grid.size // _CHUNK)):
            scanned = _scan_group(loops.take(part), positions[part], low, high, line, grid)
            for index, scan in zip(part, scanned, strict=True):
                result[index] = scan
    return [scan for scan in result if scan is not None]


def _scan_group(
    loops: AffineLoops,
    positions: FloatArray,
    low: float,
    high: float,
    line: float,
    grid: FloatArray,
) -> list[ScanLine]:
    count = positions.size
    omega = np.broadcast_to(grid, (count, grid.size))
    a, b, _, _ = loops.values(omega, line)
    rows, frequency = _zeros(loops, a * b.conj(), grid, line, low, high)
    at, jump = _crossings(loops, rows, frequency, line)
    # A real root at s = σ: one root changes sides, not a pair.
    with np.errstate(divide="ignore", invalid="ignore"):
        real = -(a[:, 0] / b[:, 0]).real
    crossing = np.flatnonzero(np.isfinite(real))
    _, real_jump = _crossings(loops, crossing, np.zeros(crossing.size), line, real[crossing])
    rows = np.concatenate([rows, crossing])
    frequency = np.concatenate([frequency, np.zeros(crossing.size)])
    at, jump = np.concatenate([at, real[crossing]]), np.concatenate([jump, real_jump // 2])
    inside = (at > low) & (at < high) & (jump != 0)
    rows, frequency, at, jump = rows[inside], frequency[inside], at[inside], jump[inside]
    order = np.lexsort((at, rows))
    rows, frequency, at, jump = rows[order], frequency[order], at[order], jump[order]
    bounds = np.searchsorted(rows, np.arange(count + 1))
    parts = [slice(bounds[i], bounds[i + 1]) for i in range(count)]
    # Count where the roots are farthest from the line: amid the widest gap.
    probes = np.empty(count)
    places = np.empty(count, dtype=int)
    for i, part in enumerate(parts):
        edges = np.concatenate([[low], at[part], [high]])
        places[i] = int(np.argmax(np.diff(edges)))
        probes[i] = 0.5 * (edges[places[i]] + edges[places[i] + 1])
    known = count_roots(loops, a + probes[:, None] * b, probes, grid, line)
    lines = []
    for i, part in enumerate(parts):
        steps = np.concatenate([[0], np.cumsum(jump[part])])
        counts = known[i] + steps - steps[places[i]]
        lines.append(
            ScanLine(
                float(positions[i]),
                at[part],
                frequency[part],
                jump[part],
                counts,
                low,
                high,
                low,
                low,
            )
        )
    return lines


def _zeros(
    loops: AffineLoops,
    product: ComplexArray,
    grid: FloatArray,
    line: float,
    low: float,
    high: float,
) -> tuple[np.ndarray, FloatArray]:
    """Find the sign changes of Im(a b*) in ω > 0; return (row, ω)."""
    g = product.imag
    change = np.signbit(g[:, 1:]) != np.signbit(g[:, :-1])
    change[:, 0] = False
    # At ω = 0 the function vanishes by symmetry: compare its slope there.
    change[:, 0] = np.signbit(g[:, 1]) != np.signbit(_near_zero(loops, grid, line))
    rows, columns = np.nonzero(change)
    left, right = grid[columns].copy(), grid[columns + 1].copy()
    left[columns == 0] = 1e-3 * grid[1]
    sign_left = ~np.signbit(g[rows, columns + 1])
    extra_rows, extra_left, extra_right, extra_sign = _dips(loops, g, grid, line)
    rows = np.concatenate([rows, extra_rows])
    left, right = np.concatenate([left, extra_left]), np.concatenate([right, extra_right])
    sign_left = np.concatenate([sign_left, extra_sign])
    chosen = loops.take(rows)

    def evaluate(omega: FloatArray, index: np.ndarray) -> FloatArray:
        a, b, _, _ = chosen.take(index).values(omega, line)
        return np.asarray((a * b.conj()).imag)

    everyone = np.arange(rows.size)
    # Illinois: regula falsi that halves a value which stays on its side twice.
    f_left, f_right = evaluate(left, everyone), evaluate(right, everyone)
    side = np.zeros(rows.size)
    root = 0.5 * (left + right)
    active = everyone
    for _ in range(60):
        if not active.size:
            break
        a, b, fl, fr = left[active], right[active], f_left[active], f_right[active]
        with np.errstate(divide="ignore", invalid="ignore"):
            new = (a * fr - b * fl) / (fr - fl)
        new = np.where((new > a) & (new < b), new, 0.5 * (a + b))
        value = evaluate(new, active)
        goes_left = np.signbit(value) == np.signbit(fl)
        done = (np.abs(new - root[active]) < 1e-13 * (1.0 + new)) | (value == 0.0)
        root[active] = new
        was = side[active]
        left[active] = np.where(goes_left, new, a)
        f_left[active] = np.where(goes_left, value, np.where(was == 1.0, 0.5 * fl, fl))
        right[active] = np.where(goes_left, b, new)
        f_right[active] = np.where(goes_left, np.where(was == -1.0, 0.5 * fr, fr), value)
        side[active] = np.where(goes_left, -1.0, 1.0)
        done |= right[active] - left[active] < 1e-14 * (1.0 + new)
        active = active[~done]
    return rows, root


def _near_zero(loops: AffineLoops, grid: FloatArray, line: float) -> FloatArray:
    omega = np.full(loops.reach.size, 1e-3 * grid[1])
    a, b, _, _ = loops.values(omega, line)
    return np.asarray((a * b.conj()).imag)


def _dips(
    loops: AffineLoops, g: FloatArray, grid: FloatArray, line: float
) -> tuple[np.ndarray, FloatArray, FloatArray, np.ndarray]:
    """Split intervals in which a parabola through three samples crosses zero twice."""
    empty = (np.zeros(0, dtype=int), np.zeros(0), np.zeros(0), np.zeros(0, dtype=bool))
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
    a, b, _, _ = loops.take(rows).values(vertex, line)
    value = (a * b.conj()).imag
    hit = (np.signbit(value) != np.signbit(y1)) & (vertex > x0) & (vertex < x2)
    rows, vertex, x0, x2, sign = rows[hit], vertex[hit], x0[hit], x2[hit], np.signbit(y1[hit])
    return (
        np.concatenate([rows, rows]),
        np.concatenate([x0, vertex]),
        np.concatenate([vertex, x2]),
        np.concatenate([sign, ~sign]),
    )


def _crossings(
    loops: AffineLoops,
    rows: np.ndarray,
    omega: FloatArray,
    line: float,
    at: FloatArray | None = None,
) -> tuple[FloatArray, np.ndarray]:
    """Return y and the change of the count (±2 for a pair) at each crossing."""
    a, b, slope_a, slope_b = loops.take(rows).values(omega, line)
    with np.errstate(divide="ignore", invalid="ignore"):
        y = -(a * b.conj()).real / np.abs(b) ** 2 if at is None else at
        motion = (-b / (slope_a + y * slope_b)).real
    jump = np.where(np.isfinite(motion), 2 * np.sign(motion), 0).astype(np.int64)
    return np.asarray(np.nan_to_num(y, nan=np.inf)), jump


def count_roots(
    loops: AffineLoops, f: ComplexArray, probes: FloatArray, grid: FloatArray, line: float
) -> np.ndarray:
    """Count the roots right of the line at y = probes by the argument principle."""
    order = loops.a.coefficients.shape[1] - 1
    turn = np.angle(f[:, 1:] / f[:, :-1])
    total = turn.sum(axis=1)
    rows, columns = np.nonzero(np.abs(turn) > _LARGEST_TURN)
    np.subtract.at(total, rows, turn[rows, columns])
    left, right = grid[columns], grid[columns + 1]
    f_left, f_right = f[rows, columns], f[rows, columns + 1]
    for _ in range(40):
        if not rows.size:
            break
        middle = 0.5 * (left + right)
        a, b, _, _ = loops.take(rows).values(middle, line)
        between = a + probes[rows] * b
        first, second = np.angle(between / f_left), np.angle(f_right / between)
        good = np.maximum(np.abs(first), np.abs(second)) <= _LARGEST_TURN
        np.add.at(total, rows[good], (first + second)[good])
        bad = ~good
        rows = np.concatenate([rows[bad], rows[bad]])
        left, right, middle = left[bad], right[bad], middle[bad]
        f_left = np.concatenate([f_left[bad], between[bad]])
        f_right = np.concatenate([between[bad], f_right[bad]])
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    end = line + 1j * grid[-1]
    scale = np.exp(1j * order * np.angle(end))
    rest = order * (math.pi / 2 - np.angle(end)) - np.angle(f[:, -1] / scale)
    return np.asarray(np.rint(order / 2 - (total + rest) / math.pi).astype(np.int64))


def affine_loops(
    start: tuple[FloatArray, FloatArray, FloatArray],
    stop: tuple[FloatArray, FloatArray, FloatArray],
    low: float,
    high: float,
    line: float = 0.0,
) -> AffineLoops:
    """Return f = a + y b from the matrices at both ends of the range of y.

    Parameters
    ----------
    start, stop : tuple of array
        A0 (N, n, n), A1 (N, n, n) and τ (N,) at y = low and at y = high.
    low, high : float
        The range of y.
    line : float
        σ, for the bound on the roots.
    """
    at_low, at_high = from_matrices(*start), from_matrices(*stop)
    size = max(at_low.coefficients.shape[2], at_high.coefficients.shape[2])
    first, last = (
        np.pad(q.coefficients, ((0, 0), (0, 0), (0, size - q.coefficients.shape[2])))
        for q in (at_low, at_high)
    )
    slope = (last - first) / (high - low)
    slope[np.abs(slope) <= 1e-13 * np.abs(last).max(axis=(1, 2), keepdims=True)] = 0.0
    # Entries are affine in y, so the larger end bounds them in between.
    reach = perron_bounds(
        np.maximum(np.abs(start[0]), np.abs(stop[0])),
        np.maximum(np.abs(start[1]), np.abs(stop[1])),
        start[2],
        line,
    )
    delays = at_low.delays
    return AffineLoops(
        Quasipolynomials(first - low * slope, delays), Quasipolynomials(slope, delays), reach
    )
