"""Which column of a file is what: by its name and unit, or as the user says."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from drillctrl.base import units
from drillctrl.base.errors import InputError
from drillctrl.base.units import Dimension
from drillctrl.records.raw import Column

TIME = "time"


@dataclass(frozen=True)
class Taken:
    """What a column was taken for.

    Attributes
    ----------
    quantity : str
        A key of `QUANTITIES`, or ``"time"``.
    column : str
        Its name in the file.
    unit : str or None
        Of its numbers there; None of instants with a date.
    """

    quantity: str
    column: str
    unit: str | None


# Quantity → dimension; the first two are needed, or the bit's speed instead of the torque.
QUANTITIES: dict[str, Dimension] = {
    "rotary_speed": units.ROTARY_SPEED,
    "torque": units.TORQUE,
    "bit_speed": units.ROTARY_SPEED,
    "bit_torque": units.TORQUE,
    "weight_on_bit": units.FORCE,
    "hook_load": units.FORCE,
    "block_position": units.LENGTH,
    "rate_of_penetration": units.SPEED,
    "depth": units.LENGTH,
}
LARGEST = {
    "rotary_speed": 200.0,
    "bit_speed": 1e3,
    "torque": 1e6,
    "bit_torque": 1e6,
    "weight_on_bit": 1e8,
    "hook_load": 1e8,
    "block_position": 1e3,
    "rate_of_penetration": 10.0,
    "depth": 2e4,
}
_TURNS = {"rpm", "rpma", "srpm", "tdrpm", "rotary", "rotation", "rotating", "drehzahl", "omega"}
_TORQUES = {
    *("torque", "torq", "trq", "tq", "tor", "stor", "stq", "tqa", "tqx", "tdtq", "tdtor", "moment"),
    *("drehmoment", "couple", "dtor", "dhtq", "btor", "rottorq"),
}
_WEIGHTS = {"wob", "swob", "dwob", "woba", "bitweight"}
_HOOKS = {"hkld", "hookload", "hkl", "hkla", "hklda"}
_BLOCKS = {"bpos", "blockpos", "blkpos", "bhgt", "blockposition", "blockheight"}
_RATES = {"rop", "ropa", "ropi"}
_DEPTHS = {"depth", "dept", "dbtm", "dmea", "bitdepth", "holedepth", "md"}
_TIMES = {
    *("time", "t", "times", "timestamp", "datetime", "date", "utc", "clock", "etim", "elapsed"),
    *("zeit", "datum", "uhrzeit", "zeitstempel", "rtime", "tid", "heure", "temps"),
}
_BELOW = {"bit", "downhole", "dh", "dhole", "bha", "collar", "mwd", "sub", "memory", "brpm", "dtor"}
_OF_ELSE = {
    *("set", "setpoint", "sp", "setp", "target", "command", "cmd", "ref", "reference", "limit"),
    *("max", "min", "alarm", "std", "motor", "pump", "mud", "flow", "stroke", "strokes", "spm"),
    *("gain", "error", "rate", "ratio", "pressure", "makeup", "total"),
}
_SUFFIX = re.compile(r"^(.*?)\s*[\[({](.*)[\])}]\s*$")


def split_name(name: str) -> tuple[str, str | None]:
    """Return a column's name without its unit, and that, where it stands in the name.

    ``Torque [kN·m]``, ``Torque (kN·m)`` and ``torque, kN·m``.
    """
    match = _SUFFIX.match(name)
    if match:
        return match[1].strip(), match[2].strip() or None
    before, comma, after = name.rpartition(",")
    if comma and units.known_unit(after.strip()):
        return before.strip(), after.strip()
    return name, None


def _words(name: str) -> list[str]:
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return [word for word in re.split(r"[^a-zäöü]+", spaced.lower()) if word]


def quantity_of(name: str) -> str | None:
    """Return what a column's name says that it is; None where it says nothing known."""
    words = set(_words(name))
    turns = bool(words & _TURNS) or any(w.endswith("rpm") or w.startswith("rpm") for w in words)
    turns = turns or ("speed" in words and bool(words & {"bit", "drive", "top", "surface", "rot"}))
    if words & _WEIGHTS or {"weight", "bit"} <= words:
        return None if words & {"set", "setpoint", "sp", "target"} else "weight_on_bit"
    if words & _RATES or {"rate", "penetration"} <= words:
        return None if words & {"set", "setpoint", "sp", "target"} else "rate_of_penetration"
    if words & _OF_ELSE:
        return None
    if words & _TORQUES:
        return "bit_torque" if words & _BELOW else "torque"
    if turns:
        return "bit_speed" if words & _BELOW else "rotary_speed"
    if words & _HOOKS or {"hook", "load"} <= words:
        return "hook_load"
    if words & _BLOCKS or ("block" in words and words & {"position", "pos", "height"}):
        return "block_position"
    if words & _DEPTHS:
        return "depth"
    return TIME if words & _TIMES else None


def read_choices(given: Iterable[str]) -> dict[str, tuple[str, str | None]]:
    """Return what the user says: quantity → column and unit.

    Parameters
    ----------
    given : iterable of str
        Such as ``"torque=STOR [kft.lbf]"``; the unit may be left out, and ``none`` instead of a
        column says that there is none.

    Raises
    ------
    InputError
        If a text has another form, or a quantity is unknown or named twice.
    """
    found: dict[str, tuple[str, str | None]] = {}
    known = (TIME, *QUANTITIES)
    for text in given:
        quantity, sign, rest = (part.strip() for part in str(text).partition("="))
        if not sign or quantity not in known or not rest:
            wanted = f"QUANTITY=COLUMN [UNIT], with one of {', '.join(known)}"
            raise InputError("column", text, wanted)
        if quantity in found:
            raise InputError("column", text, f"the only one for {quantity}")
        match = re.match(r"^(.*?)\s*\[([^\]]*)\]\s*$", rest)
        found[quantity] = (match[1].strip(), match[2].strip()) if match else (rest, None)
    return found


def choose_columns(
    columns: Sequence[Column], choices: Mapping[str, tuple[str, str | None]], source: str
) -> tuple[dict[str, tuple[Column, Taken]], list[str]]:
    """Return what each column was taken for, and notes on those that were left.

    Raises
    ------
    InputError
        If a column that is needed cannot be told, or its unit is not known; the message names
        the candidates and what to type.
    """
    by_name = {column.name: column for column in columns}
    listed = ", ".join(by_name) if len(by_name) <= 20 else f"{len(by_name)} columns"
    found: dict[str, tuple[Column, Taken]] = {}
    notes: list[str] = []
    for quantity, (name, unit) in choices.items():
        if name.lower() == "none" and name not in by_name:
            continue
        column = _named(name, by_name, quantity, listed, source)
        found[quantity] = column, _taken(quantity, column, unit, source)
    used = {id(column) for column, _ in found.values()}
    candidates: dict[str, list[Column]] = {}
    for column in columns:
        quantity_found = quantity_of(split_name(column.name)[0])
        if quantity_found and quantity_found not in choices and id(column) not in used:
            candidates.setdefault(quantity_found, []).append(column)
    for quantity in QUANTITIES:
        given = candidates.get(quantity, [])
        if not given:
            continue
        needed = quantity in ("rotary_speed", "torque", "bit_speed")
        if len(given) > 1:
            names = " or ".join(repr(column.name) for column in given)
            if needed:
                asked = f'one column: --column "{quantity}={given[0].name}"'
                raise InputError(f"{quantity} in {source}", names, asked)
            notes.append(f"{quantity} was not taken: {names}")
            continue
        try:
            found[quantity] = given[0], _taken(quantity, given[0], None, source)
        except InputError as error:
            if needed:
                raise
            notes.append(f"{quantity} was not taken: {error.parameter} {error.permitted}")
    _check_needed(found, choices, listed, source)
    # What holds instants by its kind needs no name for it.
    dated = [column for column in columns if column.unit == "epoch"]
    times = [column for column in candidates.get(TIME, dated) if TIME not in choices]
    return {**found, **_time(times, found, listed, source)}, notes


def _check_needed(
    found: Mapping[str, object],
    choices: Mapping[str, tuple[str, str | None]],
    listed: str,
    source: str,
) -> None:
    for quantity, example in (("rotary_speed", "[rpm]"), ("torque", "[kN*m]")):
        if quantity in found or (quantity in choices and "bit_speed" in found):
            continue
        asked = f'named: --column "{quantity}=COLUMN {example}", of {listed}'
        if "bit_speed" in found and quantity == "torque":
            continue
        raise InputError(f"{quantity} in {source}", "(not found)", asked)


def _named(
    name: str, by_name: Mapping[str, Column], quantity: str, listed: str, source: str
) -> Column:
    if name in by_name:
        return by_name[name]
    alike = [column for full, column in by_name.items() if split_name(full)[0] == name]
    if len(alike) == 1:
        return alike[0]
    raise InputError(f"column {quantity} of {source}", name, f"one of {listed}")


def _taken(quantity: str, column: Column, unit: str | None, source: str) -> Taken:
    if quantity == TIME:
        return Taken(TIME, column.name, unit or split_name(column.name)[1] or column.unit)
    known = unit or split_name(column.name)[1] or column.unit or _unit_in(quantity, column.name)
    if known is None:
        example = {"torque": "kN*m", "bit_torque": "kN*m"}.get(quantity, QUANTITIES[quantity].unit)
        asked = f'given: --column "{quantity}={column.name} [{example}]", or its own'
        raise InputError(f"unit of {column.name} in {source}", "(missing)", asked)
    factor(quantity, known, f"unit of {column.name} in {source}")
    return Taken(quantity, column.name, known)


def factor(quantity: str, unit: str, where: str) -> float:
    """Return how many SI units one of a quantity's unit is.

    Raises
    ------
    InputError
        If it is no unit of that.
    """
    dimension = QUANTITIES[quantity]
    spelt = {"c/min": "rpm", "rev/min": "rpm", "u/min": "rpm"}.get(unit.lower(), unit)
    if unit.isupper():  # As LAS files shout: KN.M
        spelt = re.sub(r"\bkn(?=m?\b)|\bn(?=m?\b)", lambda m: m[0][:-1] + "N", spelt.lower())
    try:
        return units.to_si(where, f"1 {spelt}", dimension)
    except InputError as error:
        if "one of two things" in error.permitted:
            raise InputError(where, unit, error.permitted) from None
        raise InputError(where, unit, f"one of {dimension.name}, as {dimension.examples}") from None


def _unit_in(quantity: str, name: str) -> str | None:
    """Return the unit that stands at the end of a name: ``torque_kNm``, ``Surface RPM``."""
    parts = [part for part in re.split(r"[_\s.]+", name) if part]
    for start in range(max(1, len(parts) - 3), len(parts)):
        for sign in ("*", "/"):
            unit = sign.join(parts[start:]).replace("*per*", "/").replace("/per/", "/")
            try:
                factor(quantity, unit, "")
            except InputError:
                continue
            return unit
    turning = QUANTITIES[quantity] is units.ROTARY_SPEED
    return "rpm" if turning and any("rpm" in word for word in _words(name)) else None


def _time(
    given: Sequence[Column], found: Mapping[str, object], listed: str, source: str
) -> dict[str, tuple[Column, Taken]]:
    if TIME in found:
        return {}
    if not given:
        asked = f'named: --column "time=COLUMN [s]", of {listed}'
        raise InputError(f"time in {source}", "(not found)", asked)
    if len(given) > 1:
        dates = [column for column in given if set(_words(column.name)) & {"date", "datum"}]
        clocks = [column for column in given if column not in dates]
        if len(dates) == 1 and len(clocks) == 1 and not isinstance(dates[0].cells, type(None)):
            joined = _joined(dates[0], clocks[0])
            if joined is not None:
                return {TIME: (joined, Taken(TIME, joined.name, None))}
        names = " or ".join(repr(column.name) for column in given)
        asked = f'one column: --column "time={given[0].name}"'
        raise InputError(f"time in {source}", names, asked)
    return {TIME: (given[0], _taken(TIME, given[0], None, source))}


def _joined(date: Column, clock: Column) -> Column | None:
    """Return a column of dates with the times of day beside them; None if they are no texts."""
    if not isinstance(date.cells, list) or not isinstance(clock.cells, list):
        return None
    cells = [f"{day} {time}" if day else "" for day, time in zip(date.cells, clock.cells)]  # noqa: B905
    return Column(f"{date.name} and {clock.name}", None, cells)
