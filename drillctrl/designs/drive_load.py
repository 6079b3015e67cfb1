"""What the bit of a string does where it drills, measured for the design of its drive."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.shelf import Shelf
from drillctrl.base.workers import open_executor, spread_out
from drillctrl.designs.drilling import Drilling
from drillctrl.designs.swings import UNKNOWN
from drillctrl.drilling.case import Case, as_case
from drillctrl.drilling.point import RigPoint
from drillctrl.motion.orbit import AxialOrbit, axial_orbit
from drillctrl.motion.response import FEWEST_PERIODS, BitResponse, bit_response
from drillctrl.simulation.status import Outcome
from drillctrl.strings.bit_load import BitAnswer, BitLoad
from drillctrl.strings.rig import StringRig
from drillctrl.strings.slopes import mode_bands

# A small swing beside the largest one: in between H of long strings changes less than its error.
_SMALL = 0.1
_CLASSES = {each.__name__: each for each in (BitLoad, BitAnswer)}

_Task = tuple[int, tuple[Case, float, float, str | Path | None]]


@checks_kinds
def bit_load(
    where: RigPoint,
    objective: Drilling | None = None,
    *,
    workers: int = 1,
    keep: str | Path | None = None,
) -> BitLoad:
    """Measure what the bit answers to its speed, and the torque by which it shakes the string.

    The rotation is imposed, so that none of it depends on the drive. A minute on two cores.

    Parameters
    ----------
    where : RigPoint
        A string, and where it drills.
    objective : Drilling, optional
        Its largest swing, and at how many torsional modes; by default 0.45 and four.
    workers : int
        Processes.
    keep : str or Path, optional
        A folder in which this is kept by what computed it, and looked for.

    Returns
    -------
    BitLoad
        In SI.

    Raises
    ------
    InputError
        If the rig has no string, nothing is cut, or the bit bounces without bound.
    """
    rig, wanted = where.rig, objective or Drilling(modes=4)
    if not isinstance(rig, StringRig):
        raise InputError("rig", "lumped to one mass each way", "a string")
    swings = sorted({min(_SMALL, wanted.kick), wanted.kick})
    hertz, _ = mode_bands(rig.string.torsion, wanted.modes)
    # Far below the frequency of the blades H changes slowly from mode to mode.
    hertz = hertz[[0, -1]] if hertz.size > 1 else hertz
    here = replace(where, rig=replace(rig, drive=None))

    def measured() -> BitLoad:
        return _measured(here, rig, hertz, swings, workers, keep)

    if keep is None:
        return measured()
    return Shelf(keep, _CLASSES).get((here, hertz.tolist(), swings), measured)


def _measured(
    here: RigPoint,
    rig: StringRig,
    hertz: FloatArray,
    swings: list[float],
    workers: int,
    keep: str | Path | None,
) -> BitLoad:
    case, per_hertz = as_case(here), 2.0 * math.pi * rig.time_scale
    places = [(0.0, 0.0), *((f, swing) for f in hertz.tolist() for swing in swings)]
    tasks = [(i, (case, f * per_hertz, swing, keep)) for i, (f, swing) in enumerate(places)]
    with open_executor(workers, None) as executor:
        found = [each for _, each in sorted(spread_out(executor, _task, tasks), key=_first)]
    orbit = found[0]
    assert isinstance(orbit, AxialOrbit)
    if orbit.broken is not None:
        why = Outcome.DIVERGES.sentence if orbit.broken == Outcome.DIVERGES else str(orbit.broken)
        wanted = f"a point at which the bit has a motion to design on: turned evenly, {why}"
        raise InputError("objective", "drilling", wanted)
    unit = rig.torsional_stiffness * rig.time_scale
    answers = [
        BitAnswer(
            f,
            swing,
            complex(each.value * unit),
            float(each.error * unit),
            bool(each.error < UNKNOWN),
        )
        for (f, swing), each in zip(places[1:], found[1:], strict=True)
        if isinstance(each, BitResponse)
    ]
    return BitLoad(
        here.rotary_speed,
        tuple(answers),
        orbit.spacing * rig.time_scale,
        orbit.torque_samples * rig.torsional_stiffness,
    )


def _first(pair: tuple[int, AxialOrbit | BitResponse]) -> int:
    return pair[0]


def _task(task: _Task) -> tuple[int, AxialOrbit | BitResponse]:
    place, (case, omega, swing, keep) = task
    if not omega:
        return place, axial_orbit(case)
    return place, bit_response(case, omega, swing, most_periods=FEWEST_PERIODS, keep=keep)
