"""The loop of bit and string without any reduction: its characteristic function and its roots.

With displacement and force at the bit for motions that the top end allows, U(s) and F(s), and
the load with which the bit answers, W(s), roots are where det(F + U W) = 0. That function has
no poles, so the argument principle counts its zeros.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.case import Where, as_case
from drillctrl.drilling.linear import bit_response
from drillctrl.strings.at_bit import StringAtBit, string_at_bit
from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.drive_rules import drive_poles
from drillctrl.strings.lump import lumped
from drillctrl.strings.model import PipeString
from drillctrl.strings.winding import zeros_right_of

# s in 1/s → dynamic stiffness of the drive, N m/rad.
TopStiffness = Callable[[ComplexArray], ComplexArray]
# s in 1/s → angle and torque at the top of a motion that the drive allows.
TopEnds = Callable[[ComplexArray], tuple[ComplexArray, ComplexArray]]


@dataclass(frozen=True)
class ExactLoop:
    """A bit on an exact string; dimensionless as the case is.

    Attributes
    ----------
    string : DrillString
        The string.
    now, then : array, (2, 4)
        Excess of weight and torque per states of the bit, now and τ0 ago.
    delay : float
        τ0.
    top : callable or None
        Angle and torque, in SI, of a motion that the drive allows, both without poles right of
        the axis but ``poles``; None where its speed is imposed.
    poles : int
        Poles of these right of the axis.
    units : DrillString or None
        Whose lumped equivalent makes the units; None for the string's own.
    """

    string: DrillString
    now: FloatArray
    then: FloatArray
    delay: float
    top: TopEnds | None = None
    poles: int = 0
    units: DrillString | None = None

    @property
    def rate(self) -> float:
        """Seconds to units of time: √(Kt/I)."""
        unit = self.units or self.string
        torsional = lumped(unit, unit.torsion)
        return float(np.sqrt(torsional.stiffness / torsional.mass))

    def __call__(self, s: npt.ArrayLike) -> ComplexArray:
        """Return the characteristic function over its positive growth, (...)."""
        axial, torsional, across, growth = self.parts(s)
        # A phase is kept, a size that overflows is not.
        return np.asarray((axial * torsional - across) * np.exp(1j * growth.imag))

    def parts(
        self, s: npt.ArrayLike
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """Return what vanishes where axial, and where torsional motion alone has a root, (...).

        Third comes what couples them, a product from both sides, and fourth the growth that all
        of it is over.
        """
        at = np.asarray(s, dtype=complex)
        unit = self.units or self.string
        axial, torsional = lumped(unit, unit.tension), lumped(unit, unit.torsion)
        rate = self.rate
        physical = np.asarray(at * rate, dtype=complex)
        x, weight, growth_x = self.string.tension.at_bit(physical)
        if self.top is None:
            theta, torque, growth = self.string.torsion.at_bit(physical)
        else:
            angle, moment = self.top(physical)
            matrix, growth = self.string.torsion.scaled_transfer(physical)
            theta = matrix[..., 0, 0] * angle + matrix[..., 0, 1] * moment
            torque = matrix[..., 1, 0] * angle + matrix[..., 1, 1] * moment
        late = np.exp(-at * self.delay)[..., None, None]
        response = self.now + late * self.then
        # Per displacement: the bit's velocities are s times these.
        load = response[..., 0::2] + at[..., None, None] * response[..., 1::2]
        a = weight / (axial.mass * rate**2) + x * load[..., 0, 0]
        d = torque / torsional.stiffness + theta * load[..., 1, 1]
        across = x * theta * load[..., 0, 1] * load[..., 1, 0]
        return np.asarray(a), np.asarray(d), np.asarray(across), np.asarray(growth + growth_x)

    def count_right_of(self, line: float = 0.0, height: float = 200.0) -> int:
        """Return the number of roots with Re s > line, by the argument principle.

        Parameters
        ----------
        line : float
            Where the contour's straight side stands.
        height : float
            How far it reaches; roots beyond are not counted.

        Raises
        ------
        InputError
            If a root lies on the contour.
        """
        # The phase turns by about the delays that waves and blades take, per unit of height.
        lines = (self.string.torsion, self.string.tension)
        turning = self.delay + 2.0 * self.rate * sum(line.transit_time for line in lines)
        zeros = zeros_right_of(self, line, height, int(8.0 * (1.0 + height * turning)))
        return zeros + self.poles

    def root(self, near: complex) -> complex:
        """Return the root that Newton's method finds from a starting point.

        Raises
        ------
        InputError
            If it finds none.
        """
        s = complex(near)
        for _ in range(50):
            step = 1e-6 * max(abs(s), 1e-3)
            around = self(s + step * np.array([0.0, 1.0, -1.0]))
            slope = (around[1] - around[2]) / (2.0 * step)
            change = complex(around[0] / slope)
            s -= change
            if abs(change) < 1e-11 * max(abs(s), 1e-3):
                return s
        raise InputError("near", near, "close to a root")


@checks_kinds
def exact_loop(where: Where, top: TopStiffness | None = None) -> ExactLoop:
    """Return the exact loop of a case whose string is one of pipe.

    Parameters
    ----------
    where : RigPoint or Case
        What drills, and where.
    top : callable, optional
        s in 1/s → dynamic stiffness of the drive in N m/rad; by default that of the plant's
        drive under its law.

    Raises
    ------
    InputError
        If the string is another one, or nothing holds the speed of the drive.
    """
    case = as_case(where)
    plant, _ = case.physics("an exact loop")
    if not isinstance(plant.string, PipeString):
        raise InputError("string", type(plant.string).__name__, "a PipeString")
    now, load, then, delay = (v[0] for v in bit_response(plant)(case.parameter_vector[None]))
    string, then = plant.string.string, load @ then
    if top is not None:
        return ExactLoop(
            string, now, then, float(delay[0, 0]), _with_stiffness(top), 0, plant.string.units
        )
    known = string_at_bit(plant)
    if known is None:
        raise InputError("plant", "with parts of your own", "a bit on a string under its drive")
    return known_loop(known, now, then, float(delay[0, 0]))


def known_loop(known: StringAtBit, now: FloatArray, then: FloatArray, delay: float) -> ExactLoop:
    """Return the exact loop of a bit on a string under its drive; see `ExactLoop`."""
    if known.control is None:
        return ExactLoop(known.string, now, then, delay, units=known.units)
    poles = drive_poles(known.control)
    return ExactLoop(known.string, now, then, delay, known.top, poles, known.units)


def _with_stiffness(top: TopStiffness) -> TopEnds:
    def ends(s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        stiffness = np.asarray(top(s), dtype=complex)
        return np.ones_like(stiffness), stiffness

    return ends
