"""Laws of a top drive with some states, by a vector of numbers in a box.

The law brakes by the top's speed and angle and drives by the pipe's torque, with N states:

    A(s) = (h + a(s)/e(s)) (1 + k/s),  B(s) = g + b(s)/e(s),  deg e = N, deg a, b < N,

k not below what brings a speed that sags back in some seconds, e in factors of first and second
order that are damped.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.strings.drive_control import DriveControl, DriveMachine, Transfer
from drillctrl.synthesis.spread import spread_points

# Speed gains in units of ζ, torque gains as such; corners in units of the speed that scales s.
_SPEED_GAIN, _INTEGRAL, _TORQUE_GAIN = 100.0, 5.0, 30.0
# Seconds in which the integral of speed makes up for as much as the speed does: a drive that
# yields to the pipe sags under a load, and a bit that turns more slowly sticks sooner.
_RECOVERS = 10.0
_CORNER, _DAMPING = (0.1, 30.0), (0.2, 1.5)
# A swing of the top of 10 rpm must not take more than the torque limit.
_SMALLEST_SWING = 10.0 * math.pi / 30.0
_LOOKED = 48


class DriveSignals(NamedTuple):
    """A machine at some s: J s, and what its path and filters make of gains on speed and torque."""

    inertia: ComplexArray
    speed: ComplexArray
    torque: ComplexArray
    x: ComplexArray

    def pick(self, where: slice) -> DriveSignals:
        """Return the drive at some of these s."""
        return DriveSignals(*(values[where] for values in self))


class LawFamily:
    """Laws of one order by a vector of numbers in a box; x is s over a rate.

    The vector: h, k over the rate, g; for an odd order the logarithm of a corner c and the parts
    of it in A and B, each over x/c + 1; for every further two states the logarithm of c, the
    damping z and two parts each, over (x/c)² + 2 z x/c + 1.
    """

    def __init__(self, order: int, pipe: float, rate: float, machine: DriveMachine) -> None:
        self.order, self.pipe, self.rate = order, pipe, rate
        largest = _SPEED_GAIN
        if machine.torque_limit is not None:
            largest = min(largest, machine.torque_limit / (_SMALLEST_SWING * pipe))
        corner = (math.log(_CORNER[0]), math.log(_CORNER[1]))
        speed, torque = (-_SPEED_GAIN, _SPEED_GAIN), (-_TORQUE_GAIN, _TORQUE_GAIN)
        slowest = min(1.0 / (_RECOVERS * rate), 0.5 * _INTEGRAL)
        rows = [(0.0, largest), (slowest, _INTEGRAL), (0.0, _TORQUE_GAIN)]
        rows += [corner, speed, torque] * (order % 2)
        rows += [corner, _DAMPING, speed, speed, torque, torque] * (order // 2)
        self.lower, self.upper = np.array(rows).T

    def starts(self, known: FloatArray) -> FloatArray:
        """Return numbers that begin descents, (q, k): laws with fewer states, and around them."""
        more = self.lower.size - known.shape[1]
        corner = math.log(3.0 + 1.5 * self.order)
        fresh = np.array([corner, 0.0, 0.0] if more == 3 else [corner, 0.8, *[0.0] * 4])
        begun = np.hstack([known, np.tile(fresh[:more], (len(known), 1))])
        cube = spread_points(_LOOKED, self.lower.size, 0) - 0.5
        spread = begun[-1] + cube * (0.5 * np.abs(begun[-1]) + 0.02 * (self.upper - self.lower))
        inset = 1e-3 * (self.upper - self.lower)
        whole = np.vstack([begun, spread])
        return np.asarray(np.clip(whole, self.lower + inset, self.upper - inset))

    def _sections(self, numbers: FloatArray) -> list[tuple[list[float], list[float], list[float]]]:
        """Return denominators with their numerators in A and B, coefficients of x."""
        found, at = [], 3
        if self.order % 2:
            corner, a, b = numbers[at : at + 3].tolist()
            found.append(([math.exp(-corner), 1.0], [a], [b]))
            at += 3
        for corner, damping, a1, a0, b1, b0 in numbers[at:].reshape(-1, 6).tolist():
            c = math.exp(-corner)
            found.append(([c * c, 2.0 * damping * c, 1.0], [a1 * c, a0], [b1 * c, b0]))
        return found

    def ends(self, numbers: FloatArray, drive: DriveSignals) -> tuple[ComplexArray, ComplexArray]:
        """Return what `DriveControl.ends` does, quickly."""
        x = drive.x
        speed, torque = (np.asarray(numbers[i], dtype=complex) for i in (0, 2))
        for below, a, b in self._sections(numbers):
            under = 1.0 / _value(below, x)
            speed = speed + _value(a, x) * under
            torque = torque + _value(b, x) * under
        speed = drive.speed * speed * (1.0 + numbers[1] / x)
        return 1.0 + drive.torque * torque, drive.inertia + speed

    def laws(self, numbers: FloatArray) -> tuple[Transfer, Transfer]:
        """Return A and B."""
        speed = (np.array([numbers[0]]), np.ones(1))
        torque = (np.array([numbers[2]]), np.ones(1))
        for below, a, b in self._sections(numbers):
            speed, torque = _sum(speed, a, below), _sum(torque, b, below)
        above = self.pipe * np.convolve(speed[0], [1.0, numbers[1]])
        return self._transfer(above, np.append(speed[1], 0.0)), self._transfer(*torque)

    def _transfer(self, above: FloatArray, below: FloatArray) -> Transfer:
        """Return a function of s from coefficients of x."""
        powers = self.rate ** -np.arange(below.size - 1.0, -1.0, -1.0)
        scale = below[0] * powers[0]
        above = np.append(np.zeros(below.size - above.size), above)
        return Transfer(tuple(above * powers / scale), tuple(below * powers / scale))


def _value(coefficients: list[float], x: ComplexArray) -> ComplexArray:
    if len(coefficients) == 1:
        return np.asarray(coefficients[0], dtype=complex)
    found = coefficients[0] * x + coefficients[1]
    return found if len(coefficients) == 2 else found * x + coefficients[2]


def _sum(
    whole: tuple[FloatArray, FloatArray], above: list[float], below: list[float]
) -> tuple[FloatArray, FloatArray]:
    """Return a sum of two rational functions."""
    top = np.polyadd(np.convolve(whole[0], below), np.convolve(whole[1], above))
    return np.asarray(top), np.convolve(whole[1], below)


def drive_signals(machine: DriveMachine, pipe: float, rate: float, s: ComplexArray) -> DriveSignals:
    """Return a machine at some s, gains on speed in units of ζ, the rate that scales s in 1/s."""
    plain = DriveControl("path", machine, Transfer((pipe,)), Transfer((1.0,)))
    path, (speed, torque) = plain.path(s), plain.laws(s)
    return DriveSignals(machine.inertia * s, path * speed, path * torque, s / rate)
