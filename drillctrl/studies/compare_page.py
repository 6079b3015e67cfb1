"""A comparison as one page that needs nothing else and prints well."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

from drillctrl.base.templates import filled

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def _image(ax: Axes) -> str:
    import matplotlib as mpl

    figure = ax.get_figure(root=True)
    assert figure is not None
    stream = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "drillctrl"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return base64.b64encode(stream.getvalue()).decode("ascii")


def comparison_page(figures: Sequence[tuple[str, Axes]], **values: object) -> str:
    """Return the page.

    Parameters
    ----------
    figures : sequence of (str, Axes)
        Titles and what was drawn.
    **values
        What the page names: see `Comparison.to_html`.
    """
    images = [(title, _image(ax)) for title, ax in figures]
    return filled("drillctrl.studies", "comparison.html.j2", figures=images, **values)
