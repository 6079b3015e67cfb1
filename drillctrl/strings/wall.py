"""Dry friction of a string on the wall of its hole, section by section."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.strings.elements import Reduced


@dataclass(frozen=True)
class Wall:
    """How a section lies against the wall.

    Attributes
    ----------
    friction_factor : float
        Of Coulomb friction, the same at rest and sliding.
    inclination : float
        Of the hole from the vertical, rad: the buoyed weight presses by its sine.
    side_force : float or None
        Force that presses, N/m, in place of that of the weight.

    Raises
    ------
    InputError
        If a value is not in its range.
    """

    friction_factor: float
    inclination: float = 0.0
    side_force: float | None = None

    def __post_init__(self) -> None:
        checked_number("friction factor", self.friction_factor, 0.0, 2.0)
        checked_number("inclination", self.inclination, 0.0, math.pi)
        if self.side_force is not None:
            checked_number("side force", self.side_force, 0.0, 1e6)
            if self.inclination:
                raise InputError("inclination", self.inclination, "left out beside a side force")

    def torque(self, buoyed_weight: float, radius: float) -> float:
        """Return the torque of friction per metre, N.

        Parameters
        ----------
        buoyed_weight : float
            N/m.
        radius : float
            Of what touches the wall, m.
        """
        pressed = self.side_force
        if pressed is None:
            pressed = buoyed_weight * math.sin(self.inclination)
        return self.friction_factor * pressed * radius


def wall_parts(
    line: Reduced, sections: list[tuple[float, float]]
) -> tuple[tuple[FloatArray, float], ...]:
    """Return the friction on the wall of each part: shares of coordinates in its angle, and torque.

    The first part is half as long as the others and turns with the bit. There are as many others
    as modes: fewer than coordinates, so that each can be held by itself.

    Parameters
    ----------
    line : Reduced
        The string in torsion.
    sections : list of tuple
        Length, m, and torque per metre, N, of each section from the bit up.
    """
    height, count = line.height, line.shapes.shape[1] - 3
    ends = np.cumsum([0.0, *(length for length, _ in sections)])
    sums = np.cumsum([0.0, *(length * torque for length, torque in sections)])
    edges = np.concatenate([[0.0], 0.5 * (height[1:] + height[:-1]), height[-1:]])
    torques = np.diff(np.interp(edges, ends, sums))
    which = np.minimum(np.floor(height / height[-1] * (count + 0.5) + 0.5).astype(int), count)
    bit = np.eye(line.shapes.shape[1])[0]
    found = [(bit, float(torques[which == 0].sum()))]
    for k in range(1, count + 1):
        here = which == k
        total = float(torques[here].sum())
        if total > 0.0:
            found.append((torques[here] @ line.shapes[here] / total, total))
    return tuple(found)
