"""Scans of charts of a string of pipe, from its exact receptances.

Where D is affine along the lines crossings are found in closed form, as in `affine_scan`; else
roots are counted at sample places and crossings bisected, as in `counting_scan`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.affine_scan import affine_lines, find_crossings
from drillctrl.charts.counting_scan import bisected_lines
from drillctrl.charts.scan import IntArray, ScanLine
from drillctrl.charts.string_loops import (
    Band,
    BitLoads,
    StringLoops,
    band,
    closed,
    count_growing,
)
from drillctrl.strings.at_bit import StringAtBit

# (positions, places along the lines) → what the bits answer there.
Loads = Callable[[FloatArray, FloatArray], BitLoads]
_SHARE = 0.37
# Crossings as far outside the line as it is long are not looked for.
_MARGIN = 1.0
_SAMPLES, _HALVINGS = 33, 4
_TRIED, _STEPS, _NOTHING, _SHARP = 4, 8, 1e-6, 1e-9


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
    known = band(string, (start, stop))
    loops = StringLoops(known, start, stop)

    def count(shares: FloatArray) -> IntArray:
        return count_growing(known, start.towards(stop, shares))

    every = np.arange(positions.size)
    found = find_crossings(loops, 0.0, known.omega, every, margin=_MARGIN)
    return affine_lines(positions, found, count, low, high)


def scan_string_counting(
    string: StringAtBit, loads: Loads, positions: FloatArray, low: float, high: float
) -> list[ScanLine]:
    """Scan many lines of one string along any parameter; see `scan_string`."""
    ends = tuple(loads(positions, np.full(positions.size, end)) for end in (low, high))
    known = band(string, ends)

    def count(held: FloatArray, at: FloatArray) -> IntArray:
        return count_growing(known, loads(held, at))

    def settle(
        held: FloatArray, left: FloatArray, right: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        return _crossed(known, loads, (held, left, right))

    return bisected_lines(
        count, settle, positions, low, high, _SAMPLES, _HALVINGS, edges_alone=True
    )


def _crossed(
    known: Band, loads: Loads, intervals: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return where in intervals D vanishes on the axis, and ω there.

    The middle where it is not found: counts tell that it is in between.
    """
    held, left, right = intervals
    middle = 0.5 * (left + right)

    size = np.abs(known.closed(loads(held, middle)))
    # A root on the axis near by leaves a dip: the deepest few are tried.
    padded = np.pad(size, ((0, 0), (1, 1)), constant_values=np.inf)
    dips = np.where((size <= padded[:, :-2]) & (size <= padded[:, 2:]), size, np.inf)
    order = np.argsort(dips, axis=1)[:, :_TRIED]
    found = np.zeros(held.size, dtype=bool)
    best, frequency = middle.copy(), known.omega[order[:, 0]]
    for choice in order.T:
        rest = np.flatnonzero(~found)
        if not rest.size:
            break
        some = tuple(part[rest] for part in intervals)
        at, omega, good = _newton(known.string, loads, known.omega[choice[rest]], some)
        best[rest[good]], frequency[rest[good]] = at[good], omega[good]
        found[rest[good]] = True
    return best, frequency


def _newton(
    string: StringAtBit,
    loads: Loads,
    omega: FloatArray,
    intervals: tuple[FloatArray, ...],
) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]:
    """Return places and ω that Newton's method finds from the middles, and where it does."""
    held, left, right = intervals
    at = 0.5 * (left + right)
    width = right - left
    step, turn = 1e-5 * width, 1e-7 * (1.0 + omega)
    three = np.tile(held, 3)
    for _ in range(_STEPS):
        places = np.concatenate([at, at + step, at])
        s = 1j * np.concatenate([omega, omega, omega + turn])[:, None]
        now, beside, above = np.split(
            closed(loads(three, places), s, *string.receptances(s))[:, 0], 3
        )
        along, up = (beside - now) / step, (above - now) / turn
        determinant = along.real * up.imag - along.imag * up.real
        with np.errstate(divide="ignore", invalid="ignore"):
            moved = (now.real * up.imag - now.imag * up.real) / determinant
            risen = (along.real * now.imag - along.imag * now.real) / determinant
        fine = np.isfinite(moved) & np.isfinite(risen)
        at, omega = at - np.where(fine, moved, 0.0), omega - np.where(fine, risen, 0.0)
        at, omega = np.clip(at, left - width, right + width), np.abs(omega)
        if (np.abs(moved) <= _SHARP * width).all() and (np.abs(risen) <= _SHARP * omega).all():
            break
    found = (np.abs(now) < _NOTHING) & (at >= left) & (at <= right)
    return at, omega, found
