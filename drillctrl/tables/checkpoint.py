"""Designs of nodes kept in a file, so that a run that was killed goes on where it was."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from drillctrl.errors import InputError
from drillctrl.tables.node import NodeDesign, NodeTask


class Checkpoint:
    """An append-only file of finished designs.

    Each line names its task by a hash of everything that the design depends on, so lines of
    another grid, structure or seed are never taken for this one's. A line that was cut short
    is dropped. Numbers are text that keeps every bit.

    Parameters
    ----------
    path : str or Path
        The file; made if it does not exist.

    Raises
    ------
    InputError
        If the file cannot be read or written.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._known: dict[str, dict[str, Any]] = {}
        try:
            self._file = self._path.open("a+b")
            self._file.seek(0)
            kept = 0
            for line in self._file:
                entry = _read_line(line)
                if entry is None:
                    break
                self._known[entry["task"]] = entry
                kept += len(line)
            self._file.truncate(kept)
        except OSError as error:
            raise self._refused(error) from None

    def _refused(self, error: OSError) -> InputError:
        return InputError(
            "checkpoint", str(self._path), f"a file that can be written ({error.strerror})"
        )

    def find(self, task: NodeTask) -> NodeDesign | None:
        """Return the design of a task if it is known."""
        entry = self._known.get(task_key(task))
        if entry is None:
            return None
        return NodeDesign(
            task.index,
            _array(entry["gains"]),
            float.fromhex(entry["spectral_abscissa"]),
            float.fromhex(entry["stationarity"]),
            tuple(_array(basin) for basin in entry["basins"]),
        )

    def keep(self, task: NodeTask, design: NodeDesign) -> None:
        """Append a design.

        Raises
        ------
        InputError
            If the disk is full or the file is gone.
        """
        entry = {
            "task": task_key(task),
            "gains": _text(design.gains),
            "spectral_abscissa": float(design.spectral_abscissa).hex(),
            "stationarity": float(design.stationarity).hex(),
            "basins": [_text(basin) for basin in design.basins],
        }
        try:
            self._file.write(json.dumps(entry).encode("ascii") + b"\n")
            self._file.flush()
        except OSError as error:
            raise self._refused(error) from None

    def remove(self) -> None:
        """Close and delete the file: what it was for is done."""
        self._file.close()
        self._path.unlink(missing_ok=True)

    def close(self) -> None:
        """Close the file and leave it for the next run."""
        self._file.close()


def task_key(task: NodeTask) -> str:
    """Return a hash of all that a design depends on."""
    structure = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in (
            (field.name, getattr(task.structure, field.name))
            for field in dataclasses.fields(task.structure)
        )
        if name != "ties"
    }
    ties = [dataclasses.astuple(tie) for tie in task.structure.ties]
    known = [gains.tolist() for gains in task.known]
    point = dataclasses.astuple(task.point)
    text = repr((task.index, point, structure, ties, task.seed, known, task.objective))
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def _read_line(line: bytes) -> dict[str, Any] | None:
    """Return an entry, or None where the line is not whole."""
    try:
        entry = json.loads(line)
        for name in ("gains", "spectral_abscissa", "stationarity", "basins", "task"):
            entry[name]
        _array(entry["gains"])
    except (ValueError, KeyError, TypeError):
        return None
    return entry if line.endswith(b"\n") else None


def _text(values: np.ndarray[Any, np.dtype[np.float64]]) -> list[str]:
    return [float(value).hex() for value in values]


def _array(values: list[str]) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([float.fromhex(value) for value in values])
