"""The operating point: dimensionless groups, and the rig point that they come from."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import makes_of_kinds
from drillctrl.base.language import LANGUAGES, Language, language_named
from drillctrl.drilling.rig import Rig

# Wear-flat groups of Table 1, used where a dimensionless point leaves them open.
LAMBDA_OVER_PSI = 0.7461
BETA = 0.2686


@dataclass(frozen=True)
class OperatingPoint:
    """The dimensionless groups of a point at which a rig drills.

    Attributes
    ----------
    omega0 : float
        ω0 > 0, rotary speed.
    delta0 : float
        δ0 ≥ 0, nominal depth of cut per radian, v0/ω0.
    psi : float
        ψ ≥ 0, cutting coefficient.
    eta : float
        η ≥ 0, ratio of the axial to the torsional natural frequency; 0 means that the hook
        load is imposed, and the rate of penetration follows.
    xi, kappa : float
        ξ, κ ≥ 0, axial and torsional damping ratio.
    blades : int
        n, number of blades.
    lam : float
        λ ≥ 0, wear-flat force; by default Table 1's 0.7461 ψ. Nonlinear model only.
    beta : float
        β ≥ 0, wear-flat torque; by default Table 1's 0.2686. Nonlinear model only.

    Raises
    ------
    InputError
        If a value is not finite or not in its range.
    """

    omega0: float
    delta0: float
    psi: float
    eta: float = 1.6
    xi: float = 0.02
    kappa: float = 0.02
    blades: int = 4
    lam: float | None = None
    beta: float = BETA

    def __post_init__(self) -> None:
        def check(name: str, low: float, high: float, open_low: bool = False) -> None:
            value = checked_number(name, getattr(self, name), low, high, open_low=open_low)
            object.__setattr__(self, name, value)

        check("omega0", 0.0, 1e6, open_low=True)
        check("delta0", 0.0, 1e6)
        check("psi", 0.0, 1e6)
        check("eta", 0.0, 1e6)
        check("xi", 0.0, 1e3)
        check("kappa", 0.0, 1e3)
        object.__setattr__(self, "blades", checked_integer("blades", self.blades, 1, 100))
        if self.lam is None:
            object.__setattr__(self, "lam", LAMBDA_OVER_PSI * self.psi)
        check("lam", 0.0, 1e9)
        check("beta", 0.0, 1e9)

    @property
    def delay(self) -> float:
        """τ0 = 2π/(n ω0), the regenerative delay of steady drilling (Eq. 18)."""
        return 2.0 * math.pi / (self.blades * self.omega0)

    @property
    def penetration_rate(self) -> float:
        """v0 = δ0 ω0, dimensionless (Eq. 21)."""
        return self.delta0 * self.omega0

    def with_changes(self, **changes: Any) -> OperatingPoint:
        """Return a point with some groups changed; λ keeps its ratio to ψ."""
        if "psi" in changes and "lam" not in changes and self.psi > 0.0:
            assert self.lam is not None
            changes["lam"] = self.lam / self.psi * changes["psi"]
        return replace(self, **changes)


@makes_of_kinds
@dataclass(frozen=True)
class RigPoint:
    """A rig at the rotary speed and penetration rate imposed at its top end.

    Attributes
    ----------
    rig : Rig
        Drill string, bit and rock.
    rotary_speed : float
        Ω0 > 0, rad/s.
    penetration_rate : float
        V0 ≥ 0, m/s.
    units : {"si", "field", "dimensionless"}
        In which people are told results; nothing that is computed depends on it.
    """

    made_by = "RigPoint(table1(), speed, rate), in rad/s and m/s"

    rig: Rig
    rotary_speed: float
    penetration_rate: float
    units: str = field(default="si", compare=False, repr=False)

    def __post_init__(self) -> None:
        speed = checked_number("rotary_speed", self.rotary_speed, 0.0, 1e6, open_low=True)
        rate = checked_number("penetration_rate", self.penetration_rate, 0.0, 1e3)
        object.__setattr__(self, "rotary_speed", speed)
        object.__setattr__(self, "penetration_rate", rate)
        language_named(self.units, with_rig=True)

    @property
    def language(self) -> Language:
        """The language of ``units``."""
        return LANGUAGES[self.units]

    def operating_point(self) -> OperatingPoint:
        """Return the dimensionless groups (Eqs. 16, 18, 21; λ and β from Eqs. 3, 14)."""
        rig = self.rig
        wear_force = rig.contact_strength * rig.bit_radius * rig.wearflat_length
        arm = rig.friction_coefficient * rig.bit_geometry * rig.bit_radius / 2.0
        return OperatingPoint(
            omega0=self.rotary_speed * rig.time_scale,
            delta0=self.penetration_rate / self.rotary_speed / rig.axial_scale,
            psi=rig.rock_strength
            * rig.bit_radius
            * rig.cutter_inclination
            * rig.inertia
            / (rig.torsional_stiffness * rig.mass),
            eta=math.sqrt(rig.axial_stiffness / rig.mass) * rig.time_scale,
            xi=rig.axial_damping / (2.0 * math.sqrt(rig.axial_stiffness * rig.mass)),
            kappa=rig.torsional_damping / (2.0 * math.sqrt(rig.torsional_stiffness * rig.inertia)),
            blades=rig.blades,
            lam=wear_force / rig.axial_force_scale,
            beta=wear_force * arm / rig.torsional_stiffness,
        )

    @classmethod
    def from_operating_point(cls, point: OperatingPoint, reference: Rig) -> RigPoint:
        """Return the rig point that has the given dimensionless groups.

        The groups fix nine of the sixteen numbers of a rig point. The other seven (M, I,
        Kt, a, l, ζ, γ, and the submerged weight) are taken from the reference, so that a
        point made from a rig gives that rig back.

        Parameters
        ----------
        point : OperatingPoint
            The groups.
        reference : Rig
            Supplies scales and geometry.

        Raises
        ------
        InputError
            If the groups need a wear flat or a friction that the reference cannot have.
        """
        assert point.lam is not None
        stiffness = point.eta**2 / reference.time_scale**2 * reference.mass
        scaled = replace(
            reference,
            axial_stiffness=stiffness,
            axial_damping=2.0 * point.xi * math.sqrt(stiffness * reference.mass),
            torsional_damping=2.0
            * point.kappa
            * math.sqrt(reference.torsional_stiffness * reference.inertia),
            rock_strength=point.psi
            * reference.torsional_stiffness
            * reference.mass
            / (reference.bit_radius * reference.cutter_inclination * reference.inertia),
            blades=point.blades,
        )
        wear_force = point.lam * scaled.axial_force_scale
        wear_torque = point.beta * scaled.torsional_stiffness
        rig = replace(
            scaled,
            contact_strength=_quotient(
                "lam", point.lam, wear_force, scaled.bit_radius * scaled.wearflat_length
            ),
            friction_coefficient=_quotient(
                "beta",
                point.beta,
                wear_torque,
                wear_force * scaled.bit_geometry * scaled.bit_radius / 2.0,
                otherwise=scaled.friction_coefficient,
            ),
        )
        speed = point.omega0 / rig.time_scale
        return cls(rig, speed, point.delta0 * speed * rig.axial_scale)


def _quotient(
    name: str, group: float, numerator: float, denominator: float, otherwise: float = 0.0
) -> float:
    if denominator > 0.0:
        return numerator / denominator
    if numerator > 0.0:
        raise InputError(name, group, "0, since the reference rig has no such friction")
    return otherwise


def changed_by(
    where: OperatingPoint | RigPoint, *, speed: float = 1.0, rate: float = 1.0
) -> OperatingPoint | RigPoint:
    """Return a point with its rotary speed and its rate of penetration times these factors.

    Faster rotation at the same rate cuts less deep.
    """
    if isinstance(where, RigPoint):
        return replace(
            where,
            rotary_speed=where.rotary_speed * speed,
            penetration_rate=where.penetration_rate * rate,
        )
    return where.with_changes(omega0=where.omega0 * speed, delta0=where.delta0 * rate / speed)
