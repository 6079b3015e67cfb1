"""Sections of a drill string: pipe with its tool joints, heavy-weight pipe, collars."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from drillctrl.base.errors import InputError, checked_number
from drillctrl.strings.line import Piece, Stretch
from drillctrl.strings.wall import Wall

KINDS = ("pipe", "heavy-weight", "collar")
JOINT_LENGTH = 9.6


@dataclass(frozen=True)
class Material:
    """What a section is made of.

    Attributes
    ----------
    density : float
        kg/m³.
    elasticity : float
        Young's modulus E, Pa.
    shear : float
        Shear modulus G, Pa.
    """

    density: float
    elasticity: float
    shear: float

    def __post_init__(self) -> None:
        for name in ("density", "elasticity", "shear"):
            value = checked_number(name, getattr(self, name), 0.0, 1e13, open_low=True)
            object.__setattr__(self, name, value)


MATERIALS = {
    "steel": Material(7850.0, 206e9, 79.3e9),
    "aluminium": Material(2780.0, 71e9, 27e9),
    "non-magnetic": Material(7900.0, 193e9, 75e9),
}


@dataclass(frozen=True)
class ToolJoint:
    """The thick ends of a joint of pipe, pin and box together.

    Attributes
    ----------
    outer_diameter, inner_diameter : float
        m.
    length : float
        Both ends together, m.
    """

    outer_diameter: float
    inner_diameter: float
    length: float = 0.55

    def __post_init__(self) -> None:
        _check_diameters("tool joint", self.outer_diameter, self.inner_diameter)
        checked_number("tool joint length", self.length, 0.0, 5.0, open_low=True, unit="m")


@dataclass(frozen=True)
class Section:
    """A row of a tally.

    Attributes
    ----------
    name : str
        What the crew calls it.
    kind : str
        ``"pipe"``, ``"heavy-weight"`` or ``"collar"``.
    length : float
        m.
    outer_diameter, inner_diameter : float
        Of the body, m.
    tool_joint : ToolJoint or None
        At each joint.
    joints : int
        How many joints the length is made of.
    weight : float or None
        Mass per metre with all that belongs to it, kg/m; by default from the geometry.
    material : Material
        Of body and tool joint.
    wall : Wall or None
        How it lies against the wall; None where it does not rub.

    Raises
    ------
    InputError
        If a value is not in its range, or the bore is wider than the section.
    """

    name: str
    kind: str
    length: float
    outer_diameter: float
    inner_diameter: float
    tool_joint: ToolJoint | None = None
    joints: int = 1
    weight: float | None = None
    material: Material = MATERIALS["steel"]
    wall: Wall | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"type of {self.name}", self.kind, f"one of {', '.join(KINDS)}")
        checked_number(f"length of {self.name}", self.length, 0.0, 2e4, open_low=True, unit="m")
        _check_diameters(self.name, self.outer_diameter, self.inner_diameter)
        if self.joints < 1:
            raise InputError(f"joints of {self.name}", self.joints, "at least 1")
        if self.weight is not None:
            checked_number(
                f"weight of {self.name}", self.weight, 0.0, 2e3, open_low=True, unit="kg/m"
            )
        if self.tool_joint is not None and self.tool_joint.length >= self.joint_length:
            wanted = f"less than a joint, {self.joint_length:g} m"
            shown = f"{self.tool_joint.length:g} m"
            raise InputError(f"tool joint length of {self.name}", shown, wanted)

    @property
    def joint_length(self) -> float:
        """Length of one joint, m."""
        return self.length / self.joints

    @property
    def geometric_weight(self) -> float:
        """Mass per metre of body and tool joints from their diameters, kg/m."""
        return self._stretch(False, 0.0, 0.0, 1.0).mean().mass

    @property
    def mass_per_metre(self) -> float:
        """Mass per metre in air, kg/m."""
        return self.geometric_weight if self.weight is None else self.weight

    @property
    def widest(self) -> float:
        """Largest outer diameter, m."""
        joint = self.tool_joint
        return max(self.outer_diameter, 0.0 if joint is None else joint.outer_diameter)

    def torsional(self, damping: float, retardation: float) -> Stretch:
        """Return the section in torsion.

        Parameters
        ----------
        damping : float
            c over the inertia, 1/s.
        retardation : float
            Of Kelvin and Voigt, s.
        """
        return self._stretch(True, damping, retardation, self._heavier)

    def axial(self, damping: float, retardation: float) -> Stretch:
        """Return the section in tension, with the same parameters."""
        return self._stretch(False, damping, retardation, self._heavier)

    @property
    def _heavier(self) -> float:
        # A stated weight counts for inertia too: what is heavier is so all around.
        return self.mass_per_metre / self.geometric_weight

    def _stretch(
        self, torsion: bool, damping: float, retardation: float, heavier: float
    ) -> Stretch:
        modulus = self.material.shear if torsion else self.material.elasticity
        size = _polar if torsion else _area
        bodies = [(self.joint_length, self.outer_diameter, self.inner_diameter)]
        joint = self.tool_joint
        if joint is not None:
            bodies[0] = (self.joint_length - joint.length, *bodies[0][1:])
            bodies.append((joint.length, joint.outer_diameter, joint.inner_diameter))
        pieces = []
        for length, outer, inner in bodies:
            mass = self.material.density * size(outer, inner) * heavier
            stiffness = modulus * size(outer, inner)
            pieces.append(Piece(length, mass, stiffness, damping * mass, retardation))
        return Stretch(tuple(pieces), self.joints)


def _area(outer: float, inner: float) -> float:
    return math.pi / 4.0 * (outer**2 - inner**2)


def _polar(outer: float, inner: float) -> float:
    return math.pi / 32.0 * (outer**4 - inner**4)


def _check_diameters(name: str, outer: float, inner: float) -> None:
    checked_number(f"OD of {name}", outer, 0.0, 1.0, open_low=True, unit="m")
    checked_number(f"ID of {name}", inner, 0.0, 1.0, unit="m")
    if inner >= outer:
        raise InputError(
            f"ID of {name}", f"{inner * 1e3:g} mm", f"below its OD, {outer * 1e3:g} mm"
        )
