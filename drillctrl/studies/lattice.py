"""Points over two axes: coarse ones first, then dense ones where what is found there changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray

Node = tuple[int, int]


class Cell(NamedTuple):
    """A square of the finest lattice, known at its corners.

    Attributes
    ----------
    i, j : int
        Its lowest corner.
    step : int
        Its width.
    """

    i: int
    j: int
    step: int

    @property
    def corners(self) -> tuple[Node, Node, Node, Node]:
        """Lower left and right, upper left and right."""
        i, j, s = self
        return (i, j), (i + s, j), (i, j + s), (i + s, j + s)

    def split(self) -> tuple[Cell, Cell, Cell, Cell]:
        """Its quarters."""
        half = self.step // 2
        a, b, c, d = (
            Cell(self.i + p * half, self.j + q * half, half) for q in (0, 1) for p in (0, 1)
        )
        return a, b, c, d


def fine_shape(counts: tuple[int, int], refine: int) -> tuple[int, int]:
    """Return the numbers of points of the finest lattice."""
    return (counts[0] - 1) * 2**refine + 1, (counts[1] - 1) * 2**refine + 1


def explore(
    counts: tuple[int, int],
    refine: int,
    find: Callable[[Sequence[Node]], Mapping[Node, str]],
) -> tuple[Cell, ...]:
    """Return cells whose corners all have the same word, or that are as small as they may be.

    Parameters
    ----------
    counts : (int, int)
        Points along each axis to begin with, at least two.
    refine : int
        How often their spacing is halved where words differ.
    find : callable
        Returns the word of each node, given as places on the finest lattice.

    Notes
    -----
    A point that a neighbour brought in counts too, so that no cell with a changing edge is left
    wide beside a narrow one.
    """
    step = 2**refine
    wide, high = fine_shape(counts, refine)
    nodes = [(i, j) for i in range(0, wide, step) for j in range(0, high, step)]
    known = dict(find(nodes))
    cells = [Cell(i, j, step) for i in range(0, wide - 1, step) for j in range(0, high - 1, step)]

    def changes(cell: Cell) -> bool:
        # Nodes that a cell may hold lie half its width apart or closer.
        span = range(cell.step + 1)
        words = {known.get((cell.i + p, cell.j + q)) for p in span for q in span}
        return len(words - {None}) > 1

    while True:
        split = [cell for cell in cells if cell.step > 1 and changes(cell)]
        if not split:
            return tuple(cells)
        children = [child for cell in split for child in cell.split()]
        new = dict.fromkeys(
            node for child in children for node in child.corners if node not in known
        )
        if new:
            known.update(find(list(new)))
        gone = set(split)
        cells = [cell for cell in cells if cell not in gone] + children


def fill(
    shape: tuple[int, int], cells: Sequence[Cell], nodes: Sequence[Node], values: FloatArray
) -> FloatArray:
    """Return values on the whole finest lattice, bilinear between the corners of cells.

    Parameters
    ----------
    shape : (int, int)
        Of the lattice.
    cells : sequence of Cell
        Of `explore`.
    nodes, values : (q,)
        What is known where; NaN spreads over the cells around it.

    Returns
    -------
    array, shape
    """
    whole = np.full(shape, np.nan)
    at = dict(zip(nodes, values.tolist(), strict=True))
    for cell in cells:
        low, right, up, far = (at[node] for node in cell.corners)
        t = np.linspace(0.0, 1.0, cell.step + 1)
        p, q = t[:, None], t[None, :]
        inside = (1 - q) * ((1 - p) * low + p * right) + q * ((1 - p) * up + p * far)
        whole[cell.i : cell.i + cell.step + 1, cell.j : cell.j + cell.step + 1] = inside
    for (i, j), value in at.items():
        whole[i, j] = value
    return whole
