"""Scan lines joined to curves: the stability boundary and the outline of the stable set."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.scan import ScanLine

Interval = tuple[float, float, float, float]
Node = tuple[int, int, int]  # line, interval, 0 for its start and 1 for its end


@dataclass(frozen=True, eq=False)
class Curve:
    """A piece of the stability boundary.

    Attributes
    ----------
    points : array, (k, 2)
        x and y.
    omega : array, (k,)
        |Im s| of the root that crosses there.
    closed : bool
        Whether the last point joins the first.
    """

    points: FloatArray
    omega: FloatArray
    closed: bool


def _groups(one: list[Interval], two: list[Interval]) -> list[tuple[list[int], list[int]]]:
    """Group the intervals of neighbouring lines by overlap."""
    items = [(a[0], a[1], 0, i) for i, a in enumerate(one)]
    items += [(b[0], b[1], 1, j) for j, b in enumerate(two)]
    groups: list[tuple[list[int], list[int]]] = []
    # Of one line the intervals are disjoint, so a sweep by start finds the overlaps.
    reach = [-np.inf, -np.inf]
    for start, stop, side, index in sorted(items):
        if not groups or start >= reach[1 - side]:
            groups.append(([], []))
            reach = [-np.inf, -np.inf]
        groups[-1][side].append(index)
        reach[side] = max(reach[side], stop)
    return groups


def stable_curves(lines: tuple[ScanLine, ...], *, rows: bool) -> list[Curve]:
    """Join the ends of stable intervals from line to line.

    Parameters
    ----------
    lines : tuple of ScanLine
        In order of position.
    rows : bool
        Whether lines are held at y and scanned along x; else the other way round.

    Returns
    -------
    list of Curve
        Edges of the chart itself are left out.
    """
    intervals = [line.stable_intervals for line in lines]
    links: dict[Node, list[Node]] = {}

    def real(node: Node) -> bool:
        line, index, end = node
        return not np.isnan(intervals[line][index][2 + end])

    def join(one: Node, two: Node) -> None:
        if real(one) and real(two):
            links.setdefault(one, []).append(two)
            links.setdefault(two, []).append(one)

    for i in range(len(lines) - 1):
        for left, right in _groups(intervals[i], intervals[i + 1]):
            for line, members in ((i, left), (i + 1, right)):
                for a, b in itertools.pairwise(members):
                    join((line, a, 1), (line, b, 0))
            if left and right:
                join((i, left[0], 0), (i + 1, right[0], 0))
                join((i, left[-1], 1), (i + 1, right[-1], 1))
            else:
                line, members = (i, left) if left else (i + 1, right)
                join((line, members[0], 0), (line, members[-1], 1))
    curves = []
    seen: set[Node] = set()
    starts = [node for node in links if len(links[node]) == 1] + list(links)
    for start in starts:
        if start in seen:
            continue
        path, closed = _walk(start, links, seen)
        points = [
            (lines[i].position, intervals[i][j][end], intervals[i][j][2 + end])
            for i, j, end in path
        ]
        table = np.array(points)
        place = table[:, [1, 0]] if rows else table[:, [0, 1]]
        curves.append(Curve(place, table[:, 2], closed))
    return curves


def _walk(start: Node, links: dict[Node, list[Node]], seen: set[Node]) -> tuple[list[Node], bool]:
    path = [start]
    seen.add(start)
    while True:
        onward = [node for node in links[path[-1]] if node not in seen]
        if not onward:
            closed = len(path) > 2 and start in links[path[-1]]
            return path, closed
        path.append(onward[0])
        seen.add(onward[0])


def stable_strips(lines: Sequence[ScanLine], *, rows: bool) -> list[FloatArray]:
    """Return polygons that cover the stable set, a quadrilateral per panel and interval.

    Returns
    -------
    list of array, (4, 2)
    """
    polygons = []
    intervals = [line.stable_intervals for line in lines]
    for i in range(len(lines) - 1):
        t0, t1 = lines[i].position, lines[i + 1].position
        for left, right in _groups(intervals[i], intervals[i + 1]):
            if not left or not right:
                continue
            one = intervals[i][left[0]][0], intervals[i][left[-1]][1]
            two = intervals[i + 1][right[0]][0], intervals[i + 1][right[-1]][1]
            corners = np.array([[t0, one[0]], [t0, one[1]], [t1, two[1]], [t1, two[0]]])
            polygons.append(corners[:, ::-1] if rows else corners)
    return polygons


def curve_fields(curve: Curve) -> dict[str, Any]:
    """Return one boundary curve."""
    omega = [value if math.isfinite(value) else None for value in curve.omega.tolist()]
    return {"omega": omega, "closed": curve.closed}
