"""Rigs from presets and files: lumped numbers, or a tally with bit, rock and drive."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from drillctrl.base import units
from drillctrl.base.errors import InputError, blamed_on, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.units import Dimension
from drillctrl.drilling.rig import PRESETS as LUMPED_PRESETS
from drillctrl.drilling.rig import Rig, read_toml, rig_from_mapping, table1
from drillctrl.strings.drill_string import Damping, DrillString
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.presets import PRESETS as STRING_PRESETS
from drillctrl.strings.presets import string_preset
from drillctrl.strings.rig import StringRig, WeightControl, string_rig
from drillctrl.strings.tally import in_si, one_of, read_sections, refuse_lacking

# What a fit to a recording knows of its rig, beside the rig itself.
FIT = "fit"
PRESETS = (*LUMPED_PRESETS, *STRING_PRESETS)
# No hole is wider.
_WIDEST = 1.0
# What a file with a string holds beside its sections, in tables.
PARTS: dict[str, dict[str, Dimension | None]] = {
    "bit": {
        "diameter": units.LENGTH,
        "blades": None,
        "wearflat_length": units.LENGTH,
        "cutter_inclination": units.NUMBER,
        "friction_coefficient": units.NUMBER,
        "geometry": units.NUMBER,
    },
    "rock": {"strength": units.STRESS, "contact_strength": units.STRESS},
    "top_drive": {
        "inertia": units.INERTIA,
        "torque_limit": units.TORQUE,
        "delay": units.TIME,
        "lag": units.TIME,
        "encoder": units.TIME,
        "torque_filter": units.TIME,
        "encoder_counts": None,
    },
    "damping": {"torsional": units.RATE, "axial": units.RATE, "kelvin_voigt": units.TIME},
    "mud": {"density": units.DENSITY},
    "hoisting": {
        "stiffness": units.STIFFNESS,
        "block_mass": units.MASS,
        "feed_gain": units.FEED_GAIN,
    },
}
# What may be left out: whole tables, and keys of tables.
_OPTIONAL_PARTS = ("top_drive", "damping", "mud", "hoisting")
_OPTIONAL = (
    *("torque_limit", "delay", "lag", "encoder", "torque_filter", "encoder_counts"),
    *("torsional", "axial", "kelvin_voigt"),
    *("stiffness", "block_mass", "feed_gain"),
)
# Attributes of a rig, and what they are called in a file.
_CALLED = {"bit_radius": "diameter", "bit_geometry": "geometry", "rock_strength": "strength"}
# Numbers in the unit that the format names.
_BARE = ("blades", "torsional", "axial", "kelvin_voigt")


@checks_kinds
def load_rig(source: str | Path) -> Rig:
    """Load a rig by the name of a preset or from a TOML file.

    Parameters
    ----------
    source : str or Path
        ``"table1"``, a string of `string_preset`, or the path of a file. The file either holds
        the attributes of `Rig` as keys, each a text with a unit (``mass = "34 t"``), or a string:
        ``[[sections]]`` from the top down, or ``sections`` as the name of a CSV file beside it
        with the same columns; ``[bit]``, ``[rock]`` and, if they are there, ``[top_drive]``,
        ``[damping]``, ``[mud]``, ``[hoisting]``.

    Raises
    ------
    InputError
        If there is no such preset or file, or the file is not TOML, lacks a key, has one too
        many, or holds a value outside its range.
    """
    if str(source) in STRING_PRESETS:
        return string_preset(str(source))
    if str(source) in LUMPED_PRESETS:
        return table1()
    data = read_toml(source, f"one of the presets {', '.join(PRESETS)} or a readable TOML file")
    return rig_from_data(data, str(source), Path(source).parent)


def rig_from_data(data: dict[str, Any], path: str, folder: Path | None = None) -> Rig:
    """Return the rig of a file that was read.

    Parameters
    ----------
    data : dict
        What TOML holds.
    path : str
        What the file is called in messages.
    folder : Path, optional
        Where a tally may lie; without it no other file is read.

    Raises
    ------
    InputError
        As `load_rig`.
    """
    data = {key: value for key, value in data.items() if key != FIT}
    if "sections" not in data and not {"bit", "rock"} & set(data):
        return rig_from_mapping(data, path)
    return _string_rig(data, path, folder)


def fitted_errors(source: str | Path) -> dict[str, float]:
    """Return relative errors of a rig that was fitted to a recording, by name.

    Parameters
    ----------
    source : str or Path
        A preset or a file as of `load_rig`; what holds no ``[fit]`` has none.

    Raises
    ------
    InputError
        If the file cannot be read, or an error is no number in [0, 0.9].
    """
    if str(source) in PRESETS:
        return {}
    known = read_toml(source, "a readable TOML file").get(FIT, {})
    rows = known.get("uncertainty", {}) if isinstance(known, dict) else {}
    found = {}
    for name in ("stiffness", "inertia", "damping"):
        row = rows.get(name) if isinstance(rows, dict) else None
        if isinstance(row, dict) and "error" in row:
            where = f"fit.uncertainty.{name}.error in {source}"
            found[name] = checked_number(where, row["error"], 0.0, 0.9)
    return found


def _string_rig(data: Mapping[str, Any], path: str, folder: Path | None) -> StringRig:
    lacking = [_lacking(data, ("sections", *PARTS), path, _OPTIONAL_PARTS)]
    for part, known in PARTS.items():
        given = data.get(part, {})
        if not isinstance(given, dict):
            raise InputError(f"{part} in {path}", given, f"a table, [{part}]")
        if part in data:
            lacking.append(_lacking(given, known, f"[{part}] of {path}", _OPTIONAL))
    refuse_lacking(lacking)
    found: dict[str, dict[str, Any]] = {}
    for part, known in PARTS.items():
        given = data.get(part, {})
        found[part] = {
            key: value
            if known[key] is None
            else in_si(f"{part}.{key} in {path}", value, known[key], bare=key in _BARE)
            for key, value in given.items()
        }
    bit, rock, drive = found["bit"], found["rock"], found["top_drive"]
    diameter = bit.pop("diameter")
    if diameter > _WIDEST:
        wanted = f"at most {_WIDEST:g} m: no hole is wider"
        raise InputError(f"bit.diameter in {path}", data["bit"]["diameter"], wanted)
    given = found["damping"]
    damping = Damping(**{
        name: checked_number(f"damping.{key} in {path}", given[key], 0.0, 1e3)
        for name, key in (("torsional", "torsional"), ("axial", "axial"),
                          ("retardation", "kelvin_voigt"))
        if key in given
    })  # fmt: skip
    mud, hoisting = found["mud"].get("density", 0.0), found["hoisting"]
    control = _weight_control(hoisting, data.get("hoisting", {}), path)
    ropes = hoisting.get("stiffness")
    string = DrillString(read_sections(data["sections"], path, folder), damping, mud, ropes)
    typed = {key: (f"{part}.{key}", value) for part in ("bit", "rock", "top_drive")
             for key, value in data.get(part, {}).items()}  # fmt: skip
    typed["hoisting stiffness"] = "hoisting.stiffness", data.get("hoisting", {}).get("stiffness")
    for parameter, key in _CALLED.items():
        typed[parameter] = typed.pop(key, (key, None))
    with blamed_on(path, typed):
        return string_rig(
            string,
            drive=DriveMachine(**drive) if drive else None,
            weight_control=control,
            bit_radius=0.5 * diameter,
            bit_geometry=bit.pop("geometry"),
            rock_strength=rock["strength"],
            contact_strength=rock["contact_strength"],
            **bit,
        )


def _weight_control(
    hoisting: Mapping[str, Any], written: Mapping[str, Any], path: str
) -> WeightControl | None:
    """Return what feeds a string by its weight, if anything does."""
    names = ("block_mass", "feed_gain")
    missing = [name for name in names if name not in hoisting]
    if len(missing) == len(names):
        return None
    if missing:
        raise InputError(f"{missing[0]} in [hoisting] of {path}", "(missing)", "given")
    typed = {name.replace("_", " "): (f"hoisting.{name}", written[name]) for name in names}
    with blamed_on(path, typed):
        return WeightControl(**{name: hoisting[name] for name in names})


def _lacking(
    given: Mapping[str, Any], known: Iterable[str], where: str, optional: Collection[str]
) -> str:
    """Return the names that must be there and are not, and where; empty if none is missing."""
    names = list(known)
    for key in given:
        if key not in names:
            raise InputError(f"key in {where}", key, one_of(key, names))
    missing = [key for key in names if key not in given and key not in optional]
    return f"{', '.join(missing)} in {where}" if missing else ""
