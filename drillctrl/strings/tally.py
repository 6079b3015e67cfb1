"""Sections of a string from a tally: tables of a rig file, or a CSV file."""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from drillctrl.base import units
from drillctrl.base.errors import InputError, blamed_on, checked_integer, checked_number
from drillctrl.base.files import check_regular
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.units import Dimension
from drillctrl.strings.catalogue import pipe
from drillctrl.strings.section import KINDS, MATERIALS, Section, ToolJoint
from drillctrl.strings.wall import Wall

_MOST_BYTES = 10_000_000
_KINDS = {
    **{kind: kind for kind in KINDS},
    **dict.fromkeys(("dp", "drill pipe", "drillpipe"), "pipe"),
    **dict.fromkeys(("hwdp", "heavy weight", "heavyweight"), "heavy-weight"),
    **dict.fromkeys(("dc", "collars", "drill collar", "drill collars"), "collar"),
}
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
# What there is where nothing is known: docs/guide/drilling-engineers.md says how to find it.
_USUAL = {
    "wearflat_length": "1 mm",
    "cutter_inclination": "0.6",
    "friction_coefficient": "0.6",
    "geometry": "1",
    "contact_strength": "the rock's strength",
}


def one_of(given: str, names: Iterable[str]) -> str:
    """Return what a name must be one of, and which of these it resembles."""
    names = list(names)
    near = difflib.get_close_matches(given, names, n=1)
    return f"one of {', '.join(names)}" + (f"; did you mean {near[0]}?" if near else "")


def refuse_lacking(lacking: Iterable[str]) -> None:
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
    refuse_lacking(lacking)
    return tuple(found)


def read_sections(given: Any, path: str, folder: Path | None) -> tuple[Section, ...]:
    """Return the sections that a rig file holds, or those of the tally that it names."""
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
            raise InputError(f"column of {path}", title, one_of(name, COLUMNS))
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
            raise InputError(f"key in {where}", key, one_of(key, COLUMNS))
    value: dict[str, Any] = {
        key: given if COLUMNS[key] is None else in_si(f"{key} in {where}", given, COLUMNS[key])
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


def in_si(name: str, value: Any, dimension: Dimension | None, *, bare: bool = False) -> float:
    """Return a number in SI; without a unit where it has none, or ``bare`` in the format's own."""
    assert dimension is not None
    if (bare or dimension is units.NUMBER) and not isinstance(value, str):
        return checked_number(name, value)
    return units.to_si(name, value, dimension)
