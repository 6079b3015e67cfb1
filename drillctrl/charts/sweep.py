"""Lines placed where a chart needs them, and the area between them.

The stable length L(t) of a line is a piecewise smooth function of its position t; its kinks
are where the boundary crosses itself, turns back, begins or ends. Panels are halved until
Simpson's rule agrees with the trapezoidal rule, and to a hair's breadth at each kink.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from drillctrl.charts.scan import ScanLine, Scanner

FIRST_LINES = 97
_NARROWEST = 2e-5
_ROUNDS = 18
_INSET = 1e-6
_MOST_LINES = 3000


@dataclass(frozen=True, eq=False)
class Sweep:
    """Scan lines over a whole chart.

    Attributes
    ----------
    lines : tuple of ScanLine
        In order of position.
    area : float
        Stable area, in units of position times scanned parameter.
    area_error : float
        Estimated bound of its error.
    """

    lines: tuple[ScanLine, ...]
    area: float
    area_error: float


def _length(line: ScanLine) -> float:
    return sum(stop - start for start, stop, _, _ in line.stable_intervals)


def _alike(first: ScanLine, second: ScanLine) -> bool:
    """Whether the stable sets of two lines are bounded by the same branches."""
    one, two = first.stable_intervals, second.stable_intervals
    if len(one) != len(two):
        return False
    for a, b in zip(one, two, strict=True):
        if max(a[0], b[0]) > min(a[1], b[1]):
            return False
        for k in (2, 3):
            if np.isnan(a[k]) != np.isnan(b[k]):
                return False
            if abs(a[k] - b[k]) > 0.15 * (1.0 + abs(a[k])):
                return False
    return True


def _signature(line: ScanLine) -> tuple[int, ...]:
    """Counts along the line where they are small: changes announce islands."""
    return tuple(min(int(count), 4) for count in line.counts[line.counts <= 4])


def sweep(
    scanner: Scanner,
    low: float,
    high: float,
    *,
    tolerance: float = 2e-4,
    first: int = FIRST_LINES,
    narrowest: float = _NARROWEST,
    inset: float = _INSET,
) -> Sweep:
    """Place lines between two positions until the stable area is known.

    Parameters
    ----------
    scanner : callable
        Returns the scan lines at given positions.
    low, high : float
        First and last position.
    tolerance : float
        Wanted relative error of the area.
    first : int
        Lines to begin with.
    narrowest : float
        Smallest panel, as a share of the range.
    inset : float
        How far inside the ends two more lines lie, as a share of the range.
    """
    span = high - low
    # An even grid, with lines a hair inside its ends: there, a boundary may coincide
    # with the edge of the chart.
    positions = np.linspace(low, high, first)
    positions = np.unique(np.concatenate([positions, [low + inset * span, high - inset * span]]))
    lines = {float(t): line for t, line in zip(positions, scanner(positions), strict=True)}
    order = sorted(lines)
    panels = list(itertools.pairwise(order))
    done: list[tuple[float, float]] = []
    wide = span / (4 * (first - 1))
    for _ in range(_ROUNDS):
        if not panels:
            break
        middles = np.array([0.5 * (a + b) for a, b in panels])
        for t, line in zip(middles, scanner(middles), strict=True):
            lines[float(t)] = line
        total = max(sum(area for area, _ in done), _rough_area(lines), 1e-12)
        waiting = []
        for (a, b), t in zip(panels, middles.tolist(), strict=True):
            one, mid, two = lines[a], lines[t], lines[b]
            area, error = _panel_area(one, mid, two, b - a)
            kink = not (_alike(one, mid) and _alike(mid, two))
            new = b - a > wide and not _signature(one) == _signature(mid) == _signature(two)
            split = (kink or new or error > tolerance * total * (b - a) / span) and (
                b - a > 2.0 * narrowest * span and len(lines) < _MOST_LINES
            )
            # A split that changes nothing of note is not worth its lines.
            if split and error < 1e-3 * tolerance * total and not (kink or new):
                split = False
            if split:
                waiting += [(a, t), (t, b)]
            else:
                done.append((area, error))
        panels = waiting
    for a, b in panels:
        lengths = _length(lines[a]), _length(lines[b])
        done.append((0.5 * (b - a) * sum(lengths), (b - a) * max(lengths)))
    kept = tuple(lines[t] for t in sorted(lines))
    undecided = sum(
        0.5
        * (two.position - one.position)
        * (one.decided_from - one.low + two.decided_from - two.low)
        for one, two in itertools.pairwise(kept)
    )
    return Sweep(
        kept,
        float(sum(area for area, _ in done)),
        float(sum(error for _, error in done) + undecided),
    )


def _rough_area(lines: dict[float, ScanLine]) -> float:
    order = sorted(lines)
    lengths = [_length(lines[t]) for t in order]
    return float(np.trapezoid(lengths, order))


def _panel_area(one: ScanLine, mid: ScanLine, two: ScanLine, width: float) -> tuple[float, float]:
    """Return Simpson's area of a panel and an estimate of its error."""
    a, m, b = _length(one), _length(mid), _length(two)
    simpson = width * (a + 4.0 * m + b) / 6.0
    refined = width * (a + 2.0 * m + b) / 4.0
    return simpson, abs(simpson - refined)
