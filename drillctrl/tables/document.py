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

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import checked_integer, checked_number
from drillctrl.delay.structure import FeedbackStructure, Tie
from drillctrl.drilling.gain_units import rig_gain_units
from drillctrl.drilling.plant import Plant
from drillctrl.drilling.point import OperatingPoint
from drillctrl.drilling.rig import Rig
from drillctrl.tables.gain_table import ABSCISSA_ERROR, FALLBACKS, GainTable
from drillctrl.tables.grid import MAX_NODES, Axis, Grid
from drillctrl.tables.interpolation import (
    CELL_NAMES,
    CONSTANT,
    UNSAFE,
    Cells,
    cell_shape,
    corners_of,
)

SCHEMA = "drillctrl/gain-table/1"
SIGN = "u = K1 Y(t) + K2 Y(t - tau0) is added to theta''; Y: outputs; tau0 = 2 pi/(blades omega0)"
_BOUNDS = ("K1_lower", "K1_upper", "K2_lower", "K2_upper")
# Four outputs and two inputs make 43.
_MOST_COLUMNS = 64
_LONGEST_WORDS = 1000


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
    columns, units = _columns(table)
    structure, rig = table.structure, table.grid.rig
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
            "values": plain_values(table.grid.reference),
        },
        "plant": table.grid.plant.text,
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
        "tried": table.tried,
        "refused": {str(node): reason for node, reason in sorted(table.refusals.items())},
        "cautions": {str(node): what for node, what in sorted(table.cautions.items())},
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


def _columns(table: GainTable) -> tuple[dict[str, FloatArray], dict[str, str]]:
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
            structure.entry_names,
            rig_gain_units(structure, table.grid.plant, rig) or [],
            table.entries.T,
            strict=False,
        ):
            columns[f"{name}_rig"], units[f"{name}_rig"] = factor * values, unit
    return columns, units


def checksum(header: dict[str, Any], columns: dict[str, FloatArray]) -> str:
    """Return the SHA-256 over the header without its checksum and all columns."""
    rest = {name: value for name, value in header.items() if name != "checksum"}
    digest = hashlib.sha256(json.dumps(rest, sort_keys=True).encode("ascii"))
    for name in sorted(columns):
        digest.update(name.encode() + b"\0" + columns[name].astype("<f8").tobytes())
    return digest.hexdigest()


def checked_layout(header: dict[str, Any]) -> tuple[int, list[str]]:
    """Return how many rows and which columns a header promises.

    To be called before anything as large is touched: a small file may announce a lot.

    Raises
    ------
    ValueError
        If it is the header of no table, or promises no rows, more than `MAX_NODES`, or more
        columns than any table has.
    """
    if header.get("schema") != SCHEMA:
        raise ValueError(f"schema {str(header.get('schema'))[:60]!r} instead of {SCHEMA!r}")
    rows = math.prod(len(values) for values in header["axes"].values())
    if not 1 <= rows <= MAX_NODES:
        raise ValueError(f"{rows} rows announced")
    names = list(header["units"])
    if len(names) > _MOST_COLUMNS:
        raise ValueError(f"{len(names)} columns announced")
    return rows, names


def plain_values(reference: OperatingPoint | Rig) -> dict[str, Any]:
    """Return the numbers of a point or a rig; what a rig knows of its string is in the plant."""
    kind = Rig if isinstance(reference, Rig) else OperatingPoint
    return {item.name: getattr(reference, item.name) for item in dataclasses.fields(kind)}


def from_document(document: Document, plant: Plant) -> GainTable:
    """Return the table that a file holds, of a plant.

    Raises
    ------
    Exception
        If the file holds no sound table: an `InputError`, or whatever a value of another kind
        than it should be makes it raise.
    """
    header, columns = document.header, document.columns
    rows, _ = checked_layout(header)
    if any(values.shape != (rows,) for values in columns.values()):
        raise ValueError(f"columns of other than the {rows} rows announced")
    for name, values in columns.items():
        if not np.isfinite(values).all():
            raise ValueError(f"a {name} that is not finite")
    if header.get("checksum") != checksum(header, columns):
        raise ValueError("a wrong checksum")
    if header["plant"] != plant.text:
        made = str(header["plant"])[:_LONGEST_WORDS]
        raise ValueError(f"gains for another plant, to be given when it is loaded: {made}")
    structure = _read_structure(header["structure"], plant)
    kind = {"point": OperatingPoint, "rig": Rig}[header["reference"]["kind"]]
    axes = tuple(Axis(name, tuple(values)) for name, values in header["axes"].items())
    grid = Grid(axes, kind(**header["reference"]["values"]), plant)
    gains = np.column_stack([columns[name] for name in structure.entry_names])[:, structure.free]
    _check_gains(structure, gains)
    if header["fallback"] not in FALLBACKS:
        raise ValueError(f"fallback {header['fallback']!r}")
    table = GainTable(
        grid,
        structure,
        gains,
        columns["spectral_abscissa"],
        columns[ABSCISSA_ERROR],
        columns["stable"] != 0.0,
        columns["certified"] != 0.0,
        columns["best_abscissa"],
        checked_number("give_up", header["give_up"], 0.0, 0.9),
        header["fallback"],
        checked_integer("seed", header["seed"], 0, 2**63 - 1),
        _read_cells(header["cells"], math.prod(cell_shape(grid)), structure),
        _words("objective", header["objective"]),
        bool(header["tried"]),
        _read_reasons(header["refused"], rows),
        # Older files have none.
        _read_reasons(header.get("cautions", {}), rows),
    )
    _check_consistency(table, document)
    return table


def _words(name: str, value: Any) -> str:
    if not (isinstance(value, str) and len(value) <= _LONGEST_WORDS and value.isprintable()):
        raise ValueError(f"{name} {str(value)[:60]!r}")
    return value


def _read_reasons(given: dict[str, Any], rows: int) -> dict[int, str]:
    found = {int(node): _words("a reason", reason) for node, reason in given.items()}
    if not all(0 <= node < rows for node in found):
        raise ValueError("a reason at a node that is not there")
    return found


def _read_structure(layout: dict[str, Any], plant: Plant) -> FeedbackStructure:
    for what, known in (
        ("outputs", plant.output_names),
        ("inputs", plant.input_names),
    ):
        names = layout[what]
        if not (1 <= len(names) <= len(known) and set(names) <= set(known)):
            raise ValueError(f"{what} {str(names)[:60]}")
    bounds = {name: np.array(layout[name], dtype=float) for name in _BOUNDS}
    return FeedbackStructure(
        _words("a structure named", layout["name"]),
        tuple(layout["outputs"]),
        **bounds,
        inputs=tuple(layout["inputs"]),
        ties=tuple(Tie(*tie) for tie in layout["ties"]),
    )


def _check_gains(structure: FeedbackStructure, gains: FloatArray) -> None:
    slack = 1e-9 * (structure.upper - structure.lower)
    if ((gains < structure.lower - slack) | (gains > structure.upper + slack)).any():
        raise ValueError("gains outside their bounds")


def _read_cells(given: dict[str, Any], count: int, structure: FeedbackStructure) -> Cells:
    mode = np.array(given["mode"])
    worst = np.array(given["spectral_abscissa"], dtype=float)
    known = mode.dtype.kind == "i" and ((mode >= 0) & (mode < len(CELL_NAMES))).all()
    if mode.shape != (count,) or worst.shape != (count,) or not known:
        raise ValueError("cells that do not fit the grid")
    listed = np.flatnonzero(mode == CONSTANT)
    if set(given["gains"]) != {str(cell) for cell in listed}:
        raise ValueError("constant gains of other cells than those that have them")
    gains = np.zeros((count, structure.lower.size))
    for cell in listed.tolist():
        gains[cell] = given["gains"][str(cell)]
    if not (np.isfinite(worst).all() and np.isfinite(gains).all()):
        raise ValueError("a number of a cell that is not finite")
    _check_gains(structure, gains[listed])
    return Cells(mode.astype(np.intp), worst, gains)


def _check_consistency(table: GainTable, document: Document) -> None:
    """Refuse numbers that contradict each other; a checksum is made by whoever makes the file."""
    columns, units = _columns(table)
    if document.columns.keys() != columns.keys() or document.header["units"] != units:
        raise ValueError("other columns or units than its grid and structure make")
    for name, values in columns.items():
        # What follows from the axes may differ in the last bit where another machine made it.
        if not np.allclose(document.columns[name], values, rtol=1e-9, atol=0.0):
            raise ValueError(f"a {name} that does not follow from the rest")
    if (table.abscissa_error < 0.0).any():
        raise ValueError("a negative error of the spectral abscissa")
    if (table.spectral_abscissa[table.stable] >= 0.0).any():
        raise ValueError("a stable node with a positive spectral abscissa")
    vouched = table.cells.mode != UNSAFE
    if not table.on_motion and (table.cells.spectral_abscissa[vouched] >= 0.0).any():
        raise ValueError("a cell that is vouched for with a positive spectral abscissa")
    if not table.sound[corners_of(table.grid)[vouched]].all():
        raise ValueError("a cell that is vouched for with a node that is not")
