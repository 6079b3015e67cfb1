"""The smoothest gains over a grid whose decay rates stay close to the best."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.structure import BoolArray, FeedbackStructure
from drillctrl.tables.batch import abscissas_at
from drillctrl.tables.continuation import edges
from drillctrl.tables.grid import Grid
from drillctrl.tables.interpolation import CONSTANT, Cells, cell_shape, corners_of

_SWEEPS = 40
_FRACTIONS = np.array([1.0, 0.7, 0.4, 0.2, 0.08, 0.03])
# Gains that are good enough lie along thin curved valleys, so that the straight way to the
# mean is often barred; steps in scattered directions find the way along.
_SCATTERED = 8
_RADII = (0.003, 0.01, 0.03, 0.1)


def smooth_gains(
    grid: Grid,
    structure: FeedbackStructure,
    gains: FloatArray,
    best: FloatArray,
    give_up: float,
) -> FloatArray:
    """Minimise the sum of squared jumps between neighbours among gains that are good enough.

    Each node is moved towards the mean of its neighbours, where the sum is least, as far
    as its α permits; nodes of one colour of a chequerboard move together. Beside points on
    that way, steps in scattered directions are tried and the neighbours' own gains, which
    leads out of another basin. The sum never rises; what is reached need not be its minimum.

    Parameters
    ----------
    grid : Grid
        Operating points.
    structure : FeedbackStructure
        With its bounds.
    gains : array, (q, k)
        Best gain vectors.
    best : array, (q,)
        Their α. Nodes with α ≥ 0 are left as they are and pull at nothing.
    give_up : float
        Share of −α that may be lost.

    Returns
    -------
    array, (q, k)
        With α ≤ (1 − give_up) · best wherever best < 0.
    """
    pairs = edges(grid.shape)
    movable = best < 0.0
    pairs = pairs[movable[pairs].all(axis=1)]
    if not len(pairs) or give_up <= 0.0:
        return gains
    places = grid.coordinates
    width = structure.upper - structure.lower
    colour = sum(np.unravel_index(np.arange(len(best)), grid.shape)) % 2
    beside: list[list[int]] = [[] for _ in best]
    for a, b in pairs.tolist():
        beside[a].append(b)
        beside[b].append(a)
    limit = (1.0 - give_up) * best
    current = gains.copy()
    scatter = np.random.default_rng(0)
    for sweep in range(_SWEEPS):
        moved = 0.0
        directions = scatter.normal(size=(_SCATTERED, gains.shape[1]))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        steps = [r * d * width for d in (*directions, *-directions) for r in _RADII]
        for parity in (0, 1):
            rows, trials = [], []
            for i in np.flatnonzero((colour == parity) & movable).tolist():
                if not beside[i]:
                    continue
                around = current[beside[i]]
                target = around.mean(axis=0)
                options = [current[i] + f * (target - current[i]) for f in _FRACTIONS]
                bent = [np.clip(current[i] + s, structure.lower, structure.upper) for s in steps]
                options += bent
                if sweep < 4:
                    options += list(around)
                here = _cost(current[i], around, width)
                ranked = sorted((_cost(g, around, width), j) for j, g in enumerate(options))
                for cost, j in ranked:
                    if cost < here - 1e-12:
                        rows.append(i)
                        trials.append(options[j])
            if not rows:
                continue
            index, vectors = np.array(rows), np.array(trials)
            alpha = abscissas_at(grid, structure, places[index], vectors)
            good = np.flatnonzero(alpha <= limit[index])
            # Trials of a node stand in the order of what they bring; the first good one is taken.
            nodes, first = np.unique(index[good], return_index=True)
            for i, position in zip(nodes.tolist(), good[first].tolist(), strict=True):
                step = float(np.abs((vectors[position] - current[i]) / width).max())
                moved = max(moved, step)
                current[i] = vectors[position]
        if moved < 1e-4:
            break
    return current


def _cost(vector: FloatArray, around: FloatArray, width: FloatArray) -> float:
    return float((((vector - around) / width) ** 2).sum())


def largest_jump(
    grid: Grid, structure: FeedbackStructure, gains: FloatArray, counted: BoolArray, cells: Cells
) -> tuple[float, tuple[int, int] | None]:
    """Return the largest change of a gain between neighbours, and between which nodes.

    Beside changes from node to node these are the steps at the borders of cells with constant
    gains: on a face between two cells a step is largest at a node.

    Parameters
    ----------
    grid, structure : Grid, FeedbackStructure
        Of the table.
    gains : array, (q, k)
        Gain vectors.
    counted : bool array, (q,)
        Nodes that are looked at.
    cells : Cells
        What is known between them.

    Returns
    -------
    float
        As a share of the width of the gain's bounds; 0 without neighbours.
    tuple of int, or None
        The two nodes; twice the same one for a step at the border of a cell.
    """
    width = structure.upper - structure.lower
    if not gains.shape[1]:
        return 0.0, None
    pairs, jumps = _between_nodes(grid, gains / width, counted, cells)
    borders, steps = _between_cells(grid, gains / width, cells, width)
    pairs, jumps = np.concatenate([pairs, borders]), np.concatenate([jumps, steps])
    if not len(pairs):
        return 0.0, None
    worst = int(np.argmax(jumps))
    return float(jumps[worst]), (int(pairs[worst, 0]), int(pairs[worst, 1]))


def _between_nodes(
    grid: Grid, gains: FloatArray, counted: BoolArray, cells: Cells
) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return neighbours between which some cell interpolates, and how far apart they are."""
    pairs = edges(grid.shape)
    # Corners stand in the order of a binary number: those of one edge differ in one digit.
    ends = np.array([(i, i | digit) for digit in (1, 2, 4) for i in range(8) if not i & digit])
    joined = corners_of(grid)[cells.mode != CONSTANT][:, ends].reshape(-1, 2)
    bridged = np.isin(pairs @ (len(gains), 1), joined @ (len(gains), 1))
    pairs = pairs[np.asarray(counted)[pairs].all(axis=1) & bridged]
    return pairs, np.abs(gains[pairs[:, 0]] - gains[pairs[:, 1]]).max(axis=1, initial=0.0)


def _between_cells(
    grid: Grid, gains: FloatArray, cells: Cells, width: FloatArray
) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return nodes on the borders of cells with constant gains, and the steps there."""
    corners, constant = corners_of(grid), cells.mode == CONSTANT
    nodes, steps = [], []
    for low, high in edges(cell_shape(grid)).tolist():
        if not constant[low] and not constant[high]:
            continue
        for node in np.intersect1d(corners[low], corners[high]).tolist():
            sides = [cells.gains[c] / width if constant[c] else gains[node] for c in (low, high)]
            nodes.append((node, node))
            steps.append(np.abs(sides[0] - sides[1]).max())
    return np.array(nodes, dtype=np.intp).reshape(-1, 2), np.array(steps)
