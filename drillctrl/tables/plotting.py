"""Figures of a table: gains and α over its grid."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.tables.grid import Axis
from drillctrl.tables.interpolation import CONSTANT, UNSAFE, cell_shape
from drillctrl.tables.table import GainTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NAMES = {
    "omega0": "rotary speed ω0",
    "delta0": "depth of cut δ0",
    "psi": "cutting coefficient ψ",
}


def axis_label(axis: Axis) -> str:
    """Return name and unit of an axis for a figure."""
    unit, _ = axis.field_unit
    name = _NAMES.get(axis.name, axis.name.replace("_", " "))
    return f"{name} ({unit})" if unit else name


def plot_table(table: GainTable) -> Figure:
    """Draw each gain and α over the two longest axes, at the middle of the third.

    Nodes that nothing stabilises are crosses; cells that did not pass are hatched, those with
    constant gains dotted.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    grid = table.grid
    # Of equally short axes the last.
    across = 2 - int(np.argmin(grid.shape[::-1]))
    down, up = (axis for axis in range(3) if axis != across)
    middle = grid.shape[across] // 2

    def layer(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return np.asarray(np.take(values.reshape(grid.shape), middle, axis=across))

    fields = dict(zip(table.structure.entry_names, table.entries.T, strict=True))
    fields = {k: v for k, v in fields.items() if np.ptp(v) > 0.0}
    fields["α"] = table.spectral_abscissa
    columns = min(3, len(fields))
    rows = math.ceil(len(fields) / columns)
    figure = Figure(figsize=(4.0 * columns, 3.3 * rows + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    x, y = (np.array(axis.values) * axis.field_unit[1] for axis in (grid.axes[down], grid.axes[up]))
    stable = layer(table.stable)
    at_x, at_y = np.meshgrid(x, y, indexing="ij")
    slot = min(middle, cell_shape(grid)[across] - 1)
    mode = np.take(table.cells.mode.reshape(cell_shape(grid)), slot, axis=across)
    for ax, (name, values) in zip(axes, fields.items(), strict=False):
        shown = layer(values)
        if name == "α":
            reach = float(np.abs(shown).max())
            picture = ax.pcolormesh(
                x, y, shown.T, shading="nearest", cmap="RdBu_r", vmin=-reach, vmax=reach
            )
        else:
            picture = ax.pcolormesh(x, y, shown.T, shading="nearest", cmap="viridis")
        figure.colorbar(picture, ax=ax)
        ax.scatter(at_x[~stable], at_y[~stable], marker="x", c="black", s=18, linewidths=0.9)
        for kind, hatch in ((UNSAFE, "////"), (CONSTANT, "..")):
            for i, j in np.argwhere(mode == kind).tolist():
                if i + 1 < len(x) and j + 1 < len(y):
                    size = x[i + 1] - x[i], y[j + 1] - y[j]
                    ax.add_patch(
                        Rectangle((x[i], y[j]), *size, fill=False, hatch=hatch, linewidth=0.0)
                    )
        ax.set_title(name)
        ax.set_xlabel(axis_label(grid.axes[down]))
        ax.set_ylabel(axis_label(grid.axes[up]))
    for ax in axes[len(fields) :]:
        ax.set_axis_off()
    third = grid.axes[across]
    held = third.values[middle] * third.field_unit[1]
    note = "× not stable, //// not vouched for, · constant gains"
    figure.suptitle(
        f"{table.structure.name} at {axis_label(third)} = {held:.4g};  {note}",
        fontsize="medium",
    )
    return figure
