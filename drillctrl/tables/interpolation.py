"""Gains between the nodes: multilinear, clamped at the edges, and checked cell by cell."""

from __future__ import annotations

import functools
import itertools
import math
import operator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.tables.grid import Grid

IntArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]

INTERPOLATED, CONSTANT, UNSAFE = 0, 1, 2
# What a conversion of units has rounded, as a share of a coordinate, is not outside.
SLACK = 1e-9
CELL_NAMES = ("interpolated", "constant gains", "not stable")


class Place(NamedTuple):
    """Where points lie in a grid.

    Attributes
    ----------
    cell : array, (q,)
        Flat index of the cell.
    corners : array, (q, 2^a)
        Flat indices of the nodes at its corners.
    weights : array, (q, 2^a)
        Multilinear, not negative, of sum 1.
    inside : array, (q,)
        False where a coordinate was clamped.
    """

    cell: IntArray
    corners: IntArray
    weights: FloatArray
    inside: BoolArray


def cell_shape(grid: Grid) -> tuple[int, ...]:
    """Return the number of cells along each axis, 1 where there is but one value."""
    return tuple(max(size - 1, 1) for size in grid.shape)


def corners_of(grid: Grid) -> IntArray:
    """Return the nodes at the corners of every cell, (c, 2^a)."""
    return place(grid, middles(grid, np.arange(math.prod(cell_shape(grid))))).corners


def middles(grid: Grid, cells: IntArray) -> FloatArray:
    """Return the coordinates of the middles of cells, (c, a)."""
    origin = np.column_stack(np.unravel_index(cells, cell_shape(grid)))
    return to_coordinates(grid, origin, np.full((cells.size, len(grid.axes)), 0.5))


def place(grid: Grid, coordinates: FloatArray) -> Place:
    """Find cells and weights of points, (q, a) coordinates on the axes."""
    low, fraction = [], []
    inside = np.ones(len(coordinates), dtype=bool)
    for axis, value in zip(grid.axes, coordinates.T, strict=True):
        ticks = np.array(axis.values)
        slack = SLACK * max(abs(ticks[0]), abs(ticks[-1]))
        inside &= (value >= ticks[0] - slack) & (value <= ticks[-1] + slack)
        if ticks.size == 1:
            low.append(np.zeros(len(value), dtype=np.intp))
            fraction.append(np.zeros(len(value)))
            continue
        index = np.clip(np.searchsorted(ticks, value, side="right") - 1, 0, ticks.size - 2)
        share = (value - ticks[index]) / (ticks[index + 1] - ticks[index])
        low.append(index)
        fraction.append(np.clip(share, 0.0, 1.0))
    cell = np.ravel_multi_index(tuple(low), cell_shape(grid))
    corners, weights = [], []
    for offset in itertools.product((0, 1), repeat=len(low)):
        node = [np.minimum(i + o, n - 1) for i, o, n in zip(low, offset, grid.shape, strict=True)]
        corners.append(np.ravel_multi_index(tuple(node), grid.shape))
        parts = [f if o else 1.0 - f for f, o in zip(fraction, offset, strict=True)]
        weights.append(functools.reduce(operator.mul, parts))
    return Place(cell, np.column_stack(corners), np.column_stack(weights), inside)


@dataclass(frozen=True, eq=False)
class Cells:
    """What is known between the nodes.

    Attributes
    ----------
    mode : int array, (c,)
        For each cell: 0, interpolated gains were stable at every point looked at; 1, they
        were not, but the constant gains given here were; 2, neither.
    spectral_abscissa : array, (c,)
        The largest α found in the cell with the gains that its mode says; in mode 2 with the
        interpolated ones.
    gains : array, (c, k)
        Constant gain vectors in mode 1, else 0.
    """

    mode: IntArray
    spectral_abscissa: FloatArray
    gains: FloatArray


def interpolated(where: Place, gains: FloatArray, cells: Cells | None) -> FloatArray:
    """Return gain vectors at places, (q, k)."""
    vectors = np.einsum("qc,qck->qk", where.weights, gains[where.corners])
    if cells is not None:
        constant = cells.mode[where.cell] == CONSTANT
        vectors[constant] = cells.gains[where.cell[constant]]
    return np.asarray(vectors)


def to_coordinates(grid: Grid, origin: IntArray, local: FloatArray) -> FloatArray:
    """Return coordinates of points given by cell and place in it, from 0 to 1."""
    columns = []
    for axis, index, share in zip(grid.axes, origin.T, local.T, strict=True):
        ticks = np.array(axis.values)
        high = ticks[np.minimum(index + 1, ticks.size - 1)]
        columns.append((1.0 - share) * ticks[index] + share * high)
    return np.column_stack(columns)
