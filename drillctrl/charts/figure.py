"""Figures of charts. Every function takes matplotlib Axes, or makes them, and returns them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from drillctrl.base.figure import BLUE, GREY, PALETTE, axis_name, headline, new_axes
from drillctrl.base.kinds import checks_kinds
from drillctrl.charts.axes import RIG_AXES, Axis
from drillctrl.charts.chains import Curve, stable_strips
from drillctrl.charts.plane_text import held_text, told_axis
from drillctrl.drilling.gain_units import control_text
from drillctrl.drilling.quantities import root_scales, told_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import XAxis, YAxis

    from drillctrl.base.arrays import FloatArray
    from drillctrl.charts.plane import Plane
    from drillctrl.charts.regions import Region
    from drillctrl.charts.scan import ScanLine

    Scale = Callable[[Any], Any]

STYLES = ("-", "--", "-.", ":")


def label_axes(ax: Axes, plane: Plane) -> None:
    """Set limits and labels, with rpm and m/h on twin axes where a rig is known."""
    ax.set_xlim(plane.x.low, plane.x.high)
    ax.set_ylim(plane.y.low, plane.y.high)
    ax.set_xlabel(axis_text(plane.x))
    ax.set_ylabel(axis_text(plane.y))
    for axis, side in ((plane.x, ax.xaxis), (plane.y, ax.yaxis)):
        factor, unit = told_axis(plane, axis)
        if unit != axis.unit:
            side.set_label_text(axis_text(replace(axis, unit=unit)))
            _tell_in(side, factor)
    if (told := plane.case.told_point) is None:
        return
    rig, language = told.rig, told.language
    rpm, turns = told_scale("angular_rate", rig, language)
    # v0 = δ0 ω0: at one speed, δ0 is proportional to the rate of penetration.
    advance, rate = told_scale("axial_rate", rig, language)
    speed = language.text("angular_rate", told.rotary_speed, 3)
    twins = {
        "omega0": (rpm, axis_name("rotary speed", turns)),
        "delta0": (
            advance * told.rotary_speed * rig.time_scale,
            axis_name(f"rate of penetration at {speed}", rate),
        ),
    }
    if plane.x.name in twins:
        factor, text = twins[plane.x.name]
        ax.secondary_xaxis("top", functions=_scaling(factor)).set_xlabel(text)
    if plane.y.name in twins:
        factor, text = twins[plane.y.name]
        ax.secondary_yaxis("right", functions=_scaling(factor)).set_ylabel(text)


def _tell_in(side: XAxis | YAxis, factor: float) -> None:
    """Number an axis by ``factor`` times what is drawn, at round numbers."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    class Scaled(MaxNLocator):
        def tick_values(self, vmin: float, vmax: float) -> list[float]:
            return [value / factor for value in super().tick_values(vmin * factor, vmax * factor)]

    side.set_major_locator(Scaled(nbins="auto", steps=[1, 2, 2.5, 5, 10]))
    side.set_major_formatter(FuncFormatter(lambda value, _: f"{value * factor:.6g}"))


def _scaling(factor: float) -> tuple[Scale, Scale]:
    return (lambda value: np.asarray(value) * factor, lambda value: np.asarray(value) / factor)


def axis_text(axis: Axis) -> str:
    """Return the label of an axis: in words, with its symbol, and its unit."""
    words = {
        "omega0": "rotary speed $\\omega_0$",
        "delta0": "nominal depth of cut $\\delta_0$",
        "psi": "cutting coefficient $\\psi$",
        "eta": "frequency ratio $\\eta$",
        "xi": "axial damping ratio $\\xi$",
        "kappa": "torsional damping ratio $\\kappa$",
        "damping": "damping ratios $\\xi = \\kappa$",
    }
    if axis.name[:1] == "K" and axis.name[1:2].isdigit():
        head, *indices = axis.name.split("_")
        delayed = " on the delayed output" if head == "K2" else ""
        name = f"gain ${head[0]}_{{{','.join([head[1:], *indices])}}}${delayed}"
        return axis_name(name, axis.unit)
    if axis.name in RIG_AXES:
        return axis_name(RIG_AXES[axis.name][2], axis.unit)
    return axis_name(words.get(axis.name, axis.label), axis.unit)


def plane_title(plane: Plane, name: str | None = None) -> str:
    """Say what closes the loop, and what is the same all over the chart.

    Parameters
    ----------
    plane : Plane
        The two parameters, and the rest.
    name : str, optional
        Of the rig.
    """
    held = ", ".join(text for text in (name, held_text(plane)) if text)
    structure, plant = plane.structure, plane.case.plant
    if structure is None:
        # A string may be turned by a drive under a law.
        head = plane.name or "without control"
    elif plant is None or _has_gain_axis(plane):
        head = structure.name
    else:
        head = control_text(
            structure, plane.K1, plane.K2, plant, plane.case.told_rig, plane.case.language
        )
    return f"{head}; {held}" if held else head


def _has_gain_axis(plane: Plane) -> bool:
    names = () if plane.structure is None else plane.structure.gain_names
    return plane.x.name in names or plane.y.name in names


def draw_strips(
    ax: Axes, polygons: list[FloatArray], colour: str, label: str, alpha: float = 0.25
) -> None:
    """Shade a set of polygons as one."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if not polygons:
        return
    # One compound path, so that neighbours that share an edge are not painted twice there.
    path = Path.make_compound_path(
        *(Path(_anticlockwise(p), closed=True) for p in closed(polygons))
    )
    ax.add_patch(PathPatch(path, facecolor=colour, edgecolor="none", alpha=alpha, label=label))


def closed(polygons: list[FloatArray]) -> list[FloatArray]:
    """Return polygons with their first corner repeated at the end."""
    return [np.vstack([polygon, polygon[:1]]) for polygon in polygons]


def _anticlockwise(polygon: FloatArray) -> FloatArray:
    x, y = polygon.T
    twice = float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum())
    return polygon if twice >= 0.0 else polygon[::-1]


def draw_curves(
    ax: Axes, curves: Sequence[Curve], colour: str, label: str, style: str = "-"
) -> None:
    """Draw boundary curves under one legend entry."""
    for curve in curves:
        points = np.vstack([curve.points, curve.points[:1]]) if curve.closed else curve.points
        ax.plot(
            points[:, 0], points[:, 1], style, color=colour, linewidth=1.4, label=label, zorder=3
        )
        label = "_nolegend_"


class Charted(Protocol):
    """What charts have in common that are drawn over each other."""

    @property
    def plane(self) -> Plane:
        """The two parameters."""

    @property
    def lines(self) -> Sequence[ScanLine]:
        """Scanned lines, from which the shading is made."""

    @property
    def rows(self) -> bool:
        """Whether lines are held at y."""

    @property
    def curves(self) -> Sequence[Curve]:
        """The boundary."""

    @property
    def stable_area(self) -> float:
        """For the legend."""


def plot_chart(
    plane: Plane,
    lines: Sequence[ScanLine],
    curves: Sequence[Curve],
    regions: Sequence[Region],
    *,
    rows: bool,
    level: float = 0.0,
    name: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw one chart: the stable set shaded, the boundary by the frequency that rules it.

    Parameters
    ----------
    plane : Plane
        The two parameters.
    lines : sequence of ScanLine
        Scanned lines, from which the shading is made.
    curves : sequence of Curve
        The boundary.
    regions : sequence of Region
        Parts whose numbers of roots are written into them.
    rows : bool
        Whether lines are held at y.
    level : float
        σ of the chart.
    name : str, optional
        Of the rig, for the title.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes() if ax is None else ax
    from matplotlib.collections import LineCollection

    _shade_rest(ax, plane, level)
    word = "stable" if level == 0.0 else f"all roots left of {level:g}"
    draw_strips(ax, stable_strips(lines, rows=rows), BLUE, word)
    pieces, speeds = [], []
    for curve in curves:
        steps = np.stack([curve.points[:-1], curve.points[1:]], axis=1)
        pieces.append(steps)
        speeds.append(np.maximum(curve.omega[:-1], curve.omega[1:]))
    if pieces:
        drawn = LineCollection(
            list(np.concatenate(pieces)), cmap="cividis", linewidths=2.2, zorder=3
        )
        rig = plane.case.told_rig
        scale = 1.0 if rig is None else root_scales(rig)[1][0]
        drawn.set_array(scale * np.concatenate(speeds))
        ax.add_collection(drawn, autolim=False)
        twin = plane.case.told_rig is not None and plane.y.name == "delta0"
        bar = ax.figure.colorbar(drawn, ax=ax, pad=0.12 if twin else 0.02)
        told = "frequency that sets in there"
        bar.set_label(axis_name(told, "Hz") if rig else axis_name(f"{told}, |Im s|"))
    _label_regions(ax, plane, regions)
    label_axes(ax, plane)
    ax.set_title(headline(plane_title(plane, name)), fontsize="medium")
    counted = "unstable roots" if level == 0.0 else "roots farther right"
    ax.legend(loc="best", fontsize="small", title=f"numbers: {counted}", title_fontsize="small")
    return ax


def _shade_rest(ax: Axes, plane: Plane, level: float) -> None:
    """Tint the whole of the axes, so that what is not stable is seen to have been computed."""
    from matplotlib.patches import Rectangle

    corner, size = (plane.x.low, plane.y.low), (plane.x.span, plane.y.span)
    word = "unstable" if level == 0.0 else "not so"
    ax.add_patch(Rectangle(corner, *size, facecolor="#F3EDE6", lw=0, zorder=0, label=word))


def _label_regions(ax: Axes, plane: Plane, regions: Sequence[Region]) -> None:
    """Write the number of unstable roots into the larger regions."""
    whole = plane.x.span * plane.y.span
    for region in regions:
        if region.unstable_roots and region.area > 0.02 * whole:
            ax.annotate(
                str(region.unstable_roots),
                (region.x, region.y),
                ha="center",
                va="center",
                fontsize="small",
                color=GREY,
            )


@checks_kinds
def plot_charts(charts: Mapping[str, Charted], ax: Axes | None = None) -> Axes:
    """Compare charts over the same axes: structures, rocks, dampings or decay rates.

    Parameters
    ----------
    charts : mapping of str to StabilityChart or StabilisableChart, or the like
        By the label in the legend; all over the same two parameters.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes() if ax is None else ax
    for rank, (label, chart) in enumerate(charts.items()):
        colour, style = PALETTE[rank % len(PALETTE)], STYLES[rank % len(STYLES)]
        strips = stable_strips(chart.lines, rows=chart.rows)
        draw_strips(ax, strips, colour, "_nolegend_", alpha=0.10)
        draw_curves(ax, chart.curves, colour, f"{label} (area {chart.stable_area:.5g})", style)
    if charts:
        label_axes(ax, next(iter(charts.values())).plane)
    # Above the axes: shaded sets leave no free corner. A twin axis needs its room first.
    twin = any(
        chart.plane.case.told_rig is not None and chart.plane.x.name == "omega0"
        for chart in charts.values()
    )
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.15 if twin else 1.01),
        fontsize="small",
        title="stable inside the shading",
        title_fontsize="small",
        frameon=False,
    )
    return ax
