"""A table as a header and columns of numbers, the form that all files share."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import platform
from importlib import metadata
from typing import Any

import numpy as np

from drillctrl.errors import InputError
from drillctrl.feedback import FeedbackStructure, Tie
from drillctrl.operating_point import OperatingPoint
from drillctrl.rig import Rig
from drillctrl.spectrum.characteristic import FloatArray
from drillctrl.tables.grid import MAX_NODES, Axis, Grid
from drillctrl.tables.interpolation import CELL_NAMES, Cells, cell_shape
from drillctrl.tables.table import FALLBACKS, GainTable

SCHEMA = "drillctrl/gain-table/1"
SIGN = "u = K1 Y(t) + K2 Y(t - tau0) is added to theta''; Y: outputs; tau0 = 2 pi/(blades omega0)"
_BOUNDS = ("K1_lower", "K1_upper", "K2_lower", "K2_upper")


@dataclasses.dataclass(frozen=True, eq=False)
class Document:
    """What a file holds.

    Attributes
    ----------
    header : dict
        JSON values: what the numbers mean, and what has no column.
    columns : dict of str to array, (q,)
        One value a node.
    """

    header: dict[str, Any]
    columns: dict[str, FloatArray]


def to_document(table: GainTable) -> Document:
    """Return the file form of a table.

    In rig units there are further columns: the axes, the delay in seconds, and every gain in
    N·m/rad or N·m·s/rad.
    """
    columns = {
        name: np.array(values, dtype=float)
        for name, values in zip(table.columns, zip(*table.rows(), strict=True), strict=True)
    }
    units = dict.fromkeys(columns, "1")
    structure, rig = table.structure, table.grid.rig
    if rig is not None:
        for axis, values in zip(table.grid.axes, table.grid.coordinates.T, strict=True):
            columns[axis.name], units[axis.name] = values.copy(), axis.unit
        columns["delay_s"] = np.array([p.delay for p in table.grid.points]) * rig.time_scale
        units["delay_s"] = "s"
        for name, (factor, unit), values in zip(
            structure.entry_names, rig_gain_units(table) or [], table.entries.T, strict=False
        ):
            columns[f"{name}_rig"], units[f"{name}_rig"] = factor * values, unit
    header: dict[str, Any] = {
        "schema": SCHEMA,
        "drillctrl": metadata.version("drillctrl"),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "sign_convention": SIGN,
        "sample_time": "continuous",
        "units": units,
        "axes": {axis.name: list(axis.values) for axis in table.grid.axes},
        "reference": {
            "kind": "point" if rig is None else "rig",
            "values": dataclasses.asdict(table.grid.reference),
        },
        "structure": {
            "name": structure.name,
            "outputs": list(structure.outputs),
            "inputs": list(structure.inputs),
            "ties": [dataclasses.astuple(tie) for tie in structure.ties],
            **{name: getattr(structure, name).tolist() for name in _BOUNDS},
        },
        "give_up": table.give_up,
        "fallback": table.fallback,
        "seed": table.seed,
        "objective": table.objective,
        "cells": {
            "modes": list(CELL_NAMES),
            "mode": table.cells.mode.tolist(),
            "spectral_abscissa": table.cells.spectral_abscissa.tolist(),
            # Only cells with gains of their own are listed.
            "gains": {
                str(i): table.cells.gains[i].tolist() for i in np.flatnonzero(table.cells.mode == 1)
            },
        },
    }
    header = json.loads(json.dumps(header, allow_nan=False))
    header["checksum"] = checksum(header, columns)
    return Document(header, columns)


def rig_gain_units(table: GainTable) -> list[tuple[float, str]] | None:
    """Return factor and SI unit of each entry of (K1, K2); None without rig units for them."""
    structure, rig = table.structure, table.grid.rig
    if rig is None or structure.inputs != ("torque",):
        return None
    if not set(structure.outputs) <= {"theta", "dtheta"}:
        return None
    # θ is in radians already; θ' is per unit of time, u in units of Kt.
    known = {
        "theta": (rig.torsional_stiffness, "N*m/rad"),
        "dtheta": (rig.torsional_stiffness * rig.time_scale, "N*m*s/rad"),
    }
    return [known[output] for output in structure.outputs] * 2


def checksum(header: dict[str, Any], columns: dict[str, FloatArray]) -> str:
    """Return the SHA-256 over the header without its checksum and all columns."""
    rest = {name: value for name, value in header.items() if name != "checksum"}
    digest = hashlib.sha256(json.dumps(rest, sort_keys=True).encode("ascii"))
    for name in sorted(columns):
        digest.update(name.encode() + b"\0" + columns[name].astype("<f8").tobytes())
    return digest.hexdigest()


def announced_rows(header: dict[str, Any]) -> int:
    """Return how many rows a header promises, before anything that large is touched.

    Raises
    ------
    ValueError
        If it promises none or more than `MAX_NODES`.
    """
    rows = math.prod(len(values) for values in header["axes"].values())
    if not 1 <= rows <= MAX_NODES:
        raise ValueError(f"{rows} rows announced")
    return rows


def from_document(document: Document) -> GainTable:
    """Return the table that a file holds.

    Raises
    ------
    InputError
        If the file holds no sound table; the message says what is wrong.
    """
    try:
        return _read(document)
    except InputError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError) as error:
        reason = f"{type(error).__name__} {error}" if isinstance(error, KeyError) else str(error)
        raise InputError("table", reason, "a sound gain table") from None


def _read(document: Document) -> GainTable:
    header, columns = document.header, document.columns
    if header.get("schema") != SCHEMA:
        raise ValueError(f"schema {str(header.get('schema'))[:60]!r} instead of {SCHEMA!r}")
    rows = announced_rows(header)
    if any(values.shape != (rows,) for values in columns.values()):
        raise ValueError(f"columns of other than the {rows} rows announced")
    for name, values in columns.items():
        if not np.isfinite(values).all():
            raise ValueError(f"a {name} that is not finite")
    if header.get("checksum") != checksum(header, columns):
        raise ValueError("a wrong checksum")
    layout = header["structure"]
    structure = FeedbackStructure(
        layout["name"],
        tuple(layout["outputs"]),
        np.array(layout["K1_lower"], dtype=float),
        np.array(layout["K1_upper"], dtype=float),
        np.array(layout["K2_lower"], dtype=float),
        np.array(layout["K2_upper"], dtype=float),
        inputs=tuple(layout["inputs"]),
        ties=tuple(Tie(*tie) for tie in layout["ties"]),
    )
    kind = {"point": OperatingPoint, "rig": Rig}[header["reference"]["kind"]]
    axes = [Axis(name, tuple(values)) for name, values in header["axes"].items()]
    grid = Grid((axes[0], axes[1], axes[2]), kind(**header["reference"]["values"]))
    entries = np.column_stack([columns[name] for name in structure.entry_names])
    gains = entries[:, structure.free]
    if header["fallback"] not in FALLBACKS:
        raise ValueError(f"fallback {header['fallback']!r}")
    return GainTable(
        grid,
        structure,
        gains,
        columns["spectral_abscissa"],
        columns["stable"] != 0.0,
        columns["certified"] != 0.0,
        columns["best_abscissa"],
        float(header["give_up"]),
        header["fallback"],
        int(header["seed"]),
        _read_cells(header["cells"], math.prod(cell_shape(grid)), gains.shape[1]),
        str(header["objective"]),
    )


def _read_cells(given: dict[str, Any], count: int, width: int) -> Cells:
    mode = np.array(given["mode"], dtype=np.intp)
    worst = np.array(given["spectral_abscissa"], dtype=float)
    gains = np.zeros((count, width))
    for cell, vector in given["gains"].items():
        gains[int(cell)] = vector
    known = (mode >= 0) & (mode < len(CELL_NAMES))
    if mode.shape != (count,) or worst.shape != (count,) or not known.all():
        raise ValueError("cells that do not fit the grid")
    if not (np.isfinite(worst).all() and np.isfinite(gains).all()):
        raise ValueError("a number of a cell that is not finite")
    return Cells(mode, worst, gains)
