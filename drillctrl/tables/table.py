"""`table`: gains over a grid of operating points, and the result that holds them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from drillctrl.base.arrays import FloatArray
from drillctrl.base.checkpoint import Checkpoint
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.workers import Progress, spread_out
from drillctrl.delay.structure import FeedbackStructure, no_control
from drillctrl.designs.drilling import Drilling
from drillctrl.drilling.structures import as_structure
from drillctrl.simulation.controller import Controller
from drillctrl.synthesis.objectives import EXACT, Exact, Objective
from drillctrl.tables.cells import cell_tasks, check_cells, joined
from drillctrl.tables.continuation import design_grid
from drillctrl.tables.grid import Grid
from drillctrl.tables.interpolation import CELL_NAMES, UNSAFE, BoolArray, Cells, interpolated, place
from drillctrl.tables.node import (
    NodeDesign,
    NodeTask,
    check_node,
    find_design,
    keep_design,
)
from drillctrl.tables.refinement import carried_over, refined_grid
from drillctrl.tables.smoothing import largest_jump, smooth_gains
from drillctrl.tables.tried_cells import try_cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FALLBACKS = ("off", "best")
# Refused nodes of which a summary tells the reason.
_SHOWN = 3
ABSCISSA_ERROR = "spectral_abscissa_error"
Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class GainTable:
    """Gains at the nodes of a grid, and what is known at and between them.

    Attributes
    ----------
    grid : Grid
        Operating points; nodes are flattened with the last axis fastest.
    structure : FeedbackStructure
        What is fed back, and within what bounds.
    gains : array, (q, k)
        Gain vector at each node; u = K1 Y(t) + K2 Y(t − τ0) is added to θ''.
    spectral_abscissa : array, (q,)
        α with these gains, per unit of dimensionless time.
    abscissa_error : array, (q,)
        How far α may be off, as in `analyze`: more than rounding where roots are multiple.
    stable, certified : bool array, (q,)
        Whether the loop is stable, and whether the count of its roots agrees.
    best_abscissa : array, (q,)
        The lowest α found at the node.
    give_up : float
        Share of the best decay rate that was given up for smoothness, 0 for none.
    fallback : {"off", "best"}
        What stands where nothing found stabilises: no control, or the best gains found.
    seed : int
        Of the searches.
    cells : Cells
        What is known between the nodes.
    objective : str
        What was minimised at each node.
    tried : bool
        Whether the gains were tried on the nonlinear motion.
    refusals : mapping of int to str
        For nodes whose gains the trials refused, why. No control stands there instead, and
        the table vouches for no cell beside them.
    """

    grid: Grid
    structure: FeedbackStructure
    gains: FloatArray
    spectral_abscissa: FloatArray
    abscissa_error: FloatArray
    stable: BoolArray
    certified: BoolArray
    best_abscissa: FloatArray
    give_up: float
    fallback: str
    seed: int
    cells: Cells
    objective: str = repr(EXACT)
    tried: bool = False
    refusals: Mapping[int, str] = field(default_factory=dict)

    @property
    def on_motion(self) -> bool:
        """Whether gains were designed on the motion that is drilled with."""
        return self.objective.startswith(f"{Drilling.__name__}(")

    @property
    def refused(self) -> BoolArray:
        """Nodes whose gains the trials refused, (q,)."""
        return np.isin(np.arange(len(self.gains)), list(self.refusals))

    @property
    def sound(self) -> BoolArray:
        """Nodes that the table vouches for, (q,).

        They are stable with gains that were not refused; on the motion that is drilled with
        their gains are recommended, whether smooth drilling is stable or not.
        """
        return np.asarray(~self.refused if self.on_motion else self.stable & ~self.refused)

    @property
    def entries(self) -> FloatArray:
        """All entries of K1, then K2, row by row, at each node, (q, 2 m p)."""
        return self.entries_of(self.gains)

    def entries_of(self, vectors: FloatArray) -> FloatArray:
        """Return all entries of K1, then K2, of gain vectors, (q, k) → (q, 2 m p)."""
        return np.asarray(self.structure.fixed + vectors @ self.structure.spread.T)

    @property
    def jump(self) -> tuple[float, tuple[int, int] | None]:
        """Largest change between neighbouring stable nodes or cells; see `largest_jump`."""
        return largest_jump(self.grid, self.structure, self.gains, self.sound, self.cells)

    def gains_at(
        self, omega0: npt.ArrayLike, delta0: npt.ArrayLike, psi: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return interpolated gains, clamped at the edges of the grid.

        Parameters
        ----------
        omega0, delta0, psi : array_like, (q,)
            Dimensionless groups, or what stands for ψ among the grid's names; numbers are
            repeated.

        Returns
        -------
        K1, K2 : array, (q, m, p)
        """
        where = place(self.grid, self.grid.locate(omega0, delta0, psi))
        flat = self.entries_of(interpolated(where, self.gains, self.cells))
        half = flat.shape[1] // 2
        shape = (len(flat), *self.structure.K1_lower.shape)
        return flat[:, :half].reshape(shape), flat[:, half:].reshape(shape)

    def stable_at(
        self, omega0: npt.ArrayLike, delta0: npt.ArrayLike, psi: npt.ArrayLike
    ) -> BoolArray:
        """Whether the table vouches for points: inside the grid, in cells that passed, (q,)."""
        where = place(self.grid, self.grid.locate(omega0, delta0, psi))
        return np.asarray(where.inside & (self.cells.mode[where.cell] != UNSAFE))

    @property
    def worst_abscissa(self) -> float | None:
        """Largest α found in the cells that the table vouches for; None if there are none."""
        vouched = self.cells.mode != UNSAFE
        return float(self.cells.spectral_abscissa[vouched].max()) if vouched.any() else None

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        jump, between = self.jump
        return {
            "schema": "drillctrl/table/1",
            "structure": self.structure.name,
            "shape": list(self.grid.shape),
            "axes": {axis.name: list(axis.values) for axis in self.grid.axes},
            "nodes": len(self.gains),
            "stable_nodes": int(self.stable.sum()),
            "certified_nodes": int(self.certified.sum()),
            "fallback": self.fallback,
            "tried": self.tried,
            "refused_nodes": len(self.refusals),
            "give_up": self.give_up,
            "largest_jump": jump,
            "largest_jump_between": None
            if between is None
            else [self.grid.coordinates[i].tolist() for i in between],
            "cells": {
                name: int((self.cells.mode == mode).sum()) for mode, name in enumerate(CELL_NAMES)
            },
            "worst_abscissa": self.worst_abscissa,
            "rows": [
                {**dict(zip(self.columns, row, strict=True)), "reason": self.refusals.get(i)}
                for i, row in enumerate(self.rows())
            ],
        }

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the first columns of a row, the same in every file."""
        names = (*self.grid.names, *self.structure.entry_names)
        known = ("spectral_abscissa", "stable", "certified", "best_abscissa", ABSCISSA_ERROR)
        return (*names, *known, "refused")

    def rows(self) -> list[list[float | bool]]:
        """Return one row a node in the order of `columns`."""
        return [
            [*groups, *gains, *rest]
            for groups, gains, *rest in zip(
                self.grid.groups(self.grid.coordinates).tolist(),
                self.entries.tolist(),
                self.spectral_abscissa.tolist(),
                self.stable.tolist(),
                self.certified.tolist(),
                self.best_abscissa.tolist(),
                self.abscissa_error.tolist(),
                self.refused.tolist(),
                strict=True,
            )
        ]

    def summary(self) -> str:
        """Return a text for people."""
        jump, between = self.jump
        axes = [
            axis.text(axis.values[0], axis.values[-1])
            + (f" ({len(axis.values)})" if len(axis.values) > 1 else "")
            for axis in self.grid.axes
        ]
        lost = "lowest α at each node"
        if self.objective != repr(EXACT):
            lost = f"{self.objective} at each node"
        if self.give_up:
            lost = f"smoothest found with at most {100 * self.give_up:g} % of the decay given up"
        if self.on_motion:
            lost = "torsional swings on the motion that is drilled with decay soonest"
        lines = [
            f"Gain table, structure {self.structure.name}, {len(self.gains)} nodes",
            f"  {', '.join(axes)}",
            f"  Choice        {lost}",
            f"  Nodes         {int(self.stable.sum())} stable, "
            f"{int(self.certified.sum())} with the root count agreeing",
        ]
        unstable = int((~self.stable & ~self.refused).sum())
        if self.on_motion:
            lines.append(f"                {unstable} unstable in smooth drilling, recommended")
        elif unstable:
            stated = "control off" if self.fallback == "off" else "the best gains found, unstable"
            lines.append(f"                {unstable} that nothing found stabilises: {stated}")
        lines += self._trial_lines()
        if self.sound.any():
            alpha = self.spectral_abscissa[self.sound]
            which = "of smooth drilling" if self.on_motion else "where stable"
            lines.append(f"  α             {alpha.min():.4g} … {alpha.max():.4g} {which}")
        if between is not None:
            ends = self.grid.coordinates[list(between)].T.tolist()
            where = [
                axis.text(*pair)
                for axis, pair in zip(self.grid.axes, ends, strict=True)
                if len(axis.values) > 1
            ]
            lines.append(
                f"  Largest jump  {100 * jump:.1f} % of a gain's range, {', '.join(where)}"
            )
        counts = [
            f"{int((self.cells.mode == mode).sum())} {name}" for mode, name in enumerate(CELL_NAMES)
        ]
        lines.append(f"  Cells         {', '.join(counts)} (searched, not proved)")
        if self.on_motion:
            passed = int((self.cells.mode != UNSAFE).sum())
            lines[-1] = (
                f"  Cells         {passed} of {self.cells.mode.size} pass trial runs in the middle"
            )
        elif self.worst_abscissa is not None:
            worst = f"{self.worst_abscissa:.4g}"
            lines.append(f"                worst α found where vouched for: {worst}")
        return "\n".join(lines)

    def _trial_lines(self) -> list[str]:
        """Say what trial runs showed, and why gains were refused."""
        if not self.tried:
            return ["                gains not tried on the nonlinear motion"]
        if not self.refusals:
            return ["                no gains refused by trial runs on the nonlinear motion"]
        word = "not recommended" if self.on_motion else "REFUSED"
        lines = [f"                {len(self.refusals)} {word} by trial runs: control off"]
        for node, reason in list(self.refusals.items())[:_SHOWN]:
            place = zip(self.grid.axes, self.grid.coordinates[node].tolist(), strict=True)
            where = ", ".join(a.text(value) for a, value in place if len(a.values) > 1)
            lines.append(f"                  {where or 'here'}: {reason}")
        hidden = len(self.refusals) - _SHOWN
        return [*lines, f"                  and {hidden} more"] if hidden > 0 else lines

    def plot(self) -> Figure:
        """Draw gains and α over the grid; see `drillctrl.tables.figure.plot_table`."""
        from drillctrl.tables.figure import Drawn, plot_table

        return plot_table(
            Drawn(
                self.grid,
                self.structure,
                self.entries,
                self.spectral_abscissa,
                self.sound,
                self.cells,
                self.entries_of(self.cells.gains),
            )
        )

    def __repr__(self) -> str:
        size = " × ".join(str(n) for n in self.grid.shape)
        return f"<GainTable {self.structure.name}: {size} nodes, {int(self.stable.sum())} stable>"


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
        )
        finer = refined_grid(grid, cells, sound)
        if finer == grid:
            break
        grid, known = finer, carried_over(designs, grid, finer)
    return result
