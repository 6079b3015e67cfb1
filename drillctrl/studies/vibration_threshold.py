"""Where, over a map, torsion has damping left on the motion that is drilled with."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.checkpoint import Checkpoint
from drillctrl.base.text import finite_or_none
from drillctrl.base.workers import Progress
from drillctrl.charts.plane import Plane
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.bit_rock import BitRock
from drillctrl.drilling.case import Case, as_case
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.point import RigPoint
from drillctrl.motion.loop import torsional_system
from drillctrl.motion.response import FEWEST_PERIODS, BitResponse, bit_response
from drillctrl.motion.swing import ModeAt, mode_at
from drillctrl.motion.torsion import torsional_modes
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.status import Outcome
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.line import Line
from drillctrl.strings.rig import StringRig
from drillctrl.strings.slopes import bit_impedance, mode_slopes
from drillctrl.studies.tasks import run_tasks, task_key
from drillctrl.studies.vibration_point import FEW_STATES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The bit's answer changes slowly over a map: at most so many points across and up, and fewer
# of a string of sections, where one takes ten seconds and more.
_MOST, _MOST_OF_STRING = (13, 9), (7, 5)
SWING = 0.03
TORSION = "#7A0177"
# Modes that are followed under a law of a drive, and steps of theirs and of Newton's method.
_MODES, _STEPS, _NEWTON = 4, 13, 3
# Last step of a root that has been followed, over its size.
_ARRIVED = 1e-5


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
    closings: tuple[Controller | DriveControl | None, ...]

    @property
    def key(self) -> str:
        keys = [
            task_key(self.case, None, "threshold", SWING, repr(each))
            if isinstance(each, DriveControl)
            else task_key(self.case, each, "threshold", SWING)
            for each in self.closings
        ]
        return "-".join(keys)


def without_drive(where: RigPoint, bit: BitRock) -> Case:
    """Return a string whose bit is turned as it drills, whatever its top drive does."""
    assert isinstance(where.rig, StringRig)
    rig = replace(where.rig, drive=None)
    return as_case(replace(where, rig=rig), paper_plant(bit, **rig.hardware()))


def torsional_field(
    plane: Plane,
    counts: tuple[int, int],
    closed: Callable[[float, float], tuple[Case, tuple[Controller | DriveControl | None, ...]]],
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
        Returns the plant at a place, that of `without_drive` where laws of a drive turn it, and
        what closes its loop in each column.
    executor, checkpoint, progress
        As in `vibration_map`.

    Notes
    -----
    The answer H of the bit is that of its axial orbit, which torque hardly changes: one for all
    columns (`bit_response`). Torsion with that answer and the gains or the law is linear. Of a
    string H takes about 20 s of processor at each place, of which there are at most 35.
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
    entry: dict[str, Any] = {"index": task.index, "growth": [None] * len(task.closings)}
    _, point = task.case.physics("a threshold")
    if not point.delta0 > 0.0:
        return entry
    laws = [each for each in task.closings if isinstance(each, DriveControl)]
    if laws:
        entry["growth"] = _under_laws(task.case, laws)
        return entry
    at = mode_at(task.case, torsional_modes(task.case)[0], SWING, most_periods=FEWEST_PERIODS)
    entry["growth"] = [
        None if isinstance(each, DriveControl) else _growth(task.case, each, at)
        for each in task.closings
    ]
    return entry


def _under_laws(case: Case, laws: Sequence[DriveControl]) -> list[float | str | None]:
    rig = case.rig
    assert isinstance(rig, StringRig)
    line, time = rig.string.torsion, rig.time_scale
    (first,) = mode_slopes(line, laws[0], 1)
    turned = 2.0 * math.pi * first.mode_frequency * time
    found = bit_response(case, turned, SWING, most_periods=FEWEST_PERIODS)
    if not math.isfinite(found.error):
        return [_unknown(found)] * len(laws)
    answer = found.value * rig.torsional_stiffness * time
    return [finite_or_none(time * law_growth(line, law, answer)) for law in laws]


def law_growth(line: Line, law: DriveControl, answer: complex) -> float:
    """Return how fast torsion grows under a law where the bit answers with H, 1/s.

    Parameters
    ----------
    line : Line
        The string in torsion.
    law : DriveControl
        Of its drive.
    answer : complex
        H, torque per speed of the bit, N m s/rad.

    Returns
    -------
    float
        The largest of the first modes; NaN where one could not be followed, or there is none.

    Notes
    -----
    The roots of Z(s) + H = 0, with Z the impedance that string and drive show the bit, are
    followed from the critical slopes, at which they lie on the imaginary axis.
    """
    rates = [-math.inf]
    for mode in mode_slopes(line, law, _MODES):
        if mode.frequency is None:
            continue
        s = 2j * math.pi * mode.frequency
        for wanted in np.linspace(mode.slope, -answer, _STEPS):
            for _ in range(_NEWTON):
                near = 1e-6 * abs(s)
                here, there = (complex(bit_impedance(line, law, at)) for at in (s, s + near))
                step = (here - wanted) * near / (there - here)
                s -= step
        if not abs(step) < _ARRIVED * abs(s):
            # It may be the one that grows.
            return math.nan
        rates.append(float(s.real))
    known = max(rates)
    return known if math.isfinite(known) else math.nan


def _growth(case: Case, controller: Controller | None, at: ModeAt) -> float | str | None:
    response = at.response
    if not math.isfinite(at.error):
        return _unknown(response)
    if controller is None:
        return at.root.real
    feedback = controller.feedback
    assert isinstance(feedback, FeedbackStructure)
    _, K1, K2 = controller.gain_sets()
    system = torsional_system(case, response.value, response.frequency, feedback.inputs)
    _, point = case.physics("a threshold")
    return spectral_abscissa(close_loop(system, feedback, K1[0], K2[0], delay=point.delay))


def _unknown(response: BitResponse) -> str | None:
    return "inf" if response.broken in (None, Outcome.DIVERGES) else None


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
