"""Laws of the field for top drives, by the rules that they are tuned by."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.drive_control import DriveControl, DriveMachine, Transfer
from drillctrl.strings.elements import elements, free_modes
from drillctrl.strings.lump import lumped

# Jc = J would leave a drive without inertia, and a loop without any delay margin.
MOST_COMPENSATED = 0.75
# A speed loop inside another one crosses at this frequency, or where its lateness costs this
# phase, in radians, whichever is slower.
_INNER_FREQUENCY, _INNER_PHASE = 3.0, 0.1

RULES = ("stiff", "soft-torque", "soft-torque-matched", "soft-torque-fastest", "z-torque")


@checks_kinds
def pi_control(
    machine: DriveMachine,
    proportional: float,
    integral: float,
    compensated: float = 0.0,
    name: str = "pi",
) -> DriveControl:
    """Return PI control of speed, with part of the drive's inertia compensated.

    Parameters
    ----------
    machine : DriveMachine
        The drive.
    proportional, integral : float
        Kp, N m s/rad, and Ki, N m/rad.
    compensated : float
        Jc, kg m², at most 0.75 J: A = Kp + Ki/s − Jc s.
    name : str
        Of the law.

    Raises
    ------
    InputError
        If a value is not in its range.
    """
    checked_number("proportional gain", proportional, 0.0, 1e12)
    checked_number("integral gain", integral, 0.0, 1e12)
    checked_number("compensated inertia", compensated, 0.0, MOST_COMPENSATED * machine.inertia)
    law = Transfer((-compensated, proportional, integral), (1.0, 0.0))
    if not compensated and not integral:
        law = Transfer((proportional,))
    return DriveControl(name, machine, law)


@checks_kinds
def stiff_control(machine: DriveMachine, pipe: float) -> DriveControl:
    """Return a drive that keeps its speed whatever the string does: Kp = 50 ζ, Ki = 5 J.

    Parameters
    ----------
    machine : DriveMachine
        The drive.
    pipe : float
        ζ of the uppermost pipe, N m s/rad.
    """
    pipe = checked_number("pipe", pipe, 1e-6, 1e9)
    return pi_control(machine, 50.0 * pipe, 5.0 * machine.inertia, name="stiff")


@checks_kinds
def soft_torque_control(
    machine: DriveMachine,
    pipe: float,
    frequency: float,
    times: float = 4.0,
    compensated: float = 0.0,
    name: str = "soft-torque",
) -> DriveControl:
    """Return soft torque tuned to a frequency: a pure resistance of ``times`` ζ there.

    Parameters
    ----------
    machine : DriveMachine
        The drive.
    pipe : float
        ζ of the uppermost pipe, N m s/rad.
    frequency : float
        Hz, of the mode that is to be damped.
    times : float
        Kp over ζ; 1 returns nothing of a wave at that frequency.
    compensated : float
        Jc, kg m².
    name : str
        Of the law.
    """
    omega = 2.0 * math.pi * checked_number("frequency", frequency, 0.0, 100.0, open_low=True)
    integral = omega**2 * (machine.inertia - compensated)
    pipe = checked_number("pipe", pipe, 1e-6, 1e9)
    return pi_control(machine, times * pipe, integral, compensated, name)


@checks_kinds
def fastest_control(machine: DriveMachine, stiffness: float, inertia: float) -> DriveControl:
    """Return the PI control under which a lumped string decays fastest, a double complex pair.

    Parameters
    ----------
    machine : DriveMachine
        The drive.
    stiffness, inertia : float
        Of the string as one torsional degree of freedom, N m/rad and kg m².
    """
    stiffness = checked_number("stiffness", stiffness, 1e-6, 1e9)
    inertia = checked_number("inertia", inertia, 1e-6, 1e9)
    proportional = 2.0 * math.sqrt(machine.inertia * stiffness)
    integral = machine.inertia * stiffness / inertia
    return pi_control(machine, proportional, integral, name="soft-torque-fastest")


@checks_kinds
def z_torque_control(
    machine: DriveMachine, pipe: float, times: float = 4.0, high_pass: float = 0.01
) -> DriveControl:
    """Return Z-torque: the set point is lowered by the pipe's torque over a wanted impedance.

    A PI loop of speed follows that set point, Kp = ωc J and Ki = Kp ωc/10, with ωc 3 Hz or
    what its lateness leaves within a phase of 0.1. A high-pass filter keeps the mean
    torque from lowering the mean speed.

    Parameters
    ----------
    machine : DriveMachine
        The drive; its ``torque_filter`` is the filter of the pipe's torque.
    pipe : float
        ζ of the uppermost pipe, N m s/rad.
    times : float
        Wanted impedance over ζ.
    high_pass : float
        Hz, corner of the high-pass filter; 0 for none.
    """
    pipe = checked_number("pipe", pipe, 1e-6, 1e9)
    wanted = pipe * checked_number("times", times, 0.0, 1e3, open_low=True)
    corner = 2.0 * math.pi * checked_number("high_pass", high_pass, 0.0, 10.0)
    speed = 2.0 * math.pi * _INNER_FREQUENCY
    if machine.lateness > 0.0:
        speed = min(speed, _INNER_PHASE / machine.lateness)
    proportional, integral = machine.inertia * speed, 0.1 * machine.inertia * speed**2
    # The high-pass filter takes the integrator's pole away.
    torque = Transfer((proportional / wanted, integral / wanted), (1.0, corner))
    law = Transfer((proportional, integral), (1.0, 0.0))
    return DriveControl("z-torque", machine, law, torque)


@checks_kinds
def transfer_control(machine: DriveMachine, law: Any, name: str = "own") -> DriveControl:
    """Return control by a transfer function of the user's own, from speed to braking torque.

    Parameters
    ----------
    machine : DriveMachine
        The drive.
    law : control.TransferFunction, Transfer or pair of sequences
        In N m s/rad, continuous, with one input and one output; a pair holds numerator and
        denominator, highest power first.
    name : str
        Of the law.

    Raises
    ------
    InputError
        If it is something else.
    """
    if isinstance(law, Transfer):
        return DriveControl(name, machine, law)
    if hasattr(law, "num") and hasattr(law, "den"):
        if getattr(law, "dt", 0) not in (0, None):
            raise InputError("law", f"sampled, dt = {law.dt}", "continuous")
        if (getattr(law, "ninputs", 1), getattr(law, "noutputs", 1)) != (1, 1):
            raise InputError("law", f"{law.ninputs} inputs, {law.noutputs} outputs", "one of each")
        return DriveControl(name, machine, Transfer(tuple(law.num[0][0]), tuple(law.den[0][0])))
    try:
        numerator, denominator = law
    except (TypeError, ValueError):
        wanted = "a control.tf, or a pair of numerator and denominator"
        raise InputError("law", type(law).__name__, wanted) from None
    return DriveControl(name, machine, Transfer(tuple(numerator), tuple(denominator)))


def first_frequency(string: DrillString) -> float:
    """Return the first torsional frequency of a string, top held, bit free, undamped, Hz."""
    return float(free_modes(elements(string.torsion), 1).frequencies[0])


@checks_kinds
def rule_control(name: str, machine: DriveMachine, string: DrillString) -> DriveControl:
    """Return the law of a rule.

    Parameters
    ----------
    name : str
        ``"stiff"``; ``"soft-torque"``: Kp = 4 ζ, tuned to the first mode;
        ``"soft-torque-matched"``: Kp = ζ there, which returns nothing of the first mode's waves;
        ``"soft-torque-fastest"``: largest decay of the lumped string; ``"z-torque"``.
    machine : DriveMachine
        The drive.
    string : DrillString
        What it turns.

    Raises
    ------
    InputError
        If there is no such rule.
    """
    pipe = string.torsion.wave_impedance
    if name == "stiff":
        return stiff_control(machine, pipe)
    if name in ("soft-torque", "soft-torque-matched"):
        times = 4.0 if name == "soft-torque" else 1.0
        return soft_torque_control(machine, pipe, first_frequency(string), times, name=name)
    if name == "soft-torque-fastest":
        single = lumped(string, string.torsion)
        return fastest_control(machine, single.stiffness, single.mass)
    if name == "z-torque":
        return z_torque_control(machine, pipe)
    raise InputError("structure", name, f"one of {', '.join(RULES)}")


def drive_poles(control: DriveControl) -> int:
    """Return how many poles of the laws lie right of the imaginary axis."""
    found = np.concatenate([control.speed.poles, control.torque.poles])
    return int(np.count_nonzero(found.real > 0.0))
