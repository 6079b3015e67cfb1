"""`table`: designs gains over a grid of operating points and checks them between its nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from drillctrl.base.checkpoint import Checkpoint
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.workers import Progress, spread_out
from drillctrl.delay.structure import FeedbackStructure, no_control
from drillctrl.designs.drilling import Drilling
from drillctrl.drilling.structures import as_structure
from drillctrl.simulation.controller import Controller
from drillctrl.synthesis.objectives import EXACT, Exact, Objective
from drillctrl.tables.cells import cell_tasks, check_cells, joined
from drillctrl.tables.continuation import design_grid
from drillctrl.tables.gain_table import FALLBACKS, GainTable
from drillctrl.tables.grid import Grid
from drillctrl.tables.node import (
    NodeDesign,
    NodeTask,
    check_node,
    find_design,
    keep_design,
)
from drillctrl.tables.refinement import carried_over, refined_grid
from drillctrl.tables.smoothing import smooth_gains
from drillctrl.tables.tried_cells import try_cells

Task = TypeVar("Task")
Result = TypeVar("Result")


@checks_kinds
def table(
    grid: Grid,
    structure: str | FeedbackStructure = "case1",
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    objective: Objective = EXACT,
    give_up: float = 0.0,
    refine: int = 0,
    fallback: str = "off",
    seed: int = 0,
    trials: bool | None = True,
    surroundings: Mapping[str, float] | None = None,
    executor: Executor | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Progress | None = None,
) -> GainTable:
    """Design gains over a grid of operating points, and check them between the nodes.

    Parameters
    ----------
    grid : Grid
        From `dimensionless_grid` or `rig_grid`.
    structure : str or FeedbackStructure
        As for `design`.
    bounds : mapping, optional
        As for `design`.
    objective : Exact, Drilling, SemiDiscrete, WorstCase or Robust
        As for `design`. Nodes are stable or not by α whatever is minimised. With `Drilling` trial
        runs choose the gains at every node and try them in every cell, and the table vouches
        for what they recommend.
    give_up : float
        0: the lowest α found at each node. Up to 0.9: the smoothest table found that keeps
        α ≤ (1 − give_up) times the best at every node.
    refine : int
        How often the spacing is halved, at most, where cells are not vouched for although a
        node of theirs is stable; up to 6.
    fallback : {"off", "best"}
        What a node gets that nothing found stabilises: no control (fixed gains alone), or
        the best gains found. It is marked as not stable either way.
    seed : int
        Of the searches; the same seed gives the same table.
    trials : bool, optional
        Whether gains are tried on the nonlinear motion, as by `design`. A node whose gains
        are refused gets no control, whatever the fallback.
    surroundings : mapping, optional
        Limits, clock and delays of the controller in these runs, as by `design`.
    executor : concurrent.futures.Executor, optional
        Designs the nodes side by side; without it this process does, one after another. The
        table does not depend on it.
    checkpoint : Checkpoint, optional
        Finished designs are kept there, and those that it knows are not done again.
    progress : callable, optional
        Called with the name of a stage, tasks done and tasks to do.

    Raises
    ------
    InputError
        If an argument is out of range or the structure does not fit the plant.
    """
    chosen = as_structure(structure)
    chosen = chosen.with_bounds(bounds or {})
    share = checked_number("give_up", give_up, 0.0, 0.9)
    rounds = checked_integer("refine", refine, 0, 6)
    checked_integer("seed", seed, 0, 2**63 - 1)
    if share and not isinstance(objective, Exact):
        raise InputError("give_up", share, f"0 with objective {objective.name}")
    on_motion = isinstance(objective, Drilling)
    if on_motion and not trials:
        raise InputError("trials", False, f"true with objective {objective.name}")
    around: dict[str, Any] = dict(surroundings or {})
    Controller(chosen, *chosen.gains(chosen.lower), **around)
    if fallback not in FALLBACKS:
        raise InputError("fallback", fallback, f"one of {', '.join(FALLBACKS)}")

    def run(stage: str, work: Callable[[Task], Result], tasks: Sequence[Task]) -> Iterable[Result]:
        for done, result in enumerate(spread_out(executor, work, tasks), 1):
            if progress is not None:
                progress(stage, done, len(tasks))
            yield result

    def remembered(
        work: Callable[[NodeTask], NodeDesign], tasks: Sequence[NodeTask]
    ) -> Iterable[NodeDesign]:
        missing = {}
        for task in tasks:
            known = None if checkpoint is None else find_design(checkpoint, task)
            if known is not None:
                yield known
            else:
                missing[task.index] = task
        for design in run("design", work, list(missing.values())):
            if checkpoint is not None:
                keep_design(checkpoint, missing[design.index], design)
            yield design

    known: dict[int, NodeDesign] = {}
    for _ in range(rounds + 1):
        designs = design_grid(grid, chosen, seed, remembered, objective, known, around)
        best = np.array([design.spectral_abscissa for design in designs])
        gains = np.array([design.gains for design in designs]).reshape(len(designs), -1)
        with threadpool_limits(1, user_api="blas"):
            gains = smooth_gains(grid, chosen, gains, best, share)
        if fallback == "off" and not on_motion:
            gains = np.where((best < 0.0)[:, None], gains, no_control(chosen))
        tasks = [
            NodeTask(
                i,
                case,
                chosen,
                seed,
                (gains[i],),
                trials=bool(trials) and not on_motion,
                surroundings=around,
            )
            for i, case in enumerate(grid.cases)
        ]
        checks = sorted(run("check", check_node, tasks), key=lambda check: check.index)
        refusals = {each.index: each.refusal for each in designs if each.refusal}
        refusals |= {each.index: each.refusal for each in checks if each.refusal}
        gains[list(refusals)] = no_control(chosen)
        stable = np.array([check.stable for check in checks])
        kept = ~np.isin(np.arange(len(gains)), list(refusals))
        sound = kept if on_motion else stable & kept
        if on_motion:
            parts = run("cells", try_cells, cell_tasks(grid, chosen, gains, sound, around, 1))
        else:
            parts = run("cells", check_cells, cell_tasks(grid, chosen, gains, sound))
        cells = joined(parts)
        result = GainTable(
            grid,
            chosen,
            gains,
            np.array([check.spectral_abscissa for check in checks]),
            np.array([check.abscissa_error for check in checks]),
            stable,
            np.array([check.certified for check in checks]),
            best,
            share,
            fallback,
            seed,
            cells,
            repr(objective),
            bool(trials),
            refusals,
            {each.index: each.caution for each in checks if each.caution},
        )
        finer = refined_grid(grid, cells, sound)
        if finer == grid:
            break
        grid, known = finer, carried_over(designs, grid, finer)
    return result
