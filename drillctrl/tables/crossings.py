"""Gains of a table while speed, feed and rock change across a cell, tried by runs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.designs.trials import STARTS, Trial, trial_duration
from drillctrl.designs.verdict import FAILURES, judge
from drillctrl.drilling.case import Case
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import Figures, figures
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.simulation.starts import Start
from drillctrl.tables.cells import CellTask
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.interpolation import INTERPOLATED, Cells, cell_shape, to_coordinates
from drillctrl.tables.scheduling import scheduled

# Units of time: before speed and feed change, of their ramp, and from its end to the step of rock.
_BEFORE, _RAMP, _AFTER = 10.0, 40.0, 20.0
_CHANGES = Start("across", text="a ramp of speed and feed and a step of rock across the cell")
_RTOL, _STEPS = 1e-7, 400_000


def crosses(task: CellTask, cell: int) -> bool:
    """Whether gains that follow the point across a cell, there and back, do no harm.

    Speed and feed go from one corner to the opposite one on a ramp, then the rock changes in a
    step; gains and delays are looked up on the way as exported controllers do. Beside the same
    runs without control.

    Parameters
    ----------
    task : CellTask
        What the table holds.
    cell : int
        One of its cells.
    """
    return not any(
        judge([trial], False).harm or trial.controlled.outcome in FAILURES
        for trial in _trials(task, cell)
    )


def _trials(task: CellTask, cell: int) -> Iterator[Trial]:
    grid = task.grid
    shape = cell_shape(grid)
    origin = np.array([np.unravel_index(cell, shape)])
    # What hangs and what is of the bit stays: nothing changes it while drilling.
    moves = [i < 2 or name == "psi" for i, name in enumerate(grid.names)]
    moves = [move and size > 1 for move, size in zip(moves, grid.shape, strict=True)]
    ends = [
        to_coordinates(grid, origin, np.where(moves, share, 0.5)[None, :])[0]
        for share in (0.0, 1.0)
    ]
    if not any(moves):
        return
    count, width = math.prod(shape), task.gains.shape[1]
    nodes = len(task.gains)
    table = GainTable(
        grid, task.structure, task.gains, np.zeros(nodes), np.zeros(nodes), np.ones(nodes, bool),
        np.ones(nodes, bool), np.zeros(nodes), 0.0, "off", 0,
        Cells(np.full(count, INTERPOLATED), np.zeros(count), np.zeros((count, width))),
    )  # fmt: skip
    around: dict[str, Any] = dict(task.surroundings)
    for here, there in (ends, ends[::-1]):
        case, scenario, duration = _way(task, here, there)
        _, point = case.physics("a change")
        controller = scheduled(table, point, scenario, duration=duration, **around)
        mine = _run(case, controller, scenario, duration)
        yield Trial(_CHANGES, mine, _run(case, None, scenario, duration))


def _way(task: CellTask, here: FloatArray, there: FloatArray) -> tuple[Case, Scenario, float]:
    case = task.grid.case(*here.tolist())
    _, point = case.physics("a change")
    _, goal = task.grid.case(*there.tolist()).physics("a change")
    changes = [Change(_BEFORE, _RAMP, omega0=goal.omega0, penetration_rate=goal.penetration_rate)]
    if goal.psi != point.psi:
        changes.append(Change(_BEFORE + _RAMP + _AFTER, psi=goal.psi))
    scenario = STARTS[0].scenario(tuple(changes))
    return case, scenario, _BEFORE + _RAMP + _AFTER + trial_duration(goal)


def _run(case: Case, controller: Controller | None, scenario: Scenario, duration: float) -> Figures:
    return figures(
        simulate(
            case,
            controller,
            duration=duration,
            scenario=scenario,
            rtol=_RTOL,
            max_steps=_STEPS,
            backwards="stop",
        )
    )
