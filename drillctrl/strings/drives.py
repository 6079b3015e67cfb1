"""Drives of one string side by side: what each returns, stands and leaves in reserve."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.language import told_language
from drillctrl.base.tableio import csv_text
from drillctrl.drilling.rig import Rig
from drillctrl.strings.bit_load import BitLoad
from drillctrl.strings.drive_box import box_lines
from drillctrl.strings.drive_control import DriveControl, DriveMachine
from drillctrl.strings.drive_design import dynamic_drive_control
from drillctrl.strings.drive_measures import DriveMeasures, measure_drive
from drillctrl.strings.drive_observer import observer_drive_control
from drillctrl.strings.drive_rules import (
    RULES,
    first_frequency,
    pi_control,
    rule_control,
    soft_torque_control,
    z_torque_control,
)
from drillctrl.strings.drive_tuned import TUNED, tuned_on_load, tuned_over, tuned_z_torque
from drillctrl.strings.drives_words import comparison_summary
from drillctrl.strings.falling import FallingTorque
from drillctrl.strings.rig import StringRig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DYNAMIC = tuple(f"dynamic-{n}" for n in range(5))
_OBSERVERS = tuple(f"observer-{n}" for n in range(1, 4))
DRIVE_NAMES = (*RULES, TUNED, *_OBSERVERS, *_DYNAMIC)
# What can be tuned to what a bit does; the others have a rule of their own.
ON_LOAD = ("soft-torque", "z-torque", TUNED, *_DYNAMIC)
_MODES = 4


@dataclass(frozen=True, eq=False)
class DriveComparison:
    """Drives of one string side by side.

    Attributes
    ----------
    rig : StringRig
        The string and its drive.
    falling : FallingTorque
        What threshold speeds are for.
    drives : tuple of DriveMeasures
        In the order asked for.
    elapsed_seconds : float
        Wall time.
    """

    rig: StringRig
    falling: FallingTorque
    drives: tuple[DriveMeasures, ...]
    elapsed_seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        machine = self.rig.drive
        assert machine is not None
        return {
            "schema": "drillctrl/drives/1",
            "length": self.rig.string.length,
            "impedance": self.rig.string.torsion.wave_impedance,
            "top_drive": asdict(machine),
            "falling_torque": asdict(self.falling),
            "drives": [drive.to_dict() for drive in self.drives],
            "elapsed_seconds": self.elapsed_seconds,
        }

    def to_csv(self) -> str:
        """Return a row for each mode of each drive."""
        rows = [
            {
                "structure": drive.control.name,
                "stable": drive.stable,
                "recommended": drive.verdict.untried,
                "delay_margin": drive.delay_margin,
                **mode.to_dict(),
            }
            for drive in self.drives
            for mode in drive.modes
        ]
        return csv_text(list(rows[0]), ([str(v) for v in row.values()] for row in rows))

    def summary(self, units: str = "si") -> str:
        """Return a table for people, in the units of ``"si"`` or ``"field"``."""
        language = told_language(units)
        return comparison_summary(self.rig, self.falling, self.drives, language)

    def plot(self, name: str | None = None, units: str = "si") -> Figure:
        """Draw ``|r|``, impedance, and damping over frequency; see `plot_drives`.

        Parameters
        ----------
        name : str, optional
            Of the rig, for the title.
        units : {"si", "field"}
            Of its length there.
        """
        from drillctrl.strings.drives_figure import plot_drives

        curves = {
            drive.control.name: (drive.frequencies, drive.reflection, drive.impedance, drive.roots)
            for drive in self.drives
        }
        length = told_language(units).text("depth", self.rig.string.length, 6)
        length += " of string, free bit"
        title = length if name is None else f"{name}, {length}"
        return plot_drives(curves, self.rig.string.torsion.wave_impedance, title)


@checks_kinds
def drive_control(
    name: str,
    rig: StringRig,
    length_error: float = 0.2,
    bit: BitLoad | None = None,
    box: Mapping[str, float] | None = None,
) -> DriveControl:
    """Return the law of a name for the drive of a rig, designed if it is a dynamic one.

    Parameters
    ----------
    name : str
        A rule as of `rule_control`, ``"z-torque-tuned"``, ``"observer-1"`` to ``"observer-3"``,
        or ``"dynamic-0"`` to ``"dynamic-4"``.
    rig : StringRig
        With a top drive.
    length_error : float
        Share by which the string may be shorter and longer in the design of a dynamic law.
    bit : BitLoad, optional
        What the bit does where it drills: the laws of `ON_LOAD` are then those under which it
        swings least there.
    box : mapping, optional
        Relative errors of the string's ``stiffness``, ``inertia`` and ``damping``: these laws
        are then those whose smallest critical slope over its corners is largest.

    Raises
    ------
    InputError
        If there is no such law, or no top drive.
    """
    machine, line = machine_of(rig), rig.string.torsion
    others = [each for _, each in box_lines(line, box)] if box else []
    if name in _DYNAMIC:
        return dynamic_drive_control(line, machine, int(name[-1]), length_error, bit, others)
    if (bit is not None or others) and name in ON_LOAD:
        pipe, first = line.wave_impedance, first_frequency(rig.string)

        def law_at(times: float) -> DriveControl:
            if name == "soft-torque":
                return soft_torque_control(machine, pipe, first, times)
            return replace(z_torque_control(machine, pipe, times), name=name)

        if bit is not None:
            return tuned_on_load(line, bit, law_at)
        return tuned_over([line, *others], law_at)
    if name == TUNED:
        return tuned_z_torque(line, machine)
    if name in _OBSERVERS:
        return observer_drive_control(rig.string.torsion, machine, int(name[-1]))
    if name not in RULES:
        raise InputError("structure", name, f"one of {', '.join(DRIVE_NAMES)}")
    return rule_control(name, machine, rig.string)


def given_control(name: str, rig: StringRig, stiffness: float, damping: float) -> DriveControl:
    """Return a PI law by its gains on the top's angle and speed, both negative where they brake.

    Parameters
    ----------
    name : str
        Of a rule of PI control.
    rig : StringRig
        With a top drive.
    stiffness, damping : float
        −Ki, N m/rad, and −Kp, N m s/rad.

    Raises
    ------
    InputError
        If the law has other gains, or a value is out of range.
    """
    machine = machine_of(rig)
    if name not in RULES or name == "z-torque":
        raise InputError("K1", "given", f"left out: {name} has a rule of its own")
    for gain in (stiffness, damping):
        if gain > 0.0:
            raise InputError("K1", gain, "at most 0: it brakes a drive that is ahead")
    return pi_control(machine, -damping, -stiffness, name=name)


def machine_of(rig: Rig) -> DriveMachine:
    """Return the drive of a rig.

    Raises
    ------
    InputError
        If it has none.
    """
    if not isinstance(rig, StringRig):
        raise InputError("rig", "lumped to one mass each way", "a string with a [top_drive]")
    if rig.drive is None:
        raise InputError("rig", "speed imposed at the top", "a string with a [top_drive]")
    return rig.drive


@checks_kinds
def compare_drives(
    rig: Rig,
    structures: Sequence[str | DriveControl],
    falling: FallingTorque | None = None,
    modes: int = _MODES,
) -> DriveComparison:
    """Put drives of one string side by side.

    Parameters
    ----------
    rig : StringRig
        With a top drive.
    structures : sequence of str or DriveControl
        Names as of `drive_control`, or laws of your own.
    falling : FallingTorque, optional
        By which the bit's torque falls with its speed.
    modes : int
        How many modes of torsion.

    Raises
    ------
    InputError
        If the rig has no top drive, or there is no such structure.
    """
    began = time.perf_counter()
    machine_of(rig)
    assert isinstance(rig, StringRig)
    if not structures:
        raise InputError("structures", "none", "at least one")
    law = FallingTorque() if falling is None else falling
    controls = [drive_control(s, rig) if isinstance(s, str) else s for s in structures]
    measured = tuple(measure_drive(rig.string, control, law, modes) for control in controls)
    return DriveComparison(rig, law, measured, time.perf_counter() - began)
