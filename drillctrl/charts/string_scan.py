"""Scans of charts of a string of pipe, from its exact receptances.

Where D is affine along the lines crossings are found in closed form, as in `affine_scan`; else
roots are counted at sample places and crossings bisected, as in `counting_scan`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.affine_scan import affine_lines, find_crossings
from drillctrl.charts.counting_scan import bisected_lines
from drillctrl.charts.scan import IntArray, ScanLine
from drillctrl.charts.string_loops import (
    BitLoads,
    StringLoops,
    closed,
    count_growing,
    frequency_grid,
)
from drillctrl.strings.at_bit import StringAtBit

# (positions, places along the lines) → what the bits answer there.
Loads = Callable[[FloatArray, FloatArray], BitLoads]
_SHARE = 0.37
# Crossings as far outside the line as it is long are not looked for.
_MARGIN = 1.0
_SAMPLES = 33


def is_affine(string: StringAtBit, start: BitLoads, middle: BitLoads, stop: BitLoads) -> bool:
    """Whether D is affine: at a share of 0.37 of the way it is as much of the change."""
    if not np.array_equal(start.delay, stop.delay):
        return False
    s = 1j * np.array([0.7, 2.9, 9.1, 23.0])
    gx, gt = string.receptances(s)
    a, b, c = (closed(loads, s, gx, gt) for loads in (start, middle, stop))
    expected = a + _SHARE * (c - a)
    return bool(np.allclose(b, expected, rtol=1e-9, atol=1e-9))


def scan_string(
    string: StringAtBit, loads: Loads, positions: FloatArray, low: float, high: float
) -> list[ScanLine]:
    """Scan many lines of one string along a parameter in which D is affine.

    Parameters
    ----------
    string : StringAtBit
        The string.
    loads : callable
        What bits answer at (positions, places along the lines).
    positions : array, (N,)
        The parameter that is held.
    low, high : float
        Limits of the other one.
    """
    start, stop = (loads(positions, np.full(positions.size, end)) for end in (low, high))
    loops = StringLoops(string, start, stop)
    grid = frequency_grid(string, (start, stop))

    def count(shares: FloatArray) -> IntArray:
        return count_growing(string, start.towards(stop, shares), grid)

    every = np.arange(positions.size)
    found = find_crossings(loops, 0.0, grid, every, margin=_MARGIN)
    return affine_lines(positions, found, count, low, high)


def scan_string_counting(
    string: StringAtBit, loads: Loads, positions: FloatArray, low: float, high: float
) -> list[ScanLine]:
    """Scan many lines of one string along any parameter; see `scan_string`."""
    ends = tuple(loads(positions, np.full(positions.size, end)) for end in (low, high))
    grid = frequency_grid(string, ends)

    def count(held: FloatArray, at: FloatArray) -> IntArray:
        return count_growing(string, loads(held, at), grid)

    def frequency(held: FloatArray, at: FloatArray) -> FloatArray:
        s = 1j * grid[1:]
        size = np.abs(closed(loads(held, at), s, *string.receptances(s)))
        return np.asarray(grid[1:][np.argmin(size, axis=1)])

    return bisected_lines(count, frequency, positions, low, high, _SAMPLES)
