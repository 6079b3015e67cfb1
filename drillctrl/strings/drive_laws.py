"""Laws of a top drive by the depth of its string, as a closing of loops and from a file."""

from __future__ import annotations

import csv
import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.files import check_regular
from drillctrl.base.kinds import checks_kinds, makes_of_kinds
from drillctrl.strings.drive_control import DriveControl, DriveMachine, Transfer

_SIDES, _PARTS = ("speed", "torque"), ("numerator", "denominator")
_LARGEST = 10_000_000


@makes_of_kinds
@dataclass(frozen=True)
class DriveLaws:
    """The law of a drive at each of some depths; in between that of the nearest one.

    Attributes
    ----------
    name : str
        Of the laws.
    depths : tuple of float
        Lengths of the string, m, rising.
    controls : tuple of DriveControl
        One a depth.

    Raises
    ------
    InputError
        If there is none, or depths do not rise.
    """

    name: str
    depths: tuple[float, ...]
    controls: tuple[DriveControl, ...]

    def __post_init__(self) -> None:
        falling = any(b <= a for a, b in itertools.pairwise(self.depths))
        if not self.depths or falling or len(self.depths) != len(self.controls):
            raise InputError("depths", list(self.depths)[:4], "rising, with a law each")

    def at(self, depth: float) -> DriveControl:
        """Return the law of the depth nearest to one, m."""
        return self.controls[int(np.abs(np.array(self.depths) - depth).argmin())]

    def reach(self, low: float, high: float) -> list[tuple[float, float, DriveControl]]:
        """Return between which depths of an interval, m, each law is the nearest."""
        middles = [0.5 * (a + b) for a, b in itertools.pairwise(self.depths)]
        edges = [low, *(m for m in middles if low < m < high), high]
        return [(a, b, self.at(0.5 * (a + b))) for a, b in itertools.pairwise(edges)]


def one_law(control: DriveControl) -> DriveLaws:
    """Return a law that is the same at all depths."""
    return DriveLaws(control.name, (0.0,), (control,))


def is_laws_file(path: str | Path) -> bool:
    """Whether a file's beginning is that of a table of laws of a drive."""
    try:
        with Path(path).open(encoding="utf-8") as file:
            head = file.read(200)
    except (OSError, UnicodeDecodeError):
        return False
    return "drillctrl/drive-table/" in head or head.startswith("depth,stable,")


@checks_kinds
def load_laws(path: str | Path, machine: DriveMachine) -> DriveLaws:
    """Return the laws of a file that `drillctrl table` wrote for a top drive.

    Parameters
    ----------
    path : str or Path
        A .json or .csv file.
    machine : DriveMachine
        The drive that follows them.

    Raises
    ------
    InputError
        If it cannot be read, or holds no such laws.
    """
    try:
        check_regular(path, _LARGEST)
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("table", str(path), f"a readable file ({error})") from None
    try:
        name, rows = _from_json(text) if text.lstrip().startswith("{") else _from_csv(text)
        found = [(float(depth), _control(name, law, machine)) for depth, law in rows]
    except InputError:
        raise
    except (KeyError, TypeError, ValueError) as error:
        wanted = "laws of a top drive, as drillctrl table --depth writes them"
        raise InputError("table", f"{path} ({error})", wanted) from None
    depths = tuple(checked_number("depth", depth, 0.0, 1e6) for depth, _ in found)
    return DriveLaws(name, depths, tuple(control for _, control in found))


def _from_json(text: str) -> tuple[str, list[tuple[Any, Mapping[str, Any]]]]:
    whole = json.loads(text)
    return str(whole["structure"]), [(node["depth"], node["law"]) for node in whole["nodes"]]


def _from_csv(text: str) -> tuple[str, list[tuple[Any, Mapping[str, Any]]]]:
    rows = csv.DictReader(text.splitlines())
    return "laws of a table", [
        (row["depth"], {s: {p: row[f"{s}_{p}"].split() for p in _PARTS} for s in _SIDES})
        for row in rows
    ]


def _control(name: str, law: Mapping[str, Any], machine: DriveMachine) -> DriveControl:
    def transfer(side: Mapping[str, Sequence[Any]]) -> Transfer:
        top, below = (tuple(float(value) for value in side[part]) for part in _PARTS)
        return Transfer(top, below)

    speed, torque = (transfer(law[side]) for side in _SIDES)
    return DriveControl(name, machine, speed, torque)
