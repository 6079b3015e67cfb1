"""Gains over a grid of operating points, and what is known at and between its nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.language import Language, told_language
from drillctrl.base.text import wrapped
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.drilling import Drilling
from drillctrl.drilling.gain_units import rig_gain_units
from drillctrl.synthesis.objectives import EXACT
from drillctrl.tables.grid import Grid
from drillctrl.tables.interpolation import CELL_NAMES, UNSAFE, BoolArray, Cells, interpolated, place
from drillctrl.tables.smoothing import largest_jump

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FALLBACKS = ("off", "best")
# Refused nodes of which a summary tells the reason.
_SHOWN = 3
ABSCISSA_ERROR = "spectral_abscissa_error"


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
    cautions : mapping of int to str
        For nodes whose gains do worse than no control with a bit that stands at first, from rest
        or out of a stick, in what: control is to be switched on once the bit turns.
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
    cautions: Mapping[int, str] = field(default_factory=dict)

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

    def gains_at(self, *groups: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return interpolated gains, clamped at the edges of the grid.

        Parameters
        ----------
        *groups : array_like, (q,)
            ω0, δ0 and ψ, or whatever the grid's names are; numbers are repeated.

        Returns
        -------
        K1, K2 : array, (q, m, p)
        """
        where = place(self.grid, self.grid.locate(*groups))
        flat = self.entries_of(interpolated(where, self.gains, self.cells))
        half = flat.shape[1] // 2
        shape = (len(flat), *self.structure.K1_lower.shape)
        return flat[:, :half].reshape(shape), flat[:, half:].reshape(shape)

    def stable_at(self, *groups: npt.ArrayLike) -> BoolArray:
        """Whether the table vouches for points: inside the grid, in cells that passed, (q,)."""
        where = place(self.grid, self.grid.locate(*groups))
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
            "cautioned_nodes": len(self.cautions),
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
                {
                    **dict(zip(self.columns, row, strict=True)),
                    "reason": self.refusals.get(i),
                    "caution": self.cautions.get(i),
                }
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

    def summary(self, units: str | None = None) -> str:
        """Return a text for people, of a rig in ``"si"`` or ``"field"`` units."""
        language, rig = told_language(units), self.grid.rig
        jump, between = self.jump
        axes = [
            axis.text(axis.values[0], axis.values[-1], language=language)
            + (f" ({len(axis.values)})" if len(axis.values) > 1 else "")
            for axis in self.grid.axes
        ]
        lost = f"{'fastest decay' if rig else 'lowest α'} at each node"
        if self.objective != repr(EXACT):
            lost = f"{self.objective} at each node"
        if self.give_up:
            lost = f"smoothest found with at most {100 * self.give_up:g} % of the decay given up"
        if self.on_motion:
            lost = "torsional swings on the motion that is drilled with decay soonest"
        lines = [
            f"Gain table, structure {self.structure.name}, {len(self.gains)} nodes: "
            f"{int(self.sound.sum())} of them to be used",
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
        lines += self._trial_lines(language)
        if self.sound.any():
            alpha = self.spectral_abscissa[self.sound]
            which = "of smooth drilling" if self.on_motion else "where stable"
            told = f"α             {alpha.min():.4g} … {alpha.max():.4g}"
            if rig is not None:
                low, high = alpha.min() / rig.time_scale, alpha.max() / rig.time_scale
                told = f"Growth        {low:.4g} … {high:.4g} 1/s"
            lines.append(f"  {told} {which}")
        if between is not None:
            ends = self.grid.coordinates[list(between)].T.tolist()
            where = [
                axis.text(*pair, language=language)
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
            worst = f"worst α found where vouched for: {self.worst_abscissa:.4g}"
            if rig is not None:
                growth = self.worst_abscissa / rig.time_scale
                worst = f"slowest decay found in cells that passed: {-growth:.4g} 1/s"
            lines.append(f"                {worst}")
        return "\n".join(wrapped(line, 16) for line in lines)

    def _trial_lines(self, language: Language) -> list[str]:
        """Say what trial runs showed, and why gains were refused."""
        if not self.tried:
            return ["                gains not tried on the nonlinear motion"]
        word = "not recommended" if self.on_motion else "REFUSED"
        lines = self._told(f"{word} by trial runs: control off", self.refusals, language)
        lines = lines or ["                no gains refused by trial runs on the nonlinear motion"]
        # One is enough: they say the same of much of a table.
        text = "to be switched on once the bit turns, such as"
        return lines + self._told(text, self.cautions, language, 1)

    def _told(
        self, what: str, reasons: Mapping[int, str], language: Language, most: int = _SHOWN
    ) -> list[str]:
        """Return how many nodes, and the first reasons with their places; nothing without any."""
        if not reasons:
            return []
        lines = [f"                {len(reasons)} {what}"]
        for node, reason in list(reasons.items())[:most]:
            place = zip(self.grid.axes, self.grid.coordinates[node].tolist(), strict=True)
            where = ", ".join(
                a.text(value, language=language) for a, value in place if len(a.values) > 1
            )
            lines.append(f"                  {where or 'here'}: {reason}")
        hidden = len(reasons) - most
        return [*lines, f"                  and {hidden} more"] if hidden > 0 else lines

    def plot(self, units: str | None = None) -> Figure:
        """Draw gains and α over the grid, of a rig in units; see `plot_table`."""
        from drillctrl.tables.figure import Drawn, plot_table

        language, rig = told_language(units), self.grid.rig
        scales = rig_gain_units(self.structure, self.grid.plant, rig) or ()
        told = [(value, language.gain(unit.replace("*", "·"))) for value, unit in scales]
        factors = np.array([value * gain.per_si for value, gain in told] or [1.0])
        return plot_table(
            Drawn(
                self.grid,
                self.structure,
                factors * self.entries,
                self.spectral_abscissa / (1.0 if rig is None else rig.time_scale),
                self.sound,
                self.cells,
                factors * self.entries_of(self.cells.gains),
                tuple(gain.unit for _, gain in told),
                language,
            )
        )

    def __repr__(self) -> str:
        size = " × ".join(str(n) for n in self.grid.shape)
        return f"<GainTable {self.structure.name}: {size} nodes, {int(self.stable.sum())} stable>"
