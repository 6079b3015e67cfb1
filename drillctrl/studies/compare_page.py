"""A comparison as one page that needs nothing else and prints well."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from drillctrl.base.figure import embedded
from drillctrl.base.templates import filled

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def comparison_page(figures: Sequence[tuple[str, Axes]], **values: object) -> str:
    """Return the page.

    Parameters
    ----------
    figures : sequence of (str, Axes)
        Titles and what was drawn.
    **values
        What the page names: see `Comparison.to_html`.
    """
    images = [(title, embedded(ax)) for title, ax in figures]
    return filled("drillctrl.studies", "comparison.html.j2", figures=images, **values)
