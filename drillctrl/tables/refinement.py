"""A finer grid where a coarse one leaves points between its nodes that are not vouched for."""

from __future__ import annotations

import dataclasses

import numpy as np

from drillctrl.delay.structure import BoolArray
from drillctrl.tables.grid import Axis, Grid
from drillctrl.tables.interpolation import UNSAFE, Cells, cell_shape, corners_of
from drillctrl.tables.node import NodeDesign


def refined_grid(grid: Grid, cells: Cells, stable: BoolArray) -> Grid:
    """Halve the spacing where cells did not pass but some of their nodes are stable.

    A grid stays a grid: a value that is put in halves every cell that it crosses.

    Parameters
    ----------
    grid : Grid
        The coarse one.
    cells : Cells
        What is known between its nodes.
    stable : bool array, (q,)
        Nodes that are stable.

    Returns
    -------
    Grid
        The same one where there is nothing to halve.

    Raises
    ------
    InputError
        If it would have more than `MAX_NODES` nodes.
    """
    failed = (cells.mode == UNSAFE) & stable[corners_of(grid)].any(axis=1)
    places = np.unravel_index(np.flatnonzero(failed), cell_shape(grid))
    axes = []
    for axis, slots in zip(grid.axes, places, strict=True):
        ticks = np.array(axis.values)
        low = np.unique(slots) if ticks.size > 1 else np.zeros(0, dtype=np.intp)
        middles = 0.5 * (ticks[low] + ticks[low + 1]) if low.size else low
        axes.append(Axis(axis.name, tuple(np.sort([*ticks, *middles]).tolist())))
    return dataclasses.replace(grid, axes=tuple(axes))


def carried_over(designs: list[NodeDesign], coarse: Grid, fine: Grid) -> dict[int, NodeDesign]:
    """Return the designs of the nodes of a coarse grid by their index in a finer one."""
    places = [
        np.searchsorted(new.values, old.values)
        for old, new in zip(coarse.axes, fine.axes, strict=True)
    ]
    mesh = np.meshgrid(*places, indexing="ij")
    index = np.ravel_multi_index(tuple(m.ravel() for m in mesh), fine.shape)
    return {
        i: dataclasses.replace(design, index=i)
        for i, design in zip(index.tolist(), designs, strict=True)
    }
