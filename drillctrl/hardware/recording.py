"""What went over the line, sample by sample: kept in a file, and read back."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.files import check_regular, write_text
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.tableio import csv_text
from drillctrl.hardware.wire import POINTS

_MARK = "drillctrl bench"
_MOST_BYTES, _MOST_SAMPLES = 2_000_000_000, 10_000_000
_POINTS = {
    "SI": ("rotary_speed", "penetration_rate", "rock_strength"),
    "dimensionless": ("omega0", "delta0", "psi"),
}


@dataclass(frozen=True, eq=False)
class Recording:
    """Samples and their answers, a row a sample.

    Attributes
    ----------
    outputs, inputs : tuple of str
        What was measured, and driven.
    units : {"SI", "dimensionless"}
        Of all columns; wall times are s.
    period : float
        Between samples.
    times : array, (n,)
        Of the motion.
    points : array, (n, 3)
        Set points, as in `Sample`.
    delay : array, (n,)
        τ0.
    measured : array, (n, p)
        Outputs.
    answers : array, (n, m)
        What was answered, before limits; where nothing was, the answer before.
    answered : bool array, (n,)
        Whether an answer came in time.
    lateness : array, (n,)
        Wall time by which the sample was sent too late, s; 0 without a clock.
    round_trip : array, (n,)
        Wall time from sample to answer, or to when it was given up, s.
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    units: str
    period: float
    times: FloatArray
    points: FloatArray
    delay: FloatArray
    measured: FloatArray
    answers: FloatArray
    answered: npt.NDArray[np.bool_]
    lateness: FloatArray
    round_trip: FloatArray

    def __len__(self) -> int:
        return len(self.times)

    @property
    def missed(self) -> int:
        """Samples to which no answer came in time."""
        return int(np.count_nonzero(~self.answered))

    def save(self, path: str | Path) -> None:
        """Write a CSV file, whole or not at all, every number to its last digit."""
        names = _columns(self.units, self.outputs, self.inputs)
        numbers = np.column_stack(
            [self.times, self.points, self.delay, self.measured, self.answers]
        ).tolist()
        rest = zip(
            self.answered.astype(int).tolist(),
            self.lateness.tolist(),
            self.round_trip.tolist(),
            strict=True,
        )
        rows = ([*map(repr, row), *after] for row, after in zip(numbers, rest, strict=True))
        told = [
            f"{_MARK}, {self.units}, period {self.period!r}",
            f"{' '.join(self.outputs)} -> {' '.join(self.inputs)}",
        ]
        write_text(path, csv_text(names, rows, told))


def _columns(units: str, outputs: Sequence[str], inputs: Sequence[str]) -> list[str]:
    after = ["answered", "lateness", "round_trip"]
    return ["time", *_POINTS[units], "delay", *outputs, *inputs, *after]


@checks_kinds
def load_recording(path: str | Path) -> Recording:
    """Read a file that `Recording.save` wrote.

    Raises
    ------
    InputError
        If it cannot be read, is none, or holds a number that is none.
    """
    wanted = "a recording that `drillctrl bench --out` wrote"
    try:
        check_regular(path, _MOST_BYTES)
        with open(path, encoding="utf-8", newline="") as file:
            return _read(path, file.readline(), file.readline(), csv.reader(file))
    except OSError as error:
        raise InputError("replay", str(path), f"{wanted} ({error.strerror})") from None
    except (ValueError, csv.Error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("replay", str(path), f"{wanted} ({error})"[:300]) from None


def _read(path: str | Path, first: str, second: str, rows: csv.reader) -> Recording:  # type: ignore[valid-type]
    words = first.strip().removeprefix("# ").split(", ")
    names = second.strip().removeprefix("# ").split(" -> ")
    if len(words) != 3 or words[0] != _MARK or words[1] not in _POINTS or len(names) != 2:
        raise ValueError("another heading")
    outputs, inputs = (tuple(part.split()) for part in names)
    period = float(words[2].removeprefix("period "))
    header = next(rows, None)
    columns = _columns(words[1], outputs, inputs)
    if header != columns or not outputs or not inputs or not 0.0 < period < 1e9:
        raise ValueError("other columns")
    found: list[list[float]] = []
    for row in rows:
        if len(row) != len(columns) or len(found) == _MOST_SAMPLES:
            raise ValueError(f"row {len(found) + 1}")
        numbers = [float(text) for text in row]
        if not all(map(math.isfinite, numbers)):
            raise ValueError(f"row {len(found) + 1}, not finite")
        found.append(numbers)
    if not found:
        raise InputError("replay", str(path), "a recording of at least one sample")
    table = np.array(found)
    p = 2 + POINTS
    m = p + len(outputs)
    end = m + len(inputs)
    return Recording(
        outputs, inputs, words[1], period, table[:, 0], table[:, 1 : 1 + POINTS],
        table[:, 1 + POINTS], table[:, p:m], table[:, m:end], table[:, end] > 0.5,
        table[:, end + 1], table[:, end + 2],
    )  # fmt: skip
