"""`stabilisable_chart`: where some gains within the bounds put all roots left of a line."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.charts.axes import Axis
from drillctrl.charts.chains import Curve, curve_fields, stable_curves
from drillctrl.charts.chart import chart
from drillctrl.charts.plane import AxisLike, Plane, area_text, make_plane, plane_fields
from drillctrl.charts.scan import ScanLine
from drillctrl.charts.scanners import first_position
from drillctrl.charts.stabilisable_scan import CROSSING_TOLERANCE, scan_stabilisable
from drillctrl.charts.sweep import sweep
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Where
from drillctrl.drilling.structures import as_structure
from drillctrl.synthesis.gain_margin import check_gains

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.charts.chart import StabilityChart

_NARROWEST = 3e-3
# Roots of loops with longer delays crowd the axis, and gains that tame them are not looked for.
_LONGEST_DELAY = 2.1


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
        Of the strip at low rotary speed that is not looked at: there the delay exceeds 2.1.
    lines : tuple of ScanLine
        The scanned lines of constant x.
    open_loop : StabilityChart
        The same axes without feedback.
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
        structure = self.structure
        return {
            "schema": "drillctrl/chart/1",
            **plane_fields(self.plane),
            "structure": structure.name,
            "K1": None,
            "K2": None,
            "optimised": True,
            "bounds": {
                name: [low, high]
                for name, low, high in zip(
                    structure.gain_names,
                    structure.lower.tolist(),
                    structure.upper.tolist(),
                    strict=True,
                )
            },
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
            "method": "gain curves",
            "samples": self.samples,
            "elapsed_seconds": self.elapsed_seconds,
        }

    def summary(self) -> str:
        """Return a text for people."""
        plane, structure = self.plane, self.structure
        bounds = ", ".join(
            f"{name} in [{low:g}, {high:g}]"
            for name, low, high in zip(
                structure.gain_names, structure.lower, structure.upper, strict=True
            )
        )
        goal = "stabilise" if self.level == 0.0 else f"put all roots left of {self.level:g}"
        alone = self.open_loop
        lines = [
            f"Where some gains of {structure.name} {goal}",
            f"  over      {plane.x.label} in [{plane.x.low:g}, {plane.x.high:g}], "
            f"{plane.y.label} in [{plane.y.low:g}, {plane.y.high:g}]",
            f"  bounds    {bounds}",
            f"  reached   {area_text(self.stable_area, self.area_error, plane)}",
            f"  open loop {area_text(alone.stable_area, alone.area_error, plane)}",
        ]
        if self.area_ratio is not None and self.area_ratio_error is not None:
            lines.append(f"  ratio     {self.area_ratio:.4g} ± {self.area_ratio_error:.1g}")
        if self.undecided_area > 0.0:
            lines.append(
                f"  undecided {self.undecided_area:.4g} at the lowest rotary speeds, "
                "where the delay exceeds 2.1"
            )
        lines.append(
            f"  sampled   {len(self.lines)} lines, {self.samples} places each before refinement; "
            "smaller islands may be missed"
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
        With one or two free gains that drive one input; its bounds are those of the search.
    level : float
        σ.
    tolerance : float
        Wanted relative error of the area.
    first_lines : int
        Evenly spaced lines of constant x to begin with.
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
    Whether gains exist at a place is decided on the explicit curves of gains that hold a
    root at the line (see `drillctrl.synthesis.gain_margin`), not by a search over gains.
    """
    began = time.perf_counter()
    plane = make_plane(point, x, y, None, None, None)
    chosen = as_structure(structure)
    check_gains(chosen.lower.size)
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
    result = sweep(
        lambda positions: scan_stabilisable(
            plane, chosen, positions, level=level, samples=samples, low=low, progress=count
        ),
        start,
        plane.x.high,
        tolerance=tolerance,
        first=first_lines,
        narrowest=_NARROWEST,
        inset=0.0,
    )
    # Every line carries two crossings or so, each within the tolerance of its root finder.
    most = max((line.at.size for line in result.lines), default=0)
    crossing = most * CROSSING_TOLERANCE * plane.y.span * plane.x.span
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
