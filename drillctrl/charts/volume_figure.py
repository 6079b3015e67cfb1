"""Figures of a stability volume."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.figure import new_axes, new_figure
from drillctrl.charts.figure import axis_text, draw_curves, label_axes

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy.typing as npt
    from matplotlib.axes import Axes

    from drillctrl.base.arrays import FloatArray
    from drillctrl.charts.axes import Axis
    from drillctrl.charts.chains import Curve
    from drillctrl.charts.plane import Plane


def plot_volume(
    corners: FloatArray,
    quads: npt.NDArray[np.int64],
    plane: Plane,
    z: Axis,
    title: str = "",
    ax: Any | None = None,
) -> Any:
    """Draw the boundary surface in three dimensions, shaded by y.

    Parameters
    ----------
    corners, quads : array, (v, 3) and (f, 4)
        The surface; see `StabilityVolume.surface`.
    plane, z : Plane and Axis
        The three parameters.
    title : str
        Above the figure.
    ax : Axes3D, optional
        With ``projection="3d"``; by default new ones.
    """
    if ax is None:
        ax = new_figure(6.8, 5.2).add_subplot(projection="3d")
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    # x and z span the floor, y is the height: the stable depth of cut in Fig. 5.
    faces = corners[quads][:, :, [0, 2, 1]]
    height = faces[:, :, 2].mean(axis=1)
    drawn = Poly3DCollection(list(faces), cmap="cividis", linewidths=0.0)
    drawn.set_array(height)
    ax.add_collection3d(drawn)
    ax.set_xlim(plane.x.low, plane.x.high)
    ax.set_ylim(z.low, z.high)
    ax.set_zlim(plane.y.low, plane.y.high)
    ax.set_xlabel(axis_text(plane.x))
    ax.set_ylabel(axis_text(z))
    ax.set_zlabel(axis_text(plane.y))
    ax.figure.colorbar(drawn, ax=ax, shrink=0.7, pad=0.12, label=axis_text(plane.y))
    ax.set_title(title, fontsize="medium")
    return ax


def plot_slices(
    slices: Mapping[float, Sequence[Curve]], plane: Plane, z: Axis, ax: Axes | None = None
) -> Axes:
    """Draw the boundaries of slices over each other (Figs. 6, 7).

    Parameters
    ----------
    slices : mapping of float to sequence of Curve
        The boundary at each value of the third parameter.
    plane, z : Plane and Axis
        The three parameters.
    ax : Axes, optional
        By default new ones.
    """
    import matplotlib as mpl

    ax = new_axes() if ax is None else ax
    colours = mpl.colormaps["cividis"](np.linspace(0.0, 0.9, len(slices)))
    for colour, (at, curves) in zip(colours, slices.items(), strict=True):
        draw_curves(ax, curves, mpl.colors.to_hex(colour), f"{z.label} = {at:.4g}")
    label_axes(ax, plane)
    ax.legend(loc="best", fontsize="small", title="stable inside")
    return ax
