"""Speed control of a top drive as the string meets it: impedance, reflection, tuning."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.strings.line import Line

# Jc = J would leave a drive without inertia, and a loop without any delay margin.
MOST_COMPENSATED = 0.75


@dataclass(frozen=True)
class SpeedControl:
    """A top drive under PI control of its speed, with part of its inertia compensated.

    Attributes
    ----------
    inertia : float
        J of the drive, referred to the string, kg m².
    proportional : float
        Kp, N m s/rad.
    integral : float
        Ki, N m/rad.
    compensated : float
        Jc, kg m², at most 0.75 J.

    Raises
    ------
    InputError
        If a value is not in its range.
    """

    inertia: float
    proportional: float
    integral: float = 0.0
    compensated: float = 0.0

    def __post_init__(self) -> None:
        checked_number("inertia of the drive", self.inertia, 0.0, 1e9, open_low=True)
        checked_number("proportional gain", self.proportional, 0.0, 1e12)
        checked_number("integral gain", self.integral, 0.0, 1e12)
        most = MOST_COMPENSATED * self.inertia
        checked_number("compensated inertia", self.compensated, 0.0, most)

    def impedance(self, s: npt.ArrayLike) -> ComplexArray:
        """Return Z(s) = Kp + Ki/s + (J − Jc) s, torque per speed at the top of the string."""
        at = np.asarray(s, dtype=complex)
        inertia = self.inertia - self.compensated
        return np.asarray(self.proportional + self.integral / at + inertia * at)

    def reflection(self, s: npt.ArrayLike, pipe: float) -> ComplexArray:
        """Return (Z − ζ)/(Z + ζ), what the drive returns of a wave in pipe of impedance ζ."""
        impedance = self.impedance(s)
        return np.asarray((impedance - pipe) / (impedance + pipe))


def stiff_control(inertia: float, pipe: float) -> SpeedControl:
    """Return a drive that keeps its speed whatever the string does: Kp = 50 ζ, Ki = 5 J.

    Parameters
    ----------
    inertia : float
        J, kg m².
    pipe : float
        ζ of the uppermost pipe, N m s/rad.
    """
    return SpeedControl(inertia, 50.0 * pipe, 5.0 * inertia)


def soft_torque_control(
    inertia: float, pipe: float, frequency: float, times: float = 4.0, compensated: float = 0.0
) -> SpeedControl:
    """Return soft torque tuned to a frequency: a pure resistance of ``times`` ζ there.

    Parameters
    ----------
    inertia : float
        J, kg m².
    pipe : float
        ζ of the uppermost pipe, N m s/rad.
    frequency : float
        Hz, of the mode that is to be damped.
    times : float
        Kp over ζ.
    compensated : float
        Jc, kg m².
    """
    omega = 2.0 * math.pi * checked_number("frequency", frequency, 0.0, 100.0, open_low=True)
    integral = omega**2 * (inertia - compensated)
    return SpeedControl(inertia, times * pipe, integral, compensated)


@dataclass(frozen=True)
class CriticalSlope:
    """How steeply the bit's torque may fall with its speed before a mode grows.

    Attributes
    ----------
    frequency : float
        Hz at which it then swings.
    slope : float
        d*, N m s/rad.
    """

    frequency: float
    slope: float


def critical_slopes(
    line: Line, control: SpeedControl | None, frequency: float, step: float = 1e-3
) -> tuple[CriticalSlope, ...]:
    """Return the slopes at which modes of torsion become undamped, in order of frequency.

    A bit whose torque falls by d per unit of speed is undamped where the impedance that the
    string shows it is d: Im Z(iω) = 0 and d = Re Z(iω). Slopes above the wave impedance of the
    lowest stretch are left out: none is needed to set off all high modes at once.

    Parameters
    ----------
    line : Line
        The string in torsion.
    control : SpeedControl or None
        Of the drive; None for an imposed speed.
    frequency : float
        Hz, up to which to look.
    step : float
        Hz between the samples; crossings closer than that are missed.
    """
    if not 0.0 < step < frequency:
        raise InputError("step", step, f"in (0, {frequency:g}) Hz")

    def impedance(f: npt.ArrayLike) -> ComplexArray:
        s = 2j * np.pi * np.asarray(f, dtype=float)
        top = np.inf if control is None else s * control.impedance(s)
        return np.asarray(line.bit_stiffness(s, top) / s)

    at = np.arange(step, frequency + step, step)
    values = impedance(at).imag
    places = np.nonzero(np.signbit(values[:-1]) != np.signbit(values[1:]))[0]
    low, high, rising = at[places], at[places + 1], values[places + 1] >= 0.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        before = (impedance(middle).imag < 0.0) == rising
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    found = impedance(high)
    # Where the sign changes through infinity the bit is held.
    lowest = line.stretches[-1].mean()
    most = np.sqrt(lowest.mass * lowest.stiffness)
    at_zero = (np.abs(found.imag) < 1e-3 * most) & (found.real < most)
    return tuple(
        CriticalSlope(float(f), float(z.real))
        for f, z in zip(high[at_zero], found[at_zero], strict=True)
    )
