"""Figures of a campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.figure import BLUE, GREEN, GREY, ORANGE, axis_name, new_figure
from drillctrl.tables.figure import axis_label
from drillctrl.tables.grid import Grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_MARKS = {
    "settled": ("o", BLUE),
    "orbit": ("x", ORANGE),
    "unsettled": ("+", ORANGE),
    "stalled": ("s", GREY),
    "reverse rotation": ("v", GREY),
    "undecided": (".", GREEN),
    "broken": ("*", "black"),
}


def plot_campaign(
    grid: Grid,
    sizes: Sequence[float],
    outcomes: npt.NDArray[np.str_],
    spectral_abscissa: FloatArray,
    basin: FloatArray,
    disturbance: Mapping[str, float],
) -> Figure:
    """Draw the outcome of each size and the edge of the basin over the two longest axes.

    Of a third axis the middle value is shown. The line is α = 0 of the linear loop. Parameters
    are the attributes of a `Campaign`.
    """
    across = 2 - int(np.argmin(grid.shape[::-1]))
    right, up = (axis for axis in range(3) if axis != across)
    middle = grid.shape[across] // 2
    chosen = np.take(np.arange(len(grid.points)).reshape(grid.shape), middle, axis=across)
    x, y = (
        np.array(grid.axes[axis].values) * grid.axes[axis].field_unit[1] for axis in (right, up)
    )
    at_x, at_y = (values.ravel() for values in np.meshgrid(x, y, indexing="ij"))
    flat = chosen.ravel()
    measured = bool((np.nan_to_num(basin[flat, 0]) > 0.0).any())
    count = len(sizes) + measured
    figure = new_figure(4.3 * count, 4.3)
    from matplotlib.colors import LogNorm

    axes = figure.subplots(1, count, squeeze=False, sharex=True, sharey=True)[0]
    alpha = spectral_abscissa[chosen]
    for k, size in enumerate(sizes):
        for name, (marker, colour) in _MARKS.items():
            there = outcomes[flat, k] == name
            if there.any():
                axes[k].plot(
                    at_x[there], at_y[there], marker, color=colour, linestyle="none", label=name,
                    markersize=5,
                )  # fmt: skip
        axes[k].set_title(f"size {size:g}", fontsize="medium")
        axes[k].legend(
            loc="upper center",
            bbox_to_anchor=(0.5, -0.16),
            ncols=3,
            fontsize="small",
            frameon=False,
        )
    if measured:
        low = basin[chosen, 0]
        shown = np.ma.masked_invalid(np.where(low > 0.0, low, np.nan))
        norm = LogNorm(min(float(shown.min()), 0.1 * float(shown.max())), float(shown.max()))
        picture = axes[-1].pcolormesh(x, y, shown.T, shading="nearest", cmap="viridis", norm=norm)
        figure.colorbar(
            picture,
            ax=axes[-1],
            label=axis_name("largest size that settles", "multiples of the disturbance"),
        )
        axes[-1].set_title("basin", fontsize="medium")
    for ax in axes:
        if min(alpha.shape) > 1 and alpha.min() < 0.0 < alpha.max():
            ax.contour(x, y, alpha.T, levels=[0.0], colors="black", linewidths=1.0)
        ax.set_xlabel(axis_label(grid.axes[right]))
        ax.set_ylabel(axis_label(grid.axes[up]))
    kick = ", ".join(f"{name} = {value:g}" for name, value in disturbance.items())
    figure.suptitle(f"After {kick} times the size; the line is α = 0", fontsize="medium")
    return figure
