"""Designs over a grid, each begun at what was found beside it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.synthesis.family import ActiveRoot
from drillctrl.synthesis.objectives import EXACT, Exact, Objective
from drillctrl.tables.batch import abscissas_at
from drillctrl.tables.grid import Grid
from drillctrl.tables.node import NodeDesign, NodeTask, design_node

Mapper = Callable[[Callable[[NodeTask], NodeDesign], Sequence[NodeTask]], Iterable[NodeDesign]]

Active = tuple[tuple[ActiveRoot, ...], ...]

_ROUNDS = 4
_MOST_KNOWN = 4
# Gains closer than this share of their ranges are taken to lie in one basin.
_ONE_BASIN = 0.1
# Excess of α over what the neighbours suggest, relative and absolute, that is looked into.
_STANDS_OUT = (0.02, 0.01)
# Relative excess of a node with other gains than a neighbour's that is looked into from there.
_BENDS = 0.002


def design_grid(
    grid: Grid,
    structure: FeedbackStructure,
    seed: int,
    run: Mapper,
    objective: Objective = EXACT,
    known: Mapping[int, NodeDesign] | None = None,
    surroundings: Mapping[str, float] | None = None,
) -> list[NodeDesign]:
    """Design every node of a grid.

    Nodes of a coarse subgrid are searched over the whole box. Those between begin at the
    gains around them, level by level. A node at which the gains of a neighbour are better
    than its own, or nearly so, is designed again from there, and one whose α stands out
    from its neighbours' is searched over the whole box too, until nothing gets better.

    Parameters
    ----------
    grid : Grid
        Operating points.
    structure : FeedbackStructure
        With its bounds.
    seed : int
        Of the starting points; the same for every node.
    run : callable
        ``run(design_node, tasks)`` yields the designs of the tasks, in any order. The result
        does not depend on how: tasks of one wave do not depend on each other.
    objective : Objective
        Other than the exact abscissa, each node is designed on its own.
    known : mapping of int to NodeDesign, optional
        Designs of some nodes; all others begin at those beside them.
    surroundings : mapping, optional
        Of the controller in the runs of designs on the motion that is drilled with.

    Returns
    -------
    list of NodeDesign
        In the order of the nodes.
    """
    found = dict(known or {})
    if not isinstance(objective, Exact):
        alone = [
            NodeTask(i, case, structure, seed, objective=objective, surroundings=surroundings or {})
            for i, case in enumerate(grid.cases)
            if i not in found
        ]
        designs = [*found.values(), *run(design_node, alone)]
        return sorted(designs, key=lambda design: design.index)
    stride = 1 if found else _coarse_stride(grid.shape)
    apart = _ONE_BASIN * (structure.upper - structure.lower)
    # The same task again would end the same.
    tried: set[tuple[int, bytes, Active]] = set()
    while stride >= 1:
        chosen = [
            index
            for index, place in enumerate(np.ndindex(grid.shape))
            if index not in found and _on_level(place, grid.shape, stride)
        ]
        tasks = []
        for i in chosen:
            gains, active = _nearby(grid.shape, i, stride, found, apart)
            tasks.append(NodeTask(i, grid.cases[i], structure, seed, gains, active=active))
        tried.update(map(_key, tasks))
        found.update({design.index: design for design in run(design_node, tasks)})
        stride //= 2
    for _ in range(_ROUNDS):
        better = 0
        for propose in (_restarts, _searches):
            proposed = propose(grid, structure, seed, found)
            tasks = [task for task in proposed if _key(task) not in tried]
            tried.update(map(_key, tasks))
            for design in run(design_node, tasks):
                if design.spectral_abscissa < found[design.index].spectral_abscissa - 1e-6:
                    found[design.index] = design
                    better += 1
        if not better:
            break
    return [found[index] for index in range(len(grid.points))]


def _key(task: NodeTask) -> tuple[int, bytes, Active]:
    return task.index, np.array(task.known).tobytes(), task.active


def edges(shape: tuple[int, ...]) -> npt.NDArray[np.intp]:
    """Return all pairs of neighbouring nodes, (e, 2)."""
    index = np.arange(math.prod(shape)).reshape(shape)
    pairs = []
    for axis in range(len(shape)):
        low = np.delete(index, -1, axis=axis).ravel()
        high = np.delete(index, 0, axis=axis).ravel()
        pairs.append(np.column_stack([low, high]))
    return np.concatenate(pairs)


def _coarse_stride(shape: tuple[int, ...]) -> int:
    """Return how far apart the nodes are that are searched over the whole box."""
    nodes = math.prod(shape)
    return 1 if nodes < 9 else 2 if nodes < 200 else 4 if nodes < 2000 else 8


def _on_level(place: tuple[int, ...], shape: tuple[int, ...], stride: int) -> bool:
    return all(
        i % stride == 0 or (i == size - 1 and stride > 1)
        for i, size in zip(place, shape, strict=True)
    )


def _nearby(
    shape: tuple[int, ...],
    index: int,
    stride: int,
    found: dict[int, NodeDesign],
    apart: FloatArray,
) -> tuple[tuple[FloatArray, ...], Active]:
    """Return the gains around a node and the active roots there, one vector a basin."""
    if not found:
        return (), ()
    place = np.unravel_index(index, shape)
    basins: list[list[NodeDesign]] = []
    for step in itertools.product((-stride, 0, stride), repeat=len(shape)):
        other = [int(i) + s for i, s in zip(place, step, strict=True)]
        if any(not 0 <= i < size for i, size in zip(other, shape, strict=True)):
            continue
        design = found.get(int(np.ravel_multi_index(other, shape)))
        if design is None:
            continue
        home = next((b for b in basins if (np.abs(b[0].gains - design.gains) < apart).all()), None)
        if home is None:
            basins.append([design])
        else:
            home.append(design)
    if not basins:
        nearest = min(found, key=lambda i: _distance(shape, i, index))
        basins = [[found[nearest]]]
    basins = basins[:_MOST_KNOWN]
    # Neighbours stand on opposite sides: their mean is closer than any of them.
    means = tuple(np.mean([design.gains for design in basin], axis=0) for basin in basins)
    return means, tuple(basin[0].roots for basin in basins)


def _distance(shape: tuple[int, ...], first: int, second: int) -> int:
    a, b = np.unravel_index(first, shape), np.unravel_index(second, shape)
    return sum(abs(int(i) - int(j)) for i, j in zip(a, b, strict=True))


def _restarts(
    grid: Grid, structure: FeedbackStructure, seed: int, found: dict[int, NodeDesign]
) -> list[NodeTask]:
    """Return tasks for the nodes at which the gains of a neighbour promise more."""
    pairs = edges(grid.shape)
    if not len(pairs) or not structure.lower.size:
        return []
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    gains = np.array([found[i].gains for i in range(len(grid.points))])
    own = np.array([found[i].spectral_abscissa for i in range(len(grid.points))])
    borrowed = abscissas_at(grid, structure, grid.coordinates[pairs[:, 0]], gains[pairs[:, 1]])
    here, there = own[pairs[:, 0]], own[pairs[:, 1]]
    promise = borrowed < here - 1e-6
    # A neighbour that does much better by far other gains may sit in a better basin, and so may
    # any with other gains where α stands out a little.
    width = structure.upper - structure.lower
    apart = np.abs((gains[pairs[:, 0]] - gains[pairs[:, 1]]) / width).max(axis=1)
    apart = apart > _ONE_BASIN
    bend = excess(own.reshape(grid.shape)).ravel()[pairs[:, 0]]
    promise |= apart & (there < here - 0.02 * np.abs(here))
    promise |= apart & (bend > _BENDS * np.abs(here))
    tasks = []
    for index in np.unique(pairs[promise, 0]).tolist():
        better = pairs[promise & (pairs[:, 0] == index), 1][:_MOST_KNOWN].tolist()
        known = tuple(gains[j] for j in better)
        active = tuple(found[j].roots for j in better)
        tasks.append(NodeTask(index, grid.cases[index], structure, seed, known, active=active))
    return tasks


def _searches(
    grid: Grid, structure: FeedbackStructure, seed: int, found: dict[int, NodeDesign]
) -> list[NodeTask]:
    """Return tasks over the whole box for the nodes whose α stands out."""
    alpha = np.array([found[i].spectral_abscissa for i in range(len(grid.points))])
    relative, absolute = _STANDS_OUT
    doubtful = excess(alpha.reshape(grid.shape)).ravel() > np.maximum(
        relative * np.abs(alpha), absolute
    )
    return [
        NodeTask(index, grid.cases[index], structure, seed)
        for index in np.flatnonzero(doubtful).tolist()
    ]


def excess(values: FloatArray) -> FloatArray:
    """Return by how much each value exceeds the middle of those beside it.

    Parameters
    ----------
    values : array
        One a node.

    Returns
    -------
    array
        Half the second difference, negated: the largest over the axes, that of the next
        node at an end; −∞ along axes of fewer than three nodes.
    """
    most = np.full(values.shape, -np.inf)
    for axis in range(values.ndim):
        if values.shape[axis] < 3:
            continue
        along = np.moveaxis(values, axis, 0)
        bend = 0.5 * (2.0 * along[1:-1] - along[:-2] - along[2:])
        # At an end a value too high bends the line the other way.
        padded = np.concatenate([-bend[:1], bend, -bend[-1:]])
        most = np.maximum(most, np.moveaxis(padded, 0, axis))
    return most
