"""Charts in fields for programs and in words for people."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.charts.chains import Curve
from drillctrl.charts.plane import Plane

if TYPE_CHECKING:
    from drillctrl.charts.chart import StabilityChart
    from drillctrl.charts.stabilisable import StabilisableChart


def plane_fields(plane: Plane) -> dict[str, Any]:
    """Return what a chart was drawn over."""
    structure = plane.structure
    axes = {
        key: {"name": axis.name, "low": axis.low, "high": axis.high, "unit": axis.unit or None}
        for key, axis in (("x", plane.x), ("y", plane.y))
    }
    return {
        "operating_point": dataclasses.asdict(plane.point),
        "axes": axes,
        "structure": structure.name if structure else None,
        "K1": plane.K1.ravel().tolist(),
        "K2": plane.K2.ravel().tolist(),
    }


def curve_fields(curve: Curve) -> dict[str, Any]:
    """Return one boundary curve."""
    omega = [value if math.isfinite(value) else None for value in curve.omega.tolist()]
    return {"omega": omega, "closed": curve.closed}


def chart_fields(chart: StabilityChart) -> dict[str, Any]:
    """Return the JSON fields of ``chart``; ``boundaries`` holds lists of (x, y)."""
    return {
        "schema": "drillctrl/chart/1",
        **plane_fields(chart.plane),
        "optimised": False,
        "level": chart.level,
        "stable_area": chart.stable_area,
        "stable_area_error": chart.area_error,
        "undecided_area": chart.undecided_area,
        "boundaries": [curve.points.tolist() for curve in chart.curves],
        "boundary_details": [curve_fields(curve) for curve in chart.curves],
        "regions": [dataclasses.asdict(region) for region in chart.regions],
        "method": chart.method,
        "elapsed_seconds": chart.elapsed_seconds,
    }


def area_text(area: float, error: float, plane: Plane) -> str:
    """Return an area with its error and its share of the chart."""
    digits = max(0, min(6, -math.floor(math.log10(max(error, 1e-12)))))
    share = area / (plane.x.span * plane.y.span)
    return f"{area:.{digits}f} ± {error:.1g} ({share:.1%} of the chart)"


def chart_summary(chart: StabilityChart) -> str:
    """Return a text for people."""
    plane = chart.plane
    name = plane.structure.name if plane.structure else "open loop"
    lines = [
        f"Stability chart of {name}",
        f"  over      {plane.x.label} in [{plane.x.low:g}, {plane.x.high:g}], "
        f"{plane.y.label} in [{plane.y.low:g}, {plane.y.high:g}]",
        f"  stable    {area_text(chart.stable_area, chart.area_error, plane)}",
    ]
    if chart.level:
        lines.append(f"  meaning   all roots left of {chart.level:g}")
    if chart.undecided_area > 0.0:
        lines.append(
            f"  undecided {chart.undecided_area:.4g} at the lowest rotary speeds, within the error"
        )
    frequencies = [curve.omega for curve in chart.curves]
    if frequencies:
        omega = np.concatenate(frequencies)
        lines.append(
            f"  boundary  {len(chart.curves)} curve(s), frequencies {omega.min():.3g} "
            f"to {omega.max():.3g}"
        )
    checked = [region for region in chart.regions if region.confirmed is not None]
    agree = sum(bool(region.confirmed) for region in checked)
    lines.append(f"  checked   the argument principle agrees in {agree} of {len(checked)} regions")
    return "\n".join(lines)


def stabilisable_fields(chart: StabilisableChart) -> dict[str, Any]:
    """Return the JSON fields of ``chart --optimise``."""
    structure = chart.structure
    return {
        "schema": "drillctrl/chart/1",
        **plane_fields(chart.plane),
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
        "level": chart.level,
        "stable_area": chart.stable_area,
        "stable_area_error": chart.area_error,
        "undecided_area": chart.undecided_area,
        "open_loop_area": chart.open_loop.stable_area,
        "open_loop_area_error": chart.open_loop.area_error,
        "area_ratio": chart.area_ratio,
        "area_ratio_error": chart.area_ratio_error,
        "boundaries": [curve.points.tolist() for curve in chart.curves],
        "boundary_details": [curve_fields(curve) for curve in chart.curves],
        "method": "gain curves",
        "samples": chart.samples,
        "elapsed_seconds": chart.elapsed_seconds,
    }


def stabilisable_summary(chart: StabilisableChart) -> str:
    """Return a text for people."""
    plane, structure = chart.plane, chart.structure
    bounds = ", ".join(
        f"{name} in [{low:g}, {high:g}]"
        for name, low, high in zip(
            structure.gain_names, structure.lower, structure.upper, strict=True
        )
    )
    goal = "stabilise" if chart.level == 0.0 else f"put all roots left of {chart.level:g}"
    lines = [
        f"Where some gains of {structure.name} {goal}",
        f"  over      {plane.x.label} in [{plane.x.low:g}, {plane.x.high:g}], "
        f"{plane.y.label} in [{plane.y.low:g}, {plane.y.high:g}]",
        f"  bounds    {bounds}",
        f"  reached   {area_text(chart.stable_area, chart.area_error, plane)}",
        f"  open loop {area_text(chart.open_loop.stable_area, chart.open_loop.area_error, plane)}",
    ]
    if chart.area_ratio is not None and chart.area_ratio_error is not None:
        lines.append(f"  ratio     {chart.area_ratio:.4g} ± {chart.area_ratio_error:.1g}")
    if chart.undecided_area > 0.0:
        lines.append(
            f"  undecided {chart.undecided_area:.4g} at the lowest rotary speeds, where the delay "
            "exceeds 2.1"
        )
    lines.append(
        f"  sampled   {len(chart.lines)} lines, {chart.samples} places each before refinement; "
        "smaller islands may be missed"
    )
    return "\n".join(lines)
