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
from drillctrl.drilling.case import Case
from drillctrl.drilling.linear import bit_response
from drillctrl.strings.at_bit import string_at_bit
from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.lump import lumped
from drillctrl.strings.model import PipeString
from drillctrl.strings.winding import zeros_right_of

# (s per second) → dynamic stiffness of the drive, N m/rad.
TopStiffness = Callable[[ComplexArray], ComplexArray]


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
        Dynamic stiffness of what turns the top end, in SI; None where its speed is imposed.
    """

    string: DrillString
    now: FloatArray
    then: FloatArray
    delay: float
    top: TopStiffness | None = None

    @property
    def rate(self) -> float:
        """Seconds to units of time: √(Kt/I)."""
        torsional = lumped(self.string, self.string.torsion)
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
        axial = lumped(self.string, self.string.tension)
        torsional = lumped(self.string, self.string.torsion)
        rate = self.rate
        physical = np.asarray(at * rate, dtype=complex)
        top: npt.ArrayLike = np.inf if self.top is None else self.top(physical)
        x, weight, growth_x = self.string.tension.at_bit(physical)
        theta, torque, growth = self.string.torsion.at_bit(physical, top)
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
        return zeros_right_of(self, line, height, int(8.0 * (1.0 + height * turning)))

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


def exact_loop(case: Case, top: TopStiffness | None = None) -> ExactLoop:
    """Return the exact loop of a case whose string is one of pipe.

    Parameters
    ----------
    case : Case
        What drills, and where.
    top : callable, optional
        s in 1/s → dynamic stiffness of the drive in N m/rad; by default that of the plant's
        drive under its law.

    Raises
    ------
    InputError
        If the string is another one, or nothing holds the speed of the drive.
    """
    plant, _ = case.physics("an exact loop")
    if top is None:
        known = string_at_bit(plant)
        top = None if known is None or known.control is None else known.top_stiffness
    if not isinstance(plant.string, PipeString):
        raise InputError("string", type(plant.string).__name__, "a PipeString")
    now, load, then, delay = (v.full() for v in bit_response(plant)(case.parameter_vector))
    return ExactLoop(plant.string.string, now, load @ then, float(delay[0, 0]), top)
