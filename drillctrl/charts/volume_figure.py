"""Figures of a stability volume."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.figure import new_axes
from drillctrl.charts.chains import stable_curves
from drillctrl.charts.figure import axis_text, draw_curves, label_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.charts.volume import StabilityVolume


def plot_volume(volume: StabilityVolume, ax: Any | None = None) -> Any:
    """Draw the boundary surface in three dimensions, shaded by y.

    Parameters
    ----------
    volume : StabilityVolume
        Of `stability_volume`.
    ax : Axes3D, optional
        With ``projection="3d"``; by default new ones.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    if ax is None:
        own = Figure(figsize=(6.8, 5.2), layout="constrained")
        FigureCanvasAgg(own)
        ax = own.add_subplot(projection="3d")
    corners, quads = volume.surface()
    plane = volume.planes[0]
    # x and z span the floor, y is the height: the stable depth of cut in Fig. 5.
    faces = corners[quads][:, :, [0, 2, 1]]
    height = faces[:, :, 2].mean(axis=1)
    drawn = Poly3DCollection(list(faces), cmap="cividis", linewidths=0.0)
    drawn.set_array(height)
    ax.add_collection3d(drawn)
    ax.set_xlim(plane.x.low, plane.x.high)
    ax.set_ylim(volume.z.low, volume.z.high)
    ax.set_zlim(plane.y.low, plane.y.high)
    ax.set_xlabel(axis_text(plane.x))
    ax.set_ylabel(axis_text(volume.z))
    ax.set_zlabel(axis_text(plane.y))
    figure = ax.get_figure(root=True)
    figure.colorbar(drawn, ax=ax, shrink=0.7, pad=0.12, label=axis_text(plane.y))
    ax.set_title(
        f"Boundary of the stable set, volume {volume.volume:.4g} ± {volume.volume_error:.1g}",
        fontsize="medium",
    )
    return ax


def plot_slices(volume: StabilityVolume, count: int = 6, ax: Axes | None = None) -> Axes:
    """Draw the boundaries of some slices over each other (Figs. 6, 7).

    Parameters
    ----------
    volume : StabilityVolume
        Of `stability_volume`.
    count : int
        How many, evenly chosen; the first, which may be empty, left out.
    ax : Axes, optional
        By default new ones.
    """
    import matplotlib as mpl

    ax = new_axes() if ax is None else ax
    chosen = np.unique(np.linspace(0, len(volume.positions) - 1, count + 1).astype(int)[1:])
    colours = mpl.colormaps["cividis"](np.linspace(0.0, 0.9, chosen.size))
    for colour, k in zip(colours, chosen, strict=True):
        label = f"{volume.z.label} = {volume.positions[k]:.4g}"
        curves = tuple(stable_curves(volume.lines[k], rows=volume.rows))
        draw_curves(ax, curves, mpl.colors.to_hex(colour), label)
    label_axes(ax, volume.planes[0])
    ax.legend(loc="best", fontsize="small", title="stable inside")
    return ax
