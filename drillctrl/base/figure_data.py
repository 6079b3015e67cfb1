"""What a figure shows as a table: each line, point and coloured square with its place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.tableio import csv_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HEADER = ("panel", "series", "horizontal", "vertical", "x", "y", "value")


def figure_table(drawn: Figure | Axes) -> str:
    """Return the data of a figure as CSV.

    Parameters
    ----------
    drawn : Figure or Axes
        Flat: lines, points, coloured lines and squares are told; shading is not.

    Returns
    -------
    str
        A row for each place: number of the panel from 1, legend, labels of both axes, x, y, and
        the value that a colour shows, if it does.

    Raises
    ------
    InputError
        If the figure is of three dimensions.
    """
    figure = drawn.get_figure(root=True)
    assert figure is not None
    panels = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
    rows: list[list[Any]] = []
    for number, ax in enumerate(panels, start=1):
        if hasattr(ax, "get_zlabel"):
            raise InputError("plot", ".csv", "a picture, for a figure of three dimensions")
        labels = [_label(ax, axis) for axis in "xy"]
        for series, places in _series(ax):
            rows += [[number, series, *labels, *place] for place in places]
    return csv_text(_HEADER, rows)


def _label(ax: Axes, axis: str) -> str:
    together = getattr(ax, f"get_shared_{axis}_axes")().get_siblings(ax)
    texts = (getattr(other, f"get_{axis}label")() for other in (ax, *together))
    return next((text for text in texts if text), "")


def _series(ax: Axes) -> Iterator[tuple[str, list[list[Any]]]]:
    from matplotlib.collections import LineCollection, PathCollection, QuadMesh

    for line in ax.lines:
        pairs = zip(*(np.asarray(data, dtype=float) for data in line.get_data()), strict=True)
        yield _name(line), [[float(x), float(y), None] for x, y in pairs]
    for found in ax.collections:
        values = found.get_array()
        if isinstance(found, QuadMesh):
            corners = np.asarray(found.get_coordinates())
            middles = 0.25 * (
                corners[1:, 1:] + corners[:-1, 1:] + corners[1:, :-1] + corners[:-1, :-1]
            )
            yield _name(found), _with_values(middles.reshape(-1, 2), values)
        elif isinstance(found, PathCollection):
            yield _name(found), _with_values(np.asarray(found.get_offsets()), values)
        elif isinstance(found, LineCollection) and values is not None:
            ends = np.array([segment[0] for segment in found.get_segments()])
            yield _name(found), _with_values(ends, values)


def _with_values(places: Any, values: Any) -> list[list[Any]]:
    told: list[Any] = [None] * len(places)
    if values is not None and np.size(values) == len(places):
        told = np.ma.filled(np.ma.asarray(values, dtype=float), np.nan).ravel().tolist()
    return [
        [float(x), float(y), value if value is None or np.isfinite(value) else None]
        for (x, y), value in zip(places, told, strict=True)
    ]


def _name(artist: Any) -> str:
    label = str(artist.get_label())
    return "" if label.startswith("_") else label
