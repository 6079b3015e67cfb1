"""`stabilisable_chart`: where some gains within the bounds put all roots left of a line."""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.text import finite_or_none
from drillctrl.charts.axes import Axis
from drillctrl.charts.chains import Curve, curve_fields, stable_curves
from drillctrl.charts.chart import chart
from drillctrl.charts.decisions import Place, Searched, by_curves, has_curves
from drillctrl.charts.plane import AxisLike, Plane, make_plane, plane_fields
from drillctrl.charts.plane_text import area_text, axis_range
from drillctrl.charts.scan import ScanLine, Scanner
from drillctrl.charts.scanners import first_position
from drillctrl.charts.searched_scan import SEARCHED_TOLERANCE, SearchedScan
from drillctrl.charts.stabilisable_scan import CROSSING_TOLERANCE, scan_stabilisable
from drillctrl.charts.sweep import sweep
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Where
from drillctrl.drilling.structures import as_structure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.charts.chart import StabilityChart

# Share of x by which lines are apart at least: those that need a search cost more.
_NARROWEST, _NARROWEST_SEARCHED = 3e-3, 2.5e-2
# The same relative to x itself, and how far apart lines are at first, with five at least.
_SAME, _LIKE, _FEWEST = 0.01, 0.03, 5
# Roots of loops with longer delays crowd the axis, and gains that tame them are not looked for.
_LONGEST_DELAY = 6.3


@dataclass(frozen=True, eq=False)
class StabilisableChart:
    """Where some gains within the bounds of a structure are stabilising.

    Attributes
    ----------
    plane : Plane
        The two parameters, and what is held.
    structure : FeedbackStructure
        What is fed back, and the bounds of its gains.
    level : float
        σ: a place counts where some gains put all roots left of Re s = σ.
    curves : tuple of Curve
        The edge of that set; ``omega`` is the frequency of a root on the line there, 0
        where the edge leaves the chart or no root is held.
    stable_area, area_error : float
        In units of x times y, and an estimate of the error that lines, crossings and
        panels leave; islands that no sample met are not in it.
    undecided_area : float
        Of the strip at low rotary speed that is not looked at: there the delay exceeds 6.3.
    lines : tuple of ScanLine
        The scanned lines of constant x.
    open_loop : StabilityChart
        The same axes without feedback.
    places : tuple of Place
        Where gains were searched for, with those found; empty where explicit curves decide.
    samples : int
        Places looked at on each line before refinement.
    elapsed_seconds : float
        Wall time.
    """

    plane: Plane
    structure: FeedbackStructure
    level: float
    curves: tuple[Curve, ...]
    stable_area: float
    area_error: float
    undecided_area: float
    lines: tuple[ScanLine, ...]
    open_loop: StabilityChart
    places: tuple[Place, ...]
    samples: int
    elapsed_seconds: float

    @property
    def rows(self) -> bool:
        """Lines are held at x."""
        return False

    @property
    def area_ratio(self) -> float | None:
        """The area as a multiple of the open loop's; None where that is zero."""
        area = self.open_loop.stable_area
        return self.stable_area / area if area > 0.0 else None

    @property
    def area_ratio_error(self) -> float | None:
        """An estimate of the error of `area_ratio`."""
        ratio, area = self.area_ratio, self.open_loop.stable_area
        if ratio is None:
            return None
        return self.area_error / area + ratio * self.open_loop.area_error / area

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        structure, plane = self.structure, self.plane
        return {
            "schema": "drillctrl/chart/1",
            **plane_fields(plane),
            "structure": structure.name,
            "K1": None,
            "K2": None,
            "optimised": True,
            "bounds": {name: list(ends) for name, ends in structure.gain_bounds.items()},
            "level": self.level,
            "stable_area": self.stable_area,
            "stable_area_error": self.area_error,
            "undecided_area": self.undecided_area,
            "open_loop_area": self.open_loop.stable_area,
            "open_loop_area_error": self.open_loop.area_error,
            "area_ratio": self.area_ratio,
            "area_ratio_error": self.area_ratio_error,
            "boundaries": [curve.points.tolist() for curve in self.curves],
            "boundary_details": [curve_fields(curve) for curve in self.curves],
            "method": "search and count" if self.places else "gain curves",
            "places": [
                {
                    plane.x.name: place.x,
                    plane.y.name: place.y,
                    "gains": place.gains.tolist(),
                    "spectral_abscissa": finite_or_none(self.level + place.margin),
                    "stable": place.stable,
                    "decided_by": "count" if place.stable else "search",
                }
                for place in self.places
            ],
            "samples": self.samples,
            "elapsed_seconds": self.elapsed_seconds,
        }

    def summary(self) -> str:
        """Return a text for people."""
        plane, structure = self.plane, self.structure
        bounds = ", ".join(
            f"{name} in [{low:g}, {high:g}]" for name, (low, high) in structure.gain_bounds.items()
        )
        goal = "stabilise" if self.level == 0.0 else f"put all roots left of {self.level:g}"
        alone = self.open_loop
        lines = [
            f"Where some gains of {structure.name} {goal}",
            f"  over      {axis_range(plane, plane.x)}, {axis_range(plane, plane.y)}",
            f"  bounds    {bounds}",
            f"  reached   {area_text(self.stable_area, self.area_error, plane)}",
            f"  open loop {area_text(alone.stable_area, alone.area_error, plane)}",
        ]
        if self.area_ratio is not None and self.area_ratio_error is not None:
            lines.append(f"  ratio     {self.area_ratio:.4g} ± {self.area_ratio_error:.1g}")
        if self.undecided_area > 0.0:
            lines.append(
                f"  undecided {self.undecided_area:.4g} at the lowest rotary speeds, "
                f"where the delay exceeds {_LONGEST_DELAY:g}"
            )
        lines.append(
            f"  sampled   {len(self.lines)} lines, {self.samples} places each before refinement; "
            "smaller islands may be missed"
        )
        if self.places:
            stable = sum(place.stable for place in self.places)
            lines.append(
                f"  proved    at {stable} places by gains and a count of roots; at "
                f"{len(self.places) - stable} others gains were searched for and not found, "
                "which is no proof: the area is a lower bound"
            )
        return "\n".join(lines)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the set and the open loop's; see `drillctrl.charts.figure.plot_charts`."""
        from drillctrl.charts.figure import plot_charts

        name = f"some gains of {self.structure.name}"
        return plot_charts({name: self, "open loop": self.open_loop}, ax)

    def __repr__(self) -> str:
        x, y = self.plane.x, self.plane.y
        return (
            f"<StabilisableChart of {self.structure.name}, {x.name} {x.low:g}:{x.high:g} × "
            f"{y.name} {y.low:g}:{y.high:g}: area {self.stable_area:.5g} ± {self.area_error:.1g}>"
        )


@checks_kinds
def stabilisable_chart(
    point: Where,
    x: AxisLike = ("omega0", 0.5, 25.0),
    y: AxisLike = ("delta0", 0.0, 15.0),
    structure: str | FeedbackStructure = "case1",
    *,
    level: float = 0.0,
    tolerance: float = 2e-3,
    first_lines: int = 17,
    samples: int = 16,
    progress: Callable[[int], None] | None = None,
) -> StabilisableChart:
    """Draw where some gains within the bounds are stabilising (Fig. 12).

    Parameters
    ----------
    point : OperatingPoint, RigPoint or Case
        Supplies all parameters that are no axis.
    x, y : (name, low, high)
        As for `chart`, but no gains.
    structure : str or FeedbackStructure
        With at least one free gain; its bounds are those of the search.
    level : float
        σ.
    tolerance : float
        Wanted relative error of the area.
    first_lines : int
        Evenly spaced lines of constant x to begin with; fewer where more than two gains are
        searched for over a narrow range of x.
    samples : int
        Places looked at on each line before refinement: islands narrower than their
        distance may be missed.
    progress : callable, optional
        Called with the number of lines done.

    Raises
    ------
    InputError
        If axes, structure or limits are wrong.

    Notes
    -----
    Whether one or two gains exist at a place is decided on the explicit curves of gains that
    hold a root at the line (see `drillctrl.synthesis.gain_margin`). More gains are searched for,
    from those of places nearby (`drillctrl.charts.searched_scan`): where they are found a count
    of roots proves it, where they are not the search may have missed them, so that the area is a
    lower bound. At the edge they hold several roots, and its ``omega`` is 0.
    """
    began = time.perf_counter()
    plane = make_plane(point, x, y, None, None, None)
    chosen = as_structure(structure)
    if not chosen.lower.size:
        raise InputError("structure", chosen.name, "one with free gains")
    checked_number("level", level, -100.0, 100.0)
    checked_number("tolerance", tolerance, 1e-6, 0.1)
    checked_integer("first_lines", first_lines, 3, 1000)
    checked_integer("samples", samples, 4, 1000)
    done = 0

    def count() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done)

    start, low = _shortest_speed(plane, plane.x), _shortest_speed(plane, plane.y)
    searched = Searched(plane, chosen, level)
    here = plane.case_at(plane.x.high, plane.y.high).system(chosen.inputs)
    curves = has_curves(here, chosen)
    scanner: Scanner
    if curves:
        scanner = functools.partial(
            scan_stabilisable, by_curves(plane, chosen, level),
            low=low, high=plane.y.high, samples=samples, progress=count,
        )  # fmt: skip
    else:
        scanner = SearchedScan(searched, low, plane.y.high, samples, count)
    # Over a narrow range of x gains hardly change from line to line.
    share = abs(start) / (plane.x.high - start)
    fewest = min(first_lines, max(_FEWEST, math.ceil(1.0 / max(_LIKE * share, 1e-3))))
    result = sweep(
        scanner,
        start,
        plane.x.high,
        tolerance=tolerance,
        first=first_lines if curves else fewest,
        narrowest=_NARROWEST if curves else max(_NARROWEST_SEARCHED, _SAME * share),
        inset=0.0,
    )
    accuracy = CROSSING_TOLERANCE if curves else SEARCHED_TOLERANCE
    # Every line carries two crossings or so, each within the tolerance of its root finder.
    most = max((line.at.size for line in result.lines), default=0)
    crossing = most * accuracy * plane.y.span * plane.x.span
    return StabilisableChart(
        plane,
        chosen,
        level,
        tuple(stable_curves(result.lines, rows=False)),
        result.area,
        result.area_error + crossing,
        (start - plane.x.low) * plane.y.span + (low - plane.y.low) * plane.x.span,
        result.lines,
        chart(point, x, y, level=level),
        tuple(searched.places),
        samples,
        time.perf_counter() - began,
    )


def _shortest_speed(plane: Plane, axis: Axis) -> float:
    """Return where an axis begins to be looked at: delays must not be too long.

    Raises
    ------
    InputError
        If that leaves nothing.
    """
    start = first_position(axis)
    if axis.name in ("omega0", "speed"):
        _, point = plane.case.physics("an axis omega0")
        slowest = 2.0 * math.pi / (point.blades * _LONGEST_DELAY)
        if axis.name == "speed":
            assert plane.rig_point is not None
            slowest *= 30.0 / math.pi / plane.rig_point.rig.time_scale
        start = max(start, slowest)
    if not start < axis.high:
        raise InputError(f"limits of {axis.name}", f"up to {axis.high:g}", f"beyond {start:.4g}")
    return start
