"""Scan lines of what feedback can reach: where some gains within bounds are stabilising.

Along a line the margin of the best gains is sampled; its sign changes are found by a
bracketing root finder, and a low dip between samples is followed to its floor, since a
narrow island may lie there.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from typing import Protocol

import numpy as np
import scipy.optimize

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.scan import ScanLine

_DIP = 0.3
_CEILING = 10.0
# Wanted accuracy of a crossing, as a share of the line.
CROSSING_TOLERANCE = 2e-5


class Reached(Protocol):
    """What is known of the best gains at a place."""

    @property
    def margin(self) -> float:
        """Real part of the root that decides, less σ: negative where gains exist."""

    @property
    def omega(self) -> float:
        """Frequency of the root that is held at the line."""


# x, y, and whether to look all over the bounds or only near what is known.
Decision = Callable[[float, float, bool], Reached]


def scan_stabilisable(
    decide: Decision,
    positions: FloatArray,
    low: float,
    high: float,
    *,
    samples: int = 16,
    progress: Callable[[], None] | None = None,
) -> list[ScanLine]:
    """Scan lines of constant x along y.

    Parameters
    ----------
    decide : callable
        Answers for one place.
    positions : array, (N,)
        Values of x.
    low, high : float
        Ends of the lines.
    samples : int
        Evenly spaced places to begin with.
    progress : callable, optional
        Called after each line.

    Returns
    -------
    list of ScanLine
        ``counts`` is 0 where gains exist and 1 where not; ``omega`` is the frequency of the
        root that the best gains hold at the line.
    """
    lines = []
    for position in positions.tolist():
        lines.append(_scan(functools.partial(decide, position), position, low, high, samples))
        if progress is not None:
            progress()
    return lines


def _scan(
    decide: Callable[[float, bool], Reached],
    position: float,
    low: float,
    high: float,
    samples: int,
) -> ScanLine:
    def value(y: float, everywhere: bool = False) -> float:
        return bounded_margin(decide(y, everywhere).margin)

    at = np.linspace(low, high, samples)
    found = np.array([value(y, True) for y in at.tolist()])
    for i in range(1, samples - 1):
        dip = found[i] <= found[i - 1] and found[i] <= found[i + 1]
        if dip and 0.0 < found[i] < _DIP:
            floor = _floor(value, float(at[i - 1]), float(at[i + 1]))
            if floor is not None:
                at, found = np.append(at, floor[0]), np.append(found, floor[1])
    order = np.argsort(at)
    at, found = at[order], found[order]
    tolerance = CROSSING_TOLERANCE * (high - low)
    crossings, omega = [], []
    for i in np.flatnonzero((found[1:] < 0.0) != (found[:-1] < 0.0)).tolist():
        a, b = float(at[i]), float(at[i + 1])
        if found[i] * found[i + 1] == 0.0:
            place = a if found[i] == 0.0 else b
        else:
            place = float(scipy.optimize.brentq(value, a, b, xtol=tolerance, rtol=1e-10))
        inner = tolerance if found[i + 1] < 0.0 else -tolerance
        crossings.append(place)
        omega.append(decide(float(np.clip(place + inner, low, high)), False).omega)
    return reached_line(position, low, high, bool(found[0] < 0.0), crossings, omega)


def bounded_margin(margin: float) -> float:
    """Return a margin that brackets can take: it is infinite where nothing is in reach."""
    return float(np.clip(margin, -_CEILING, _CEILING))


def reached_line(
    position: float,
    low: float,
    high: float,
    stable: bool,
    crossings: list[float],
    omega: list[float],
) -> ScanLine:
    """Return a line on which places in reach and out of reach take turns.

    Parameters
    ----------
    position, low, high : float
        x, and the ends of the line.
    stable : bool
        Whether gains exist at its low end.
    crossings, omega : list of float
        Where that changes, and the frequency of the root that is held there.
    """
    counts = [0 if stable ^ (k % 2 == 1) else 1 for k in range(len(crossings) + 1)]
    jump = np.array([b - a for a, b in itertools.pairwise(counts)], dtype=np.int64)
    return ScanLine(
        position,
        np.array(crossings, dtype=float),
        np.nan_to_num(np.array(omega, dtype=float)),
        jump,
        np.array(counts, dtype=np.int64),
        low,
        high,
        low,
        low,
    )


def _floor(value: Callable[[float], float], a: float, b: float) -> tuple[float, float] | None:
    """Return the first negative place that a golden-section descent meets, if any."""
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    fc, fd = value(c), value(d)
    for _ in range(8):
        if min(fc, fd) < 0.0:
            return (c, fc) if fc < fd else (d, fd)
        if fc < fd:
            b, d, fd = d, c, fc
            c = b - ratio * (b - a)
            fc = value(c)
        else:
            a, c, fc = c, d, fd
            d = a + ratio * (b - a)
            fd = value(d)
    return None
