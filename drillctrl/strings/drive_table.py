"""Laws of a top drive over depth: what to set as pipe is added, and what it stands in between."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.figure import BLUE, GREY, ORANGE, axis_name, new_figure
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.language import told_language
from drillctrl.base.tableio import csv_text
from drillctrl.base.text import finite_or_none, wrapped
from drillctrl.drilling.rig import Rig
from drillctrl.strings.changed import changed_rig
from drillctrl.strings.drive_laws import DriveLaws
from drillctrl.strings.drive_measures import DriveMeasures, measure_drive
from drillctrl.strings.drive_verdict import UNTRIED, DriveVerdict, drive_verdict
from drillctrl.strings.drives import drive_control, machine_of
from drillctrl.strings.drives_words import settings_text
from drillctrl.strings.falling import FallingTorque
from drillctrl.strings.line import Line
from drillctrl.strings.slopes import lowest_impedance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MODES, _MOST = 4, 200


@dataclass(frozen=True, eq=False)
class DriveTable:
    """The law of a drive at several depths.

    Attributes
    ----------
    rig : StringRig
        At the depth that it was given.
    structure : str
        As of `drive_control`.
    depths : tuple of float
        Lengths of the string, m, rising.
    drives : tuple of DriveMeasures
        One a depth.
    between : tuple of float
        Weakest slope halfway to the next depth, under the worse of the laws on both sides,
        N m s/rad; one less than depths. Laws are held to there.
    harm : str or None
        At which of these depths a law does harm, and what; None where none does.
    elapsed_seconds : float
        Wall time.
    """

    rig: Rig
    structure: str
    depths: tuple[float, ...]
    drives: tuple[DriveMeasures, ...]
    between: tuple[float, ...]
    harm: str | None
    elapsed_seconds: float

    @property
    def stable(self) -> bool:
        """Whether string and drive are, with a free bit, at and between all depths."""
        return all(drive.stable for drive in self.drives) and min(self.between, default=1.0) > 0.0

    @property
    def laws(self) -> DriveLaws:
        """The laws alone, as a map takes them."""
        controls = tuple(drive.control for drive in self.drives)
        return DriveLaws(self.structure, self.depths, controls)

    def _rows(self) -> list[dict[str, Any]]:
        rows = []
        for depth, drive, after in zip(
            self.depths, self.drives, (*self.between, None), strict=True
        ):
            weakest = drive.weakest
            rows.append(
                {
                    "depth": depth,
                    "stable": drive.stable,
                    "recommended": drive.verdict.untried,
                    "reason": drive.verdict.untried_reason(),
                    "smallest_critical_slope": drive.smallest_slope,
                    "weakest_slope": weakest and (weakest.slope if drive.stable else 0.0),
                    "weakest_frequency": weakest and weakest.frequency,
                    "weakest_slope_after": after,
                    "delay_margin": finite_or_none(drive.delay_margin),
                    "first_frequency": drive.modes[0].slope.mode_frequency,
                }
            )
        return rows

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        laws = [drive.control.to_dict() for drive in self.drives]
        return {
            "schema": "drillctrl/drive-table/1",
            "structure": self.structure,
            "top_drive": asdict(self.drives[0].control.machine),
            "stable": self.stable,
            "recommended": None if self.harm is None else False,
            "reason": self.harm or UNTRIED,
            "nodes": [{**row, "law": law} for row, law in zip(self._rows(), laws, strict=True)],
            "elapsed_seconds": self.elapsed_seconds,
        }

    def to_csv(self) -> str:
        """Return a row for each depth, coefficients of s in 1/s from the highest power on."""
        rows = self._rows()
        for row, drive in zip(rows, self.drives, strict=True):
            for side, law in drive.control.to_dict().items():
                for part, values in law.items():
                    row[f"{side}_{part}"] = " ".join(map(repr, values))
        return csv_text(list(rows[0]), (list(row.values()) for row in rows))

    def summary(self, units: str | None = None) -> str:
        """Return a table for people, in ``"si"`` or ``"field"`` units."""
        language = told_language(units)
        deep, slope = language.units["depth"], language.units["impedance"]
        per = slope.unit.removesuffix("/rad")
        holds = "Stable with a free bit" if self.stable else "NOT stable with a free bit"
        lines = [
            f"{holds}: top drive under {self.structure} over the depth of its string",
            f"depth, {deep.unit}  first mode, Hz  critical slope, {per}  "
            f"of all to 30 Hz  margin, ms",
        ]
        for row in self._rows():
            margin = row["delay_margin"]
            weakest = row["weakest_slope"]
            lines.append(
                f"{deep.per_si * row['depth']:8.6g}{row['first_frequency']:16.4f}"
                f"{slope.per_si * row['smallest_critical_slope']:{18 + len(per)}.4g}"
                f"{'any' if weakest is None else f'{slope.per_si * weakest:.4g}':>17}"
                f"{'none' if margin is None else f'{1e3 * margin:.3g}':>12}"
            )
        for depth, drive in self._laws():
            there = language.text("depth", depth, 6)
            lines.append(wrapped(f"{there}: {settings_text(drive.control, language)}", 2))
        if self.between:
            stood = f"{slope.per_si * min(self.between):.4g} {per}"
            lines.append(f"Held to the middle between depths, laws stand {stood} there")
        lines.append(
            wrapped(f"Refused: at {self.harm}." if self.harm else f"{UNTRIED.capitalize()}.")
        )
        return "\n".join(lines)

    def _laws(self) -> list[tuple[float, DriveMeasures]]:
        return list(zip(self.depths, self.drives, strict=True))

    def plot(self, units: str | None = None) -> Figure:
        """Draw what the laws stand over depth, in ``"si"`` or ``"field"`` units."""
        language = told_language(units)
        deep, slope = language.units["depth"], language.units["impedance"]
        depths = deep.per_si * np.array(self.depths)
        figure = new_figure(6.0, 4.0)
        ax = figure.subplots()
        rows = self._rows()
        ceiling = lowest_impedance(self.rig.string.torsion)  # type: ignore[attr-defined]
        four = slope.per_si * np.array([row["smallest_critical_slope"] for row in rows])
        weakest = [row["weakest_slope"] for row in rows]
        every = slope.per_si * np.array([ceiling if s is None else s for s in weakest])
        ax.plot(depths, four, "o-", color=BLUE, label="first four modes")
        ax.plot(depths, every, "s--", ms=4, color=ORANGE, label="all modes to 30 Hz")
        if self.between:
            between = slope.per_si * np.array(self.between)
            ax.plot(
                0.5 * (depths[1:] + depths[:-1]),
                between,
                "x",
                color=GREY,
                label="all modes, law held to there",
            )
        ax.set_xlabel(axis_name("length of the string", deep.unit))
        ax.set_ylabel(axis_name("critical slope", slope.unit))
        ax.set_ylim(bottom=0.0)
        ax.legend(fontsize=8)
        return figure


@checks_kinds
def drive_table(rig: Rig, structure: str, depths: Sequence[float]) -> DriveTable:
    """Tune or design the law of a top drive at several depths.

    Parameters
    ----------
    rig : StringRig
        With a top drive; its pipe is added or taken away at the top.
    structure : str
        As of `drive_control`.
    depths : sequence of float
        Lengths of the string, m, rising.

    Raises
    ------
    InputError
        If the rig has no top drive, there is no such structure, or a depth is out of range.
    """
    began = time.perf_counter()
    machine_of(rig)
    if not 1 <= len(depths) <= _MOST or any(b <= a for a, b in itertools.pairwise(depths)):
        raise InputError("depth", list(depths)[:4], f"one to {_MOST} values, rising")
    rigs = [changed_rig(rig, depth=depth) for depth in depths]
    falling = FallingTorque()
    controls = [drive_control(structure, each) for each in rigs]
    drives = tuple(
        measure_drive(each.string, control, falling, _MODES)
        for each, control in zip(rigs, controls, strict=True)
    )
    judged = [(depth, drive.verdict) for depth, drive in zip(depths, drives, strict=True)]
    between = []
    for i in range(len(rigs) - 1):
        middle = 0.5 * (depths[i] + depths[i + 1])
        line = changed_rig(rig, depth=middle).string.torsion
        laws = [drive_verdict(line, control) for control in controls[i : i + 2]]
        between.append(min(_stands(line, law) for law in laws))
        judged += [(middle, law) for law in laws]
    refused = (f"{depth:.6g} m {law.reason()}" for depth, law in judged if not law.recommended)
    harm = next(refused, None)
    elapsed = time.perf_counter() - began
    return DriveTable(rig, structure, tuple(depths), drives, tuple(between), harm, elapsed)


def _stands(line: Line, law: DriveVerdict) -> float:
    if not law.stable:
        return 0.0
    return lowest_impedance(line) if law.weakest is None else law.weakest.slope
