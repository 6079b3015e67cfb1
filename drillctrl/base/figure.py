"""Figures. Every function takes matplotlib Axes, or makes them, and returns them."""

from __future__ import annotations

import base64
import io
import textwrap
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from drillctrl.base.errors import InputError
from drillctrl.base.extras import required
from drillctrl.base.figure_data import figure_table
from drillctrl.base.files import replacing, write_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure


# Okabe and Ito's palette, told apart by colour-blind readers too.
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#666666"
PALETTE = (BLUE, ORANGE, GREEN, GREY, "#CC79A7", "#56B4E9")
FIGURE_ENDINGS = (".pdf", ".png", ".svg", ".csv")
# Widths of one column and two, mm, texts, points, and the widest figure of one column, inches.
JOURNAL = (88.0, 180.0, 7.0, 6.6)
STYLES = ("screen", "journal")


def axis_name(quantity: str, unit: str = "") -> str:
    """Return the label of an axis or a colour bar: what is drawn, and in which unit."""
    return f"{quantity}, {unit or 'dimensionless'}"


def plain_ticks(axis: Axis) -> None:
    """Write the numbers of a logarithmic axis as people do, with no powers of ten."""
    from matplotlib.ticker import LogLocator

    axis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
    for write in (axis.set_major_formatter, axis.set_minor_formatter):
        write("{x:g}")


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
    # What is longer than the figure is broken; letters are about half as wide as high.
    for ax in figure.axes:
        for label, room in ((ax.xaxis.label, inches), (ax.yaxis.label, inches * up / across)):
            most = int(0.8 * room * 72.0 / (0.55 * points))
            if len(label.get_text()) > most:
                label.set_text(headline(label.get_text(), most))
    return figure


def embedded(drawn: Figure | Axes) -> str:
    """Return a figure as a base64 text of SVG, for a page that needs no other file."""
    stream = io.BytesIO()
    _write(drawn, stream, ".svg")
    return base64.b64encode(stream.getvalue()).decode("ascii")


def _write(drawn: Figure | Axes, stream: IO[bytes], ending: str, style: str = "screen") -> None:
    """Write a figure; the same one has the same bytes."""
    import matplotlib as mpl

    metadata = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    figure = drawn.get_figure(root=True)
    assert figure is not None
    words: dict[str, Any] = {"svg.hashsalt": "drillctrl"}
    dots = 150
    if style == "journal":
        # Texts as texts, in fonts that publishers take.
        words |= {"svg.fonttype": "none", "pdf.fonttype": 42}
        dots = 600
    with mpl.rc_context(words):  # type: ignore[arg-type, unused-ignore]
        figure.savefig(stream, format=ending[1:], dpi=dots, metadata=metadata.get(ending))


def save_figure(drawn: Figure | Axes, path: str | Path, style: str = "screen") -> None:
    """Write a figure, or that of some Axes, by the file's ending, whole or not at all.

    Parameters
    ----------
    drawn : Figure or Axes
        What is drawn.
    path : str or Path
        ``.png``, ``.pdf``, ``.svg``, or ``.csv`` for the data of the figure as a table.
    style : {"screen", "journal"}
        For a journal it is 88 or 180 mm wide, with texts of 7 points that stay texts.

    Raises
    ------
    InputError
        If the ending or the style is none of these.
    """
    check_figure_path(path)
    check_style(style)
    ending = Path(path).suffix.lower()
    if ending == ".csv":
        write_text(path, figure_table(drawn))
        return
    if style == "journal":
        figure = drawn.get_figure(root=True)
        assert figure is not None
        one, two, points, widest = JOURNAL
        width = one if figure.get_size_inches()[0] <= widest else two
        restyled(drawn, width, points)
    with replacing(path) as file:
        _write(drawn, file, ending, style)


def check_style(style: str) -> None:
    """Raise `InputError` if there is no such style."""
    if style not in STYLES:
        raise InputError("style", style, f"one of {', '.join(STYLES)}")


def check_figure_path(path: str | Path) -> None:
    """Raise `InputError` if a figure cannot be written under this name, or not drawn."""
    required("matplotlib", "figures")
    if Path(path).suffix.lower() not in FIGURE_ENDINGS:
        raise InputError("plot", str(path), f"a file that ends in {', '.join(FIGURE_ENDINGS)}")
