"""The bit in the rock: depth of cut (Eqs. 7-9), and the load that it brings (Eqs. 2-6)."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from drillctrl.drilling.coefficients import Coefficients, Expression
from drillctrl.drilling.part import Part


class Load(NamedTuple):
    """Weight on bit and torque on bit (Eq. 2)."""

    weight_on_bit: Expression
    torque_on_bit: Expression


class Contact(NamedTuple):
    """How the bit meets the rock, its switches decided.

    Attributes
    ----------
    cut : expression
        R(d) H(Φ'), depth of the rock that is being cut, over all blades.
    pressed : expression
        H(d) H(Z'), share of the wear-flat force that acts; at Z' = 0 anything in [0, 1].
    direction : expression
        sgn(Φ'); at Φ' = 0 anything in [-1, 1].
    """

    cut: Expression
    pressed: Expression
    direction: Expression


class Rates(NamedTuple):
    """Velocities of the bit, Z' and Φ'."""

    axial: Expression
    rotary: Expression


class BitRock(Part):
    """A bit–rock law: a subclass names its parameters and says what the rock bears.

    What holds the bit still follows from the law's own branches: at Φ' = 0 the torque lies
    between ``direction`` = -1 without a cut and +1 with it, at Z' = 0 the weight between
    ``pressed`` = 0 and 1, in which it must be affine.
    """

    def load(self, c: Coefficients, contact: Contact, rates: Rates, q: Any) -> Load:
        """Return the load on the bit.

        Parameters
        ----------
        c : Coefficients
            Of cutting and wear flat, in any consistent units.
        contact : Contact
            What is cut, pressed and rubbed.
        rates : Rates
            Velocities of the bit.
        q : record
            The law's own parameters by name.
        """
        raise NotImplementedError(f"{type(self).__name__} must say what load it brings")


class PaperLaw(BitRock):
    """Cutting in proportion to depth, and a wear flat with dry friction (Eqs. 2, 3)."""

    def load(self, c: Coefficients, contact: Contact, rates: Rates, q: Any) -> Load:
        """Return the load of Eqs. 2 and 3."""
        return Load(
            c.cutting_force * contact.cut + c.wear_force * contact.pressed,
            c.cutting_torque * contact.cut + c.wear_torque * contact.direction * contact.pressed,
        )


def ramp(y: Expression) -> Expression:
    """R(y) of Eq. 4, with slope 1 at y = 0 as seen from the cutting side."""
    return ca.if_else(y >= 0, y, 0)


def heaviside(y: Expression) -> Expression:
    """H(y) of Eq. 5."""
    return ca.if_else(y >= 0, 1, 0)


def switched(depth: Expression, rates: Rates) -> Contact:
    """Return the contact that depth and velocities decide (Eqs. 4-6)."""
    return Contact(
        cut=ramp(depth) * heaviside(rates.rotary),
        pressed=heaviside(depth) * heaviside(rates.axial),
        direction=ca.sign(rates.rotary),
    )


class Kinematics(NamedTuple):
    """What the bit did during the delay, and its velocities now.

    Attributes
    ----------
    depth : expression
        d, total depth of cut (Eqs. 7, 9).
    turned : expression
        Φ(t) − Φ(t − τ) (Eq. 8).
    rates : Rates
        Z' and Φ'.
    """

    depth: Expression
    turned: Expression
    rates: Rates


def kinematics(c: Coefficients, now: Any, then: Any, delay: Expression) -> Kinematics:
    """Return depth of cut, angle turned and velocities (Eqs. 7-9).

    Parameters
    ----------
    c : Coefficients
        Speeds of steady drilling, and number of blades.
    now, then : sequence
        The bit's perturbation (x, x', θ, θ') at t and t − τ.
    delay : expression
        τ.
    """
    return Kinematics(
        depth=c.blades * (c.penetration_rate * delay + now[0] - then[0]),
        turned=c.rotary_speed * delay + now[2] - then[2],
        rates=Rates(c.penetration_rate + now[1], c.rotary_speed + now[3]),
    )


def pitch(c: Coefficients) -> Expression:
    """2π/n, the angle between two blades."""
    return 2 * np.pi / c.blades


def steady_depth(c: Coefficients) -> Expression:
    """d0 = 2π V0/Ω0, total depth of cut per revolution in steady drilling (Eq. 11)."""
    return 2 * np.pi * (c.penetration_rate / c.rotary_speed)


def steady_delay(c: Coefficients) -> Expression:
    """2π/(n Ω0), the delay of steady drilling (Eq. 18)."""
    return 2 * np.pi / (c.blades * c.rotary_speed)


def steady_load(law: BitRock, c: Coefficients, q: Any) -> Load:
    """Weight on bit and torque on bit in steady drilling (Eqs. 2, 3, 10, 11)."""
    rates = Rates(c.penetration_rate, c.rotary_speed)
    return law.load(c, Contact(steady_depth(c), 1.0, 1.0), rates, q)
