"""A drill string: its sections from the top down, how it is damped, and what hangs in it."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

from drillctrl.base.errors import InputError, checked_number
from drillctrl.strings.line import Line, Piece, Stretch
from drillctrl.strings.section import Section

STANDARD_GRAVITY = 9.80665
DEEPEST, HEAVIEST_MUD = 15e3, 3000.0
_JOINT = 9.6
# Of a joint, that is worth a piece of its own.
_LEAST_SHARE = 1e-3


@dataclass(frozen=True)
class Damping:
    """What damps the motion of a string about steady drilling.

    Attributes
    ----------
    torsional, axial : float
        Viscous, over the mass that it acts on, 1/s. It stands for mud and wall.
    retardation : float
        Of Kelvin and Voigt, s, for both motions. The default damps 5 Hz by 0.3 % and 50 Hz by
        3 % of critical; without any, cutting excites axial modes of hundreds of hertz.

    Raises
    ------
    InputError
        If a value is negative.
    """

    torsional: float = 0.1
    axial: float = 0.1
    retardation: float = 2e-4

    def __post_init__(self) -> None:
        for name in ("torsional", "axial", "retardation"):
            value = checked_number(f"{name} damping", getattr(self, name), 0.0, 1e3)
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class DrillString:
    """A drill string from the top drive to the bit.

    Attributes
    ----------
    sections : tuple of Section
        From the top down; the last one carries the bit.
    damping : Damping
        Of its motion.
    mud_density : float
        kg/m³; 0 for air. Buoyancy alone: the mud's inertia is left out.
    hoisting_stiffness : float or None
        Of the ropes above the top end, N/m; None where the feed is imposed at the top end.

    Raises
    ------
    InputError
        If there is no section, or a value is not in its range.
    """

    sections: tuple[Section, ...]
    damping: Damping = Damping()
    mud_density: float = 0.0
    hoisting_stiffness: float | None = None

    def __post_init__(self) -> None:
        if not self.sections:
            raise InputError("sections", "none", "at least one")
        checked_number("mud density", self.mud_density, 0.0, HEAVIEST_MUD)
        if self.hoisting_stiffness is not None:
            checked_number("hoisting stiffness", self.hoisting_stiffness, 0.0, 1e12, open_low=True)

    @property
    def length(self) -> float:
        """Length in metres."""
        return sum(section.length for section in self.sections)

    @property
    def shallowest(self) -> float:
        """Length with one joint of its uppermost section, m."""
        top = self.sections[0]
        joint = top.joint_length if top.joints > 1 else min(top.length, _JOINT)
        return self.length - top.length + joint

    def at_depth(self, length: float) -> DrillString:
        """Return the string with pipe added or taken away at its top.

        Parameters
        ----------
        length : float
            Of the whole string, m. What is no whole joint of the uppermost section hangs above
            it as a short one, its tool joint as much shorter.

        Raises
        ------
        InputError
            If it leaves less than one joint of the uppermost section, or is above 15 km.
        """
        length = checked_number("depth", length, self.shallowest, DEEPEST)
        top = self.sections[0]
        left = length - (self.length - top.length)
        if top.tool_joint is None:
            return replace(self, sections=(replace(top, length=left), *self.sections[1:]))
        joint = top.joint_length
        whole = max(1, math.floor(left / joint + 1e-9))
        pipes = [replace(top, length=whole * joint, joints=whole)]
        share = left / joint - whole
        if share > _LEAST_SHARE:
            tool = replace(top.tool_joint, length=share * top.tool_joint.length)
            pipes.insert(0, replace(top, length=share * joint, joints=1, tool_joint=tool))
        return replace(self, sections=(*pipes, *self.sections[1:]))

    @property
    def mass(self) -> float:
        """Mass in air, kg."""
        return sum(section.length * section.mass_per_metre for section in self.sections)

    @property
    def submerged_weight(self) -> float:
        """Weight in the mud, N."""
        return sum(section.length * self.buoyed(section) for section in self.sections)

    def buoyed(self, section: Section) -> float:
        """Return the weight of a section in the mud, N/m."""
        lift = max(1.0 - self.mud_density / section.material.density, 0.0)
        return STANDARD_GRAVITY * section.mass_per_metre * lift

    @functools.cached_property
    def wall_torques(self) -> tuple[tuple[float, float, float], ...]:
        """Length, m, and torque on the wall per metre, N, of each section from the top down.

        The first torque is that while it slides, the second the most that holds it at rest.
        """
        return tuple(
            (s.length, *(s.wall.torques(self.buoyed(s), 0.5 * s.widest) if s.wall else (0.0, 0.0)))
            for s in self.sections
        )

    @property
    def wall_torque(self) -> float:
        """Torque of friction on the wall while the whole string slides, N m."""
        return sum(length * torque for length, torque, _ in self.wall_torques)

    @functools.cached_property
    def torsion(self) -> Line:
        """The string in torsion."""
        damping = self.damping
        return Line(
            tuple(
                section.torsional(damping.torsional, damping.retardation)
                for section in self.sections
            )
        )

    @functools.cached_property
    def tension(self) -> Line:
        """The string in tension, under the ropes if these give way."""
        damping = self.damping
        stretches = tuple(
            section.axial(damping.axial, damping.retardation) for section in self.sections
        )
        if self.hoisting_stiffness is not None:
            # A spring without mass, of any length: a metre of pipe that weighs nothing.
            ropes = Stretch((Piece(1.0, 0.0, self.hoisting_stiffness),))
            stretches = (ropes, *stretches)
        return Line(stretches)
