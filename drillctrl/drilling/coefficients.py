"""What the equations of motion multiply, from a rig (Eqs. 1, 3) or from groups (Eqs. 15, 16)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

Expression = Any  # casadi.SX, or a float or array where every argument is one

GROUP_NAMES = ("omega0", "delta0", "psi", "eta", "xi", "kappa", "blades", "lam", "beta")
RIG_PARAMETER_NAMES = (
    "mass",
    "inertia",
    "axial_stiffness",
    "torsional_stiffness",
    "axial_damping",
    "torsional_damping",
    "rock_strength",
    "contact_strength",
    "bit_radius",
    "wearflat_length",
    "cutter_inclination",
    "friction_coefficient",
    "bit_geometry",
    "submerged_weight",
    "blades",
    "rotary_speed",
    "penetration_rate",
)


class Coefficients(NamedTuple):
    """What the equations of motion multiply, in any consistent set of units."""

    mass: Expression
    inertia: Expression
    axial_damping: Expression
    torsional_damping: Expression
    axial_stiffness: Expression
    torsional_stiffness: Expression
    cutting_force: Expression
    cutting_torque: Expression
    wear_force: Expression
    wear_torque: Expression
    weight: Expression
    rotary_speed: Expression
    penetration_rate: Expression
    blades: Expression


def rig_coefficients(rig: Any) -> Coefficients:
    """Return the coefficients in SI (Eqs. 1, 3) from names as in `RIG_PARAMETER_NAMES`."""
    cutting = rig.rock_strength * rig.bit_radius
    wear = rig.contact_strength * rig.bit_radius * rig.wearflat_length
    return Coefficients(
        mass=rig.mass,
        inertia=rig.inertia,
        axial_damping=rig.axial_damping,
        torsional_damping=rig.torsional_damping,
        axial_stiffness=rig.axial_stiffness,
        torsional_stiffness=rig.torsional_stiffness,
        cutting_force=cutting * rig.cutter_inclination,
        cutting_torque=cutting * rig.bit_radius / 2,
        wear_force=wear,
        wear_torque=wear * rig.bit_radius * rig.friction_coefficient * rig.bit_geometry / 2,
        weight=rig.submerged_weight,
        rotary_speed=rig.rotary_speed,
        penetration_rate=rig.penetration_rate,
        blades=rig.blades,
    )


def dimensionless_coefficients(point: Any) -> Coefficients:
    """Return the dimensionless coefficients (Eqs. 15, 16) from names as in `GROUP_NAMES`.

    Groups that a string has no use for may be missing; what follows from them is NaN.
    """
    eta, xi, kappa = (getattr(point, name, math.nan) for name in ("eta", "xi", "kappa"))
    return Coefficients(
        mass=1.0,
        inertia=1.0,
        axial_damping=2 * xi * eta,
        torsional_damping=2 * kappa,
        axial_stiffness=eta**2,
        torsional_stiffness=1.0,
        cutting_force=point.psi,
        cutting_torque=1.0,
        wear_force=point.lam,
        wear_torque=point.beta,
        weight=0.0,
        rotary_speed=point.omega0,
        penetration_rate=point.delta0 * point.omega0,
        blades=point.blades,
    )
