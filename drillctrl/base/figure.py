"""Figures. Every function takes matplotlib Axes, or makes them, and returns them."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

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


def save_figure(drawn: Figure | Axes, path: str | Path) -> None:
    """Write a figure, or that of some Axes, by the file's ending, whole or not at all.

    Raises
    ------
    InputError
        If the ending is none of .pdf, .png, .svg.
    """
    check_figure_path(path)
    metadata = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    ending = Path(path).suffix.lower()
    figure = drawn.get_figure(root=True)
    assert figure is not None
    with replacing(path) as file:
        import matplotlib as mpl

        with mpl.rc_context({"svg.hashsalt": "drillctrl"}):
            figure.savefig(file, format=ending[1:], dpi=150, metadata=metadata.get(ending))


def check_figure_path(path: str | Path) -> None:
    """Raise `InputError` if a figure cannot be written under this name, or not drawn."""
    required("matplotlib", "figures")
    if Path(path).suffix.lower() not in FIGURE_ENDINGS:
        raise InputError("plot", str(path), f"a file that ends in {', '.join(FIGURE_ENDINGS)}")
