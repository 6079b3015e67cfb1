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
        Of Coulomb friction while it slides.
    inclination : float
        Of the hole from the vertical, rad: the buoyed weight presses by its sine.
    side_force : float or None
        Force that presses, N/m, in place of that of the weight.
    static_factor : float or None
        Friction factor at rest, not below ``friction_factor``; by default the same.

    Raises
    ------
    InputError
        If a value is not in its range.
    """

    friction_factor: float
    inclination: float = 0.0
    side_force: float | None = None
    static_factor: float | None = None

    def __post_init__(self) -> None:
        checked_number("friction factor", self.friction_factor, 0.0, 2.0)
        if self.static_factor is not None:
            checked_number("static factor", self.static_factor, self.friction_factor, 4.0)
        checked_number("inclination", self.inclination, 0.0, math.pi)
        if self.side_force is not None:
            checked_number("side force", self.side_force, 0.0, 1e6)
            if self.inclination:
                raise InputError("inclination", self.inclination, "left out beside a side force")

    def torques(self, buoyed_weight: float, radius: float) -> tuple[float, float]:
        """Return the torque of friction per metre, N, while it slides and at most at rest.

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
        most = self.friction_factor if self.static_factor is None else self.static_factor
        return self.friction_factor * pressed * radius, most * pressed * radius


def wall_parts(
    line: Reduced, sections: list[tuple[float, float, float]]
) -> tuple[tuple[FloatArray, float, float], ...]:
    """Return the friction of each part: shares of coordinates in its angle, torque, and at rest.

    The first part is half as long as the others and turns with the bit. There are as many others
    as modes: fewer than coordinates, so that each can be held by itself.

    Parameters
    ----------
    line : Reduced
        The string in torsion.
    sections : list of tuple
        Length, m, and torques per metre, N, sliding and at rest, of each section from the bit up.
    """
    height, count = line.height, line.shapes.shape[1] - 3
    lengths, sliding, resting = np.array(sections).T
    ends = np.cumsum([0.0, *lengths])
    edges = np.concatenate([[0.0], 0.5 * (height[1:] + height[:-1]), height[-1:]])
    torques, held = (
        np.diff(np.interp(edges, ends, np.cumsum([0.0, *(lengths * per_metre)])))
        for per_metre in (sliding, resting)
    )
    which = np.minimum(np.floor(height / height[-1] * (count + 0.5) + 0.5).astype(int), count)
    bit = np.eye(line.shapes.shape[1])[0]
    found = [(bit, float(torques[which == 0].sum()), float(held[which == 0].sum()))]
    for k in range(1, count + 1):
        here = which == k
        total = float(torques[here].sum())
        if total > 0.0:
            shares = torques[here] @ line.shapes[here] / total
            found.append((shares, total, float(held[here].sum())))
    return tuple(found)
