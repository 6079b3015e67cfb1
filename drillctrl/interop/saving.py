"""Results in files: what took long to compute is not computed again.

A file is JSON that a person can read: a header, and the result as it is, every number to the last
digit. Physics is code and is not in it: the file names its plant, and the reader must have it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from drillctrl.base.codec import decode, encode
from drillctrl.base.errors import InputError
from drillctrl.base.files import check_regular, write_text
from drillctrl.base.kinds import checks_kinds
from drillctrl.designs.result import Analysis
from drillctrl.drilling.plant import Plant, paper_plant
from drillctrl.interop.saved_kinds import CLASSES, RESULTS, Result
from drillctrl.simulation.kept import kept_run, restored_run
from drillctrl.simulation.result import Simulation
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.studies.campaign import Campaign
from drillctrl.studies.trial import OUTCOMES

SCHEMA = "drillctrl/result/1"
# A run of a million steps has some hundred million digits.
MAX_BYTES = 1_000_000_000
_NAMES = ", ".join(kind.__name__ for kind in RESULTS)


@checks_kinds
def save_result(result: Result, path: str | Path) -> None:
    """Write a result to a JSON file, whole or not at all; `load_result` reads it.

    Parameters
    ----------
    result : Design, Analysis, Simulation, Campaign, Comparison, VibrationMap or RigReport
        The result, of any plant; also a StabilityChart, StabilisableChart or StabilityVolume,
        a BitResponse, BitBand, DrillingMotion, RecordStudy or DriveComparison.
    path : str or Path
        A name that ends in .json.

    Raises
    ------
    InputError
        If it is another result, holds something of your own other than a plant, or the name
        does not end in .json.
    OSError
        If the file cannot be written; an existing one is then left as it was.
    """
    _check_ending(path)
    if not isinstance(result, RESULTS):
        raise InputError("result", type(result).__name__, f"one of {_NAMES}")
    try:
        if isinstance(result, Simulation):
            content = {"Simulation": _plain(result)["run"]}
        else:
            content = {type(result).__name__: encode(result, CLASSES, _plain)}
    except TypeError as error:
        wanted = f"made of what drillctrl defines, not of {error}"
        raise InputError("result", type(result).__name__, wanted) from None
    header = {"schema": SCHEMA, "drillctrl": metadata.version("drillctrl")}
    # As a reader will see them.
    content = json.loads(json.dumps(content, allow_nan=False))
    document = {**header, "checksum": _checksum(content), "result": content}
    write_text(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


@checks_kinds
def load_result(path: str | Path, plant: Plant | None = None) -> Result:
    """Read a result that `save_result` wrote.

    Nothing in a file is ever executed, and what can be checked against the physics is: the
    linear system of a design is that of its plant, its spectral abscissa that of its gains,
    the steps of a run follow each other.

    Parameters
    ----------
    path : str or Path
        The file.
    plant : Plant, optional
        The physics, which a file names but cannot hold; by default the paper's with the string
        that its rig may have.

    Returns
    -------
    Design, Analysis, Simulation, Campaign or another of what `save_result` takes
        As it was saved.

    Raises
    ------
    InputError
        If there is no such file, it is truncated, changed, or no result at all, or of
        another plant.
    """
    _check_ending(path)
    try:
        check_regular(path, MAX_BYTES)
        document = json.loads(Path(path).read_text(encoding="utf-8"))
        return _read(document, plant)
    except OSError as error:
        reason = error.strerror or "not readable"
        raise InputError("result", str(path), f"a readable file ({reason})") from None
    except Exception as error:
        # Whatever a broken file makes the classes raise.
        reason = " ".join(f"{type(error).__name__} {error}".split())[:400]
        raise InputError("result", str(path), f"an intact result ({reason})") from None


def _check_ending(path: str | Path) -> None:
    if Path(path).suffix.lower() != ".json":
        raise InputError("result", str(path), "a name that ends in .json")


def _plain(value: Any) -> Any:
    """Return plants by their texts, and of runs what they follow from."""
    if isinstance(value, Simulation):
        return {"run": encode(kept_run(value), CLASSES, _plain)["map"]}
    return {"plant": value.text} if isinstance(value, Plant) else None


def _checksum(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode("utf-8")).hexdigest()


def _read(document: Any, plant: Plant | None) -> Result:
    if document.get("schema") != SCHEMA:
        raise ValueError(f"schema {str(document.get('schema'))[:60]!r} instead of {SCHEMA!r}")
    content = document["result"]
    if document.get("checksum") != _checksum(content):
        raise ValueError("a wrong checksum")
    ((name, data),) = content.items()
    if name not in {kind.__name__ for kind in RESULTS}:
        raise ValueError(f"a result of kind {name[:60]!r}")
    known = [paper_plant(), *_strings(data)] if plant is None else [plant]

    def physics(text: Any) -> Plant:
        for one in known:
            if one.text == text:
                return one
        raise ValueError(f"another plant, to be given when it is loaded: {str(text)[:400]}")

    def run(kept: Any) -> Simulation:
        return restored_run({key: decode(kept[key], CLASSES, special) for key in kept})

    special = {"plant": physics, "run": run}
    if name == "Simulation":
        return run(data)
    result: Any = decode(data, CLASSES, special)
    if type(result).__name__ != name:
        raise ValueError(f"a {type(result).__name__} in place of a {name}")
    if isinstance(result, Analysis):
        _check_analysis(result)
    elif isinstance(result, Campaign):
        _check_campaign(result)
    # What cannot be told is of another kind than it should be.
    if hasattr(result, "summary"):
        result.summary()
        json.dumps(result.to_dict(), allow_nan=False)
    return result  # type: ignore[no-any-return]


def _strings(data: Any) -> list[Plant]:
    """Return the plants of the rigs with a string that a result tells of."""
    if isinstance(data, list):
        return [plant for item in data for plant in _strings(item)]
    if not isinstance(data, Mapping):
        return []
    if data.get("is") == "StringRig":
        return [paper_plant(**decode(data, CLASSES).hardware())]
    return [plant for item in data.values() for plant in _strings(item)]


def _check_analysis(result: Analysis) -> None:
    """Refuse a result whose gains do not do what it says on the plant that it names."""
    structure = result.structure
    meant = result.case.system(None if structure is None else structure.inputs)
    mine = (result.plant.A0, *result.plant.delayed, result.plant.B, result.plant.C)
    theirs = (meant.A0, *meant.delayed, meant.B, meant.C)
    if result.plant.delays != meant.delays or not all(
        a.shape == b.shape and np.allclose(a, b, rtol=1e-9, atol=1e-12)
        for a, b in zip(mine, theirs, strict=True)
    ):
        raise ValueError("a linear system that is not that of its plant")
    alpha = spectral_abscissa(result.system())
    room = 1e-6 * (1.0 + abs(alpha)) + 10.0 * result.loop.abscissa_error
    if not abs(alpha - result.loop.spectral_abscissa) <= room:
        told = f"{result.loop.spectral_abscissa:g} where its gains have {alpha:g}"
        raise ValueError(f"a spectral abscissa of {told}")
    if result.stable and not result.loop.spectral_abscissa < 0.0:
        raise ValueError("a stable loop with a positive spectral abscissa")


def _check_campaign(found: Campaign) -> None:
    points, sizes = len(found.grid.points), len(found.sizes)
    shapes = {
        "spectral_abscissa": (points,),
        "durations": (points,),
        "outcomes": (points, sizes),
        "settling_times": (points, sizes),
        "basin": (points, 2),
    }
    for name, shape in shapes.items():
        if np.shape(getattr(found, name)) != shape:
            raise ValueError(f"{name} that do not fit the grid")
    strange = {*found.outcomes.ravel().tolist()} - {*OUTCOMES}
    if strange:
        raise ValueError(f"outcomes {sorted(map(str, strange))}")
