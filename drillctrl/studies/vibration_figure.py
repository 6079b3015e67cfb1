"""Figures of a vibration map. They take arrays and know no results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.figure import BLUE, GREY, ORANGE, axis_name, headline, new_figure
from drillctrl.charts.figure import axis_text
from drillctrl.charts.plane import Plane
from drillctrl.simulation.status import OUTCOME_NAMED, Outcome
from drillctrl.studies.lattice import Cell, Node, fill
from drillctrl.studies.vibration_threshold import TORSION, TorsionalField, draw_threshold

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Outcome → what an engineer calls it and its colour, from the mildest to the worst.
OUTCOMES = {
    Outcome.SETTLES: ("smooth drilling", "#E8F1F8"),
    Outcome.ORBIT: ("swings without stick", "#9CCBEA"),
    Outcome.CHAOTIC: ("swings, never repeating", "#56A0D3"),
    Outcome.BOUNCES: ("bit bounces", "#F0E442"),
    Outcome.STICK_SLIP: ("stick-slip", "#E69F00"),
    Outcome.LATE: ("falls behind the feed", "#D55E00"),
    Outcome.UNDECIDED: ("undecided", "#DDDDDD"),
    Outcome.STALLS: ("bit stands still", "#CC79A7"),
    Outcome.TURNS_BACK: ("bit turns backwards", "#8C4A75"),
    Outcome.DIVERGES: ("grows without bound", "#444444"),
}
# Quantity → text of the colour bar, colours, and its range, which ends where values do; None
# for no other end. The swing of a bit that hardly turns may be any number.
_COLOURED: dict[str, tuple[str, str, float, float | None]] = {
    "swing": (axis_name("stick-slip index"), "YlOrRd", 0.0, 2.0),
    "stick_fraction": (axis_name("time in torsional stick", "%"), "YlOrRd", 0.0, None),
    "off_rock_fraction": (axis_name("time off the rock", "%"), "YlOrRd", 0.0, None),
    "feed": (axis_name("rate of penetration kept", "%"), "YlOrRd_r", 0.0, 100.0),
    "weight_ratio": (axis_name("mean over steady weight on bit"), "YlOrRd", 1.0, None),
}
_PERCENT = ("stick_fraction", "off_rock_fraction", "feed")
SHOWN = ("outcome", *_COLOURED)
_BROKEN = "#BBBBBB"


class Drawn(NamedTuple):
    """One column of a figure.

    Attributes
    ----------
    title : str
        What closes the loop.
    columns : mapping
        Quantity → entries at the nodes; ``spectral_abscissa``; and ``boundary``, curves or None.
    """

    title: str
    columns: Mapping[str, Any]


def check_shown(quantities: Sequence[str]) -> None:
    """Raise `InputError` unless they are some of `SHOWN`, each once."""
    for name in quantities:
        if name not in SHOWN or list(quantities).count(name) > 1:
            raise InputError("quantities", name, f"among {', '.join(SHOWN)}, each once")
    if not quantities:
        raise InputError("quantities", "none", f"among {', '.join(SHOWN)}")


def plot_map(
    plane: Plane,
    shape: tuple[int, int],
    nodes: Sequence[Node],
    cells: Sequence[Cell],
    drawn: Sequence[Drawn],
    quantities: Sequence[str],
    *,
    difference: bool = False,
    marked: tuple[float, float] | None,
    title: str,
    threshold: TorsionalField | None = None,
) -> Figure:
    """Draw quantities over two axes, one row each, with one column for each controller.

    Parameters
    ----------
    plane : Plane
        The two axes.
    shape, nodes, cells
        Of the lattice; see `VibrationMap`.
    drawn : sequence of Drawn
        Columns.
    quantities : sequence of str
        Some of `SHOWN`.
    difference : bool
        Whether a further column says what the last controller changes against the first.
    marked : (float, float) or None
        The operating point.
    title : str
        Above all.
    threshold : TorsionalField, optional
        Drawn as the line where torsion has no damping left.

    Raises
    ------
    InputError
        If there is no such quantity.
    """
    check_shown(quantities)
    columns = len(drawn) + int(difference)
    figure = new_figure(1.6 + 4.2 * columns + 1.2, 3.6 * len(quantities) + 0.8)
    grid = figure.subplots(len(quantities), columns, squeeze=False, sharex=True, sharey=True)
    beside, grid = grid[:, len(drawn) :], grid[:, : len(drawn)]
    x = np.linspace(plane.x.low, plane.x.high, shape[0])
    y = np.linspace(plane.y.low, plane.y.high, shape[1])

    def whole(values: Any) -> FloatArray:
        return fill(shape, cells, nodes, np.array(values, dtype=float))

    for row, name, changed in zip(grid, quantities, beside, strict=True):
        if name == "outcome":
            fields = [whole(_ranks(each)) for each in drawn]
            _outcomes(row, x, y, fields)
        else:
            factor = 100.0 if name in _PERCENT else 1.0
            fields = [factor * whole(each.columns[name]) for each in drawn]
            _coloured(row, x, y, fields, *_COLOURED[name])
        for ax in changed:
            _change(ax, x, y, fields[-1] - fields[0], name)
    edge = False
    for row in grid:
        for k, (ax, each) in enumerate(zip(row, drawn, strict=True)):
            if threshold is not None:
                draw_threshold(ax, threshold, threshold.growth[k])
            alpha = whole(each.columns["spectral_abscissa"])
            edge = _overlay(ax, x, y, alpha, each, marked) or edge
            ax.set_xlim(plane.x.low, plane.x.high)
            ax.set_ylim(plane.y.low, plane.y.high)
    for ax in (*grid[-1], *beside[-1]):
        ax.set_xlabel(axis_text(plane.x))
    for ax in grid[:, 0]:
        ax.set_ylabel(axis_text(plane.y))
    for ax, each in zip(grid[0], drawn, strict=True):
        ax.set_title(headline(each.title, 48), fontsize="medium")
    for ax in beside[0] if difference else ():
        ax.set_title("change from left to right", fontsize="medium")
    lines = {"edge": edge, "threshold": threshold is not None, "marked": marked is not None}
    _legend(figure, grid, "outcome" in quantities, **lines)
    figure.suptitle(title, fontsize="medium")
    return figure


def _ranks(drawn: Drawn) -> list[int]:
    order = list(OUTCOMES)
    return [order.index(OUTCOME_NAMED[word]) for word in drawn.columns["outcome"]]


def _outcomes(
    row: npt.NDArray[Any], x: FloatArray, y: FloatArray, fields: list[FloatArray]
) -> None:
    """Draw what becomes of the bit: a colour each."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    colours = ListedColormap([colour for _, colour in OUTCOMES.values()])
    norm = BoundaryNorm(np.arange(len(OUTCOMES) + 1) - 0.5, len(OUTCOMES))
    for ax, field in zip(row, fields, strict=True):
        ax.pcolormesh(x, y, field.T, shading="nearest", cmap=colours, norm=norm)


def _coloured(
    row: npt.NDArray[Any],
    x: FloatArray,
    y: FloatArray,
    fields: list[FloatArray],
    label: str,
    colours: str,
    low: float,
    high: float | None,
) -> None:
    """Draw a number on one scale in all columns, grey where it could not be measured."""
    known = np.concatenate([field[np.isfinite(field)] for field in fields])
    largest = float(known.max(initial=low))
    top = max(largest if high is None else min(largest, high), low + 1e-3)
    picture = None
    drawn = []
    for ax, field in zip(row, fields, strict=True):
        ax.set_facecolor(_BROKEN)
        picture = ax.pcolormesh(
            x, y, np.ma.masked_invalid(field.T), shading="nearest", cmap=colours, vmin=low, vmax=top
        )
        if low == 0.0:
            drawn += _contours(ax, x, y, field, top)
    bar = row[0].figure.colorbar(
        picture, ax=list(row), label=label, extend="max" if largest > top else "neither"
    )
    for contours in drawn:
        bar.add_lines(contours, erase=False)


def _change(ax: Axes, x: FloatArray, y: FloatArray, field: FloatArray, name: str) -> None:
    """Draw what control changes: blue is better, orange worse, white alike."""
    from matplotlib.colors import ListedColormap

    if name == "outcome":
        colours = ListedColormap([BLUE, "white", ORANGE])
        picture = ax.pcolormesh(
            x, y, np.sign(field).T, shading="nearest", cmap=colours, vmin=-1.5, vmax=1.5
        )
        bar = ax.figure.colorbar(picture, ax=ax, ticks=[-1, 0, 1])
        bar.ax.set_yticklabels(["better", "alike", "worse"])
        bar.set_label(axis_name("change of outcome"))
        return
    _, colours_of, _, _ = _COLOURED[name]
    label = axis_name(f"change of {name.replace('_', ' ')}", "%" if name in _PERCENT else "")
    reach = max(float(np.abs(field[np.isfinite(field)]).max(initial=0.0)), 1e-3)
    ax.set_facecolor(_BROKEN)
    picture = ax.pcolormesh(
        x, y, np.ma.masked_invalid(field.T), shading="nearest", vmin=-reach, vmax=reach,
        cmap="RdBu" if colours_of.endswith("_r") else "RdBu_r",
    )  # fmt: skip
    ax.figure.colorbar(picture, ax=ax, label=label)


def _contours(ax: Axes, x: FloatArray, y: FloatArray, field: FloatArray, top: float) -> list[Any]:
    """Draw and return thin lines at round values within the scale, if there are any."""
    from matplotlib.ticker import MaxNLocator

    known = field[np.isfinite(field)]
    levels = [v for v in MaxNLocator(4).tick_values(0.0, top) if 0.0 < v < top]
    levels = [v for v in levels if known.size and known.min() < v < known.max()]
    if not levels:
        return []
    masked = np.ma.masked_invalid(field.T)
    return [ax.contour(x, y, masked, levels=levels, colors=GREY, linewidths=0.7)]


def _overlay(
    ax: Axes,
    x: FloatArray,
    y: FloatArray,
    alpha: FloatArray,
    drawn: Drawn,
    marked: tuple[float, float] | None,
) -> bool:
    """Draw the edge of the linear theory, if there is one, and the operating point."""
    boundary = drawn.columns["boundary"]
    edge = bool(boundary) or bool((alpha < 0.0).any() and (alpha > 0.0).any())
    if boundary is not None:
        for curve in boundary:
            ax.plot(curve[:, 0], curve[:, 1], color="black", linewidth=1.3)
    elif edge:
        ax.contour(x, y, alpha.T, levels=[0.0], colors="black", linewidths=1.3)
    if marked is not None:
        ax.plot(*marked, "*", color="white", markeredgecolor="black", markersize=13, clip_on=False)
    return edge


def _legend(
    figure: Figure,
    grid: npt.NDArray[Any],
    outcomes: bool,
    *,
    edge: bool,
    threshold: bool,
    marked: bool,
) -> None:
    """Say below the pictures what colours and marks mean, as far as they occur."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    if outcomes:
        for k, (name, colour) in enumerate(OUTCOMES.values()):
            if any(_occurs(ax, k) for ax in grid.ravel()):
                handles.append(Patch(facecolor=colour, edgecolor="black", lw=0.4, label=name))
    if any(_is_grey(ax) for ax in grid.ravel()):
        handles.append(Patch(facecolor=_BROKEN, label="not measured: the run broke off"))
    if edge:
        handles.append(Line2D([], [], color="black", label="edge of linear stability"))
    if any(len(ax.collections) > 1 for ax in grid[int(outcomes) :].ravel()):
        handles.append(Line2D([], [], color=GREY, lw=0.7, label="lines as on the colour bar"))
    if threshold:
        label = "torsion loses its damping, on the motion drilled with"
        handles.append(Line2D([], [], color=TORSION, linestyle="dashed", label=label))
    if marked:
        handles.append(
            Line2D(
                [], [], color="white", marker="*", markeredgecolor="black", markersize=12,
                linestyle="none", label="operating point",
            )
        )  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize="small")


def _mesh(ax: Axes) -> Any:
    return ax.collections[0]


def _occurs(ax: Axes, rank: int) -> bool:
    """Whether an outcome is drawn."""
    from matplotlib.colors import BoundaryNorm

    mesh = _mesh(ax)
    return isinstance(mesh.norm, BoundaryNorm) and bool((mesh.get_array() == rank).any())


def _is_grey(ax: Axes) -> bool:
    """Whether something could not be measured."""
    return bool(np.ma.getmaskarray(_mesh(ax).get_array()).any())
