"""A top drive with inertia of its own instead of an imposed rotary speed.

The top end turns by φ beside ω0 t, carries J times the inertia at the bit, and is moved by the
drive's torque: what soft-torque and impedance-matching speed controllers act on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from drillctrl.base.errors import checked_number
from drillctrl.drilling.block import Block
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.string import TOP, String

# What a drive gives that no law turns.
CONSTANT_TORQUE = "constant-torque"


class TopDrive(Block):
    """A drive: J I φ'' is the torque of the string on it plus the drive's.

    Its states are ``phi`` and ``dphi``, its input is ``drive``, the perturbation of the
    drive's torque. Rotary speeds that a scenario asks for are its set point.

    Attributes
    ----------
    parameters : mapping
        ``inertia_ratio``, J > 0, inertia of the drive, referred to the string, over I.

    Raises
    ------
    InputError
        If the ratio is not positive.
    """

    parameters = {"inertia_ratio": 2.0}  # noqa: RUF012

    def __init__(self, **values: float) -> None:
        super().__init__(**values)
        checked_number("inertia_ratio", self.values["inertia_ratio"], 0.0, 1e6, open_low=True)

    def mechanics(self, string: String, c: Coefficients, q: Any) -> String:
        """Return the string whose top end is free to turn."""

        def renamed(weights: Mapping[str, Any]) -> dict[str, Any]:
            return {("phi" if n == TOP[1] else n): w for n, w in weights.items()}

        mass = string.mass[:, :]
        names = renamed(string.coordinates)
        place = list(names).index("phi")
        mass[place, place] = mass[place, place] + q.inertia_ratio * c.inertia
        return replace(
            string,
            coordinates=names,
            mass=mass,
            inputs={**string.inputs, "drive": "phi"},
            outputs={
                name: (quantity, renamed(weights))
                for name, (quantity, weights) in string.outputs.items()
            },
            imposed=tuple(name for name in string.imposed if name != TOP[1]),
            sides=tuple(side._replace(weights=renamed(side.weights)) for side in string.sides),
        )
