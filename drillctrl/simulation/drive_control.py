"""Laws of a top drive in the simulator, with torque limit, delay, lag and sampling."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.bit_rock import BitRock
from drillctrl.drilling.case import Case, as_case
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.point import RigPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.stepping import SteppedRun
from drillctrl.simulation.structure import structure_of
from drillctrl.strings.drive_control import DriveControl, DriveMachine
from drillctrl.strings.drive_law import INTEGRAL, LAW, asking_plant, without_integral
from drillctrl.strings.drive_sampled import SampledDrive
from drillctrl.strings.drive_stepped import SteppedDrive
from drillctrl.strings.model import PipeString
from drillctrl.strings.rig import StringRig

DRIVE_PATH = ("measurement_delay", "actuator_lag")
_NONE, _ANY = np.zeros((1, 1)), np.full((1, 1), 1e12)
LAW_LOOP = FeedbackStructure(
    "law of the drive", (LAW,), -_ANY, _ANY, -_NONE, _NONE, ("drive",)
)  # fmt: skip


@checks_kinds
def law_controller(
    where: RigPoint,
    control: DriveControl,
    bit: BitRock | None = None,
    *,
    period: float | None = None,
    tracking: float | None = None,
) -> tuple[Case, Controller]:
    """Return the plant that works out what any law asks of its drive, and the controller for it.

    Parameters
    ----------
    where : RigPoint
        A string under a top drive with inertia, and where it drills.
    control : DriveControl
        Any law; filters and states of its own are in the plant. Delay, lag and torque limit of
        its machine are the controller's; what it adds to the torque of steady drilling stays
        within what the drive has beyond that, both ways.
    bit : BitRock, optional
        The bit–rock law, the paper's without it.
    period : float, optional
        Sampling period of the command, s; without it the law is continuous.
    tracking : float, optional
        Time in which the law's integral gives way at the torque limit, s; by default Kp/Ki.
        ``math.inf`` lets it go on, so that the drive makes up for lost turns.

    Returns
    -------
    Case, Controller
        What `simulate` takes.

    Raises
    ------
    InputError
        If the rig has no such drive, the law differentiates, or the drive has less torque than
        steady drilling takes.

    Notes
    -----
    The integral does not wind up at the torque limit: its rate is less by what the command is
    beyond the limit, over ``tracking`` (back-calculation; Åström and Hägglund, Advanced PID
    Control, 2006, section 3.5). The lag of the drive plays no part in it. Poles of a law other
    than the one at 0 are left to themselves.
    """
    rig, machine = where.rig, control.machine
    if not isinstance(rig, StringRig) or rig.drive is None:
        raise InputError("rig", type(rig).__name__, "one with a string and a top drive")
    if control.speed.excess > 0 and not machine.encoder:
        wanted = "a law without compensated inertia, or a drive with an encoder's filter"
        raise InputError("control", control.name, wanted)
    _check_counts(machine)
    case = as_case(where, asking_plant(rig, control, bit))
    time = rig.time_scale
    return case, Controller(
        replace(LAW_LOOP, name=control.name),
        [1.0],
        [0.0],
        limit=_spare_torque(case, machine, rig.torsional_stiffness),
        measurement_delay=machine.delay / time,
        actuator_lag=machine.lag / time,
        period=None if period is None else period / time,
        back_calculation=_giving_way(control, tracking, time),
    )


@checks_kinds
def free_drive(where: RigPoint, bit: BitRock | None = None) -> tuple[Case, dict[str, float]]:
    """Return the plant whose top drive takes any torque, and what surrounds a law of it.

    Parameters
    ----------
    where : RigPoint
        A string under a top drive with inertia, and where it drills.
    bit : BitRock, optional
        The bit–rock law, the paper's without it.

    Returns
    -------
    Case, dict
        Outputs ``phi`` and ``dphi``, input ``drive``; limit, measurement_delay, actuator_lag and
        encoder of its machine as `SteppedRun` takes them.

    Raises
    ------
    InputError
        If the rig has no such drive, or it has less torque than steady drilling takes.
    """
    rig = where.rig
    if not isinstance(rig, StringRig) or rig.drive is None:
        raise InputError("rig", type(rig).__name__, "one with a string and a top drive")
    machine = rig.drive
    drive = TopDrive(inertia_ratio=machine.inertia / rig.inertia)
    blocks = (*rig.hoist(), drive)
    case = as_case(where, paper_plant(bit, PipeString(rig.string), blocks=blocks))
    limit = _spare_torque(case, machine, rig.torsional_stiffness)
    around = {
        "measurement_delay": machine.delay / rig.time_scale,
        "actuator_lag": machine.lag / rig.time_scale,
    }
    if machine.encoder_counts is not None:
        around["encoder"] = math.tau / machine.encoder_counts
    return case, around if limit is None else {**around, "limit": limit}


def _giving_way(control: DriveControl, tracking: float | None, time: float) -> dict[str, float]:
    """Return how fast the law's integral gives way at the torque limit, dimensionless."""
    integral, rest = without_integral(control.speed)
    if not integral or control.machine.torque_limit is None or tracking == math.inf:
        return {}
    if tracking is None:
        proportional = rest.numerator[-1] / rest.denominator[-1]
        tracking = proportional / integral if proportional * integral > 0.0 else 1.0
    return {INTEGRAL: time / checked_number("tracking", tracking, 0.0, 1e6, open_low=True)}


@checks_kinds
def simulate_drive(
    where: RigPoint,
    law: SampledDrive,
    *,
    duration: float = 200.0,
    depth: float | Sequence[float] | None = None,
    **options: Any,
) -> Simulation:
    """Simulate the string under a sampled law of its drive, as the exported source computes it.

    Parameters
    ----------
    where : RigPoint
        A string under a top drive with inertia, and where it drills.
    law : SampledDrive
        Of `sampled_drive`; it feeds back what the speed is beyond that of steady drilling, and the
        torque comes to that of steady drilling, which leaves so much less of the limit.
    duration : float
        Dimensionless time to simulate.
    depth : float or sequence of float, optional
        What the law is told on its axes, SI; by default of where it drills: the length of the
        string, the rotary speed, the strength of the rock, the density of the mud.
    **options
        Of `SteppedRun`: scenario, initial, cutting, backwards, rtol, atol, and of the drive
        measurement_delay and actuator_lag where they are not those of the rig's.

    Raises
    ------
    InputError
        If the rig has no such drive, or another than the law is for.
    """
    case, around = free_drive(where)
    rig = where.rig
    assert isinstance(rig, StringRig)
    assert rig.drive is not None
    if rig.drive.inertia != law.machine.inertia:
        wanted = f"{rig.drive.inertia:g}, as the rig's"
        raise InputError("inertia of the drive", law.machine.inertia, wanted)
    torque, time = rig.torsional_stiffness, rig.time_scale
    steady = structure_of(case).arrays.top_torque * torque
    controller = SteppedDrive(law)
    around["limit"] = checked_number("limit", law.limit, steady, open_low=True) / torque
    run = SteppedRun(
        case, ("dphi",), ("drive",), period=law.period / time, duration=duration,
        **{**around, **options},
    )  # fmt: skip
    here = {
        "depth": rig.string.length,
        "rotary_speed": where.rotary_speed,
        "rock_strength": rig.rock_strength,
        "mud": rig.string.mud_density,
    }
    place = [here[name] for name, _ in law.axes] if depth is None else depth
    late, lag = (float({**around, **options}[name]) * time for name in DRIVE_PATH)
    kept = math.exp(-law.period / lag) if lag else 0.0
    # What the drive gave when the speed was measured that is there now.
    acting = 0.0
    past = deque([0.0] * (1 + round(late / law.period)))
    while run.goes_on:
        controller.limit = law.limit - steady
        speed = float(run.outputs()[0]) / time
        command = controller.step(speed, 0.0, past.popleft(), place)
        acting = kept * acting + (1.0 - kept) * command
        past.append(acting)
        run.hold([command / torque])
        run.advance()
    return run.result()


def _check_counts(machine: DriveMachine) -> None:
    """Refuse an encoder that counts where a law feeds back its states."""
    if machine.encoder_counts is not None:
        wanted = "left out here: simulate_drive and bench count, sample by sample"
        raise InputError("encoder_counts of the drive", machine.encoder_counts, wanted)


def _spare_torque(case: Case, machine: DriveMachine, unit: float) -> float | None:
    """Return the torque that a drive has beyond that of steady drilling, dimensionless."""
    if machine.torque_limit is None:
        return None
    steady = structure_of(case).arrays.top_torque * unit
    most = checked_number(
        "torque limit of the drive", machine.torque_limit, steady, 1e9, open_low=True
    )
    return (most - steady) / unit
