"""Rig files as texts: read without touching another file, and everything wrong in them by line."""

from __future__ import annotations

import copy
import functools
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from drillctrl.base.errors import InputError
from drillctrl.drilling.rig import Rig, read_toml, table1
from drillctrl.strings.files import load_rig, rig_from_data
from drillctrl.strings.rig import StringRig
from drillctrl.strings.saving import section_texts

LONGEST = 200_000
_MOST_COMPLAINTS = 30
# A string that is sound: what stands for what is wrong, so that the rest can be looked at.
_SOUND: dict[str, Any] = {
    "bit": {
        "diameter": "216 mm",
        "blades": 4,
        "wearflat_length": "1.2 mm",
        "cutter_inclination": 0.6,
        "friction_coefficient": 0.6,
        "geometry": 1.0,
    },
    "rock": {"strength": "60 MPa", "contact_strength": "60 MPa"},
    "top_drive": {"inertia": "2900 kg*m^2"},
}
_SECTION = {
    "name": "pipe",
    "type": "pipe",
    "length": "1000 m",
    "outer_diameter": "127 mm",
    "inner_diameter": "108 mm",
}
_WRITTEN = {"OD": "outer_diameter", "ID": "inner_diameter", "tool joint length": "length"}
_HEADER = re.compile(r"\s*(\[{1,2})\s*([\w.\-]+)\s*\]{1,2}")
_KEY = re.compile(r"\s*[\"']?([\w\-]+)[\"']?\s*=")


@dataclass(frozen=True)
class Complaint:
    """Something wrong in a rig file.

    Attributes
    ----------
    line : int or None
        Where it stands, from 1; None where it concerns the whole file.
    text : str
        What is wrong, and what is permitted.
    """

    line: int | None
    text: str


@functools.lru_cache(maxsize=32)
def rig_from_text(text: str, name: str) -> Rig:
    """Return the rig of a TOML file that is given as a text; no other file is read.

    Parameters
    ----------
    text : str
        As `load_rig` describes it, with the sections in the text.
    name : str
        What the file is called in messages.

    Raises
    ------
    InputError
        If it makes no rig.
    """
    return rig_from_data(_parsed(text, name), name)


def complaints(text: str, name: str) -> tuple[Complaint, ...]:
    """Return everything that is wrong in a rig file, by line; empty where it makes a rig.

    What is wrong is replaced by something sound, and the rest looked at again.
    """
    try:
        data = copy.deepcopy(_parsed(text, name))
    except InputError as error:
        at = re.search(r"at line (\d+)", str(error))
        return (Complaint(int(at[1]) if at else None, str(error)),)
    lines = _lines(text)
    found: list[Complaint] = []
    while len(found) < _MOST_COMPLAINTS:
        try:
            rig_from_data(data, name)
            break
        except InputError as error:
            part, keys = _place(error, data, name)
            known = [lines[part, key] for key in keys if (part, key) in lines]
            line = min(known) if known else lines.get((part, ""))
            found.append(Complaint(line, str(error)))
            if not _mend(data, part, keys):
                break
    return tuple(sorted(found, key=lambda complaint: complaint.line or 0))


def rig_as_text(source: str) -> str:
    """Return a rig file as one text that needs no other: sections of a tally are written out.

    Raises
    ------
    InputError
        If there is no such file, or it makes no rig.
    """
    rig = load_rig(source)
    data = read_toml(source, "a readable TOML file")
    if isinstance(rig, StringRig) and isinstance(data.get("sections"), str):
        data["sections"] = [section_texts(section) for section in rig.string.sections]
        return tomli_w.dumps(data)
    return Path(source).read_text(encoding="utf-8-sig")


def _parsed(text: str, name: str) -> dict[str, Any]:
    if len(text) > LONGEST:
        wanted = f"at most {LONGEST} characters"
        raise InputError(f"length of {name}", len(text), wanted)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError("rig", name, f"valid TOML ({error})") from None
    except (RecursionError, ValueError):
        # A number of thousands of digits is a ValueError.
        raise InputError("rig", name, "TOML of ordinary numbers, not nested deep") from None


def _lines(text: str) -> dict[tuple[str, str], int]:
    """Return the line of each key by its part and name; of a part itself under no name."""
    found: dict[tuple[str, str], int] = {}
    part, sections = "", 0
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            part = header[2]
            if header[1] == "[[" and part == "sections":
                sections += 1
                part = f"sections {sections}"
            found.setdefault((part, ""), number)
        elif key := _KEY.match(line):
            found.setdefault((part, key[1]), number)
    return found


def _place(error: InputError, data: dict[str, Any], name: str) -> tuple[str, tuple[str, ...]]:
    """Return which part of a file a message is about, and which of its keys."""
    about = error.parameter
    keys = about
    part = ""
    for pattern in (
        rf"(?P<keys>.+) in section (?P<row>\d+) of {re.escape(name)}",
        rf"(?P<keys>.+) in \[(?P<part>\w+)\] of {re.escape(name)}",
        rf"(?P<part>\w+)\.(?P<keys>\w+) in {re.escape(name)}",
        rf"(?P<keys>.+) in {re.escape(name)}",
    ):
        match = re.fullmatch(pattern, about)
        if match:
            groups = match.groupdict()
            keys = groups["keys"]
            part = f"sections {groups['row']}" if "row" in groups else groups.get("part") or ""
            break
    else:
        keys, _, called = about.rpartition(" of ")
        rows = data.get("sections")
        if isinstance(rows, list):
            for i, row in enumerate(rows, 1):
                if str(row.get("name", row.get("pipe"))) == called:
                    part = f"sections {i}"
    if keys == "key":
        return part, (str(error.value),)
    return part, tuple(_WRITTEN.get(key, key) for key in keys.split(", "))


def _mend(data: dict[str, Any], part: str, keys: tuple[str, ...]) -> bool:
    """Put something sound in the place of what is wrong; return whether that can be done."""
    if part.startswith("sections "):
        index = int(part.split()[1]) - 1
        if data["sections"][index] == _SECTION:
            return False
        data["sections"][index] = dict(_SECTION)
        return True
    whole: dict[str, Any] = data
    sound: dict[str, Any] = {**_SOUND, "sections": [dict(_SECTION)]}
    if part:
        whole, sound = data.get(part, {}), _SOUND.get(part, {})
    elif not {"bit", "rock", "sections"} & set(data):
        sound = _lumped_fields()
    changed = False
    for key in keys:
        if key in sound and whole.get(key) != sound[key]:
            whole[key] = copy.deepcopy(sound[key])
            changed = True
        elif key in whole and key not in sound:
            del whole[key]
            changed = True
    return changed


def _lumped_fields() -> dict[str, Any]:
    rig = table1()
    fields: dict[str, Any] = {"blades": rig.blades}
    for name, item in Rig.__dataclass_fields__.items():
        if "dimension" in item.metadata:
            value, unit = getattr(rig, name), item.metadata["dimension"].unit
            fields[name] = f"{value!r} {unit}" if unit else value
    return fields
