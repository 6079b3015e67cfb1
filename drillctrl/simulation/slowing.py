"""Slowing down: the speed at which stick-slip begins under a law of the top drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.bit_rock import BitRock
from drillctrl.drilling.friction import Stribeck
from drillctrl.drilling.point import RigPoint
from drillctrl.simulation.drive_control import law_controller
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.falling import FallingTorque
from drillctrl.strings.rig import StringRig
from drillctrl.strings.slopes import drive_is_stable, mode_slopes

_MODES = 16
_RAMP = 2.0
# Of the speed, at the start; share of each step that is looked at; samples of it.
_KICK, _SETTLED, _SAMPLES = 0.1, 0.5, 3000
_MOST_STEPS = 20_000_000
STICKS = 1.0


@dataclass(frozen=True, eq=False)
class Slowing:
    """What became of a bit whose set speed was changed step by step.

    Attributes
    ----------
    control : DriveControl
        The law.
    speeds : array, (k,)
        rad/s, those that were reached, in their order.
    swings : array, (k,)
        Stick-slip index of the bit over the second half of each step; infinite where it stands
        still throughout.
    linear : float
        rad/s, below which steady turning is unstable: where the torque falls by the smallest
        critical slope of the first 16 modes of torsion; infinite if the drive is by itself.
    status : str
        How the run ended.
    """

    control: DriveControl
    speeds: np.ndarray
    swings: np.ndarray
    linear: float
    status: str

    @property
    def stick_slip(self) -> float:
        """Largest speed with full stick-slip, rad/s; 0 if it never came."""
        sticks = self.speeds[self.swings >= STICKS]
        return float(sticks.max()) if sticks.size else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        return {
            "structure": self.control.name,
            "speeds": self.speeds.tolist(),
            "swings": [swing if math.isfinite(swing) else None for swing in self.swings.tolist()],
            "stick_slip_speed": self.stick_slip,
            "linear_speed": self.linear if math.isfinite(self.linear) else None,
            "status": self.status,
        }


@checks_kinds
def slow_down(
    where: RigPoint,
    control: DriveControl,
    speeds: Sequence[float],
    *,
    falling: FallingTorque | None = None,
    hold: float = 60.0,
    period: float | None = None,
    time_limit: float = 300.0,
) -> Slowing:
    """Simulate a bit whose torque falls with its speed, while the driller slows down or speeds up.

    The run begins with a kick of the string by a tenth of the first speed; see `Scenario`.

    Parameters
    ----------
    where : RigPoint
        A string under a top drive, and the rate of penetration; its speed is not used.
    control : DriveControl
        The law, with delay, lag and torque limit of its machine.
    speeds : sequence of float
        Set speeds one after the other, rad/s, all above 0.
    falling : FallingTorque, optional
        What is added to the wear torque.
    hold : float
        Seconds at each.
    period : float, optional
        Sampling period of the drive, s.
    time_limit : float
        Seconds of wall time.

    Raises
    ------
    InputError
        If the rig has no top drive, or there are no speeds above 0.
    """
    law = FallingTorque() if falling is None else falling
    given = np.atleast_1d(np.asarray(speeds, dtype=float))
    if not given.size or not (np.isfinite(given) & (given > 0.0)).all():
        raise InputError("speeds", given.tolist(), "at least one, all above 0")
    hold = checked_number("hold", hold, 2.0 * _RAMP, 1e5)
    rig = where.rig
    if not isinstance(rig, StringRig):
        raise InputError("rig", type(rig).__name__, "one with a string and a top drive")
    time, torque = rig.time_scale, rig.torsional_stiffness
    friction: BitRock = Stribeck(drop=law.drop / torque, decay=law.decay * time)
    begun = replace(where, rotary_speed=float(given[0]))
    case, controller = law_controller(begun, control, friction, period=period)
    changes = tuple(
        Change(hold * (i + 1) / time, _RAMP / time, omega0=speed * time)
        for i, speed in enumerate(given[1:].tolist())
    )
    run = simulate(
        case,
        controller,
        duration=hold * given.size / time,
        scenario=Scenario(changes=changes, kick=(0.0, _KICK)),
        rtol=1e-6,
        max_steps=_MOST_STEPS,
        time_limit=time_limit,
    )
    swings = []
    for i, speed in enumerate(given.tolist()):
        start, stop = hold * (i + _SETTLED) / time, hold * (i + 1) / time
        if stop > run.times[-1] * (1.0 + 1e-9):
            break
        bit = run.at(np.linspace(start, min(stop, run.times[-1]), _SAMPLES), ("dtheta",))
        swing = float(np.ptp(bit.dtheta)) / (2.0 * speed * time)
        swings.append(math.inf if bit.stuck.all() else swing)
    line = rig.string.torsion
    slope = min(mode.slope for mode in mode_slopes(line, control, _MODES))
    stable = drive_is_stable(line, control)
    linear = law.threshold_speed(slope) if stable else math.inf
    return Slowing(control, given[: len(swings)], np.array(swings), linear, str(run.status))
