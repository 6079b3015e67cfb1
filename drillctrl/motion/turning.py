"""A bit that is turned at an imposed speed, so that the axial motion alone is left."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from drillctrl.base.errors import InputError, checked_number
from drillctrl.drilling.block import Block
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.realisation import Realisation

_ANGLES = ("angle", "angular_rate")
_TURNED = ("theta", "dtheta")


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
            C=ca.SX.eye(size), R=made.R[states, :], late=(),
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
