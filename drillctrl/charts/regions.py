"""Regions of a chart with the same number of unstable roots, checked at sample points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillctrl.charts.plane import Plane
from drillctrl.charts.scan import ScanLine

_LABELLING_LINES = 65
_SMALLEST_SHARE = 1e-3
_MOST_CHECKED = 12


@dataclass(frozen=True)
class Region:
    """A connected part of the chart with one number of unstable roots.

    Attributes
    ----------
    unstable_roots : int
        Roots right of the line, conjugates counted.
    x, y : float
        A point well inside.
    area : float
        Approximate, from the lines that label the chart.
    confirmed : bool or None
        Whether the argument principle at (x, y) counts the same; None if not asked.
    """

    unstable_roots: int
    x: float
    y: float
    area: float
    confirmed: bool | None


def label_regions(
    plane: Plane, lines: tuple[ScanLine, ...], level: float, *, rows: bool
) -> tuple[Region, ...]:
    """Collect segments of equal count into regions, the largest first.

    Parameters
    ----------
    plane : Plane
        For the check.
    lines : tuple of ScanLine
        In order of position.
    level : float
        σ of the line right of which roots are counted.
    rows : bool
        Whether lines are held at y.
    """
    wanted = np.linspace(lines[0].position, lines[-1].position, _LABELLING_LINES)
    places = np.array([line.position for line in lines])
    chosen = [lines[i] for i in np.unique(np.searchsorted(places, wanted).clip(0, len(lines) - 1))]
    parent: list[int] = []

    def find(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    segments: list[tuple[int, float, float, float, float]] = []
    before: list[tuple[float, float, int, int]] = []
    positions = np.array([line.position for line in chosen])
    edges = np.concatenate([positions[:1], 0.5 * (positions[1:] + positions[:-1]), positions[-1:]])
    for width, line in zip(np.diff(edges), chosen, strict=True):
        skip = int(np.searchsorted(line.at, line.listed_from))
        ends = np.concatenate([[line.listed_from], line.at[skip:], [line.high]])
        now = []
        k = 0
        for start, stop, count in zip(ends[:-1], ends[1:], line.counts[skip:], strict=True):
            index = len(parent)
            parent.append(index)
            segments.append((int(count), line.position, float(start), float(stop), float(width)))
            now.append((float(start), float(stop), int(count), index))
            while k < len(before) and before[k][1] <= start:
                k += 1
            j = k
            while j < len(before) and before[j][0] < stop:
                if before[j][2] == count and min(stop, before[j][1]) > max(start, before[j][0]):
                    parent[find(index)] = find(before[j][3])
                j += 1
        before = now
    members: dict[int, list[tuple[int, float, float, float, float]]] = {}
    for i, segment in enumerate(segments):
        members.setdefault(find(i), []).append(segment)
    whole = plane.x.span * plane.y.span
    low, high = float(positions[0]), float(positions[-1])

    def room(segment: tuple[int, float, float, float, float]) -> float:
        """How far the middle of a segment is from its ends and from the edges of the chart."""
        _, position, start, stop, _ = segment
        across = min(position - low, high - position) / (high - low)
        return min(across, 0.5 * (stop - start) / (lines[0].high - lines[0].low))

    found = []
    for group in members.values():
        area = sum((stop - start) * width for _, _, start, stop, width in group)
        if area < _SMALLEST_SHARE * whole:
            continue
        count, position, start, stop, _ = max(group, key=room)
        found.append((area, count, position, 0.5 * (start + stop)))
    found.sort(reverse=True)
    regions = []
    for rank, (area, count, position, at) in enumerate(found):
        x, y = (at, position) if rows else (position, at)
        confirmed = None
        if rank < _MOST_CHECKED:
            confirmed = plane.unstable_roots(x, y, level) == count
        regions.append(Region(count, float(x), float(y), float(area), confirmed))
    return tuple(regions)
