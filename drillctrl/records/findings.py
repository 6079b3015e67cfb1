"""What was found in a recording, as values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.text import finite_or_none
from drillctrl.records.downhole import Downhole
from drillctrl.records.drive_seen import DriveSeen
from drillctrl.records.fit_values import RecordFit
from drillctrl.records.peaks import Peak
from drillctrl.records.record import Record
from drillctrl.records.swings import Period, Windows, window_means


@dataclass(frozen=True, eq=False)
class ComputedMap:
    """Runs of the string over speed and weight on bit.

    Attributes
    ----------
    speeds, weights : array, (x,), (y,)
        rad/s and N.
    swing : array, (x, y)
        Stick-slip index of the bit; NaN where a run ended before it could be measured.
    outcomes : str array, (x, y)
        Words as in `Outcome`.
    top : str
        What turned the string.
    """

    speeds: FloatArray
    weights: FloatArray
    swing: FloatArray
    outcomes: npt.NDArray[np.str_]
    top: str

    def rows(self) -> list[dict[str, Any]]:
        """Return the JSON fields: a row for each run."""
        return [
            {
                "speed": float(speed),
                "weight_on_bit": float(weight),
                "outcome": str(self.outcomes[i, j]),
                "swing": finite_or_none(float(self.swing[i, j])),
            }
            for i, speed in enumerate(self.speeds)
            for j, weight in enumerate(self.weights)
        ]

    def at(self, speed: float, weight: float) -> float:
        """Return the index of the nearest run."""
        i, j = np.argmin(abs(self.speeds - speed)), np.argmin(abs(self.weights - weight))
        return float(self.swing[i, j])


@dataclass(frozen=True, eq=False)
class Findings:
    """What a recording says; `RecordStudy` tells what each value is."""

    record: Record
    period: Period | None
    swing: float | None
    swing_from: str | None
    severity: Windows | None
    torque_severity: Windows | None
    sticking: float | None
    modes: tuple[Peak, ...]
    modes_from: str | None
    bit: Downhole | None
    string_from: str | None
    fit: RecordFit | None
    drive: DriveSeen | None
    measured_error: float | None
    notes: tuple[str, ...]
    computed: ComputedMap | None = None

    def drilled(self) -> list[dict[str, float | None]]:
        """Return speed, weight on bit and index of the windows: the map of what was drilled."""
        record = self.record
        if self.severity is None or "rotary_speed" not in record.values:
            return []
        speed = window_means(record.values["rotary_speed"], record.step)
        weight = record.values.get("weight_on_bit")
        means = np.full(speed.size, np.nan)
        if weight is not None:
            means = window_means(weight, record.step)
        return [
            {
                "time": float(time),
                "speed": float(turning),
                "weight_on_bit": finite_or_none(float(load)),
                "swing": float(index),
            }
            for time, turning, load, index in zip(
                self.severity.times, speed, means, self.severity.values, strict=True
            )
            if np.isfinite(index) and np.isfinite(turning)
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        record = self.record
        torque = self.torque_severity
        return {
            "schema": "drillctrl/record/1",
            "source": record.source,
            "start": record.start,
            "duration": record.duration,
            "step": record.step,
            "columns": {taken.quantity: taken.column for taken in record.taken},
            "units": {taken.quantity: taken.unit for taken in record.taken},
            "period": None if self.period is None else self.period.value,
            "period_drift": None if self.period is None else self.period.drift,
            "periods": [] if self.period is None else _pairs(self.period.times, self.period.values),
            "swing": self.swing,
            "swing_from": self.swing_from,
            "torque_swing": None if torque is None else median(torque.values),
            "sticking": self.sticking,
            "modes": [mode._asdict() for mode in self.modes],
            "modes_from": self.modes_from,
            "severity": []
            if self.severity is None
            else _pairs(self.severity.times, self.severity.values),
            "drilled": self.drilled(),
            "computed": [] if self.computed is None else self.computed.rows(),
            "drive": None if self.drive is None else self.drive.to_dict(),
            "bit": None if self.bit is None else self._bit_fields(self.bit),
            "fit": None if self.fit is None else self.fit.to_dict(),
            "notes": list(self.notes),
        }

    def _bit_fields(self, bit: Downhole) -> dict[str, Any]:
        known = np.isfinite(bit.speed)
        return {
            "string": self.string_from,
            "band": bit.band,
            "speed_error": bit.speed_error,
            "torque_error": bit.torque_error,
            "speed_min": float(bit.speed[known].min()) if known.any() else None,
            "speed_max": float(bit.speed[known].max()) if known.any() else None,
            "measured_error": self.measured_error,
        }


def median(values: FloatArray) -> float | None:
    """Return the median of what is known; None of nothing."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else None


def _pairs(times: FloatArray, values: FloatArray) -> list[dict[str, float]]:
    return [
        {"time": float(time), "value": float(value)}
        for time, value in zip(times, values, strict=True)
        if np.isfinite(value)
    ]
