"""Rigs from presets and files: lumped numbers, or a tally with bit, rock and drive."""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from drillctrl.base import units
from drillctrl.base.errors import InputError, blamed_on, checked_integer, checked_number
from drillctrl.base.files import check_regular
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.units import Dimension
from drillctrl.drilling.rig import PRESETS as LUMPED_PRESETS
from drillctrl.drilling.rig import Rig, read_toml, rig_from_mapping, table1
from drillctrl.strings.catalogue import pipe
from drillctrl.strings.drill_string import Damping, DrillString
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.presets import PRESETS as STRING_PRESETS
from drillctrl.strings.presets import string_preset
from drillctrl.strings.rig import StringRig, WeightControl, string_rig
from drillctrl.strings.section import KINDS, MATERIALS, Section, ToolJoint
from drillctrl.strings.wall import Wall

# What a fit to a recording knows of its rig, beside the rig itself.
FIT = "fit"
PRESETS = (*LUMPED_PRESETS, *STRING_PRESETS)
# No hole is wider.
_WIDEST = 1.0
_MOST_BYTES = 10_000_000
_KINDS = {
    **{kind: kind for kind in KINDS},
    **dict.fromkeys(("dp", "drill pipe", "drillpipe"), "pipe"),
    **dict.fromkeys(("hwdp", "heavy weight", "heavyweight"), "heavy-weight"),
    **dict.fromkeys(("dc", "collars", "drill collar", "drill collars"), "collar"),
}
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
# What there is where nothing is known: docs/guide/drilling-engineers.md says how to find it.
_USUAL = {
    "wearflat_length": "1 mm",
    "cutter_inclination": "0.6",
    "friction_coefficient": "0.6",
    "geometry": "1",
    "contact_strength": "the rock's strength",
}
# Attributes of a rig, and what they are called in a file.
_CALLED = {"bit_radius": "diameter", "bit_geometry": "geometry", "rock_strength": "strength"}
# Numbers in the unit that the format names.
_BARE = ("blades", "torsional", "axial", "kelvin_voigt")
COLUMNS: dict[str, Dimension | None] = {
    "name": None,
    "type": None,
    "pipe": None,
    "joints": None,
    "joint_length": units.LENGTH,
    "material": None,
    "length": units.LENGTH,
    "outer_diameter": units.LENGTH,
    "inner_diameter": units.LENGTH,
    "tool_joint_outer_diameter": units.LENGTH,
    "tool_joint_inner_diameter": units.LENGTH,
    "tool_joint_length": units.LENGTH,
    "weight": units.LINEAR_DENSITY,
    "youngs_modulus": units.STRESS,
    "shear_modulus": units.STRESS,
    "density": units.DENSITY,
    "friction_factor": units.NUMBER,
    "static_factor": units.NUMBER,
    "inclination": units.ANGLE,
    "side_force": units.SIDE_FORCE,
}
# As tallies are headed.
_ALSO = {
    "od": "outer_diameter",
    "id": "inner_diameter",
    "tool_joint_od": "tool_joint_outer_diameter",
    "tool_joint_id": "tool_joint_inner_diameter",
}


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
    _refuse_lacking(lacking)
    found: dict[str, dict[str, Any]] = {}
    for part, known in PARTS.items():
        given = data.get(part, {})
        found[part] = {
            key: value
            if known[key] is None
            else _si(f"{part}.{key} in {path}", value, known[key], bare=key in _BARE)
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
    string = DrillString(_sections(data["sections"], path, folder), damping, mud, ropes)
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
            near = difflib.get_close_matches(str(key), names, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise InputError(f"key in {where}", key, f"one of {', '.join(names)}{hint}")
    missing = [key for key in names if key not in given and key not in optional]
    return f"{', '.join(missing)} in {where}" if missing else ""


def _refuse_lacking(lacking: Iterable[str]) -> None:
    """Say all that is missing at once."""
    told = "; ".join(filter(None, lacking))
    if told:
        usual = ", ".join(f"{key} {value}" for key, value in _USUAL.items() if key in told)
        hint = f", where not known about {usual}" if usual else ""
        raise InputError(told, "(missing)", f"given{hint}")


def _each_section(rows: Iterable[tuple[str, Mapping[str, Any]]]) -> tuple[Section, ...]:
    found, lacking = [], []
    for where, row in rows:
        try:
            found.append(_section(row, where))
        except InputError as error:
            if error.value != "(missing)":
                raise
            lacking.append(error.parameter)
    _refuse_lacking(lacking)
    return tuple(found)


def _sections(given: Any, path: str, folder: Path | None) -> tuple[Section, ...]:
    if isinstance(given, str) and folder is not None:
        return read_tally(folder / given)
    if not isinstance(given, list) or not given or not all(isinstance(r, dict) for r in given):
        wanted = "tables, [[sections]]" + (", or the name of a CSV file" if folder else "")
        raise InputError(f"sections in {path}", given, wanted)
    rows = [{_ALSO.get(key.lower(), key.lower()): row[key] for key in row} for row in given]
    return _each_section((f"section {i} of {path}", row) for i, row in enumerate(rows, 1))


@checks_kinds
def read_tally(path: str | Path) -> tuple[Section, ...]:
    """Return the sections of a string from a CSV file, from the top down.

    Parameters
    ----------
    path : str or Path
        With a header of ``name``, ``type`` or ``pipe`` (a name of `pipe_names`), ``length`` or
        ``joints`` (and ``joint length``), ``outer diameter`` or ``OD``, ``inner diameter`` or
        ``ID``, ``tool joint OD``, ``tool joint ID``, ``tool joint length``, ``weight`` (per
        metre), ``material``, ``youngs modulus``, ``shear modulus``, ``density``, and for friction
        on the wall ``friction factor`` with ``inclination`` or ``side force``, and perhaps
        ``static factor``, in any order.
        A unit stands behind a value, or behind the column's name: ``OD [in]``.

    Raises
    ------
    InputError
        If the file cannot be read, is empty, or a row makes no section.
    """
    try:
        check_regular(path, _MOST_BYTES)
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8"
        raise InputError("tally", str(path), f"a readable CSV file ({reason})") from None
    table = [row for row in csv.reader(text.splitlines()) if any(cell.strip() for cell in row)]
    if len(table) < 2:
        raise InputError("tally", str(path), "a header and at least one section")
    names, behind = [], []
    for title in table[0]:
        match = re.fullmatch(r"\s*(.*?)\s*(?:[\[(](.*)[\])])?\s*", title)
        assert match is not None
        name = re.sub(r"[\s\-]+", "_", match[1].strip().lower())
        names.append(_ALSO.get(name, name))
        behind.append(match[2])
    for name, title in zip(names, table[0], strict=True):
        if name not in COLUMNS:
            raise InputError(f"column of {path}", title, f"one of {', '.join(COLUMNS)}")
    rows = []
    for line, row in enumerate(table[1:], 2):
        where = f"row {line} of {path}"
        if len(row) != len(names):
            raise InputError(where, f"{len(row)} cells", f"{len(names)}, as the header has")
        cells = {}
        for name, unit, cell in zip(names, behind, row, strict=True):
            value = cell.strip()
            if not value:
                continue
            bare = re.fullmatch(r"[+-]?[\d.]+(?:[eE][+-]?\d+)?", value)
            cells[name] = f"{value} {unit}" if unit and bare and COLUMNS[name] else value
        rows.append((where, cells))
    return _each_section(rows)


def _section(row: Mapping[str, Any], where: str) -> Section:
    for key in row:
        if key not in COLUMNS:
            raise InputError(f"key in {where}", key, f"one of {', '.join(COLUMNS)}")
    value: dict[str, Any] = {
        key: given if COLUMNS[key] is None else _si(f"{key} in {where}", given, COLUMNS[key])
        for key, given in row.items()
    }
    bought = pipe(str(row["pipe"])) if "pipe" in row else None
    kind = _KINDS.get(str(row.get("type", bought.kind if bought else "")).lower())
    if kind is None and "type" in row:
        raise InputError(f"type in {where}", row["type"], ", ".join(_KINDS))
    material = str(row.get("material", "steel")).lower()
    if material not in MATERIALS:
        raise InputError(f"material in {where}", row["material"], f"one of {', '.join(MATERIALS)}")
    joints = 1
    if "joints" in row:
        number = float(row["joints"]) if str(row["joints"]).strip().isdigit() else row["joints"]
        joints = checked_integer(f"joints in {where}", number, 1, 10_000)
    if bought is not None:
        value.setdefault("outer_diameter", bought.outer_diameter)
        value.setdefault("inner_diameter", bought.inner_diameter)
        value.setdefault("joint_length", bought.joint_length)
    if "joint_length" in value:
        if "joints" in row:
            value.setdefault("length", joints * value["joint_length"])
        elif "length" in value:
            joints = max(1, round(value["length"] / value["joint_length"]))
    needed = ("length", "outer_diameter", "inner_diameter")
    missing = [name for name in needed if value.get(name) is None]
    if kind is None or missing:
        names = missing if kind else ["type", *missing]
        raise InputError(f"{', '.join(names)} in {where}", "(missing)", "given")
    own = {
        field: value[name]
        for field, name in (
            ("elasticity", "youngs_modulus"), ("shear", "shear_modulus"), ("density", "density")
        )
        if name in value
    }  # fmt: skip
    name = str(row.get("name", row.get("pipe", kind)))
    with blamed_on(where, _written(row, name)):
        return Section(
            name,
            kind,
            value["length"],
            value["outer_diameter"],
            value["inner_diameter"],
            _tool_joint(value, where) or (bought.tool_joint if bought else None),
            joints,
            value.get("weight"),
            replace(MATERIALS[material], **own),
            _wall(value, where),
        )


def _written(row: Mapping[str, Any], name: str) -> dict[str, tuple[str, object]]:
    """Return what stands in a row for what a section checks; lengths follow from joints too."""
    short = {"outer_diameter": "OD", "inner_diameter": "ID"}
    names = {f"{short.get(key, key)} of {name}": key for key in ("length", "weight", *short)}
    names |= {f"{short[key]} of tool joint": f"tool_joint_{key}" for key in short}
    names |= {f"tool joint length{of}": "tool_joint_length" for of in ("", f" of {name}")}
    return {said: (key, row[key]) for said, key in names.items() if key in row}


def _wall(value: Mapping[str, Any], where: str) -> Wall | None:
    names = ("friction_factor", "static_factor", "inclination", "side_force")
    given = {name: value[name] for name in names if name in value}
    if not given:
        return None
    if "friction_factor" not in given:
        raise InputError(
            f"friction_factor in {where}", "(missing)", f"given beside {next(iter(given))}"
        )
    if not {"inclination", "side_force"} & set(given):
        wanted = "given beside friction_factor"
        raise InputError(f"inclination or side_force in {where}", "(missing)", wanted)
    with blamed_on(where, {name.replace("_", " "): (name, value[name]) for name in given}):
        return Wall(**given)


def _tool_joint(value: Mapping[str, Any], where: str) -> ToolJoint | None:
    names = ("tool_joint_outer_diameter", "tool_joint_inner_diameter", "tool_joint_length")
    given = [name for name in names if name in value]
    if not given:
        return None
    if len(given) < len(names):
        lacking = ", ".join(name for name in names if name not in value)
        raise InputError(f"{lacking} in {where}", "(missing)", f"given beside {given[0]}")
    return ToolJoint(*(value[name] for name in names))


def _si(name: str, value: Any, dimension: Dimension | None, *, bare: bool = False) -> float:
    assert dimension is not None
    if (bare or dimension is units.NUMBER) and not isinstance(value, str):
        return checked_number(name, value)
    return units.to_si(name, value, dimension)
