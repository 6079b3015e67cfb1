"""Speed control of a top drive in the simulator: PI with torque limit, delay, lag and sampling."""

from __future__ import annotations

import numpy as np

from drillctrl.base.errors import InputError, checked_number
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import as_case
from drillctrl.drilling.point import RigPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.structure import structure_of
from drillctrl.strings.rig import StringRig
from drillctrl.strings.speed_control import SpeedControl

_NONE = np.zeros((1, 2))
_ANY = np.full((1, 2), 1e12)
SPEED_LOOP = FeedbackStructure(
    "drive speed", ("phi", "dphi"), -_ANY, _ANY, -_NONE, _NONE, ("drive",)
)  # fmt: skip


def drive_controller(
    where: RigPoint,
    control: SpeedControl,
    *,
    torque_limit: float | None = None,
    delay: float = 0.0,
    lag: float = 0.0,
    period: float | None = None,
) -> Controller:
    """Return the controller that holds the speed of a rig's top drive.

    Parameters
    ----------
    where : RigPoint
        A string under a top drive with inertia, and where it drills.
    control : SpeedControl
        Kp and Ki of that drive, such as `stiff_control` or `soft_torque_control` returns.
    torque_limit : float, optional
        Largest torque of the drive, N m, above that of steady drilling. What the controller
        adds stays within their difference both ways.
    delay, lag : float
        Age of the measured speed and time constant of the drive, s.
    period : float, optional
        Sampling period, s; without it the law is continuous.

    Raises
    ------
    InputError
        If the rig has no such drive, or a value is out of its range.

    Notes
    -----
    The integral of the speed is the drive's angle behind its set point. It goes on while the
    drive is at its limit, so that a drive that was stalled makes up for lost turns.
    """
    rig = where.rig
    inertia = rig.drive_inertia if isinstance(rig, StringRig) else None
    if inertia is None:
        raise InputError("rig", type(rig).__name__, "one with a string and a top drive")
    if control.inertia != inertia:
        raise InputError("inertia of the drive", control.inertia, f"{inertia:g}, as of the rig")
    if control.compensated:
        raise InputError("compensated inertia", control.compensated, "0 in the simulator")
    unit, time = rig.torsional_stiffness, rig.time_scale
    limit = None
    if torque_limit is not None:
        steady = float(structure_of(as_case(where)).arrays.steady[1]) * unit
        most = checked_number("torque_limit", torque_limit, steady, 1e9, open_low=True)
        limit = (most - steady) / unit
    return Controller(
        SPEED_LOOP,
        [-control.integral / unit, -control.proportional / (unit * time)],
        [0.0, 0.0],
        limit=limit,
        measurement_delay=checked_number("delay", delay, 0.0, 1e3) / time,
        actuator_lag=checked_number("lag", lag, 0.0, 1e3) / time,
        period=None if period is None else period / time,
    )
