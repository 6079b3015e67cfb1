"""`design_drive`: the law of a top drive, and what it does for a string and at a point."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from drillctrl.base.kinds import checks_kinds
from drillctrl.base.language import told_language
from drillctrl.base.text import wrapped
from drillctrl.drilling.case import as_case
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.rig import Rig
from drillctrl.strings.drive_law import driven_plant
from drillctrl.strings.drive_measures import DriveMeasures
from drillctrl.strings.drives import DriveComparison, compare_drives, drive_control, machine_of
from drillctrl.strings.drives_words import law_text, refusal, setting_sentence
from drillctrl.strings.falling import FallingTorque
from drillctrl.strings.named_roots import NamedRoots, named_roots
from drillctrl.strings.rig import StringRig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from drillctrl.designs.result import Analysis


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
    elapsed_seconds : float
        Wall time.
    """

    found: DriveComparison
    drilling: Analysis | None
    modes: NamedRoots | None
    elapsed_seconds: float

    @property
    def drive(self) -> DriveMeasures:
        """The law and what it is measured by."""
        return self.found.drives[0]

    @property
    def stable(self) -> bool:
        """Whether it is stable with a free bit, and at the point if there is one."""
        return self.drive.stable and (self.drilling is None or self.drilling.stable)

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
            "drilling": drilling,
            "elapsed_seconds": self.elapsed_seconds,
        }

    def summary(self, units: str = "si") -> str:
        """Return a text for people, in the units of ``"si"`` or ``"field"``."""
        language = told_language(units)
        good = self.drive.verdict.recommended
        first = setting_sentence(self.drive.control, language)
        lines = [
            wrapped(first if good else refusal(self.drive, language)),
            wrapped(f"Law in SI units: {law_text(self.drive.control)}"),
            "",
            self.found.summary(units),
        ]
        if self.drilling is not None:
            said = self.drilling
            lines += ["", f"At the point: {self._outcome(said)}"]
            if self.modes is not None:
                lines += [f"  {text}" for _, text in self.modes.lines]
        return "\n".join(lines)

    def _outcome(self, said: Analysis) -> str:
        """Return what becomes of vibration, and of which, with the frequency in Hz."""
        rig = said.case.rig
        assert rig is not None
        hertz = abs(said.loop.dominant_roots[0].value.imag) / (2.0 * math.pi * rig.time_scale)
        rate = said.spectral_abscissa / rig.time_scale
        if said.stable:
            return f"all vibration dies away, {hertz:.3g} Hz slowest, by {-rate:.3g} 1/s"
        return f"vibration GROWS, {hertz:.3g} Hz fastest, by {rate:.3g} 1/s"

    def plot(self, name: str | None = None) -> Figure:
        """Draw ``|r|``, impedance, and damping over frequency, under the name of the rig."""
        return self.found.plot(name)


@checks_kinds
def design_drive(
    where: RigPoint | Rig,
    structure: str,
    falling: FallingTorque | None = None,
    *,
    length_error: float = 0.2,
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
    found = compare_drives(rig, [drive_control(structure, rig, length_error)], falling)
    drilling = modes = None
    if isinstance(where, RigPoint):
        # Half of a second to load, and a law without a point has no use for it.
        from drillctrl.designs.design import analyze

        case = as_case(where, driven_plant(rig, found.drives[0].control))
        drilling = analyze(case)
        modes = named_roots(case, None, drilling.K1, drilling.K2)
    return DriveDesign(found, drilling, modes, time.perf_counter() - began)
