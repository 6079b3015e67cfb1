"""A top end that is fed by its weight instead of an imposed rate of penetration.

The hook moves by h beside V0 t. The faster it is let down than is told, the less it is held:
m h'' = (pull of the string) − c (h' − feed) − k (h − feed t). So in steady drilling it feeds at
V0; where the bit does not keep up the weight that is missing at the hook slows the feed down, by
the weight over c, and a bit that stands still is loaded by c V0 more than in steady drilling at
most. With c → ∞ the feed is imposed, with c = k = 0 the hook load.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from drillctrl.base.errors import checked_number
from drillctrl.drilling.block import Block
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.string import TOP, String

HOOK = "hook"


class Hoist(Block):
    """A hook with mass that is fed by its weight; states ``hook`` and ``dhook``.

    Rates of penetration that a scenario asks for are its set point. Its input is ``hoist``, the
    perturbation of the hook load, downwards.

    Attributes
    ----------
    parameters : mapping
        ``hoist_mass``, m over the mass at the bit, > 0; ``hoist_damping``, c in units of that
        mass over the unit of time; ``hoist_stiffness``, k, of ropes above it, in units of
        that mass over the square of the unit of time.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    parameters = {"hoist_mass": 1.0, "hoist_damping": 0.0, "hoist_stiffness": 0.0}  # noqa: RUF012

    def __init__(self, **values: float) -> None:
        super().__init__(**values)
        for name, value in self.values.items():
            checked_number(name, value, 0.0, 1e9, open_low=name == "hoist_mass")

    def mechanics(self, string: String, c: Coefficients, q: Any) -> String:
        """Return the string whose upper end hangs on a hook that is fed."""
        rate = (c.torsional_stiffness / c.inertia) ** 0.5
        damping = q.hoist_damping * c.mass * rate
        stiffness = q.hoist_stiffness * c.mass * rate**2
        names = list(string.coordinates)
        hook = names.index(TOP[0])
        coordinates: dict[str, str] = {}
        for name, quantity in string.coordinates.items():
            if name == TOP[0]:
                coordinates[HOOK] = quantity
            coordinates[name] = quantity

        def between(matrix: ca.SX, value: Any) -> ca.SX:
            grown = _with_row(matrix, hook + 1)
            for i, j, sign in ((0, 0, 1), (1, 1, 1), (0, 1, -1), (1, 0, -1)):
                grown[hook + i, hook + j] = grown[hook + i, hook + j] + sign * value
            return grown

        mass = _with_row(string.mass, hook + 1)
        mass[hook, hook] = mass[hook, hook] + q.hoist_mass * c.mass
        outputs = {
            name: (quantity, {(HOOK if n == TOP[0] else n): w for n, w in weights.items()})
            for name, (quantity, weights) in string.outputs.items()
        }
        return replace(
            string,
            coordinates=coordinates,
            mass=mass,
            damping=between(string.damping, damping),
            stiffness=between(string.stiffness, stiffness),
            inputs={**string.inputs, "hoist": HOOK},
            outputs=outputs,
        )


def _with_row(matrix: ca.SX, place: int) -> ca.SX:
    """Return a matrix with an empty row and column more."""
    size = matrix.shape[0]
    old = [i for i in range(size + 1) if i != place]
    grown = ca.SX(size + 1, size + 1)
    grown[old, old] = matrix
    return grown
