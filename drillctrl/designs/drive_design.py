"""`design_drive`: the law of a top drive, and what it does for a string and at a point."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.language import told_language
from drillctrl.base.text import wrapped
from drillctrl.designs.drilling import Drilling
from drillctrl.designs.drive_load import bit_load
from drillctrl.designs.drive_motion import DriveMotion, drive_motion
from drillctrl.designs.drive_trials import DriveTrials, best_tried, drive_trials, trials_text
from drillctrl.designs.result import Analysis, dominant_kind
from drillctrl.designs.words import vibration_text
from drillctrl.drilling.case import as_case
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.rig import Rig
from drillctrl.strings.drive_box import Corner, box_told, corners
from drillctrl.strings.drive_law import driven_plant
from drillctrl.strings.drive_measures import DriveMeasures
from drillctrl.strings.drive_tuned import TUNED
from drillctrl.strings.drive_verdict import UNTRIED
from drillctrl.strings.drives import (
    ON_LOAD,
    DriveComparison,
    compare_drives,
    drive_control,
    machine_of,
)
from drillctrl.strings.drives_words import refusal, setting_sentence
from drillctrl.strings.falling import FallingTorque
from drillctrl.strings.named_roots import NamedRoots, named_roots
from drillctrl.strings.rig import StringRig

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class DriveDesign:
    """A law of a top drive.

    Attributes
    ----------
    found : DriveComparison
        The law and what it is measured by, whatever the bit does.
    drilling : Analysis or None
        The linear motion at the point, the bit in the rock; None without a point.
    modes : NamedRoots or None
        Its roots by the modes of the string.
    asked : str
        The law that was asked for; that of ``drive`` where another does better in trial runs.
    trials : tuple of DriveTrials
        What trial runs showed of the laws of ``found``; empty where none were made.
    motion : DriveMotion or None
        What was measured of the motion that is drilled with; None where laws were designed for
        the string alone.
    elapsed_seconds : float
        Wall time.
    box : tuple of Corner
        What the law is worth at the corners of what is known of the string.
    """

    found: DriveComparison
    drilling: Analysis | None
    modes: NamedRoots | None
    asked: str
    trials: tuple[DriveTrials, ...]
    motion: DriveMotion | None
    elapsed_seconds: float
    box: tuple[Corner, ...] = ()

    @property
    def drive(self) -> DriveMeasures:
        """The law and what it is measured by."""
        return self.found.drives[0]

    @property
    def stable(self) -> bool:
        """Whether it is with a free bit, at the point if there is one and at all corners."""
        held = all(corner.stable for corner in self.box)
        return self.drive.stable and held and (self.drilling is None or self.drilling.stable)

    @property
    def recommended(self) -> bool | None:
        """Whether the law does no harm in trial runs; None where it was not tried.

        False too where it does its string harm, whatever the bit does.
        """
        verdict = self.drive.verdict
        return not self.trials[0].verdict.harm if self.trials else verdict.untried

    @property
    def reason(self) -> str:
        """One sentence why."""
        if self.trials:
            return self.trials[0].verdict.reason
        return self.drive.verdict.untried_reason()

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        whole = self.found.to_dict()
        fields = {
            "schema": "drillctrl/drive-design/1",
            **self.drive.to_dict(),
            **{name: whole[name] for name in ("length", "impedance", "top_drive")},
            "falling_torque": whole["falling_torque"],
        }
        # Of the drive, where the bit is free; ``drilling`` says so of the point.
        fields["pipe_impedance"] = whole["impedance"]
        fields["impedance"] = self.drive.to_dict()["impedance"]
        objective = "worst-case" if self.box else "critical-slope"
        objective = objective if self.motion is None else "drilling"
        drilling = None
        if self.drilling is not None:
            drilling = self.drilling.to_dict()
            if self.modes is not None:
                drilling |= self.modes.to_dict()
            drilling["structure"] = self.drive.control.name
        return {
            **fields,
            "stable_with_free_bit": self.drive.stable,
            "stable": self.stable,
            "recommended": self.recommended,
            "reason": self.reason,
            "asked": self.asked,
            "objective": objective,
            **({"box": [corner._asdict() for corner in self.box]} if self.box else {}),
            "on_motion": self.motion and self.motion.to_dict(),
            "trials": [each.to_dict() for each in self.trials],
            "drilling": drilling,
            "elapsed_seconds": self.elapsed_seconds,
        }

    def summary(self, units: str = "si") -> str:
        """Return a text for people, in the units of ``"si"`` or ``"field"``."""
        language = told_language(units)
        first = setting_sentence(self.drive.control, language)
        if not self.drive.verdict.recommended:
            first = refusal(self.drive, language)
        elif self.recommended is None:
            first += f" It was {UNTRIED}: runs need a speed and a feed."
        elif not self.recommended:
            first = f"Refused: {self.drive.control.name}, {self.reason}."
        elif self.asked != self.drive.control.name:
            first += f" In trial runs it did better than {self.asked}."
        # What a comparison advises may be another than what runs bore out.
        _, table = self.found.summary(units).split("\n\n", 1)
        lines = [wrapped(first), "", table]
        if self.box:
            lines += ["", wrapped(f"Over what is known of the string: {box_told(self.box)}.")]
        if self.drilling is not None:
            loop, kind = self.drilling.loop, dominant_kind(self.drilling)
            told = vibration_text(loop, self.found.rig.time_scale, kind)
            lines += ["", f"At the point: {told}"]
            if self.modes is not None:
                lines += [f"  {text}" for _, text in self.modes.lines]
        if self.trials and self.drilling is not None:
            lines += ["", trials_text(self.trials, self.drilling.case.place)]
        if self.motion is not None:
            lines += ["", self.motion.text(language)]
        return "\n".join(lines)

    def plot(self, name: str | None = None, units: str = "si") -> Figure:
        """Draw ``|r|``, impedance, and damping over frequency, under the name of the rig."""
        return self.found.plot(name, units)


@checks_kinds
def design_drive(
    where: RigPoint | Rig,
    structure: str,
    falling: FallingTorque | None = None,
    *,
    length_error: float = 0.2,
    objective: Drilling | None = None,
    trials: bool = False,
    workers: int = 1,
    keep: str | Path | None = None,
    box: Mapping[str, float] | None = None,
) -> DriveDesign:
    """Find the law of a top drive, by the rule of its name or by optimisation.

    Parameters
    ----------
    where : RigPoint or StringRig
        A string under a top drive, and where it drills if that is to be looked at.
    structure : str
        As of `drive_control`: ``"stiff"``, ``"soft-torque"``, ``"z-torque"`` … are tuned by
        rule; ``"dynamic-0"`` to ``"dynamic-4"`` are optimised.
    falling : FallingTorque, optional
        By which the bit's torque falls with its speed, for threshold speeds.
    length_error : float
        Share by which the string may be shorter and longer: what is optimised holds the
        smallest critical slope of all of these up.
    objective : Drilling, optional
        At a point, laws are those under which the bit swings least there: by what it answers and
        by how it shakes the string, measured in a minute or two; see `bit_load`.
    trials : bool
        At a point, whether laws are run from a small start and from kicks beside a stiff drive:
        the one asked for and, beside an optimised one, ``"z-torque"`` tuned and by its rule, and
        ``"soft-torque"`` by its own. The best of these is the answer.
    workers : int
        Processes that share the runs.
    keep : str or Path, optional
        A folder in which what was measured of the bit is kept, and looked for.
    box : mapping, optional
        Relative errors of the string's ``stiffness``, ``inertia`` and ``damping``, as of one
        fitted to a recording: laws are held against its corners, and those that have something
        to tune are tuned to them instead of to shorter and longer strings.

    Returns
    -------
    DriveDesign
        Stable or not: look at ``stable``.

    Raises
    ------
    InputError
        If the rig has no top drive, or there is no such structure.
    """
    began = time.perf_counter()
    rig = where.rig if isinstance(where, RigPoint) else where
    machine_of(rig)
    assert isinstance(rig, StringRig)
    bit = None
    if objective is not None:
        if not isinstance(where, RigPoint):
            raise InputError("objective", objective.name, "used at a point: speed and feed")
        if structure not in ON_LOAD:
            wanted = f"used with {', '.join(ON_LOAD)}: {structure} has nothing to tune"
            raise InputError("objective", objective.name, wanted)
        bit = bit_load(where, objective, workers=workers, keep=keep)
        if box:
            raise InputError("box", f"{len(box)} errors", f"left out with {objective.name}")
    laws = [drive_control(structure, rig, length_error, bit, box)]
    if trials and isinstance(where, RigPoint) and (bit or structure.startswith("dynamic-")):
        rules = [drive_control(name, rig, box=box) for name in ("z-torque", "soft-torque")]
        for law in (drive_control(TUNED, rig, length_error, bit, box), *rules):
            # What tuning leaves as it is by its rule need not be run twice.
            if all((law.speed, law.torque) != (known.speed, known.torque) for known in laws):
                name = f"{law.name} by rule" if law.name == structure else law.name
                laws.append(replace(law, name=name))
    found = compare_drives(rig, laws, falling)
    tried: tuple[DriveTrials, ...] = ()
    if trials and isinstance(where, RigPoint):
        tried = drive_trials(where, found.drives, workers)
        best = best_tried(tried)
        tried = (best, *(each for each in tried if each is not best))
        found = replace(found, drives=tuple(each.drive for each in tried))
    motion = None
    if bit is not None and isinstance(where, RigPoint):
        motion = drive_motion(where, bit, found.drives, tried[0] if tried else None)
    drilling = modes = None
    if isinstance(where, RigPoint):
        # Half of a second to load, and a law without a point has no use for it.
        from drillctrl.designs.design import analyze

        case = as_case(where, driven_plant(rig, found.drives[0].control))
        drilling = analyze(case)
        modes = named_roots(case, None, drilling.K1, drilling.K2)
    return DriveDesign(
        found, drilling, modes, structure, tried, motion, time.perf_counter() - began,
        corners(rig.string.torsion, box, found.drives[0].control) if box else (),
    )  # fmt: skip
