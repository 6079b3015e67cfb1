"""Gains between the nodes: multilinear, clamped at the edges, and checked cell by cell."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import plant_system
from drillctrl.spectrum.batch import spectral_abscissas
from drillctrl.spectrum.characteristic import FloatArray
from drillctrl.synthesis.descent import bfgs
from drillctrl.synthesis.family import loop_family
from drillctrl.synthesis.measures import worst_case
from drillctrl.tables.grid import Grid

IntArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]

INTERPOLATED, CONSTANT, UNSAFE = 0, 1, 2
CELL_NAMES = ("interpolated", "constant gains", "not stable")

_STEPS = (0.25, 0.125, 0.0625, 0.03)
# Share of the range of α over a cell that the worst point may have been missed by.
_MISSED = 0.1
_DESCENT = 60
# Cells of one task.
_TOGETHER = 64


class Place(NamedTuple):
    """Where points lie in a grid.

    Attributes
    ----------
    cell : array, (q,)
        Flat index of the cell.
    corners : array, (q, 8)
        Flat indices of the nodes at its corners.
    weights : array, (q, 8)
        Multilinear, not negative, of sum 1.
    inside : array, (q,)
        False where a coordinate was clamped.
    """

    cell: IntArray
    corners: IntArray
    weights: FloatArray
    inside: BoolArray


def cell_shape(grid: Grid) -> tuple[int, int, int]:
    """Return the number of cells along each axis, 1 where there is but one value."""
    a, b, c = (max(size - 1, 1) for size in grid.shape)
    return a, b, c


def corners_of(grid: Grid) -> IntArray:
    """Return the nodes at the corners of every cell, (c, 8)."""
    return place(grid, _middles(grid, np.arange(math.prod(cell_shape(grid))))).corners


def _middles(grid: Grid, cells: IntArray) -> FloatArray:
    """Return the coordinates of the middles of cells, (c, 3)."""
    origin = np.column_stack(np.unravel_index(cells, cell_shape(grid)))
    return _to_coordinates(grid, origin, np.full((cells.size, 3), 0.5))


def place(grid: Grid, coordinates: FloatArray) -> Place:
    """Find cells and weights of points, (q, 3) coordinates on the axes."""
    low, fraction = [], []
    inside = np.ones(len(coordinates), dtype=bool)
    for axis, value in zip(grid.axes, coordinates.T, strict=True):
        ticks = np.array(axis.values)
        # What a conversion of units has rounded is not outside.
        slack = 1e-9 * max(abs(ticks[0]), abs(ticks[-1]))
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
    for offset in itertools.product((0, 1), repeat=3):
        node = [np.minimum(i + o, n - 1) for i, o, n in zip(low, offset, grid.shape, strict=True)]
        corners.append(np.ravel_multi_index(tuple(node), grid.shape))
        parts = [f if o else 1.0 - f for f, o in zip(fraction, offset, strict=True)]
        weights.append(parts[0] * parts[1] * parts[2])
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


@dataclass(frozen=True, eq=False)
class CellTask:
    """Some cells to check, as plain data.

    Attributes
    ----------
    grid, structure : Grid, FeedbackStructure
        Of the table.
    gains : array, (q, k)
        Gain vectors at the nodes.
    stable : bool array, (q,)
        Nodes that are stable.
    cells : int array, (c,)
        Which ones.
    """

    grid: Grid
    structure: FeedbackStructure
    gains: FloatArray
    stable: BoolArray
    cells: IntArray


def cell_tasks(
    grid: Grid, structure: FeedbackStructure, gains: FloatArray, stable: BoolArray
) -> list[CellTask]:
    """Return tasks that together check every cell."""
    every = np.arange(math.prod(cell_shape(grid)))
    # A copy leaves behind what the grid has worked out and a task need not carry.
    bare = dataclasses.replace(grid)
    return [
        CellTask(bare, structure, gains, stable, every[i : i + _TOGETHER])
        for i in range(0, every.size, _TOGETHER)
    ]


def joined(parts: Iterable[tuple[IntArray, Cells]]) -> Cells:
    """Return the cells of all tasks, whatever order they come in."""
    ordered = [cells for _, cells in sorted(parts, key=lambda part: int(part[0][0]))]
    return Cells(
        np.concatenate([cells.mode for cells in ordered]),
        np.concatenate([cells.spectral_abscissa for cells in ordered]),
        np.concatenate([cells.gains for cells in ordered]),
    )


def check_cells(task: CellTask) -> tuple[IntArray, Cells]:
    """Check the interpolated gains in some cells, and mend those that fail.

    α is computed at the centre, the middles of the edges and faces, and the corners; from the
    worst of these a pattern search looks for a worse point. A cell passes if what it finds is
    negative by a tenth of the range of α in the cell. One that fails with stable corners is
    given the constant gains that are best at its worst of these points, if they pass.

    Returns
    -------
    cells : int array, (c,)
        Those of the task.
    found : Cells
        What is known of them.
    """
    grid, structure, gains = task.grid, task.structure, task.gains
    total, count = math.prod(cell_shape(grid)), task.cells.size
    origin = np.column_stack(np.unravel_index(task.cells, cell_shape(grid)))
    worst, spread = _worst(grid, structure, gains, None, task.cells, origin)
    corners = place(grid, _middles(grid, task.cells)).corners
    sound = task.stable[corners].all(axis=1)
    passed = sound & (worst + _MISSED * spread < 0.0)
    mode = np.where(passed, INTERPOLATED, UNSAFE)
    constant = np.zeros((count, gains.shape[1]))
    for i in np.flatnonzero(sound & ~passed).tolist():
        candidate = _constant_gains(grid, structure, gains[np.unique(corners[i])], origin[i])
        trial = Cells(np.full(total, CONSTANT), np.zeros(total), np.tile(candidate, (total, 1)))
        here = np.array([i])
        value, width = _worst(grid, structure, gains, trial, task.cells[here], origin[here])
        if value[0] + _MISSED * width[0] < 0.0:
            mode[i], worst[i], constant[i] = CONSTANT, value[0], candidate
    return task.cells, Cells(mode, worst, constant)


def _to_coordinates(grid: Grid, origin: IntArray, local: FloatArray) -> FloatArray:
    """Return coordinates of points given by cell and place in it, from 0 to 1."""
    columns = []
    for axis, index, share in zip(grid.axes, origin.T, local.T, strict=True):
        ticks = np.array(axis.values)
        high = ticks[np.minimum(index + 1, ticks.size - 1)]
        columns.append((1.0 - share) * ticks[index] + share * high)
    return np.column_stack(columns)


def _lattice(grid: Grid) -> FloatArray:
    """Return corners, middles of edges and faces, and the centre of a unit cell, (l, 3)."""
    ticks = [(0.0, 0.5, 1.0) if size > 1 else (0.0,) for size in grid.shape]
    return np.array(list(itertools.product(*ticks)))


def _abscissas(
    grid: Grid,
    structure: FeedbackStructure,
    gains: FloatArray,
    cells: Cells | None,
    index: IntArray,
    coordinates: FloatArray,
) -> FloatArray:
    where = place(grid, coordinates)
    # A point on the border of two cells belongs to the one that asks for it.
    vectors = interpolated(where, gains, None if cells is None else cells)
    if cells is not None:
        own = cells.mode[index] == CONSTANT
        vectors[own] = cells.gains[index[own]]
    groups = grid.groups(coordinates)
    parameters = dict(zip(("omega0", "delta0", "psi"), groups.T, strict=True))
    first = grid.point(*(axis.values[0] for axis in grid.axes))
    return spectral_abscissas(first, parameters, structure, vectors)


def _worst(
    grid: Grid,
    structure: FeedbackStructure,
    gains: FloatArray,
    cells: Cells | None,
    index: IntArray,
    origin: IntArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the largest α found in each cell, and the range of α over its lattice."""
    lattice = _lattice(grid)
    count = len(index)
    local = np.tile(lattice, (count, 1))
    of_cell, of_origin = np.repeat(index, len(lattice)), np.repeat(origin, len(lattice), axis=0)
    at = _to_coordinates(grid, of_origin, local)
    alpha = _abscissas(grid, structure, gains, cells, of_cell, at).reshape(count, -1)
    spread = alpha.max(axis=1) - alpha.min(axis=1)
    best, here = alpha.max(axis=1), lattice[np.argmax(alpha, axis=1)]
    directions = np.array(
        [
            sign * unit
            for unit, size in zip(np.eye(3), grid.shape, strict=True)
            for sign in (-1.0, 1.0)
            if size > 1
        ]
    ).reshape(-1, 3)
    if not len(directions):
        return best, spread
    for step in _STEPS:
        trials = np.clip(here[:, None] + step * directions, 0.0, 1.0)
        flat = trials.reshape(-1, 3)
        cell = np.repeat(index, len(directions))
        at = _to_coordinates(grid, np.repeat(origin, len(directions), axis=0), flat)
        values = _abscissas(grid, structure, gains, cells, cell, at).reshape(count, -1)
        top = np.argmax(values, axis=1)
        rows = np.arange(count)
        better = values[rows, top] > best
        best = np.where(better, values[rows, top], best)
        here = np.where(better[:, None], trials[rows, top], here)
    return best, spread


def _constant_gains(
    grid: Grid, structure: FeedbackStructure, corner_gains: FloatArray, origin: IntArray
) -> FloatArray:
    """Return the gains with the least worst abscissa over the lattice of a cell."""
    lattice = _lattice(grid)
    coordinates = _to_coordinates(grid, np.tile(origin, (len(lattice), 1)), lattice)
    families = [
        loop_family(plant_system(grid.point(*row), structure.inputs), structure)
        for row in coordinates.tolist()
    ]
    worst = worst_case(families)
    starts = [*corner_gains, corner_gains.mean(axis=0)]
    start = min(starts, key=lambda vector: worst(vector)[0])
    return bfgs(worst, start, structure.lower, structure.upper, most=_DESCENT).gains
