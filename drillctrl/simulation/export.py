"""Write the motion of a simulation to a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.extras import required
from drillctrl.base.files import replacing
from drillctrl.base.language import FIELD
from drillctrl.base.tableio import csv_text
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.rig_units import QUANTITIES, SI_UNITS

ENDINGS = (".csv", ".npz", ".parquet")
_MOST_ROWS = 10_000_000


def check_export_path(path: str | Path) -> None:
    """Raise `InputError` if a motion cannot be written under this name."""
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise InputError("out", str(path), f"a file that ends in {', '.join(ENDINGS)}")
    if ending == ".parquet":
        required("pyarrow", "tables")


def checked_every(every: float, duration: float) -> float:
    """Return the time between rows of a table of a run that lasts so long, checked."""
    return checked_number("every", every, duration / _MOST_ROWS, 1e9, open_low=True)


def _instants(end: float, every: float) -> FloatArray:
    """Return equally spaced instants of a run."""
    step = checked_every(every, end)
    return step * np.arange(int(end / step) + 1, dtype=float)


def export_motion(simulation: Simulation, path: str | Path, every: float | None = None) -> None:
    """Write the motion, whole or not at all.

    That of a rig is written in SI units, or those of the field where its point says so; any other
    dimensionless.

    Parameters
    ----------
    simulation : Simulation
        A run.
    path : str or Path
        ``.csv`` (a comment line with the units, then a header), ``.npz`` (one array a column) or
        ``.parquet`` (needs pyarrow).
    every : float, optional
        Dimensionless time between the rows, from 0 on; without it they are the integrator's
        own steps.

    Raises
    ------
    InputError
        If the ending is none of these, or there would be more rows than memory is for.
    OSError
        If the file cannot be written.
    """
    check_export_path(path)
    times = None if every is None else _instants(float(simulation.times[-1]), every)
    rig, language = simulation.case.told_rig, simulation.case.language
    if rig is None:
        motion = simulation.motion if times is None else simulation.at(times)
        columns, units = motion.columns(), "dimensionless"
    else:
        seconds = None if times is None else times * rig.time_scale
        columns, names = simulation.in_rig_units(seconds).columns(), dict(SI_UNITS)
        if language is FIELD:
            for name, quantity in QUANTITIES.items():
                columns[name] = language.number(quantity, 1.0) * columns[name]
                names[name] = language.unit(quantity)
        units = ", ".join(f"{name} in {unit}" for name, unit in names.items())
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
