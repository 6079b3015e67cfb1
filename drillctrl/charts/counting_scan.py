"""Scan along any parameter: count roots at sample places and bisect where the count changes.

For the pairs of parameters that leave no closed form, such as η and a common damping ratio.
A stable stretch shorter than the sample distance can be missed; nothing else can.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.affine_scan import AffineLoops, count_roots, frequency_grid
from drillctrl.charts.scan import IntArray, ScanLine
from drillctrl.spectrum.quasipolynomial import Quasipolynomials, from_matrices, perron_bounds

Matrices = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
_SAMPLES = 65
_HALVINGS = 34
_CHUNK = 400_000


def _constant(matrices: tuple[FloatArray, FloatArray, FloatArray], line: float) -> AffineLoops:
    loops = from_matrices(*matrices)
    nothing = Quasipolynomials(np.zeros_like(loops.coefficients), loops.delays)
    return AffineLoops(loops, nothing, perron_bounds(*matrices, line))


def count_right(matrices: tuple[FloatArray, FloatArray, FloatArray], line: float) -> IntArray:
    """Count the roots right of Re s = ``line`` of N loops by the argument principle.

    Parameters
    ----------
    matrices : tuple of array
        A0 (N, n, n), A1 (N, n, n) and τ (N,).
    line : float
        σ.
    """
    loops = _constant(matrices, line)
    counts = np.zeros(loops.reach.size, dtype=np.int64)
    # Loops with similar delays and reach share a grid.
    scale = np.maximum(loops.a.delays, 1e-6)
    group = np.floor(2 * np.log2(scale)) * 1000 + np.floor(2 * np.log2(loops.reach))
    for key in np.unique(group):
        members = np.flatnonzero(group == key)
        grid = frequency_grid(loops.take(members), line)
        for part in np.array_split(members, max(1, members.size * grid.size // _CHUNK)):
            some = loops.take(part)
            f = some.values(np.broadcast_to(grid, (part.size, grid.size)), line)[0]
            counts[part] = count_roots(some, f, np.zeros(part.size), grid, line)
    return counts


def scan_counting(
    matrices: Matrices, positions: FloatArray, low: float, high: float, line: float = 0.0
) -> list[ScanLine]:
    """Scan many lines along any parameter.

    Parameters
    ----------
    matrices : callable
        Returns A0, A1 and τ at (positions, places along the lines).
    positions : array, (N,)
        The parameter that is held.
    low, high : float
        Limits of the other one.
    line : float
        σ: roots right of it are counted.
    """
    samples = np.linspace(low, high, _SAMPLES)
    held = np.repeat(positions, _SAMPLES)
    counts = count_right(matrices(held, np.tile(samples, positions.size)), line)
    counts = counts.reshape(positions.size, _SAMPLES)
    rows, columns = np.nonzero(counts[:, 1:] != counts[:, :-1])
    left, right = samples[columns], samples[columns + 1]
    before, after = counts[rows, columns], counts[rows, columns + 1]
    for _ in range(_HALVINGS):
        if not rows.size:
            break
        middle = 0.5 * (left + right)
        between = count_right(matrices(positions[rows], middle), line)
        first, second = between != before, between != after
        rows = np.concatenate([rows[first], rows[second]])
        left, right = (
            np.concatenate([left[first], middle[second]]),
            np.concatenate([middle[first], right[second]]),
        )
        before, after = (
            np.concatenate([before[first], between[second]]),
            np.concatenate([between[first], after[second]]),
        )
    at = 0.5 * (left + right)
    omega = _frequencies(matrices(positions[rows], at), line) if rows.size else at
    order = np.lexsort((at, rows))
    rows, at, omega, jump = rows[order], at[order], omega[order], (after - before)[order]
    bounds = np.searchsorted(rows, np.arange(positions.size + 1))
    lines = []
    for i, position in enumerate(positions):
        part = slice(bounds[i], bounds[i + 1])
        along = counts[i, 0] + np.concatenate([[0], np.cumsum(jump[part])])
        lines.append(
            ScanLine(float(position), at[part], omega[part], jump[part], along, low, high, low, low)
        )
    return lines


def _frequencies(matrices: tuple[FloatArray, FloatArray, FloatArray], line: float) -> FloatArray:
    """Return |Im s| of the root nearest to the line for each loop."""
    loops = _constant(matrices, line)
    result = np.empty(loops.reach.size)
    for i in range(result.size):
        one = loops.take(np.array([i]))
        grid = frequency_grid(one, line)
        f, _, slope, _ = one.values(grid[None, :], line)
        start = int(np.argmin(np.abs(f[0] / slope[0])))
        omega = float(grid[start])
        for _ in range(20):
            f, _, slope, _ = one.values(np.array([[omega]]), line)
            # The root lies on the line, so only the step along it is taken.
            step = float((f / slope).imag[0, 0])
            omega -= step
            if abs(step) < 1e-12 * (1.0 + omega):
                break
        result[i] = abs(omega)
    return result
