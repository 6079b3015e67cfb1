"""Where, over a map, torsion has damping left on the motion that is drilled with."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.checkpoint import Checkpoint
from drillctrl.base.errors import InputError
from drillctrl.base.workers import Progress
from drillctrl.charts.plane import Plane
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Case
from drillctrl.motion.loop import torsional_system
from drillctrl.motion.response import FEWEST_PERIODS
from drillctrl.motion.swing import ModeAt, mode_at
from drillctrl.motion.torsion import torsional_modes
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.status import Outcome
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.strings.rig import StringRig
from drillctrl.studies.tasks import run_tasks, task_key
from drillctrl.studies.vibration_point import FEW_STATES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The bit's answer changes slowly over a map: at most so many points across and up, and fewer
# of a string of sections, where one takes ten seconds and more.
_MOST, _MOST_OF_STRING = (13, 9), (7, 5)
SWING = 0.03
TORSION = "#7A0177"


@dataclass(frozen=True, eq=False)
class TorsionalField:
    """Growth of small torsional swings about the axial orbit, over a map.

    Attributes
    ----------
    x, y : array, (k,) and (l,)
        Places, in the axes' units.
    growth : tuple of array, (k, l)
        Of each column of the map, 1/s with a rig, else per unit of time; NaN where the bit's
        answer is not known, infinite where the bit swings of itself.
    """

    x: FloatArray
    y: FloatArray
    growth: tuple[FloatArray, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return JSON types; None where a number is not known."""
        known = [np.where(np.isfinite(g), g, np.nan).tolist() for g in self.growth]
        none = [[[None if math.isnan(v) else v for v in row] for row in g] for g in known]
        grows = [(g > 0.0).tolist() for g in self.growth]
        swing = {"swing": SWING, "x": self.x.tolist(), "y": self.y.tolist()}
        return {**swing, "growth": none, "grows": grows}


@dataclass(frozen=True, eq=False)
class _Task:
    index: int
    case: Case
    controllers: tuple[Controller | None, ...]

    @property
    def key(self) -> str:
        keys = [task_key(self.case, each, "threshold", SWING) for each in self.controllers]
        return "-".join(keys)


def check_threshold(case: Case) -> None:
    """Raise `InputError` if a top drive turns the string: its own motion is not looked at."""
    if isinstance(case.rig, StringRig) and case.rig.drive is not None:
        wanted = "left out for a string under a top drive, whose own motion is not in it"
        raise InputError("threshold", "asked for", wanted)


def torsional_field(
    plane: Plane,
    counts: tuple[int, int],
    closed: Callable[[float, float], tuple[Case, tuple[Controller | None, ...]]],
    executor: Executor | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Progress | None = None,
) -> TorsionalField:
    """Return how small torsional swings grow over a map, in each of its columns.

    Parameters
    ----------
    plane : Plane
        The two axes.
    counts : (int, int)
        Points of the map across and up; fewer are looked at where these are many.
    closed : callable
        Returns the plant at a place, and what closes its loop in each column.
    executor, checkpoint, progress
        As in `vibration_map`.

    Notes
    -----
    The answer H of the bit is that of its axial orbit, which torque hardly changes: one for all
    columns (`bit_response`). Torsion with that answer and the gains is linear.
    """
    plant, _ = plane.case.physics("a threshold")
    most = _MOST if len(plant.state_names) <= FEW_STATES else _MOST_OF_STRING
    x = np.linspace(plane.x.low, plane.x.high, min(counts[0], most[0]))
    y = np.linspace(plane.y.low, plane.y.high, min(counts[1], most[1]))
    places = [(a, b) for a in x.tolist() for b in y.tolist()]
    tasks = [_Task(k, *closed(*place)) for k, place in enumerate(places)]
    found = run_tasks(_grown, tasks, executor, checkpoint, progress, "threshold")
    scale = 1.0 if plane.case.rig is None else 1.0 / plane.case.rig.time_scale
    columns = zip(*(entry["growth"] for entry in found), strict=True)
    return TorsionalField(
        x,
        y,
        tuple(
            scale * np.array([_number(value) for value in column]).reshape(x.size, y.size)
            for column in columns
        ),
    )


def _number(value: float | str | None) -> float:
    return math.nan if value is None else float(value)


def _grown(task: _Task) -> dict[str, Any]:
    """Return the growth of each column; 'inf' where the bit swings of itself, None unknown."""
    entry: dict[str, Any] = {"index": task.index, "growth": [None] * len(task.controllers)}
    _, point = task.case.physics("a threshold")
    if not point.delta0 > 0.0:
        return entry
    at = mode_at(task.case, torsional_modes(task.case)[0], SWING, most_periods=FEWEST_PERIODS)
    entry["growth"] = [_growth(task.case, each, at) for each in task.controllers]
    return entry


def _growth(case: Case, controller: Controller | None, at: ModeAt) -> float | str | None:
    response = at.response
    if not math.isfinite(at.error):
        unstable = response.broken in (None, Outcome.DIVERGES)
        return "inf" if unstable else None
    if controller is None:
        return at.root.real
    feedback = controller.feedback
    assert isinstance(feedback, FeedbackStructure)
    _, K1, K2 = controller.gain_sets()
    system = torsional_system(case, response.value, response.frequency, feedback.inputs)
    _, point = case.physics("a threshold")
    return spectral_abscissa(close_loop(system, feedback, K1[0], K2[0], delay=point.delay))


def draw_threshold(ax: Axes, found: TorsionalField, growth: FloatArray) -> None:
    """Draw where small torsional swings neither grow nor decay; unknown places are left out."""
    known = np.abs(growth[np.isfinite(growth)])
    if not known.size:
        return
    # Beyond what can be told a swing grows: as fast as others do.
    field = np.where(growth == np.inf, np.median(known), growth)
    if (field < 0.0).any() and (field > 0.0).any():
        shown = np.ma.masked_invalid(field.T)
        ax.contour(found.x, found.y, shown, levels=[0.0], colors=TORSION,
                   linewidths=1.6, linestyles="dashed")  # fmt: skip
