"""Files of a vibration map: rows, all of it, or a lattice for programs that read grids."""

from __future__ import annotations

import json
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.extras import required
from drillctrl.base.files import replacing, write_text
from drillctrl.base.tableio import csv_text
from drillctrl.charts.axes import Axis
from drillctrl.simulation.status import OUTCOME_NAMED, Outcome
from drillctrl.studies.lattice import fill
from drillctrl.studies.vibration_values import MapValues, Severity

_ENDINGS = (".csv", ".json", ".nc")
_NUMBERS = {
    "swing": "stick-slip index",
    "stick_fraction": "share of the time in torsional stick",
    "off_rock_fraction": "share of the time off the rock",
    "feed": "rate of penetration over that of the top end",
    "weight_ratio": "mean over steady weight on bit",
}


def check_map_path(path: str | Path) -> None:
    """Raise `InputError` if a map cannot be written under this name."""
    ending = Path(path).suffix.lower()
    if ending not in _ENDINGS:
        raise InputError("path", str(path), f"a name that ends in {', '.join(_ENDINGS)}")
    if ending == ".nc":
        required("xarray", "tables")


def save_map(found: MapValues, path: str | Path) -> None:
    """Write a map by the file's ending, whole or not at all.

    Raises
    ------
    InputError
        If the name does not end in .csv, .json or .nc, or a package for it is missing.
    """
    check_map_path(path)
    ending = Path(path).suffix.lower()
    if ending == ".nc":
        content = _netcdf(found)
        with replacing(path) as file:
            file.write(content)
    elif ending == ".json":
        write_text(path, json.dumps(found.to_dict(), indent=1, allow_nan=False) + "\n")
    else:
        told = ", ".join(f"{axis.name} in {axis.unit or '1'}" for axis in _axes(found))
        note = f"drillctrl map: {told}; the worst of the starts {', '.join(found.starts)}"
        write_text(path, csv_text(found.columns(), found.rows(), [note]))


def _axes(found: MapValues) -> tuple[Axis, Axis]:
    return found.plane.x, found.plane.y


def _netcdf(found: MapValues) -> bytes:
    """Return a CF file on the finest lattice: numbers bilinear between points, outcomes nearest."""
    import xarray

    x, y = _axes(found)
    coordinates = {
        axis.name: (axis.name, np.linspace(axis.low, axis.high, count), _units(axis))
        for axis, count in zip((x, y), found.shape, strict=True)
    }
    variables: dict[str, Any] = {}
    severities = {"": found.uncontrolled}
    if found.controlled is not None:
        severities = {"": found.controlled, f"{found.first}_": found.uncontrolled}
    for prefix, severity in severities.items():
        for name, words in _NUMBERS.items():
            field = fill(found.shape, found.cells, found.nodes, getattr(severity, name))
            about = {"units": "1", "long_name": words}
            variables[f"{prefix}{name}"] = ((y.name, x.name), field.T, about)
        ranks = fill(found.shape, found.cells, found.nodes, _ranks(severity))
        flags: dict[str, Any] = {
            "flag_values": np.arange(len(Outcome), dtype="int8"),
            "flag_meanings": " ".join(sorted(OUTCOME_NAMED, key=_rank)),
            "long_name": "what becomes of the bit",
        }
        whole = np.rint(ranks.T).astype("int8")
        variables[f"{prefix}outcome"] = ((y.name, x.name), whole, flags)
    attributes = {
        "Conventions": "CF-1.8",
        "title": "drillctrl vibration map",
        "comment": f"{found.plane.case.place}; worst of the starts {', '.join(found.starts)}",
        "source": f"drillctrl {metadata.version('drillctrl')}",
    }
    data = xarray.Dataset(variables, coordinates, attributes)
    encoding = {name: {"_FillValue": None} for name in (x.name, y.name)}
    return bytes(data.to_netcdf(None, engine="scipy", encoding=encoding))


def _units(axis: Axis) -> dict[str, str]:
    return {"units": axis.unit or "1", "long_name": axis.name.replace("_", " ")}


def _rank(word: str) -> int:
    return OUTCOME_NAMED[word].severity


def _ranks(severity: Severity) -> Any:
    return np.array([_rank(word) for word in severity.outcomes.tolist()], dtype=float)
