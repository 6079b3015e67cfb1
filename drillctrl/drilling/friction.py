"""Friction laws of the bit beside the paper's."""

from __future__ import annotations

from typing import Any

import casadi as ca

from drillctrl.drilling.bit_rock import BitRock, Contact, Load, PaperLaw, Rates
from drillctrl.drilling.coefficients import Coefficients


class FreeBit(BitRock):
    """A bit off the rock: no weight, no torque, whatever it does."""

    def load(self, c: Coefficients, contact: Contact, rates: Rates, q: Any) -> Load:
        """Return nothing."""
        return Load(ca.SX(0), ca.SX(0))


class Stribeck(BitRock):
    """The paper's law with a torque that falls as the bit turns faster.

    To the wear torque β (of Eq. 3) comes ``drop`` exp(−abs(Φ')/``decay``), as far as the wear
    flat is pressed. At the steady speed Ω0 the torque falls by drop/decay exp(−Ω0/decay) per
    unit of speed.

    Attributes
    ----------
    parameters : mapping
        ``drop``, a torque, and ``decay`` > 0, a rotary speed.
    """

    parameters = {"drop": 1.0, "decay": 1.5}  # noqa: RUF012
    quantities = {"drop": "torque", "decay": "angular_rate"}  # noqa: RUF012

    def load(self, c: Coefficients, contact: Contact, rates: Rates, q: Any) -> Load:
        """Return the paper's load and what falls with speed."""
        plain = PaperLaw().load(c, contact, rates, q)
        falling = q.drop * ca.exp(-ca.fabs(rates.rotary) / q.decay)
        return Load(
            plain.weight_on_bit,
            plain.torque_on_bit + falling * contact.pressed * contact.direction,
        )
