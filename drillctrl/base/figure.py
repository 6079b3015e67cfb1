"""Figures. Every function takes matplotlib Axes, or makes them, and returns them."""

from __future__ import annotations

import base64
import io
import textwrap
from pathlib import Path
from typing import IO, TYPE_CHECKING

from drillctrl.base.errors import InputError
from drillctrl.base.extras import required
from drillctrl.base.files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Okabe and Ito's palette, told apart by colour-blind readers too.
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#666666"
PALETTE = (BLUE, ORANGE, GREEN, GREY, "#CC79A7", "#56B4E9")
FIGURE_ENDINGS = (".pdf", ".png", ".svg")


def axis_name(quantity: str, unit: str = "") -> str:
    """Return the label of an axis or a colour bar: what is drawn, and in which unit."""
    return f"{quantity}, {unit or 'dimensionless'}"


def headline(text: str, columns: int = 64) -> str:
    """Return a title in lines that fit above the axes."""
    return "\n".join(textwrap.wrap(text, columns, break_on_hyphens=False))


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure that belongs to no window.

    Raises
    ------
    InputError
        If matplotlib is not installed.
    """
    required("matplotlib", "figures")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def new_axes(width: float = 6.4, height: float = 4.2) -> Axes:
    """Return Axes in a new figure that belongs to no window."""
    return new_figure(width, height).add_subplot()


def restyled(drawn: Figure | Axes, width: float, points: float) -> Figure:
    """Return a figure made as wide as a column, all its texts in one size.

    Parameters
    ----------
    drawn : Figure or Axes
        It is changed.
    width : float
        mm; the height keeps its proportion.
    points : float
        Size of the texts.
    """
    from matplotlib.text import Text

    figure = drawn.get_figure(root=True)
    assert figure is not None
    across, up = figure.get_size_inches()
    inches = width / 25.4
    figure.set_size_inches(inches, inches * up / across)
    for text in figure.findobj(Text):
        text.set_fontsize(points)
    return figure


def embedded(drawn: Figure | Axes) -> str:
    """Return a figure as a base64 text of SVG, for a page that needs no other file."""
    stream = io.BytesIO()
    _write(drawn, stream, ".svg")
    return base64.b64encode(stream.getvalue()).decode("ascii")


def _write(drawn: Figure | Axes, stream: IO[bytes], ending: str) -> None:
    """Write a figure; the same one has the same bytes."""
    import matplotlib as mpl

    metadata = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    figure = drawn.get_figure(root=True)
    assert figure is not None
    with mpl.rc_context({"svg.hashsalt": "drillctrl"}):
        figure.savefig(stream, format=ending[1:], dpi=150, metadata=metadata.get(ending))


def save_figure(drawn: Figure | Axes, path: str | Path) -> None:
    """Write a figure, or that of some Axes, by the file's ending, whole or not at all.

    Raises
    ------
    InputError
        If the ending is none of .pdf, .png, .svg.
    """
    check_figure_path(path)
    with replacing(path) as file:
        _write(drawn, file, Path(path).suffix.lower())


def check_figure_path(path: str | Path) -> None:
    """Raise `InputError` if a figure cannot be written under this name, or not drawn."""
    required("matplotlib", "figures")
    if Path(path).suffix.lower() not in FIGURE_ENDINGS:
        raise InputError("plot", str(path), f"a file that ends in {', '.join(FIGURE_ENDINGS)}")
