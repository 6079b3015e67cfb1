"""How hard the bit vibrates at one operating point: plain data in and out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.text import finite_or_none
from drillctrl.drilling.case import Case
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.loads import loads
from drillctrl.simulation.starts import StartRun, start_runs
from drillctrl.simulation.status import OUTCOME_NAMED, Outcome
from drillctrl.studies.tasks import linear_abscissa, task_key

# Quantity → whether its largest value is the worst, or its smallest.
QUANTITIES = {
    "swing": True,
    "stick_fraction": True,
    "off_rock_fraction": True,
    "feed": False,
    "weight_ratio": True,
}
# A motion that is irregular or grows takes ever more steps; a bounded one of 200 units of time
# takes half of these at most. Waves along a long string take many more.
_RTOL, _MOST_STEPS, FEW_STATES = 1e-6, 60_000, 8
# What ends a run before it can be measured.
_BROKEN = (Outcome.UNDECIDED, Outcome.TURNS_BACK, Outcome.DIVERGES)


@dataclass(frozen=True, eq=False)
class VibrationTask:
    """What to try at an operating point.

    Attributes
    ----------
    index : int
        Of the point.
    case : Case
        What drills, and where.
    controller : Controller or None
        Closes the loop.
    starts : tuple of str
        Names of starts.
    duration : float
        Of each run, dimensionless.
    linear : bool
        Whether α of the linear loop is told, which takes seconds of a long string.
    """

    index: int
    case: Case
    controller: Controller | None
    starts: tuple[str, ...]
    duration: float
    linear: bool = True

    @property
    def key(self) -> str:
        """Hash of all that the result depends on."""
        return task_key(self.case, self.controller, "map", self.starts, self.duration, self.linear)


def measure_point(task: VibrationTask) -> dict[str, Any]:
    """Return α of the linear loop and the worst of all starts, in JSON types.

    ``outcome`` and ``start`` are those of the start that ends worst; of each quantity the worst
    of all starts is told, None where one of them ends before it can be measured.
    """
    plant, _ = task.case.physics("a map")
    made = start_runs(
        task.case,
        task.controller,
        starts=task.starts,
        duration=task.duration,
        rtol=_RTOL,
        # What comes after is no worse a verdict, and takes long.
        backwards="stop",
        max_steps=_MOST_STEPS if len(plant.state_names) <= FEW_STATES else 1_000_000,
    )
    rows = [_measured(run) for run in made]
    worst = max(rows, key=lambda row: (OUTCOME_NAMED[row["outcome"]].severity, row["swing"] or 0.0))
    entry: dict[str, Any] = {
        "index": task.index,
        "spectral_abscissa": _abscissa(task) if task.linear else None,
        "outcome": worst["outcome"],
        "start": worst["start"],
    }
    for name, most in QUANTITIES.items():
        values = [row[name] for row in rows]
        entry[name] = None if None in values else (max if most else min)(values)
    return entry


def _abscissa(task: VibrationTask) -> float | None:
    """Return α, or None where the roots of a long string cannot be told apart."""
    try:
        return linear_abscissa(task.case, task.controller)
    except InputError:
        return None


def _measured(run: StartRun) -> dict[str, Any]:
    found = run.figures
    row: dict[str, Any] = {"start": run.start, "outcome": str(found.outcome)}
    if found.outcome in _BROKEN:
        return {**row, **dict.fromkeys(QUANTITIES)}
    borne = loads(run.simulation)
    values = (
        found.swing,
        found.stick_fraction,
        borne.off_rock_fraction,
        found.feed,
        borne.weight_ratio,
    )
    told = (None if value is None else finite_or_none(value) for value in values)
    return {**row, **dict(zip(QUANTITIES, told, strict=True))}


def as_array(entries: list[dict[str, Any]], name: str) -> FloatArray:
    """Return a quantity of all entries, (q,); NaN for None."""
    return np.array([np.nan if entry[name] is None else entry[name] for entry in entries], float)
