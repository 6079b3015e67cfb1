"""The axial orbit of a bit that turns evenly: what rock and string bear on it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.case import Where
from drillctrl.motion.record import halves
from drillctrl.motion.response import KICKS, Start, settling_time, turned_case
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.status import Outcome, Status
from drillctrl.simulation.summary import PER_STEP

# Returns of a periodic orbit come together within this share of its size.
_CLOSES = 1e-3
_MOST_RETURNS = 40
_SETTLED = 1e-3
_LOOKED_AT, _SAMPLES = 400.0, 40_001


@dataclass(frozen=True, eq=False)
class AxialOrbit:
    """The axial motion at steady rotation, over its last 400 units of time.

    Attributes
    ----------
    settles : bool
        Whether it ends in smooth drilling.
    period : float or None
        After which it repeats; None of a motion that settles or does not repeat.
    weight, torque : float
        Means of the loads on the bit.
    weight_ratio, torque_ratio : float
        Over those of smooth drilling.
    held, lifted : float
        Shares of the time: held at Z' = 0, and off the rock.
    deepest : float
        Largest depth of cut over that of smooth drilling.
    spacing : float
        Between the samples of the torque.
    torque_samples : array
        Torque on bit, less its mean, over the time looked at.
    broken : Status, Outcome or None
        Why the run broke off, or that the bit bounces without bound; all else is then NaN.
    """

    settles: bool
    period: float | None
    weight: float
    torque: float
    weight_ratio: float
    torque_ratio: float
    held: float
    lifted: float
    deepest: float
    spacing: float = field(repr=False)
    torque_samples: FloatArray = field(repr=False)
    broken: Status | Outcome | None = None

    @property
    def periodic(self) -> bool:
        """Whether it repeats, or rests."""
        return self.settles or self.period is not None


@checks_kinds
def axial_orbit(where: Where, kick: float = KICKS[0], **options: Any) -> AxialOrbit:
    """Return the axial orbit that a bit reaches while it turns at Ω0.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where.
    kick : float
        Axial velocity at t = 0 beyond the rate of penetration, over that rate.
    **options
        Of `simulate`.

    Raises
    ------
    InputError
        As `bit_response` does.
    """
    case = turned_case(where, 1.0)
    _, point = case.physics("an axial orbit")
    start = Start(case, settling_time(case), 1.0, 0.0, kick, options)
    start.settle()
    run = start.run(_LOOKED_AT) if start.broken is None else None
    if run is None or start.broken is not None:
        no = float("nan")
        return AxialOrbit(
            False, None, no, no, no, no, no, no, no, no, np.zeros(0), start.broken
        )  # fmt: skip
    means = halves(run, 0.0, _LOOKED_AT, 1.0)
    tail = run.on_steps(PER_STEP, 0.0, ("dx", "depth"))
    times = np.linspace(0.0, float(run.times[-1]), _SAMPLES)
    samples = run.at(times, ("torque_on_bit",)).torque_on_bit
    weight, torque = float(means.weight[0]), float(means.torque[0])
    settles = float(np.ptp(tail.dx)) <= _SETTLED * point.penetration_rate
    return AxialOrbit(
        settles,
        None if settles else _period(run),
        weight,
        torque,
        weight / run.steady_load[0],
        torque / run.steady_load[1],
        float(means.held[0]),
        float(means.lifted[0]),
        float(tail.depth.max()) / run.structure.steady_depth,
        float(times[1] - times[0]),
        samples - samples.mean(),
    )


def _period(run: Simulation) -> float | None:
    """Return the time after which the motion repeats, by the states where x rises past its middle.

    The depth of cut stands for what the rock remembers.
    """
    names = ("x", "dx", "depth")
    tail = run.on_steps(PER_STEP, 0.0, names)
    size = np.array([[np.ptp(getattr(tail, name))] for name in names])
    middle = 0.5 * float(tail.x.max() + tail.x.min())
    below = tail.x < middle
    rising = np.flatnonzero(below[:-1] & ~below[1:])
    times = _crossed(run, middle, tail.times[rising], tail.times[rising + 1])
    if times.size < 4:
        return None
    motion = run.at(times, names)
    states = np.stack([getattr(motion, name) for name in names]) / size
    for count in range(1, min(times.size // 2, _MOST_RETURNS)):
        if np.abs(states[:, count:] - states[:, :-count]).max() < _CLOSES:
            return float((times[count:] - times[:-count]).mean())
    return None


def _crossed(run: Simulation, middle: float, low: FloatArray, high: FloatArray) -> FloatArray:
    for _ in range(50):
        centre = 0.5 * (low + high)
        before = run.at(centre, ("x",)).x < middle if centre.size else np.zeros(0, dtype=bool)
        low, high = np.where(before, centre, low), np.where(before, high, centre)
    return np.asarray(0.5 * (low + high))
