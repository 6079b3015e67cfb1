"""Figures of a table: gains and α over its grid."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.figure import axis_name, new_figure
from drillctrl.base.language import SI, Language
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.tables.grid import Axis, Grid
from drillctrl.tables.interpolation import CONSTANT, UNSAFE, BoolArray, Cells, cell_shape

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# A title, and what draws below it.
Panel = tuple[str, Callable[["Axes"], None]]

_MOST_LAYERS = 8
_NAMES = {
    "omega0": "rotary speed ω0",
    "delta0": "depth of cut δ0",
    "psi": "cutting coefficient ψ",
}


def axis_label(axis: Axis, language: Language = SI) -> str:
    """Return name and unit of an axis for a figure."""
    unit, _ = axis.told(language)
    name = _NAMES.get(axis.name, axis.name.replace("_", " "))
    return axis_name(name, unit)


class Drawn(NamedTuple):
    """What is drawn of a table.

    Attributes
    ----------
    grid, structure : Grid, FeedbackStructure
        Operating points, and what is fed back.
    entries : array, (q, 2 m p)
        All entries of K1, then K2, at each node.
    spectral_abscissa, stable : array, (q,)
        α at each node, and whether it is vouched for: stable, and not refused.
    cells : Cells
        What is known between the nodes.
    constant : array, (c, 2 m p)
        The entries in the cells whose gains are constant.
    units : tuple of str
        Of the entries; none without a rig.
    language : Language
        Of the axes.
    """

    grid: Grid
    structure: FeedbackStructure
    entries: FloatArray
    spectral_abscissa: FloatArray
    stable: BoolArray
    cells: Cells
    constant: FloatArray
    units: tuple[str, ...] = ()
    language: Language = SI

    @property
    def growth(self) -> tuple[str, str, str]:
        """Title, label and unit of the growth rates."""
        return ("growth", "growth rate", "1/s") if self.units else ("α", "α", "")

    def gain(self, column: int) -> str:
        """Label of an entry."""
        return axis_name("gain", self.units[column] if self.units else "")


def plot_table(table: Drawn) -> Figure:
    """Draw each free gain and α over the grid.

    Over one axis as lines, over two as maps; over three the gains are those at the middle of
    the shortest axis, and α is drawn at each of its values, or at eight of them. Nodes that
    nothing stabilises are crosses; cells that did not pass are hatched, those with constant
    gains dotted.

    Raises
    ------
    InputError
        If the grid has more axes.
    """
    if len(table.grid.axes) > 3:
        raise InputError("plot", f"{len(table.grid.axes)} axes", "at most three")
    panels = _panels(table)
    columns = min(3, len(panels))
    rows = math.ceil(len(panels) / columns)
    figure = new_figure(max(4.0 * columns, 6.5), 3.3 * rows + 0.4)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    held = [
        axis.text(*axis.values, language=table.language)
        for axis in table.grid.axes
        if len(axis.values) == 1
    ]
    for ax, (title, draw) in zip(axes, panels, strict=False):
        draw(ax)
        ax.set_title(title)
    for ax in axes[len(panels) :]:
        ax.set_axis_off()
    cells = "did not pass" if table.units else "not vouched for"
    marks = f"× not stable or refused, //// {cells}, · constant gains"
    figure.suptitle(f"{table.structure.name}, {', '.join([*held, marks])}", fontsize="medium")
    return figure


def _panels(table: Drawn) -> list[Panel]:
    free = table.structure.spread.any(axis=1)
    names = np.array(table.structure.entry_names)[free].tolist()
    fields = dict(zip(names, table.entries.T[free], strict=True))
    title, *_ = table.growth
    labels = [table.gain(k) for k in np.flatnonzero(free).tolist()]
    grid = table.grid
    if len(grid.points) == 1:
        fields[title] = table.spectral_abscissa
        return [("one node", functools.partial(_values, fields))]
    if sorted(grid.shape)[1] == 1:
        along = int(np.argmax(grid.shape))
        lines: list[Panel] = [
            (name, functools.partial(_line, table, along, column))
            for name, column in zip(names, np.flatnonzero(free).tolist(), strict=True)
        ]
        return [*lines, (title, functools.partial(_line, table, along, None))]
    # Of equally short axes the last.
    across = 2 - int(np.argmin(grid.shape[::-1]))
    depth, third = grid.shape[across], grid.axes[across]
    maps: list[Panel] = [
        (
            name
            if depth == 1
            else f"{name} at {third.text(third.values[depth // 2], language=table.language)}",
            functools.partial(_map, table, across, depth // 2, values, "viridis", label),
        )
        for (name, values), label in zip(fields.items(), labels, strict=True)
    ]
    shown = np.unique(np.linspace(0, depth - 1, min(depth, _MOST_LAYERS)).round().astype(int))
    for layer in shown.tolist():
        at = third.text(third.values[layer], language=table.language)
        alpha, label = table.spectral_abscissa, axis_name(*table.growth[1:])
        draw = functools.partial(_map, table, across, layer, alpha, "RdBu_r", label)
        maps.append((title if depth == 1 else f"{title} at {at}", draw))
    return maps


def _values(fields: dict[str, FloatArray], ax: Axes) -> None:
    text = "\n".join(f"{name} = {values[0]:.6g}" for name, values in fields.items())
    ax.text(0.5, 0.5, text, ha="center", va="center", fontsize="large", transform=ax.transAxes)
    ax.set_axis_off()


def _line(table: Drawn, along: int, column: int | None, ax: Axes) -> None:
    """Draw an entry of (K1, K2), or α for None, over the one axis that there is."""
    axis = table.grid.axes[along]
    x = np.array(axis.values) * axis.told(table.language)[1]
    values = table.spectral_abscissa if column is None else table.entries[:, column]
    constant = table.cells.mode == CONSTANT
    if column is None:
        ax.plot(x, values, marker=".")
        ax.axhline(0.0, color="black", linewidth=0.8)
        worst = table.cells.spectral_abscissa
        ax.hlines(worst, x[:-1], x[1:], color="C1", label="worst found between")
        ax.legend(fontsize="small")
    else:
        ax.plot(x, values, marker=".", linestyle="")
        steady = table.constant[:, column]
        for i in range(x.size - 1):
            ends = [steady[i]] * 2 if constant[i] else values[i : i + 2]
            ax.plot(x[i : i + 2], ends, color="C0")
    for kind, hatch in ((UNSAFE, "////"), (CONSTANT, "..")):
        for i in np.flatnonzero(table.cells.mode == kind).tolist():
            ax.axvspan(x[i], x[i + 1], fill=False, hatch=hatch, linewidth=0.0, alpha=0.4)
    ax.scatter(x[~table.stable], values[~table.stable], marker="x", c="black", zorder=3)
    ax.set_xlabel(axis_label(axis, table.language))
    ax.set_ylabel(axis_name(*table.growth[1:]) if column is None else table.gain(column))


def _map(
    table: Drawn,
    across: int,
    layer: int,
    values: FloatArray,
    colours: str,
    label: str,
    ax: Axes,
) -> None:
    """Draw values over two axes at one value of the third."""
    from matplotlib.patches import Rectangle

    grid = table.grid
    down, up = (axis for axis in range(3) if axis != across)

    def cut(given: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return np.asarray(np.take(given.reshape(grid.shape), layer, axis=across))

    x, y = (
        np.array(axis.values) * axis.told(table.language)[1]
        for axis in (grid.axes[down], grid.axes[up])
    )
    # Colours for α are white at 0.
    reach = float(np.abs(values).max()) if colours == "RdBu_r" else None
    low = None if reach is None else -reach
    picture = ax.pcolormesh(
        x, y, cut(values).T, shading="nearest", cmap=colours, vmin=low, vmax=reach
    )
    ax.figure.colorbar(picture, ax=ax, label=label)
    stable = cut(table.stable)
    at_x, at_y = np.meshgrid(x, y, indexing="ij")
    ax.scatter(at_x[~stable], at_y[~stable], marker="x", c="black", s=18, linewidths=0.9)
    # The cells on both sides of the layer; of two marks the graver one.
    sides = cell_shape(grid)
    beside = sorted({min(max(side, 0), sides[across] - 1) for side in (layer - 1, layer)})
    mode = np.take(table.cells.mode.reshape(sides), beside, axis=across).max(axis=across)
    for kind, hatch in ((UNSAFE, "////"), (CONSTANT, "..")):
        for i, j in np.argwhere(mode == kind).tolist():
            size = x[i + 1] - x[i], y[j + 1] - y[j]
            ax.add_patch(Rectangle((x[i], y[j]), *size, fill=False, hatch=hatch, linewidth=0.0))
    ax.set_xlabel(axis_label(grid.axes[down], table.language))
    ax.set_ylabel(axis_label(grid.axes[up], table.language))
