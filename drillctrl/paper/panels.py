"""Figures with several Axes, and what a reproduced figure consists of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from drillctrl.base.figure import new_figure
from drillctrl.paper.agreement import Agreement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Reproduced:
    """A figure drawn again, and the statements that were checked on the way.

    Attributes
    ----------
    figure : Figure or None
        None where there is nothing to draw.
    agreements : list of Agreement
        In the order of the paper.
    table : list of dict
        Rows of numbers behind the figure, where it has some worth keeping.
    """

    figure: Figure | None
    agreements: list[Agreement]
    table: list[dict[str, Any]] = field(default_factory=list)


def panels(rows: int, columns: int) -> tuple[Figure, list[Axes]]:
    """Return a figure that belongs to no window, and its Axes row by row."""
    figure = new_figure(5.6 * columns, 3.9 * rows)
    return figure, list(figure.subplots(rows, columns, squeeze=False).ravel())
