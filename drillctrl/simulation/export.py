"""Write the motion of a simulation to a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.extras import required
from drillctrl.base.files import replacing
from drillctrl.base.tableio import csv_text
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.rig_units import SI_UNITS

ENDINGS = (".csv", ".npz", ".parquet")


def check_export_path(path: str | Path) -> None:
    """Raise `InputError` if a motion cannot be written under this name."""
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise InputError("out", str(path), f"a file that ends in {', '.join(ENDINGS)}")
    if ending == ".parquet":
        required("pyarrow", "tables")


def export_motion(simulation: Simulation, path: str | Path) -> None:
    """Write the motion at the integrator's own steps, whole or not at all.

    That of a rig is written in SI units, any other dimensionless.

    Parameters
    ----------
    simulation : Simulation
        A run.
    path : str or Path
        ``.csv`` (a comment line with the units, then a header), ``.npz`` (one array a column) or
        ``.parquet`` (needs pyarrow).

    Raises
    ------
    InputError
        If the ending is none of these.
    OSError
        If the file cannot be written.
    """
    check_export_path(path)
    if simulation.rig is None:
        columns, units = simulation.motion.columns(), "dimensionless"
    else:
        columns = simulation.in_rig_units().columns()
        units = ", ".join(f"{name} in {unit}" for name, unit in SI_UNITS.items())
    ending = Path(path).suffix.lower()
    with replacing(path) as file:
        if ending == ".npz":
            np.savez_compressed(file, allow_pickle=False, **columns)
        elif ending == ".parquet":
            import pyarrow
            import pyarrow.parquet

            pyarrow.parquet.write_table(pyarrow.table(columns), file)
        else:
            rows = zip(*(column.tolist() for column in columns.values()), strict=True)
            told = f"drillctrl simulation, {units}; {simulation.point!r}"
            file.write(csv_text(columns, rows, [told]).encode("utf-8"))
