"""Rigs from presets and files: lumped numbers, or a tally with bit, rock and drive."""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drillctrl.base import units
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.files import check_regular
from drillctrl.base.units import Dimension
from drillctrl.drilling.rig import PRESETS as LUMPED_PRESETS
from drillctrl.drilling.rig import Rig, read_toml, rig_from_mapping, table1
from drillctrl.strings.catalogue import pipe
from drillctrl.strings.drill_string import Damping, DrillString
from drillctrl.strings.presets import PRESETS as STRING_PRESETS
from drillctrl.strings.presets import string_preset
from drillctrl.strings.rig import StringRig, string_rig
from drillctrl.strings.section import KINDS, MATERIALS, Section, ToolJoint

# No hole is wider.
_WIDEST = 1.0
_MOST_BYTES = 10_000_000
_KINDS = {
    **{kind: kind for kind in KINDS},
    **{"dp": "pipe", "drill pipe": "pipe", "hwdp": "heavy-weight", "dc": "collar"},
}
_PARTS: dict[str, dict[str, Dimension | None]] = {
    "bit": {
        "diameter": units.LENGTH,
        "blades": None,
        "wearflat_length": units.LENGTH,
        "cutter_inclination": units.NUMBER,
        "friction_coefficient": units.NUMBER,
        "bit_geometry": units.NUMBER,
    },
    "rock": {"strength": units.STRESS, "contact_strength": units.STRESS},
    "top_drive": {"inertia": units.INERTIA},
    "string": {
        "tally": None,
        "section": None,
        "mud_density": units.DENSITY,
        "hoisting_stiffness": units.STIFFNESS,
        "torsional_damping": None,
        "axial_damping": None,
        "retardation": units.TIME,
    },
}
_LEFT_OUT = {
    *("top_drive", "tally", "section", "mud_density", "hoisting_stiffness"),
    *("torsional_damping", "axial_damping", "retardation"),
}
_COLUMNS: dict[str, Dimension | None] = {
    "name": None,
    "type": None,
    "pipe": None,
    "joints": None,
    "material": None,
    "length": units.LENGTH,
    "od": units.LENGTH,
    "id": units.LENGTH,
    "tool_joint_od": units.LENGTH,
    "tool_joint_id": units.LENGTH,
    "tool_joint_length": units.LENGTH,
    "weight": units.LINEAR_DENSITY,
}


def load_rig(source: str | Path) -> Rig:
    """Load a rig by the name of a preset or from a TOML file.

    Parameters
    ----------
    source : str or Path
        ``"table1"``, a string of `string_preset`, or the path of a file. The file either holds
        the attributes of `Rig` as keys, each a text with a unit (``mass = "34 t"``), or tables
        ``bit``, ``rock``, ``string`` and, if there is one, ``top_drive``. The string is a list
        of sections, or the name of a CSV file beside it with the same columns.

    Raises
    ------
    InputError
        If there is no such preset or file, or the file is not TOML, lacks a key, has one too
        many, or holds a value outside its range.
    """
    presets = (*LUMPED_PRESETS, *STRING_PRESETS)
    if str(source) in STRING_PRESETS:
        return string_preset(str(source))
    if str(source) in LUMPED_PRESETS:
        return table1()
    data = read_toml(source, f"one of the presets {', '.join(presets)} or a readable TOML file")
    if "string" not in data:
        return rig_from_mapping(data, str(source))
    return _string_rig(data, Path(source))


def _string_rig(data: Mapping[str, Any], path: Path) -> StringRig:
    _check_keys(data, _PARTS, str(path))
    found: dict[str, dict[str, Any]] = {}
    for part, known in _PARTS.items():
        given = data.get(part, {})
        if not isinstance(given, dict):
            raise InputError(f"{part} in {path}", given, f"a table, [{part}]")
        if part in data:
            _check_keys(given, known, f"[{part}] of {path}")
        found[part] = {
            key: value if known[key] is None else _si(f"{part}.{key} in {path}", value, known[key])
            for key, value in given.items()
        }
    bit, rock, string = found["bit"], found["rock"], found["string"]
    diameter = bit.pop("diameter")
    if diameter > _WIDEST:
        wanted = f"at most {_WIDEST:g} m: no hole is wider"
        raise InputError(f"bit.diameter in {path}", data["bit"]["diameter"], wanted)
    return string_rig(
        DrillString(
            _sections(string, path),
            Damping(**{
                name: checked_number(f"string.{key} in {path}", string[key], 0.0, 1e3)
                for name, key in (("torsional", "torsional_damping"), ("axial", "axial_damping"),
                                  ("retardation", "retardation"))
                if key in string
            }),
            string.get("mud_density", 0.0),
            string.get("hoisting_stiffness"),
        ),
        drive_inertia=found["top_drive"].get("inertia"),
        bit_radius=0.5 * diameter,
        rock_strength=rock["strength"],
        contact_strength=rock["contact_strength"],
        **bit,
    )  # fmt: skip


def _check_keys(given: Mapping[str, Any], known: Mapping[str, Any], where: str) -> None:
    for key in given:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise InputError(f"key in {where}", key, f"one of {', '.join(known)}{hint}")
    missing = [key for key in known if key not in given and key not in _LEFT_OUT]
    if missing:
        raise InputError(f"{', '.join(missing)} in {where}", "(missing)", "given")


def _sections(string: Mapping[str, Any], path: Path) -> tuple[Section, ...]:
    if ("tally" in string) == ("section" in string):
        wanted = "one of both: tally, the name of a CSV file, or [[string.section]]"
        raise InputError(f"string in {path}", "both" if "tally" in string else "neither", wanted)
    if "tally" in string:
        return read_tally(path.parent / str(string["tally"]))
    rows = string["section"]
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError(f"string.section in {path}", rows, "tables, [[string.section]]")
    found = []
    for i, row in enumerate(rows, 1):
        found.append(_section({key.lower(): v for key, v in row.items()}, f"section {i} of {path}"))
    return tuple(found)


def read_tally(path: str | Path) -> tuple[Section, ...]:
    """Return the sections of a string from a CSV file, from the top down.

    Parameters
    ----------
    path : str or Path
        With a header of ``name``, ``type`` or ``pipe`` (a name of `pipe_names`), ``joints`` or
        ``length``, ``OD``, ``ID``, ``tool joint OD``, ``tool joint ID``, ``tool joint length``,
        ``weight`` (per metre), ``material``, in any order. A unit stands behind a value, or
        behind the column's name: ``OD [in]``.

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
        names.append(re.sub(r"[\s\-]+", "_", match[1].strip().lower()))
        behind.append(match[2])
    for name, title in zip(names, table[0], strict=True):
        if name not in _COLUMNS:
            raise InputError(f"column of {path}", title, f"one of {', '.join(_COLUMNS)}")
    sections = []
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
            cells[name] = f"{value} {unit}" if unit and bare and _COLUMNS[name] else value
        sections.append(_section(cells, where))
    return tuple(sections)


def _section(row: Mapping[str, Any], where: str) -> Section:
    for key in row:
        if key not in _COLUMNS:
            raise InputError(f"key in {where}", key, f"one of {', '.join(_COLUMNS)}")
    value: dict[str, Any] = {
        key: given if _COLUMNS[key] is None else _si(f"{key} in {where}", given, _COLUMNS[key])
        for key, given in row.items()
    }
    bought = pipe(str(row["pipe"])) if "pipe" in row else None
    kind = _KINDS.get(str(row.get("type", bought.kind if bought else "")).lower())
    if kind is None:
        raise InputError(f"type in {where}", row.get("type", "(missing)"), ", ".join(_KINDS))
    material = str(row.get("material", "steel")).lower()
    if material not in MATERIALS:
        raise InputError(f"material in {where}", row["material"], f"one of {', '.join(MATERIALS)}")
    joints = 1
    if "joints" in row:
        number = float(row["joints"]) if str(row["joints"]).strip().isdigit() else row["joints"]
        joints = checked_integer(f"joints in {where}", number, 1, 10_000)
    if bought is not None:
        value.setdefault("od", bought.outer_diameter)
        value.setdefault("id", bought.inner_diameter)
        value.setdefault("length", joints * bought.joint_length if "joints" in row else None)
        if "joints" not in row and value["length"] is not None:
            joints = max(1, round(value["length"] / bought.joint_length))
    missing = [name for name in ("length", "od", "id") if value.get(name) is None]
    if missing:
        raise InputError(f"{', '.join(missing)} in {where}", "(missing)", "given")
    return Section(
        str(row.get("name", row.get("pipe", kind))),
        kind,
        value["length"],
        value["od"],
        value["id"],
        _tool_joint(value, where) or (bought.tool_joint if bought else None),
        joints,
        value.get("weight"),
        MATERIALS[material],
    )


def _tool_joint(value: Mapping[str, Any], where: str) -> ToolJoint | None:
    names = ("tool_joint_od", "tool_joint_id", "tool_joint_length")
    given = [name for name in names if name in value]
    if not given:
        return None
    if len(given) < len(names):
        lacking = ", ".join(name for name in names if name not in value)
        raise InputError(f"{lacking} in {where}", "(missing)", f"given beside {given[0]}")
    return ToolJoint(*(value[name] for name in names))


def _si(name: str, value: Any, dimension: Dimension | None) -> float:
    assert dimension is not None
    if dimension is units.NUMBER and not isinstance(value, str):
        return checked_number(name, value)
    return units.to_si(name, value, dimension)
