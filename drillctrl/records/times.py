"""Instants of the rows of a file, in seconds."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence

import numpy as np

from drillctrl.base import units
from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.records.columns import Taken
from drillctrl.records.raw import Column
from drillctrl.records.text import numbers_of

_CLOCK = re.compile(r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)", re.ASCII)
_NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d*)?(?:[eE][+-]?\d+)?", re.ASCII)
_SLASHED = re.compile(r"(\d{1,4})([/.\-])(\d{1,2})\2(\d{2,4})[T ]+(.*)")
_DAY = 86400.0
_HALF_DAY = 0.5 * _DAY
_NAMED = {"sec": "s", "secs": "s", "seconds": "s", "minutes": "min", "hours": "h", "hr": "h"}


def instants(
    column: Column, taken: Taken, source: str, dates: str | None
) -> tuple[FloatArray, str | None, list[str]]:
    """Return seconds, the first instant as a text if it has a date, and notes.

    Parameters
    ----------
    column, taken
        Of the times.
    source : str
        The file, for messages.
    dates : {"day-first", "month-first"}, optional
        How 03/04/2026 is read.

    Raises
    ------
    InputError
        If a cell is no instant, or dates or the unit have two readings.
    """
    if not isinstance(column.cells, list):
        values = np.asarray(column.cells, dtype=float)
        if column.unit == "epoch":
            return values, _told(values), []
        return _in_seconds(values, column.name, taken, source)
    cells = column.cells
    first = next((cell for cell in cells if cell), "")
    if _NUMBER.fullmatch(first):
        return _in_seconds(numbers_of(cells, column.name, source), column.name, taken, source)
    if _CLOCK.fullmatch(first):
        return _clock(cells, column.name, source), None, []
    values, notes = _stamps(cells, column.name, source, dates)
    return values, _told(values), notes


def _in_seconds(
    values: FloatArray, name: str, taken: Taken, source: str
) -> tuple[FloatArray, str | None, list[str]]:
    unit, notes = taken.unit, []
    if unit is None:
        last = re.split(r"[_\s.]+", name)[-1].lower()
        unit = _NAMED.get(last, last if last in ("s", "ms", "us", "min", "h") else None)
    if unit is None:
        known = values[np.isfinite(values)]
        step = float(np.median(np.abs(np.diff(known)))) if known.size > 1 else 0.0
        if known.size and known[0] > 1e8:
            raise _ask(name, source, f"{known[0]:.0f}", "s or ms since 1970")
        if known.size and 2e4 < known[0] < 8e4 and step < 1e-3:
            raise _ask(name, source, f"{known[0]:.6g}", "days, as spreadsheets count: [day]?")
        if not 0.001 <= step <= 2.0:
            raise _ask(name, source, "(missing)", f"rows are {step:g} apart")
        unit = "s"
        notes = [f"{name} has no unit and was taken as seconds"]
    where = f"unit of {name} in {source}"
    spelt = _NAMED.get(unit.lower(), unit.lower() if unit.isupper() else unit)
    factor = units.to_si(where, f"1 {spelt}", units.TIME)
    return values * factor, None, notes


def _ask(name: str, source: str, value: str, why: str) -> InputError:
    asked = f'given: --column "time={name} [s]", or its own ({why})'
    return InputError(f"unit of {name} in {source}", value, asked)


def _clock(cells: Sequence[str], name: str, source: str) -> FloatArray:
    """Return seconds of times of day, which begin anew at midnight."""
    values = np.full(len(cells), np.nan)
    for i, cell in enumerate(cells):
        if not cell:
            continue
        match = _CLOCK.fullmatch(cell)
        if match is None:
            raise _bad(cell, name, i, source, "a time of day such as 13:05:00.25, or empty")
        hours, minutes, seconds = int(match[1]), int(match[2]), float(match[3].replace(",", "."))
        if hours > 23 or minutes > 59 or seconds >= 61.0:
            raise _bad(cell, name, i, source, "a time of day, from 00:00:00 to 23:59:59")
        values[i] = 3600.0 * hours + 60.0 * minutes + seconds
    steps = np.diff(np.where(np.isfinite(values), values, 0.0), prepend=values[:1])
    days = np.cumsum(np.where(steps < -_HALF_DAY, 1.0, np.where(steps > _HALF_DAY, -1.0, 0.0)))
    return np.asarray(values + _DAY * days)


def _bad(cell: str, name: str, row: int, source: str, wanted: str) -> InputError:
    shown = cell if len(cell) <= 40 else f"{cell[:40]}…"
    return InputError(f"{name}, row {row + 1} of {source}", shown, wanted)


def _stamps(
    cells: Sequence[str], name: str, source: str, dates: str | None
) -> tuple[FloatArray, list[str]]:
    order, notes = _order(cells, name, source, dates)
    values = np.full(len(cells), np.nan)
    zoned: bool | None = None
    for i, cell in enumerate(cells):
        if not cell:
            continue
        try:
            stamp = dt.datetime.fromisoformat(_iso(cell, order))
        except ValueError:
            wanted = "an instant such as 2026-03-01T12:00:00.05+01:00, or empty"
            raise _bad(cell, name, i, source, wanted) from None
        if zoned is None:
            zoned = stamp.tzinfo is not None
        if (stamp.tzinfo is not None) != zoned:
            wanted = "with a time zone, as the first has" if zoned else "without one, as the first"
            raise _bad(cell, name, i, source, wanted)
        stamp = stamp if zoned else stamp.replace(tzinfo=dt.UTC)
        values[i] = stamp.timestamp()
    return values, notes


def _order(
    cells: Sequence[str], name: str, source: str, dates: str | None
) -> tuple[str, list[str]]:
    """Return how dates are written: year, day or month first."""
    first = second = 0
    sign = ""
    for cell in cells:
        match = _SLASHED.fullmatch(cell)
        if match is None or len(match[1]) == 4:
            continue
        first, second, sign = max(first, int(match[1])), max(second, int(match[3])), match[2]
    if not first:
        return "year-first", []
    if first > 12 and second > 12:
        raise InputError(f"dates of {name} in {source}", f"{first}, {second}", "days and months")
    found = {"day-first"} if first > 12 or sign == "." else {"day-first", "month-first"}
    found = {"month-first"} if second > 12 else found
    if dates is not None:
        found &= {dates}
        if not found:
            raise InputError("dates", dates, f"how they are written in {source}")
    if len(found) > 1:
        asked = "told apart: --dates day-first or --dates month-first"
        example = next(cell for cell in cells if _SLASHED.fullmatch(cell))
        raise InputError(f"dates of {name} in {source}", example, asked)
    order = found.pop()
    return order, [f"dates of {name} were read {order}"]


def _iso(cell: str, order: str) -> str:
    text = re.sub(r"\s*(UTC|GMT|Z)$", "+00:00", cell.strip())
    text = re.sub(r"\s+(?=[+-]\d\d:?\d\d$)", "", text).replace(",", ".")
    match = _SLASHED.fullmatch(text)
    if match is None or order == "year-first":
        return text.replace("/", "-")
    day, month = (match[1], match[3]) if order == "day-first" else (match[3], match[1])
    year = match[4] if len(match[4]) == 4 else f"20{match[4]}"
    clock = match[5].strip()
    half = re.fullmatch(r"(\d{1,2})(:.*?)\s*([AP])M", clock, re.IGNORECASE)
    if half is not None:
        clock = f"{int(half[1]) % 12 + 12 * (half[3].upper() == 'P'):02d}{half[2]}"
    clock = clock if re.match(r"\d\d", clock) else f"0{clock}"
    return f"{year}-{int(month):02d}-{int(day):02d}T{clock}"


def _told(values: FloatArray) -> str | None:
    known = values[np.isfinite(values)]
    if not known.size or not -6e10 < known[0] < 2.5e11:
        return None
    return dt.datetime.fromtimestamp(float(known.min()), dt.UTC).isoformat()
