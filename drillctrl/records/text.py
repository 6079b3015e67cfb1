"""Tables in text files: which sign separates cells, where the header is, what a number is."""

from __future__ import annotations

import codecs
import contextlib
import csv
import itertools
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError

_SEPARATORS = ("\t", ";", "|", ",")
_SAMPLE = 200
_SIGNS = frozenset("0123456789+-.eE")
# What stands in files of numbers for none.
_ABSENT = (-999.0, -999.25, -9999.0, -9999.25)
_PLAIN = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?", re.ASCII)
_STAMP = re.compile(r"[\dTZ:./+\- ]*\d[:.\-/]\d[\dTZ:.,/+\- ]*(?:AM|PM|UTC)?", re.IGNORECASE)
_GROUPED = (
    re.compile(r"[+-]?\d{1,3}(?:,\d{3})+\.\d+", re.ASCII),
    re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+,\d+", re.ASCII),
)
_WITH_UNIT = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*([^\W\d_].*)", re.ASCII)
_MISSING = {"", "nan", "null", "none", "n/a", "na", "-", "--", "nil"}


class Split(NamedTuple):
    """A table of texts.

    Attributes
    ----------
    names : list of str
        Of the columns.
    units : list
        From a row of units below the names; None where there is none.
    columns : list of list of str
        Their cells, stripped.
    """

    names: list[str]
    units: list[str | None]
    columns: list[list[str]]


def split_text(content: bytes, source: str) -> Split:
    """Return the table of a text file.

    Empty lines are passed over, and so is what stands above the header.

    Raises
    ------
    InputError
        If it is no text, has no rows, or a row has more or fewer cells than the header.
    """
    text = _decoded(content, source)
    numbered = enumerate(re.split(r"\r\n|\r|\n", text), 1)
    told = ((number, line) for number, line in numbered if line.strip(" \t,;|"))
    lines = list(itertools.dropwhile(lambda each: each[1].lstrip().startswith("#"), told))
    if len(lines) < 2:
        raise InputError("record", source, "a header and rows below it")
    separator = _separator([line for _, line in lines[:_SAMPLE]], source)
    rows = _rows([line for _, line in lines], separator, source)
    numbers = [number for number, _ in lines]
    first = next((i for i, row in enumerate(rows) if _is_data(row)), None)
    if first is None:
        raise InputError("record", source, "a header and rows of numbers below it")
    if first == 0:
        names, units = [f"column {i + 1}" for i in range(len(rows[0]))], None
    else:
        names, units = _header(rows[:first])
    width = len(names)
    while width > 1 and not names[width - 1] and all(len(r) < width or not r[-1] for r in rows):
        width -= 1
    repeated = rows[first - 1] if first else None
    kept: list[list[str]] = []
    for number, row in zip(numbers[first:], rows[first:], strict=True):
        if row == repeated:
            raise InputError(f"line {number} of {source}", "the header again", "a row of numbers")
        if len(row) < width or any(row[width:]):
            wanted = f"{width}, as the header has"
            raise InputError(f"line {number} of {source}", f"{len(row)} cells", wanted)
        kept.append(row[:width])
    doubled = [name for name in set(names[:width]) if name and names.count(name) > 1]
    if doubled:
        raise InputError(f"column of {source}", sorted(doubled)[0], "named once in the header")
    cells = [list(column) for column in zip(*kept, strict=True)]
    behind = [None] * width if units is None else [unit or None for unit in units[:width]]
    both = [_without_unit(*each) for each in zip(cells, behind, strict=True)]
    return Split(names[:width], [unit for _, unit in both], [column for column, _ in both])


def _without_unit(cells: list[str], unit: str | None) -> tuple[list[str], str | None]:
    """Return cells without the one unit that stands behind each number, and that."""
    from drillctrl.base.units import known_unit

    own = ""
    for cell in cells:
        if cell.lower() in _MISSING:
            continue
        match = _WITH_UNIT.fullmatch(cell)
        if match is None or (own and match[2] != own):
            return cells, unit
        own = match[2]
    if unit is not None or not known_unit(own):
        return cells, unit
    return [cell.removesuffix(own).rstrip() for cell in cells], own


def _decoded(content: bytes, source: str) -> str:
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encodings = ["utf-16"]
    else:
        encodings = ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            text = content.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    else:
        raise InputError("record", source, "a text file, in UTF-8, UTF-16 or Windows-1252")
    odd = next((c for c in text if ord(c) < 32 and c not in "\t\r\n\f"), None)
    if odd is not None:
        wanted = f"a text file; it has the character {odd!r}"
        raise InputError("record", source, wanted)
    return text


def _rows(lines: Sequence[str], separator: str | None, source: str) -> list[list[str]]:
    if separator is None:
        return [line.split() for line in lines]
    try:
        reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
        rows = [[cell.strip() for cell in row] for row in reader]
    except csv.Error as error:
        raise InputError("record", source, f"a table of text ({error})") from None
    if len(rows) != len(lines):
        raise InputError("record", source, "one line a row; a quotation mark is not closed")
    return rows


def _separator(lines: Sequence[str], source: str) -> str | None:
    """Return the sign that splits the lower half of lines alike; None for spaces."""
    lower = lines[len(lines) // 2 :]
    for sign in _SEPARATORS:
        try:
            counts = [len(row) for row in csv.reader(lower, delimiter=sign)]
        except csv.Error:
            continue
        # Most lines agree; those that do not are named later.
        usual = max(set(counts), key=counts.count, default=1)
        if usual > 1 and 2 * counts.count(usual) > len(counts):
            return sign
    usual = len(lower[0].split())
    if usual > 1:
        return None
    raise InputError("record", source, "columns separated by commas, semicolons, tabs or spaces")


def _is_number(cell: str) -> bool:
    kinds = (_PLAIN, _COMMA, *_GROUPED, _WITH_UNIT)
    return any(kind.fullmatch(cell) for kind in kinds)


def _is_data(row: Sequence[str]) -> bool:
    told = [cell for cell in row if cell.lower() not in _MISSING]
    right = sum(_is_number(cell) or bool(_STAMP.fullmatch(cell)) for cell in told)
    return len(told) > 0 and 2 * right > len(told)


def _header(above: Sequence[list[str]]) -> tuple[list[str], list[str] | None]:
    """Return names, and units from a row of them, from the rows above the first of data."""
    last = above[-1]
    if len(above) > 1 and len(above[-2]) == len(last):
        units = [re.sub(r"^[\[(](.*)[\])]$", r"\1", cell).strip() for cell in last]
        bare = [cell for cell in units if cell]
        if bare and all(_like_unit(cell) for cell in bare):
            return above[-2], units
    return last, None


def _like_unit(cell: str) -> bool:
    from drillctrl.base.units import known_unit

    return known_unit(cell) or cell.lower() in ("date", "time", "utc", "-", "iso", "unitless")


def numbers_of(cells: Sequence[str], name: str, source: str) -> FloatArray:
    """Return the numbers of a column, NaN where a cell is empty or says that there is none.

    Raises
    ------
    InputError
        If a cell is something else, or some have a decimal comma and some a point.
    """
    if set("".join(cells)) <= _SIGNS and all(cells):
        with contextlib.suppress(ValueError):
            return known_numbers(np.array(cells, dtype=float))
    for grouped, sign in zip(_GROUPED, ",.", strict=True):
        # Both signs in a number tell which one sets thousands apart.
        if any(grouped.fullmatch(cell) for cell in cells):
            whole = re.compile(rf"[+-]?(?:\d{{1,3}}(?:\{sign}\d{{3}})+|\d+)(?:[.,]\d+)?")
            if all(whole.fullmatch(cell) for cell in cells if sign in cell):
                cells = [cell.replace(sign, "") for cell in cells]
    commas = any(_COMMA.fullmatch(cell) for cell in cells)
    values = np.full(len(cells), np.nan)
    for i, cell in enumerate(cells):
        if cell.lower() in _MISSING:
            continue
        plain = cell
        if commas:
            if "." in cell:
                where = f"{name}, row {i + 1} of {source}"
                raise InputError(where, cell, "with a decimal comma, as others have")
            plain = cell.replace(",", ".", 1)
        if not _PLAIN.fullmatch(plain):
            shown = cell if len(cell) <= 40 else f"{cell[:40]}…"
            raise InputError(f"{name}, row {i + 1} of {source}", shown, "a number, or empty")
        values[i] = float(plain)
    return known_numbers(values)


def known_numbers(values: FloatArray) -> FloatArray:
    """Return numbers, NaN where one says that there is none."""
    return np.where(np.isin(values, _ABSENT) | np.isinf(values), np.nan, values)
