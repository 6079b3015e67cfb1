"""A rig at another depth or in another mud."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.bit_rock import BitRock
from drillctrl.drilling.case import Case, as_case
from drillctrl.drilling.plant import Plant, paper_plant
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.rig import Rig
from drillctrl.strings.at_bit import string_at_bit, turns_freely
from drillctrl.strings.drill_string import DEEPEST, HEAVIEST_MUD, DrillString
from drillctrl.strings.drive_law import driven_plant
from drillctrl.strings.model import PipeString
from drillctrl.strings.rig import StringRig, lumped_values

CHANGES = ("depth", "mud")


def string_of(rig: Rig | None) -> DrillString:
    """Return the string of a rig.

    Raises
    ------
    InputError
        If it has none.
    """
    if not isinstance(rig, StringRig):
        shown = "no rig" if rig is None else "lumped to one mass each way"
        raise InputError("rig", shown, "a string of sections: only that has a depth and mud")
    return rig.string


def permitted_range(string: DrillString, name: str) -> tuple[float, float]:
    """Return between what the depth, m, or the mud's density, kg/m³, of a string may be."""
    return (string.shallowest, DEEPEST) if name == "depth" else (0.0, HEAVIEST_MUD)


@checks_kinds
def changed_rig(rig: Rig, depth: float | None = None, mud: float | None = None) -> StringRig:
    """Return a rig that has drilled to another depth, or with another mud.

    Parameters
    ----------
    rig : StringRig
        The rig.
    depth : float, optional
        Length of the string, m: pipe is added or taken away at its top.
    mud : float, optional
        Density, kg/m³. It bears on the weight of the string alone.

    Raises
    ------
    InputError
        If the rig has no string, or a value is out of range.
    """
    string = _at(string_of(rig), depth, mud)
    assert isinstance(rig, StringRig)
    values: dict[str, Any] = {**lumped_values(string)}
    return replace(rig, string=string, **values)


def changed_case(case: Case, point: RigPoint) -> Case:
    """Return a case at a point of a rig that was changed: the bit's law and the drive's stay.

    Raises
    ------
    InputError
        If the plant is not that of a rig, under a law or not.
    """
    plant, _ = case.physics("another string")
    return as_case(point, changed_plant(plant, point.rig))


def _at(string: DrillString, depth: float | None, mud: float | None) -> DrillString:
    if depth is not None:
        string = string.at_depth(depth)
    if mud is not None:
        checked_number("mud", mud, *permitted_range(string, "mud"))
        string = replace(string, mud_density=mud)
    return string


def restrung(plant: Plant, depth: float | None = None, mud: float | None = None) -> Plant:
    """Return a plant that hangs on its string at another depth, or in another mud.

    Its units stay those of the string as it was, so that the numbers of points, gains and drives
    mean the same.

    Parameters
    ----------
    plant : Plant
        Whose string is one of pipe.
    depth, mud : float, optional
        As of `changed_rig`.

    Raises
    ------
    InputError
        If the plant has no such string, or a value is out of range.
    """
    hung = plant.string
    if not isinstance(hung, PipeString):
        wanted = "a string of sections: only that has a depth and mud"
        raise InputError("string", type(hung).__name__, wanted)
    string = _at(hung.string, depth, mud)
    if string == hung.string:
        return plant
    usual = hung.frequencies == PipeString(hung.string).frequencies
    torsional, axial = (None, None) if usual else hung.frequencies
    other = PipeString(string, torsional, axial, hung.tolerance, hung.units)
    return replace(plant, string=other)


def changed_plant(plant: Plant, rig: Rig) -> Plant:
    """Return the plant of a rig that was changed, with the laws of bit and drive of a plant."""
    assert isinstance(rig, StringRig)
    if isinstance(plant.string, PipeString) and turns_freely(plant):
        return paper_plant(plant.bit, **rig.hardware())
    known = string_at_bit(plant)
    if known is None:
        raise InputError("plant", "with parts of your own", "that of a rig's string")
    bit: BitRock = plant.bit
    if known.control is not None:
        return driven_plant(rig, known.control, bit)
    return paper_plant(bit, **rig.hardware())
