"""Write rigs to files that `load_rig` reads back without loss."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import tomli_w

from drillctrl.base import units
from drillctrl.base.files import write_text
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.units import Dimension
from drillctrl.drilling.rig import Rig, rig_mapping
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.files import PARTS
from drillctrl.strings.rig import StringRig
from drillctrl.strings.section import Section
from drillctrl.strings.tally import COLUMNS

# As people write them, where nothing is lost by it.
_SPELT = {
    units.LENGTH: ("m", "mm", "in"),
    units.STRESS: ("MPa", "GPa"),
    units.TIME: ("s", "ms"),
    units.TORQUE: ("kN*m",),
    units.INERTIA: ("kg*m^2",),
    units.DENSITY: ("kg/m^3",),
    units.LINEAR_DENSITY: ("kg/m", "lb/ft"),
    units.STIFFNESS: ("kN/m",),
    units.RATE: ("1/s",),
}


@checks_kinds
def save_rig(rig: Rig, path: str | Path) -> None:
    """Write a rig to a TOML file that `load_rig` reads back without loss.

    Parameters
    ----------
    rig : Rig
        Of lumped numbers, or with a string.
    path : str or Path
        Of the file.

    Raises
    ------
    OSError
        If the file cannot be written; an existing file is then left as it was.
    """
    data = _string_rig(rig) if isinstance(rig, StringRig) else rig_mapping(rig)
    write_text(path, tomli_w.dumps(data))


def _string_rig(rig: StringRig) -> dict[str, Any]:
    string = rig.string
    damping = string.damping
    values: dict[str, dict[str, Any]] = {
        "bit": {
            "diameter": 2.0 * rig.bit_radius,
            "blades": rig.blades,
            "wearflat_length": rig.wearflat_length,
            "cutter_inclination": rig.cutter_inclination,
            "friction_coefficient": rig.friction_coefficient,
            "geometry": rig.bit_geometry,
        },
        "rock": {"strength": rig.rock_strength, "contact_strength": rig.contact_strength},
        "top_drive": _drive(rig.drive),
        "damping": {
            "torsional": damping.torsional,
            "axial": damping.axial,
            "kelvin_voigt": damping.retardation,
        },
        "mud": {"density": string.mud_density} if string.mud_density else {},
        "hoisting": _hoisting(rig),
    }
    parts = {name: _texts(part, PARTS[name]) for name, part in values.items() if part}
    return {**parts, "sections": [section_texts(one) for one in string.sections]}


def _drive(machine: DriveMachine | None) -> dict[str, Any]:
    if machine is None:
        return {}
    values = {name: getattr(machine, name) for name in PARTS["top_drive"]}
    return {name: value for name, value in values.items() if value is not None}


def _hoisting(rig: StringRig) -> dict[str, Any]:
    control, ropes = rig.weight_control, rig.string.hoisting_stiffness
    if control is not None:
        return {"block_mass": control.block_mass, "feed_gain": control.feed_gain}
    return {} if ropes is None else {"stiffness": ropes}


def section_texts(section: Section) -> dict[str, Any]:
    """Return a section by the keys of `load_rig`, as a file holds them."""
    joint, material = section.tool_joint, section.material
    values: dict[str, Any] = {
        "name": section.name,
        "type": section.kind,
        "joints": section.joints,
        "length": section.length,
        "outer_diameter": section.outer_diameter,
        "inner_diameter": section.inner_diameter,
        "weight": section.weight,
        "youngs_modulus": material.elasticity,
        "shear_modulus": material.shear,
        "density": material.density,
    }
    if joint is not None:
        values["tool_joint_outer_diameter"] = joint.outer_diameter
        values["tool_joint_inner_diameter"] = joint.inner_diameter
        values["tool_joint_length"] = joint.length
    if section.wall is not None:
        values |= asdict(section.wall)
        if section.wall.side_force is not None:
            del values["inclination"]
    known = {name: value for name, value in values.items() if value is not None}
    return _texts(known, COLUMNS)


def _texts(values: Mapping[str, Any], kinds: Mapping[str, Dimension | None]) -> dict[str, Any]:
    """Return values as the file holds them: a number with a unit as a text."""
    texts = {}
    for name, value in values.items():
        kind = kinds[name]
        texts[name] = _text(float(value), kind) if kind is not None and kind.unit else value
    return texts


def _text(value: float, kind: Dimension) -> str:
    """Return the shortest text that reads back as the same number."""
    exact = f"{value!r} {kind.unit.replace('**', '^')}"
    spelt = [exact]
    for unit in _SPELT.get(kind, ()):
        text = f"{units.from_si(value, kind, unit):.12g} {unit}"
        if units.to_si("value", text, kind) == value:
            spelt.append(text)
    return min(spelt, key=len)
