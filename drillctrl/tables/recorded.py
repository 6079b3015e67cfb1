"""A recorded motion as samples of a controller, from a table of numbers."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.files import check_regular

TIMES = ("time", "times", "t")
_MOST_BYTES, _MOST_ROWS = 1_000_000_000, 10_000_000


class RecordedMotion(NamedTuple):
    """Samples of a motion.

    Attributes
    ----------
    outputs : array, (n, p)
        What is measured, in the units of the table.
    places : array, (n, a), optional
        Coordinates on the table's axes; the middle of the table without them.
    delay : array, (n,), optional
        τ0; nearly the longest of the table without it.
    """

    outputs: FloatArray
    places: FloatArray | None = None
    delay: FloatArray | None = None


def read_motion(
    path: str | Path, outputs: Sequence[str], axes: Sequence[str], period: float
) -> RecordedMotion:
    """Read a motion from a CSV file, such as ``simulate`` or ``bench --out`` writes.

    Parameters
    ----------
    path : str or Path
        Comments begin with ``#``; then a header. Columns are found by name: those of the outputs,
        in the units of the table, and, where they are there, of its axes and ``delay``.
        With a column ``time``, ``times`` or ``t`` samples are interpolated linearly at each
        period; else each row is one.
    outputs, axes : sequence of str
        Names of a table's.
    period : float
        Between samples.

    Raises
    ------
    InputError
        If the file cannot be read, lacks an output, has a number that is none, or its times
        do not rise.
    """
    wanted = f"a CSV file with the columns {', '.join(outputs)}"
    try:
        check_regular(path, _MOST_BYTES)
        with open(path, encoding="utf-8", newline="") as file:
            rows = csv.reader(line for line in file if not line.startswith("#"))
            header = [name.strip() for name in next(rows, [])]
            for name in outputs:
                if header.count(name) != 1:
                    raise InputError("motion", str(path), f"{wanted}; {name} is missing")
            times = next((name for name in TIMES if name in header), None)
            placed = all(header.count(name) == 1 for name in axes)
            names = [*outputs, *(axes if placed else ())]
            names += [name for name in ("delay", times) if name is not None and name in header]
            columns = [header.index(name) for name in names]
            found: list[list[float]] = []
            for row in rows:
                if len(row) != len(header) or len(found) == _MOST_ROWS:
                    raise InputError("motion", str(path), f"{wanted}; row {len(found) + 1} is bad")
                found.append([float(row[column]) for column in columns])
    except OSError as error:
        raise InputError("motion", str(path), f"{wanted} ({error.strerror})") from None
    except (ValueError, csv.Error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("motion", str(path), f"{wanted} ({error})"[:300]) from None
    values = np.array(found)
    if not found or not np.isfinite(values).all():
        raise InputError("motion", str(path), f"{wanted}, finite, at least one row")
    if times is not None:
        values = _sampled(values[:, :-1], values[:, -1], period, path)
    count, end = len(outputs), len(outputs) + len(axes)
    delay = values[:, -1] if "delay" in header else None
    return RecordedMotion(values[:, :count], values[:, count:end] if placed else None, delay)


def _sampled(values: FloatArray, times: FloatArray, period: float, path: str | Path) -> FloatArray:
    # Where the motion jumps there are two rows of one time.
    if (np.diff(times) < 0.0).any():
        raise InputError("motion", str(path), "one whose times rise")
    count = math.floor((times[-1] - times[0]) / period + 1e-6) + 1
    if count > _MOST_ROWS:
        raise InputError("motion", str(path), f"one of at most {_MOST_ROWS} periods")
    at = times[0] + period * np.arange(count)
    return np.column_stack([np.interp(at, times, column) for column in values.T])
