"""The string between top end and bit (Eq. 1)."""

from __future__ import annotations

from drillctrl.drilling.bit_rock import BitRock
from drillctrl.drilling.coefficients import Coefficients, Expression


def equations_of_motion(
    c: Coefficients,
    stretch: Expression,
    twist: Expression,
    axial_rate: Expression,
    rotary_rate: Expression,
    load: BitRock,
    axial_force: Expression,
    torque: Expression,
) -> tuple[Expression, Expression]:
    """Return the axial and the angular acceleration of the bit (Eq. 1, with actuators).

    Parameters
    ----------
    c : Coefficients
        Inertia, damping, stiffness and weight.
    stretch, twist : expression
        z − V0 t and φ − Ω0 t.
    axial_rate, rotary_rate : expression
        Velocities of the bit.
    load : BitRock
        Weight on bit and torque on bit.
    axial_force, torque : expression
        Actuator force and torque on the bit.
    """
    axial = c.weight - load.weight_on_bit - c.axial_damping * axial_rate
    angular = -load.torque_on_bit - c.torsional_damping * rotary_rate
    return (
        (axial - c.axial_stiffness * stretch + axial_force) / c.mass,
        (angular - c.torsional_stiffness * twist + torque) / c.inertia,
    )
