"""A drill string in the plant: its two lines reduced to what a frequency asks for."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import checked_number
from drillctrl.base.kinds import makes_of_kinds
from drillctrl.drilling.coefficients import Coefficients, Expression
from drillctrl.drilling.string import SideFriction, String, StringModel
from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.elements import Reduced, resolved
from drillctrl.strings.lump import lumped
from drillctrl.strings.wall import wall_parts

# Hz, up to which strings are right, for cutting ties torsion to what it excites axially; and the
# number of modes that are right in any case: what cutting excites is counted in modes.
TORSIONAL_FREQUENCY = 10.0
AXIAL_FREQUENCY = 15.0
_FEWEST_MODES = 8
TOLERANCE = 2e-3


class Resolved(NamedTuple):
    """Both lines of a string reduced, and how far they are from the exact ones.

    Attributes
    ----------
    tension, torsion : Reduced
        See `elements`.
    tension_error, torsion_error : float
        Their `distance` from the exact lines.
    """

    tension: Reduced
    torsion: Reduced
    tension_error: float
    torsion_error: float


@functools.lru_cache(maxsize=32)
def resolve(string: DrillString, torsional: float, axial: float, tolerance: float) -> Resolved:
    """Return both lines of a string with as few modes as the tolerance asks for."""
    tension, tension_error = resolved(string.tension, axial, tolerance)
    torsion, torsion_error = resolved(string.torsion, torsional, tolerance)
    return Resolved(tension, torsion, tension_error, torsion_error)


@makes_of_kinds
class PipeString(StringModel):
    """A drill string of pipe by its modes.

    Beside the bit's and the top end's coordinates its states are the amplitudes of the modes,
    ``x1``, ``x2`` … and ``theta1``, ``theta2`` …; its output ``pipe_torque`` is the torque in
    the uppermost pipe.

    Parameters
    ----------
    string : DrillString
        The string.
    torsional_frequency, axial_frequency : float
        Hz, up to which each motion must be right; by default 10 and 15 Hz, and where a line has
        had eight modes if that is higher.
    tolerance : float
        Largest error of the reflection of a wave at the bit up to there.
    units : DrillString, optional
        The string whose lumped equivalent makes the units of mass, force and time, where that
        is another: so that strings of several lengths share points and gains.

    Raises
    ------
    InputError
        If a number is out of its range, or no elements reach the tolerance.
    """

    string: DrillString
    frequencies: tuple[float, float]
    tolerance: float
    units: DrillString
    unused_groups = ("eta", "xi", "kappa")

    def __init__(
        self,
        string: DrillString,
        torsional_frequency: float | None = None,
        axial_frequency: float | None = None,
        tolerance: float = TOLERANCE,
        units: DrillString | None = None,
    ) -> None:
        super().__init__()
        frequencies = tuple(
            max(usual, 0.5 * _FEWEST_MODES / line.transit_time)
            if value is None
            else checked_number(name, value, 0.0, 1e3, open_low=True)
            for name, value, usual, line in (
                ("torsional_frequency", torsional_frequency, TORSIONAL_FREQUENCY, string.torsion),
                ("axial_frequency", axial_frequency, AXIAL_FREQUENCY, string.tension),
            )
        )
        tolerance = checked_number("tolerance", tolerance, 1e-6, 1.0)
        self.__dict__.update(
            string=string,
            frequencies=frequencies,
            tolerance=tolerance,
            units=string if units is None else units,
        )
        if string.wall_torque > 0.0:
            # So plants that differ by it differ in words, too.
            self.__dict__["walls"] = tuple(section.wall for section in string.sections)

    @property
    def form(self) -> Any:
        """The string and how closely it is resolved."""
        return PipeString, self.string, self.frequencies, self.tolerance, self.units

    @property
    def resolved(self) -> Resolved:
        """The string's lines as they enter."""
        return resolve(self.string, *self.frequencies, self.tolerance)

    def build(self, c: Coefficients, q: Any) -> String:
        """Return the string, scaled to its units."""
        found = self.resolved
        axial = lumped(self.units, self.units.tension)
        torsional = lumped(self.units, self.units.torsion)
        time = np.sqrt(torsional.mass / torsional.stiffness)
        # The coefficients say what the units of force and time are.
        rate = (c.torsional_stiffness / c.inertia) ** 0.5 * time
        lines = (
            ("x", "length", found.tension, c.mass / axial.mass),
            ("theta", "angle", found.torsion, c.inertia / torsional.mass),
        )
        coordinates = _coordinates(lines)
        names = list(coordinates)
        matrices: list[ca.SX] = []
        for i, power in enumerate((0, 1, 2)):
            whole = ca.SX(len(names), len(names))
            for name, _, line, unit in lines:
                places = [names.index(n) for n in _names(name, line)]
                whole[places, places] = ca.DM(line.matrices[i]) * (unit * rate**power)
            matrices.append(whole)
        # Torque in the uppermost element, in units of the lumped stiffness.
        torsion = found.torsion
        weights = torsion.top_force * (c.torsional_stiffness / torsional.stiffness)
        outputs = {"pipe_torque": ("torque", _weights(_names("theta", torsion), weights))}
        reference = {name: None for name in names if name[-1].isdigit()}
        mass, damping, stiffness = matrices
        return String(
            coordinates, mass, damping, stiffness, outputs=outputs, reference=reference,
            sides=self._sides(torsion, c.torsional_stiffness / torsional.stiffness),
        )  # fmt: skip

    def _sides(self, torsion: Reduced, unit: Expression) -> tuple[SideFriction, ...]:
        """Return the friction on the wall."""
        if self.string.wall_torque == 0.0:
            return ()
        names = _names("theta", torsion)
        return tuple(
            SideFriction(_weights(names, shares), torque * unit, held * unit)
            for shares, torque, held in wall_parts(torsion, [*self.string.wall_torques][::-1])
        )


def _names(name: str, line: Reduced) -> list[str]:
    modes = line.shapes.shape[1] - 2
    return [name, *(f"{name}{i + 1}" for i in range(modes)), f"{name}_top"]


def _coordinates(lines: tuple[tuple[str, str, Reduced, Expression], ...]) -> dict[str, str]:
    inner: dict[str, str] = {}
    for name, quantity, line, _ in lines:
        inner |= dict.fromkeys(_names(name, line)[1:-1], quantity)
    ends = {name: quantity for name, quantity, _, _ in lines}
    return {**ends, **inner, **{f"{name}_top": quantity for name, quantity in ends.items()}}


def _weights(names: list[str], values: FloatArray) -> dict[str, float]:
    return dict(zip(names, values, strict=True))
