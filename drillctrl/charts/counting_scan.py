"""Scan along any parameter: count roots at sample places and bisect where the count changes.

For the pairs of parameters that leave no closed form, such as η and a common damping ratio.
A stable stretch shorter than the sample distance can be missed; nothing else can.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import UndecidedError
from drillctrl.charts.scan import IntArray, ScanLine
from drillctrl.delay.reduced import ReducedLoops, reduced_matrices
from drillctrl.spectrum.characteristic import perron_bounds
from drillctrl.spectrum.count import UNDECIDED, count_many, follow, is_small

LoopMatrices = tuple[FloatArray, FloatArray, FloatArray]
Matrices = Callable[[FloatArray, FloatArray], LoopMatrices]
_SAMPLES = 65
# To some 1e-10 of the line.
_HALVINGS = 27


def count_right(matrices: LoopMatrices, line: float) -> IntArray:
    """Count the roots right of Re s = ``line`` of N loops by the argument principle.

    Parameters
    ----------
    matrices : tuple of array
        A0 (N, n, n), A1 (N, n, n) and τ (N,).
    line : float
        σ.

    Raises
    ------
    UndecidedError
        If roots of a loop cannot be counted.
    """
    loops, bounds = _reduced(matrices, line)
    counts = count_many(loops, line, bounds)
    # A root on the line to rounding lies on one side of a line beside it.
    for share in (1e-11, 1e-9, 1e-7):
        left = np.flatnonzero(counts == UNDECIDED)
        if left.size:
            shift = share * float(bounds[left].min())
            counts[left] = count_many(loops.take(left), line + shift, bounds[left])
    if (counts == UNDECIDED).any():
        raise UndecidedError("level", line, "one that no root lies on over whole lines")
    return counts


def _reduced(matrices: LoopMatrices, line: float) -> tuple[ReducedLoops, FloatArray]:
    """Return the loops and the bounds on their roots."""
    bounds = perron_bounds(*matrices, line)
    turns = float((bounds * matrices[2]).max(initial=0.0))
    plain = is_small(matrices[0].shape[-1], turns)
    return reduced_matrices(*matrices, plain=plain), bounds


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

    def settle(
        held: FloatArray, left: FloatArray, right: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        at = 0.5 * (left + right)
        return at, _frequencies(matrices(held, at), line)

    def count(held: FloatArray, at: FloatArray) -> IntArray:
        return count_right(matrices(held, at), line)

    return bisected_lines(count, settle, positions, low, high, _SAMPLES, _HALVINGS)


def bisected_lines(
    count: Callable[[FloatArray, FloatArray], IntArray],
    settle: Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray]],
    positions: FloatArray,
    low: float,
    high: float,
    every: int,
    halvings: int,
    *,
    edges_alone: bool = False,
) -> list[ScanLine]:
    """Return scan lines from counts alone.

    Parameters
    ----------
    count : callable
        Number of roots right of the line at (positions, places along the lines).
    settle : callable
        Crossings and |Im s| there at (positions, lower and upper ends of short intervals).
    positions : array, (N,)
        The parameter that is held.
    low, high : float
        Limits of the other one.
    every, halvings : int
        Samples of each line, and how often intervals are halved.
    edges_alone : bool
        Settle those crossings alone that bound a stable stretch; the others stay where the
        counts put them, without a frequency.
    """
    samples = np.linspace(low, high, every)
    held = np.repeat(positions, every)
    counts = count(held, np.tile(samples, positions.size)).reshape(positions.size, every)
    rows, columns = np.nonzero(counts[:, 1:] != counts[:, :-1])
    left, right = samples[columns], samples[columns + 1]
    before, after = counts[rows, columns], counts[rows, columns + 1]
    for _ in range(halvings):
        if not rows.size:
            break
        middle = 0.5 * (left + right)
        between = count(positions[rows], middle)
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
    at, omega = 0.5 * (left + right), np.zeros(rows.size)
    # Only the edge of what is stable has to be sharp.
    edge = np.flatnonzero((before == 0) | (after == 0)) if edges_alone else np.arange(rows.size)
    if edge.size:
        at[edge], omega[edge] = settle(positions[rows[edge]], left[edge], right[edge])
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


def _frequencies(matrices: LoopMatrices, line: float) -> FloatArray:
    """Return |Im s| of the root nearest to the line for each loop."""
    loops, bounds = _reduced(matrices, line)
    result = np.zeros(loops.count)
    for i, bound in enumerate(bounds.tolist()):
        one = loops.take(slice(i, i + 1))
        seen = follow(one, line, bound)
        speed = np.where(np.isfinite(seen.slope), np.abs(seen.slope), np.inf)
        omega = float(seen.omega[int(np.argmax(speed))])
        for _ in range(20):
            slope = complex(one.evaluate(np.array([[line + 1j * omega]]))[2][0, 0])
            if not np.isfinite(slope):
                break
            # The root lies on the line, so only the step along it is taken.
            step = (1.0 / slope).imag
            omega -= step
            if abs(step) < 1e-12 * (1.0 + omega):
                break
        result[i] = abs(omega)
    return result
