"""The bit's motion, carried down, as a table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.files import write_text
from drillctrl.base.language import Language
from drillctrl.base.tableio import csv_text

if TYPE_CHECKING:
    from drillctrl.records.findings import Findings

_RPM = 30.0 / np.pi


def save_bit(study: Findings, path: str | Path, told: Language) -> None:
    """Write the bit's speed and torque over time; see `RecordStudy.save_bit`."""
    if Path(path).suffix.lower() != ".csv":
        raise InputError("path", str(path), "a file that ends in .csv")
    bit = study.bit
    if bit is None:
        raise InputError("path", str(path), "left out: the bit's speed is not known")
    torque, scale = told.units["torque"]
    unit = torque.replace("·", "*")
    header = ["time [s]", "bit speed [rpm]", f"bit torque [{unit}]"]
    columns = [bit.time, _RPM * bit.speed, scale * bit.torque]
    rows = (
        ["" if not np.isfinite(cell) else f"{cell:.6g}" for cell in row]
        for row in zip(*columns, strict=True)
    )
    basis = (
        f"carried down from {study.record.source}; right to {bit.band:.3g} Hz, "
        f"standard errors by noise {_RPM * bit.speed_error:.3g} rpm "
        f"and {scale * bit.torque_error:.3g} {unit}"
    )
    write_text(path, csv_text(header, rows, [basis]))
