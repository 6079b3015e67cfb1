"""Designs of nodes as entries of a checkpoint."""

from __future__ import annotations

import dataclasses
import hashlib
from typing import Any

import numpy as np

from drillctrl.base.checkpoint import Checkpoint
from drillctrl.synthesis.family import ActiveRoot
from drillctrl.tables.node import NodeDesign, NodeTask


def find_design(checkpoint: Checkpoint, task: NodeTask) -> NodeDesign | None:
    """Return the design of a task if a checkpoint knows it."""
    entry = checkpoint.find(task_key(task))
    if entry is None:
        return None
    return NodeDesign(
        task.index,
        _array(entry["gains"]),
        float.fromhex(entry["spectral_abscissa"]),
        float.fromhex(entry["stationarity"]),
        tuple(_array(basin) for basin in entry["basins"]),
        tuple(ActiveRoot(float.fromhex(omega), count) for omega, count in entry["roots"]),
    )


def keep_design(checkpoint: Checkpoint, task: NodeTask, design: NodeDesign) -> None:
    """Append a design; its numbers are text that keeps every bit.

    Raises
    ------
    InputError
        If the disk is full or the file is gone.
    """
    entry = {
        "gains": _text(design.gains),
        "spectral_abscissa": float(design.spectral_abscissa).hex(),
        "stationarity": float(design.stationarity).hex(),
        "basins": [_text(basin) for basin in design.basins],
        "roots": [[root.omega.hex(), root.multiplicity] for root in design.roots],
    }
    checkpoint.keep(task_key(task), entry)


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
    active = [[dataclasses.astuple(root) for root in roots] for roots in task.active]
    rest = task.seed, known, active, task.objective
    text = repr((task.index, point, structure, ties, *rest))
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def _text(values: np.ndarray[Any, np.dtype[np.float64]]) -> list[str]:
    return [float(value).hex() for value in values]


def _array(values: list[str]) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([float.fromhex(value) for value in values])
