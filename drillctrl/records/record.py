"""A recording of a rig: what was measured, in SI units, at equal steps."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.records.columns import (
    LARGEST,
    TIME,
    Taken,
    choose_columns,
    factor,
    read_choices,
)
from drillctrl.records.health import without_spikes
from drillctrl.records.raw import Column, read_columns
from drillctrl.records.text import known_numbers, numbers_of
from drillctrl.records.times import instants

_FEWEST_ROWS = 50
_MOST_SAMPLES = 20_000_000
# A gap is longer than so many steps.
_GAP = 5.0
_POINT, _THOUSANDS = re.compile(r"[-+]?\d+\.\d+"), re.compile(r"[-+]?\d{1,3}(,\d{3})+")
# So many times as many rows go back in time as go on: a file in reverse.
_REVERSED = 3.0
# More than this share of rows that go back, and as many that repeat a time, are no times.
_NO_TIMES = 0.2
# Fewer stamps than this do not tell how far apart they are.
_STAMPS = 4
DATES = ("day-first", "month-first")


@dataclass(frozen=True, eq=False)
class Record:
    """A recording; make it with `read_record`.

    Attributes
    ----------
    source : str
        Where it comes from.
    step : float
        Time between samples, s.
    values : mapping
        Quantity → array, (k,), in SI units, NaN in gaps. Torque that turns the string is
        positive where rotation is.
    taken : tuple of Taken
        What was taken for what.
    start : str or None
        The first instant, where the file has dates.
    notes : tuple of str
        What was done to the rows.
    """

    source: str
    step: float
    values: Mapping[str, FloatArray]
    taken: tuple[Taken, ...] = ()
    start: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def time(self) -> FloatArray:
        """Seconds from the first sample, (k,)."""
        size = next(iter(self.values.values())).size
        return self.step * np.arange(size, dtype=float)

    @property
    def duration(self) -> float:
        """From the first to the last sample, s."""
        return float(self.time[-1])

    def part(self, begin: float, end: float) -> Record:
        """Return the samples from one time to another, s from the first.

        Raises
        ------
        InputError
            If fewer than 50 are left.
        """
        first, last = max(0, math.ceil(begin / self.step)), math.floor(end / self.step) + 1
        values = {name: data[first:last] for name, data in self.values.items()}
        if len(next(iter(values.values()))) < _FEWEST_ROWS:
            wanted = f"a part of 0 to {self.duration:g} s with at least {_FEWEST_ROWS} samples"
            raise InputError("part", f"{begin:g} to {end:g} s", wanted)
        return replace(self, values=values)

    def slower(self, step: float) -> Record:
        """Return means over as many samples as fit into a longer step, s."""
        count = int(step / self.step + 1e-9)
        if count < 2:
            return self
        size = next(iter(self.values.values())).size // count
        values = {
            name: data[: size * count].reshape(size, count).mean(axis=1)
            for name, data in self.values.items()
        }
        return replace(self, step=self.step * count, values=values)

    def segments(self, *names: str, shortest: float = 0.0) -> list[slice]:
        """Return the stretches without gaps in these quantities, of a least length in s."""
        known = np.all([np.isfinite(self.values[name]) for name in names], axis=0)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], known.astype(int), [0]])))
        least = max(2.0, shortest / self.step)
        return [
            slice(int(a), int(b))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
            if b - a >= least
        ]


@checks_kinds
def read_record(
    path: str | Path, columns: Iterable[str] = (), *, dates: str | None = None
) -> Record:
    """Read what a rig has recorded.

    Parameters
    ----------
    path : str or Path
        ``.csv``, ``.txt`` or ``.tsv`` (separated by commas, semicolons, tabs or spaces; decimal
        points or commas), ``.las`` (with lasio), ``.parquet`` (with pyarrow) or ``.mat``
        (MATLAB 5 to 7.2, a vector a column).
    columns : iterable of str
        Which column is what, where names and units do not tell: ``"torque=STOR [kft.lbf]"``.
    dates : {"day-first", "month-first"}, optional
        How 03/04/2026 is read; needed only where no date tells.

    Raises
    ------
    InputError
        If the file is damaged, or a column, unit or date that is needed cannot be told; one line
        that names the candidates.
    """
    if dates is not None and dates not in DATES:
        raise InputError("dates", dates, f"one of {', '.join(DATES)}")
    choices, source = read_choices(columns), str(path)
    found, notes = choose_columns(read_columns(path), choices, source)
    column, taken = found.pop(TIME)
    times, start, more = instants(column, taken, source, dates)
    notes += more
    _check_signs([column, *(one for one, _ in found.values())], source)
    values = {}
    for name, (column, what) in found.items():
        assert what.unit is not None
        data = _numbers(column, source) * factor(name, what.unit, column.name)
        most = float(np.nanmax(np.abs(data), initial=0.0)) if np.isfinite(data).any() else math.nan
        if math.isnan(most):
            raise InputError(f"{column.name} of {source}", "no numbers", "a column of numbers")
        if most > LARGEST[name]:
            row = int(np.nanargmax(np.abs(data)))
            shown = f"{data[row] / factor(name, what.unit, ''):g} {what.unit}"
            limit = f"at most {LARGEST[name] / factor(name, what.unit, ''):.4g} {what.unit}"
            raise InputError(f"{column.name}, row {row + 1} of {source}", shown, limit)
        if data.size != times.size:
            wanted = f"{times.size} numbers, as the times"
            raise InputError(f"{column.name} of {source}", f"{data.size} numbers", wanted)
        values[name] = data
    step, values, done = _even(times, values, source)
    told = [taken, *(what for _, what in found.values())]
    return Record(source, step, values, tuple(told), start, (*notes, *done))


def _check_signs(columns: Iterable[Column], source: str) -> None:
    """Refuse commas that may be thousands: all before three digits, beside decimal points."""
    texts = [column for column in columns if isinstance(column.cells, list)]
    points = any(_POINT.fullmatch(cell) for column in texts for cell in column.cells)
    for column in texts:
        told = [cell for cell in column.cells if "," in cell]
        if points and told and all(_THOUSANDS.fullmatch(cell) for cell in told):
            wanted = "without commas: of thousands or of decimals, while others have points?"
            raise InputError(f"{column.name} of {source}", told[0], wanted)


def _numbers(column: Column, source: str) -> FloatArray:
    if isinstance(column.cells, list):
        return numbers_of(column.cells, column.name, source)
    data = np.asarray(column.cells, dtype=float)
    return known_numbers(data)


def _even(
    times: FloatArray, values: Mapping[str, FloatArray], source: str
) -> tuple[float, dict[str, FloatArray], list[str]]:
    """Return step, values at equal steps, and what was done for it."""
    notes = []
    known = np.isfinite(times)
    if not known.all():
        notes.append(f"{int((~known).sum())} rows without a time were left out")
    times = times[known]
    rows = {name: data[known] for name, data in values.items()}
    if times.size < _FEWEST_ROWS:
        raise InputError("record", source, f"at least {_FEWEST_ROWS} rows with a time")
    steps = np.diff(times)
    if (steps < 0.0).sum() > _REVERSED * (steps > 0.0).sum():
        notes.append("the rows stood in reverse and were turned round")
        times, rows = times[::-1], {name: data[::-1] for name, data in rows.items()}
    if falling := int((np.diff(times) < 0.0).sum()):
        notes.append(f"time went back at {falling} rows; rows were sorted by time")
        order = np.argsort(times, kind="stable")
        alike = int((np.diff(times[order]) == 0.0).sum())
        if min(falling, alike) > _NO_TIMES * times.size:
            wanted = f"rising: it goes back at {falling} of {times.size} rows. Are these times?"
            raise InputError(f"times of {source}", f"{alike} rows alike", wanted)
        times, rows = times[order], {name: data[order] for name, data in rows.items()}
    times, rows, more = _without_repeats(times, rows)
    notes += more
    times = np.asarray(times - times[0], dtype=float)
    steps = np.diff(times)
    step = float(np.median(steps)) if steps.size else 0.0
    if not step > 0.0 or times[-1] < 10.0 * step:
        raise InputError(f"times of {source}", "all the same", "rising")
    count = round(times[-1] / step) + 1
    if count > _MOST_SAMPLES:
        wanted = f"at most {_MOST_SAMPLES} steps of {step:g} s from first to last"
        raise InputError(f"times of {source}", f"{count} steps", wanted)
    rows, more = without_spikes(times, rows, step)
    notes += more
    grid = step * np.arange(count)
    gaps = steps[steps > _GAP * step]
    if gaps.size:
        notes.append(f"{gaps.size} gaps of {gaps.sum():.3g} s together were left open")
    even = {name: _interpolated(grid, times, data, step) for name, data in rows.items()}
    for name in ("rotary_speed", "torque"):
        if name in even and np.nanmean(even[name]) < 0.0:
            even[name] = -even[name]
            notes.append(f"{name} is negative throughout and was turned round")
    return step, even, notes


def _without_repeats(
    times: FloatArray, rows: dict[str, FloatArray]
) -> tuple[FloatArray, dict[str, FloatArray], list[str]]:
    """Return rows with times that all differ."""
    same = np.diff(times) == 0.0
    if not same.any():
        return times, rows, []
    alike = np.all([np.nan_to_num(np.diff(data), nan=1.0) == 0.0 for data in rows.values()], axis=0)
    repeated = np.concatenate([[False], same & alike])
    notes = []
    # Stamps of whole seconds above a faster clock: rows lie evenly within each.
    if same.sum() > 0.4 * times.size and repeated.sum() < 0.5 * same.sum():
        first = np.flatnonzero(np.concatenate([[True], ~same]))
        counts = np.diff(np.append(first, times.size))
        unit = float(np.median(np.diff(times[first]))) if first.size > 1 else 0.0
        within = np.arange(times.size) - np.repeat(first, counts)
        usual = float(np.median(counts))
        spread = times + unit * within / np.repeat(np.maximum(counts, usual), counts)
        if first.size < _STAMPS:
            wanted = f"finer: {first.size} different ones cannot tell {times.size} rows apart"
            raise InputError("times of the record", f"{usual:g} rows alike", wanted)
        notes.append(f"about {usual:g} rows share each time and were spread evenly over {unit:g} s")
        keep = np.concatenate([[True], np.diff(spread) > 0.0])
        return spread[keep], {name: data[keep] for name, data in rows.items()}, notes
    keep = np.concatenate([[True], ~same])
    differing = int((~keep).sum()) - int(repeated.sum())
    notes.append(f"{int((~keep).sum())} rows repeat the time before and were left out")
    if differing:
        notes[-1] += f", {differing} of them with other numbers"
    return times[keep], {name: data[keep] for name, data in rows.items()}, notes


def _interpolated(grid: FloatArray, times: FloatArray, data: FloatArray, step: float) -> FloatArray:
    """Return values at equal steps, NaN within gaps; a column may be slower than the file."""
    known = np.isfinite(data)
    if known.sum() < 2:
        return np.full(grid.size, np.nan)
    at, what = times[known], data[known]
    own = max(step, float(np.median(np.diff(at))))
    even = np.interp(grid, at, what)
    outside = (grid < at[0] - 0.5 * step) | (grid > at[-1] + 0.5 * step)
    after = np.clip(np.searchsorted(at, grid), 1, at.size - 1)
    wide = at[after] - at[after - 1] > _GAP * own
    inside = (grid > at[after - 1] + 0.5 * step) & (grid < at[after] - 0.5 * step)
    return np.where((wide & inside) | outside, np.nan, even)
