"""The bit's motion, carried down, as a table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.files import write_text
from drillctrl.base.tableio import csv_text

if TYPE_CHECKING:
    from drillctrl.records.findings import Findings

_RPM = 30.0 / np.pi


def save_bit(study: Findings, path: str | Path) -> None:
    """Write the bit's speed and torque over time; see `RecordStudy.save_bit`."""
    if Path(path).suffix.lower() != ".csv":
        raise InputError("path", str(path), "a file that ends in .csv")
    bit = study.bit
    if bit is None:
        raise InputError("path", str(path), "left out: the bit's speed is not known")
    header = ["time [s]", "bit speed [rpm]", "bit torque [kN*m]"]
    columns = [bit.time, _RPM * bit.speed, 1e-3 * bit.torque]
    rows = (
        ["" if not np.isfinite(cell) else f"{cell:.6g}" for cell in row]
        for row in zip(*columns, strict=True)
    )
    told = (
        f"carried down from {study.record.source}; right to {bit.band:.3g} Hz, "
        f"standard errors by noise {_RPM * bit.speed_error:.3g} rpm "
        f"and {1e-3 * bit.torque_error:.3g} kN*m"
    )
    write_text(path, csv_text(header, rows, [told]))
