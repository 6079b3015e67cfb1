"""A bit whose speed swings as asked: imposed, so that the axial motion alone is left, or led."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from drillctrl.base.errors import InputError, checked_number
from drillctrl.drilling.block import Block
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.quantities import Signal
from drillctrl.drilling.realisation import Realisation

_ANGLES = ("angle", "angular_rate")
_TURNED = ("theta", "dtheta")
# Damping that leads the bit at the frequency, over that of a mass of the bit's inertia with a
# damping ratio of 1, and the width of the band in which it acts, over the frequency.
_GRIP, _BAND = 1.0, 0.5


class Turned(Block):
    """Rotation of the bit that is imposed: θ'' = −ω² θ, whatever the rock bears.

    θ' = a at t = 0 makes the bit turn at Ω0 + a cos ωt for good. What else turns is left out,
    and so are inputs, sensors and signals that arrive late: the axial string and the rock remain.

    Attributes
    ----------
    parameters : mapping
        ``turning_frequency``, ω > 0.

    Raises
    ------
    InputError
        If the frequency is not positive.
    """

    parameters = {"turning_frequency": 1.0}  # noqa: RUF012

    def __init__(self, **values: float) -> None:
        super().__init__(**values)
        frequency = self.values["turning_frequency"]
        checked_number("turning_frequency", frequency, 0.0, 1e6, open_low=True)

    def signals(self, made: Realisation, c: Coefficients, q: Any) -> Realisation:
        """Return the axial equations beside the imposed rotation.

        Raises
        ------
        InputError
            If the axial motion depends on what turns elsewhere than at the bit.
        """
        kept, others = axial_states(made)
        rows = [made.state_names.index(name) for name in _TURNED]
        if others and made.A[kept, [*rows, *others]].nnz():
            raise InputError("string", "coupled between x and theta", "uncoupled but for the bit")
        size, states = len(kept) + 2, [*kept[:2], *rows, *kept[2:]]
        a = made.A[states, states]
        load, top = made.E[states, :], made.T[states, :]
        a[2:4, :] = 0
        a[2, 3], a[3, 2] = 1, -(q.turning_frequency**2)
        load[2:4, :], top[2:4, :] = 0, 0
        signals = tuple(made.states[i] for i in states)
        return replace(
            made, states=signals, inputs=(), outputs=signals, A=a, E=load, B=ca.SX(size, 0), T=top,
            C=ca.SX.eye(size), R=made.R[states, :], late=(), drag=ca.SX(0, 2),
            side_force=ca.SX(0, 0), side_rate=ca.SX(0, 1), side_torque=ca.SX(0, 1),
            side_held=ca.SX(0, 1),
        )  # fmt: skip


def axial_states(made: Realisation) -> tuple[list[int], list[int]]:
    """Return the places of the axial states, and those of all others but the bit's θ and θ'."""
    axial = [i for i, signal in enumerate(made.states) if signal.quantity not in _ANGLES]
    rest = [
        i
        for i, signal in enumerate(made.states)
        if signal.quantity in _ANGLES and signal.name not in _TURNED
    ]
    return axial, rest


class Led(Block):
    """Speed of the bit that is led in a band about ω alone.

    A damper of that band drags the bit along at Ω0 + a cos ωt, where a is θ' of ``lead`` at
    t = 0; at all other frequencies string and bit turn as they would, so that the torque of
    the axial orbit makes the speed ripple.

    Attributes
    ----------
    parameters : mapping
        ``lead_frequency``, ω > 0.

    Raises
    ------
    InputError
        If the frequency is not positive.
    """

    parameters = {"lead_frequency": 1.0}  # noqa: RUF012

    def __init__(self, **values: float) -> None:
        super().__init__(**values)
        checked_number("lead_frequency", self.values["lead_frequency"], 0.0, 1e6, open_low=True)

    def signals(self, made: Realisation, c: Coefficients, q: Any) -> Realisation:
        """Return the equations with lead and band.

        The lead is p'' = −ω² p, the band g' = B (θ' − p' − g) − ω² h with h' = g; the torque on
        the bit is the damping times g.
        """
        omega, n = q.lead_frequency, len(made.states)
        names = ("lead", "dlead"), ("drag_sum", "drag")
        added = [Signal(*pair) for two in names for pair in zip(two, _ANGLES, strict=True)]
        states = (*made.states, *added)
        a, load, top = ca.SX(n + 4, n + 4), ca.SX(n + 4, 2), ca.SX(n + 4, 4)
        a[:n, :n], load[:n, :], top[:n, :] = made.A, made.E, made.T
        speed = made.state_names.index(_TURNED[1])
        lead, rate, total, drag = range(n, n + 4)
        a[lead, rate], a[rate, lead] = 1, -(omega**2)
        band = _BAND * omega
        a[drag, speed], a[drag, rate], a[drag, drag], a[drag, total] = (
            band,
            -band,
            -band,
            -(omega**2),
        )
        a[total, drag] = 1
        inertia = c.torsional_stiffness / omega**2
        a[:n, drag] = made.E[:, 1] * (2 * _GRIP * inertia * omega)
        reference = ca.SX(n + 4, 4)
        reference[:n, :] = made.R[:n, :]
        return replace(
            made, states=states, inputs=(), outputs=states, A=a, E=load, B=ca.SX(n + 4, 0), T=top,
            C=ca.SX.eye(n + 4), R=reference, late=(),
        )  # fmt: skip
