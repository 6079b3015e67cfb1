"""The bit on the rock: depth of cut, weight and torque on bit (Eqs. 2-9)."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca

from drillctrl.drilling.coefficients import Coefficients, Expression


def ramp(y: Expression) -> Expression:
    """R(y) of Eq. 4, with slope 1 at y = 0 as seen from the cutting side."""
    return ca.if_else(y >= 0, y, 0)


def heaviside(y: Expression) -> Expression:
    """H(y) of Eq. 5."""
    return ca.if_else(y >= 0, 1, 0)


class BitRock(NamedTuple):
    """Weight on bit and torque on bit (Eq. 2), each cutting plus friction."""

    weight_on_bit: Expression
    torque_on_bit: Expression


class Contact(NamedTuple):
    """How the bit meets the rock: the arguments of Eq. 3 once its switches are decided.

    Attributes
    ----------
    cut : expression
        R(d) H(Φ'), depth of the rock that is being cut.
    pressed : expression
        H(d) H(Z'), share of the wear-flat force that acts; at Z' = 0 anything in [0, 1].
    direction : expression
        sgn(Φ'); at Φ' = 0 anything in [-1, 1].
    """

    cut: Expression
    pressed: Expression
    direction: Expression


def contact_load(c: Coefficients, contact: Contact) -> BitRock:
    """Return the bit-rock interaction (Eqs. 2, 3) on one branch of its switches."""
    return BitRock(
        c.cutting_force * contact.cut + c.wear_force * contact.pressed,
        c.cutting_torque * contact.cut + c.wear_torque * contact.direction * contact.pressed,
    )


def bit_rock(
    c: Coefficients, depth: Expression, axial_rate: Expression, rotary_rate: Expression
) -> BitRock:
    """Return the bit-rock interaction (Eqs. 2-6).

    Parameters
    ----------
    c : Coefficients
        Cutting and wear-flat coefficients.
    depth : expression
        Total depth of cut over all blades, d.
    axial_rate, rotary_rate : expression
        Z' and Φ', velocities of the bit.
    """
    contact = Contact(
        cut=ramp(depth) * heaviside(rotary_rate),
        pressed=heaviside(depth) * heaviside(axial_rate),
        direction=ca.sign(rotary_rate),
    )
    return contact_load(c, contact)


class Kinematics(NamedTuple):
    """What the bit did during the delay, and its velocities now.

    Attributes
    ----------
    depth : expression
        d, total depth of cut (Eqs. 7, 9).
    turned : expression
        Φ(t) − Φ(t − τ) (Eq. 8).
    axial_rate, rotary_rate : expression
        Z' and Φ'.
    """

    depth: Expression
    turned: Expression
    axial_rate: Expression
    rotary_rate: Expression


def kinematics(c: Coefficients, now: Any, then: Any, delay: Expression) -> Kinematics:
    """Return depth of cut, angle turned and velocities (Eqs. 7-9).

    Parameters
    ----------
    c : Coefficients
        Speeds imposed at the top end, and number of blades.
    now, then : record
        Perturbations X(t) and X(t − τ) by name, as in `STATE_NAMES`.
    delay : expression
        τ.
    """
    return Kinematics(
        depth=c.blades * (c.penetration_rate * delay + now.x - then.x),
        turned=c.rotary_speed * delay + now.theta - then.theta,
        axial_rate=c.penetration_rate + now.dx,
        rotary_rate=c.rotary_speed + now.dtheta,
    )
