"""Drill strings and rigs by name."""

from __future__ import annotations

from typing import Any

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.strings.catalogue import INCH, pipe
from drillctrl.strings.drill_string import Damping, DrillString
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.rig import StringRig, string_rig
from drillctrl.strings.section import Material, Section

PRESETS = ("paper-string", "vertical-3000", "deep-5000")

_ROCK: dict[str, Any] = {
    "rock_strength": 60e6,
    "contact_strength": 60e6,
    "wearflat_length": 1.2e-3,
    "cutter_inclination": 0.6,
    "friction_coefficient": 0.6,
    "bit_geometry": 1.0,
}


@checks_kinds
def string_preset(name: str) -> StringRig:
    """Return a rig with a real string by name, one of `PRESETS`."""
    makers = dict(zip(PRESETS, (paper_string, vertical_3000, deep_5000), strict=True))
    if name not in makers:
        raise InputError("name", name, f"one of {', '.join(PRESETS)}")
    return makers[name]()


def paper_string() -> StringRig:
    """Return 1000 m of pipe above 200 m of collars, the string behind Table 1.

    Lumped to one degree of freedom each way it is Table 1, damping included.
    """
    steel = Material(8000.0, 200e9, 77e9)
    pipes = Section("pipe", "pipe", 1000.0, 0.127, 0.108, material=steel)
    collars = Section("collars", "collar", 200.0, 0.1524, 0.0572, material=steel)
    # The pipe's own retardation takes its part of the damping of Table 1.
    own = Damping().retardation
    damping = Damping(
        torsional=32.9 / 116.0 - own * 938.0 / 116.0,
        axial=1.56e4 / 3.4e4 - own * 7.0e5 / 3.4e4,
        retardation=own,
    )
    return string_rig(DrillString((pipes, collars), damping), bit_radius=0.108, blades=4, **_ROCK)


def vertical_3000() -> StringRig:
    """Return 3000 m in a 12 1/4 in hole: 5 in pipe, heavy-weight, 8 in collars, a top drive.

    The drive has 2900 kg m² at the string, usual for electric top drives; mud of 10 ppg.
    """
    sections = (
        _joints("drill pipe", '5" 19.5#', 284),
        _joints("heavy-weight", '5" HWDP', 14),
        Section("collars", "collar", 139.2, 8.0 * INCH, 2.8125 * INCH),
    )
    string = DrillString(sections, mud_density=1198.0)
    return string_rig(
        string, drive=DriveMachine(2900.0), bit_radius=0.5 * 12.25 * INCH, blades=6, **_ROCK
    )


def deep_5000() -> StringRig:
    """Return 5000 m in an 8 1/2 in hole: 5 1/2 in pipe, heavy-weight, 6 3/4 in collars."""
    sections = (
        _joints("drill pipe", '5 1/2" 21.9#', 496),
        _joints("heavy-weight", '5" HWDP', 15),
        Section("collars", "collar", 94.4, 6.75 * INCH, 2.8125 * INCH),
    )
    string = DrillString(sections, mud_density=1438.0)
    return string_rig(
        string, drive=DriveMachine(2900.0), bit_radius=0.5 * 8.5 * INCH, blades=5, **_ROCK
    )


def _joints(name: str, kind: str, count: int) -> Section:
    bought = pipe(kind)
    return Section(
        name,
        bought.kind,
        count * bought.joint_length,
        bought.outer_diameter,
        bought.inner_diameter,
        bought.tool_joint,
        count,
    )
