"""A run as values to keep: what was asked for, and the steps; the rest follows from both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.drilling.case import Case
from drillctrl.simulation.kernel import data
from drillctrl.simulation.layout import settings_for
from drillctrl.simulation.past import Past
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import LONGEST, checked_run
from drillctrl.simulation.status import Status
from drillctrl.simulation.structure import structure_of

# What is not kept: it is made again of the rest.
_DERIVED = ("structure", "settings", "history", "rig")
_LATE = 1e-9
# Blade pitches that a rock face may lie back.
_MOST_PASSES = 1_000_000


def kept_run(run: Simulation) -> dict[str, Any]:
    """Return what is to be kept of a run.

    Raises
    ------
    InputError
        If it started from the past of another one, which is not kept.
    """
    if isinstance(run.scenario.start, Past):
        raise InputError("result", "a run that goes on from another", "one with a start of its own")
    kept = {item.name: getattr(run, item.name) for item in fields(run) if item.init}
    kept = {name: value for name, value in kept.items() if name not in _DERIVED}
    real, whole = run.history
    return {**kept, "real": np.array(real), "whole": np.array(whole)}


def restored_run(kept: Mapping[str, Any]) -> Simulation:
    """Return the run that `kept_run` kept.

    Raises
    ------
    ValueError
        If the steps are none that a run can have.
    InputError
        If what was asked for is out of range.
    """
    names = {item.name for item in fields(Simulation) if item.init} - {*_DERIVED}
    if set(kept) != {*names, "real", "whole"}:
        raise ValueError("other entries than a run has")
    case, controller, status = kept["case"], kept["controller"], kept["status"]
    if not isinstance(case, Case) or not isinstance(status, Status):
        raise ValueError("a run without a case or a status")
    structure = structure_of(case)
    asked = {
        name: kept[name] for name in ("duration", "model", "cutting", "backwards", "rtol", "atol")
    }
    scenario, *_ = checked_run(
        case, kept["scenario"], structure=structure, controller=controller, **asked
    )
    _, point = case.physics("a simulation")
    settings = settings_for(
        structure,
        controller,
        scenario.drive(point),
        duration=asked["duration"],
        linear=asked["model"] == "linear",
        multiple=asked["cutting"] == "multiple",
        backwards=asked["backwards"] == "rest",
        rtol=asked["rtol"],
        atol=asked["atol"],
    )
    sides = int(settings.whole[data.SIDES])
    sizes = len(structure.state_names), len(structure.input_names), sides
    history = data.History(kept["real"], kept["whole"])
    first = checked_integer("first", kept["first"], 1, max(1, len(history.real)))
    _check_steps(history, sizes, first, asked["duration"])
    for name in ("rejected", "evaluations"):
        checked_integer(name, kept[name], 0, 10**12)
    checked_number("elapsed_seconds", kept["elapsed_seconds"], 0.0)
    rest = {name: kept[name] for name in names}
    return Simulation(**rest, structure=structure, settings=settings, history=history, rig=case.rig)


def _check_steps(
    history: data.History, sizes: tuple[int, int, int], first: int, end: float
) -> None:
    """Refuse steps that do not follow each other, or that point to others than those before."""
    real, whole = history
    rows = len(real)
    if real.dtype != float or whole.dtype != np.int64 or rows == 0:
        raise ValueError("steps of another kind")
    if real.shape != (rows, data.history_width(*sizes)) or whole.shape != (rows, data.WHOLES):
        raise ValueError("steps that do not fit the plant")
    if not np.isfinite(real[first:]).all():
        raise ValueError("a step that is not finite")
    start, length = real[1:, data.START], real[1:, data.LENGTH]
    if not (length > 0.0).all() or not (np.diff(real[:, data.START]) > 0.0).all():
        raise ValueError("steps out of order")
    gap = np.abs(start[1:] - (start + length)[:-1]).max(initial=0.0)
    last = float((start + length)[-1]) if start.size else 0.0
    if gap > _LATE * (1.0 + abs(last)) or last > min(end, LONGEST) * (1.0 + _LATE):
        raise ValueError("steps that leave gaps, or go on beyond the end")
    limits = {
        data.CONTACT: 1,
        data.TORSION: data.REVERSE,
        data.AXIAL: data.RIDING,
        data.LEVEL: data.NO_BREAK,
        data.LAG: rows - 1,
        data.FACE: rows - 1,
        data.PASSES: _MOST_PASSES,
        data.SATURATED: 4 ** sizes[1] - 1,
        data.BEHIND: 1,
    }
    for column, most in limits.items():
        if not ((whole[:, column] >= 0) & (whole[:, column] <= most)).all():
            raise ValueError("a step in no mode that there is")
