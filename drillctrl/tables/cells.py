"""Gains between the nodes, checked cell by cell and mended where they fail."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.strings.changed import CHANGES
from drillctrl.synthesis.descent import bfgs
from drillctrl.synthesis.family import loop_family
from drillctrl.synthesis.measures import worst_case
from drillctrl.tables.batch import abscissas_at
from drillctrl.tables.grid import Grid
from drillctrl.tables.interpolation import (
    CONSTANT,
    INTERPOLATED,
    UNSAFE,
    BoolArray,
    Cells,
    IntArray,
    cell_shape,
    interpolated,
    middles,
    place,
    to_coordinates,
)

_STEPS = (0.25, 0.125, 0.0625, 0.03)
# Share of the range of α over a cell that the worst point may have been missed by.
_MISSED = 0.1
_DESCENT = 60
# Cells of one task.
TOGETHER = 64


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
    surroundings : mapping
        Of the controller in trial runs.
    """

    grid: Grid
    structure: FeedbackStructure
    gains: FloatArray
    stable: BoolArray
    cells: IntArray
    surroundings: Mapping[str, float] = field(default_factory=dict)


def cell_tasks(
    grid: Grid,
    structure: FeedbackStructure,
    gains: FloatArray,
    stable: BoolArray,
    surroundings: Mapping[str, float] | None = None,
    together: int = TOGETHER,
) -> list[CellTask]:
    """Return tasks that together check every cell."""
    every = np.arange(math.prod(cell_shape(grid)))
    # A copy leaves behind what the grid has worked out and a task need not carry.
    bare = dataclasses.replace(grid)
    return [
        CellTask(bare, structure, gains, stable, every[i : i + together], surroundings or {})
        for i in range(0, every.size, together)
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
    worst of these a pattern search looks for a worse point, at its depth where that is an axis:
    every other depth is another plant. A cell passes if what it finds is
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
    corners = place(grid, middles(grid, task.cells)).corners
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
    return abscissas_at(grid, structure, coordinates, vectors)


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
    at = to_coordinates(grid, of_origin, local)
    alpha = _abscissas(grid, structure, gains, cells, of_cell, at).reshape(count, -1)
    spread = alpha.max(axis=1) - alpha.min(axis=1)
    best, here = alpha.max(axis=1), lattice[np.argmax(alpha, axis=1)]
    directions = np.array(
        [
            sign * unit
            for unit, size, axis in zip(np.eye(3), grid.shape, grid.axes, strict=True)
            for sign in (-1.0, 1.0)
            if size > 1 and axis.name not in CHANGES
        ]
    ).reshape(-1, 3)
    if not len(directions):
        return best, spread
    for step in _STEPS:
        trials = np.clip(here[:, None] + step * directions, 0.0, 1.0)
        flat = trials.reshape(-1, 3)
        cell = np.repeat(index, len(directions))
        at = to_coordinates(grid, np.repeat(origin, len(directions), axis=0), flat)
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
    coordinates = to_coordinates(grid, np.tile(origin, (len(lattice), 1)), lattice)
    families = [
        loop_family(grid.case(*row).system(structure.inputs), structure)
        for row in coordinates.tolist()
    ]
    worst = worst_case(families)
    starts = [*corner_gains, corner_gains.mean(axis=0)]
    start = min(starts, key=lambda vector: worst(vector)[0])
    return bfgs(worst, start, structure.lower, structure.upper, most=_DESCENT).gains
