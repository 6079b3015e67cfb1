"""A string and its blocks as first-order equations X' = A X + E w + B u + T top, Y = C X − R top.

w is the load on the bit beyond the steady one, (weight, torque); top is what the top end has
moved beyond V0 t and Ω0 t: (x, x', θ, θ').
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
import scipy.sparse

from drillctrl.base.errors import InputError
from drillctrl.drilling.coefficients import Expression
from drillctrl.drilling.quantities import EFFORTS, RATES, Signal
from drillctrl.drilling.string import BIT, TOP, String


class Late(NamedTuple):
    """A term matrix · X(t − delay), of a signal that arrives late."""

    delay: Expression
    matrix: ca.SX


@dataclass(frozen=True, eq=False)
class Realisation:
    """First-order equations of a linear structure.

    Attributes
    ----------
    states, inputs, outputs : tuple of Signal
        n, m and p of them. The first four states are the bit's x, x', θ, θ'.
    A, E, B, T : SX, (n, n), (n, 2), (n, m), (n, 4)
        Of the equations of motion.
    C, R : SX, (p, n), (p, 4)
        Of the outputs.
    late : tuple of Late
        Terms that act with a delay.
    input_delays : mapping
        Input → how late it acts, for those that do.
    drag : SX, (n, 2)
        What a jump of an imposed speed of the top end, axial or torsional, adds to the states at
        once where inertia hangs on it: then its acceleration acts, which ``T`` leaves out. On
        the states of the string without its blocks'.
    side_force, side_rate, side_torque, side_held : SX, (n0, k), (k, n0 + 1), (k, 1), (k, 1)
        Of friction along the string, on the n0 states that it has without its blocks': what a
        torque of each part does, its speed by states and by that of an imposed top end, its
        torque while it slides, and the most that holds it at rest.
    """

    states: tuple[Signal, ...]
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    A: ca.SX
    E: ca.SX
    B: ca.SX
    T: ca.SX
    C: ca.SX
    R: ca.SX
    late: tuple[Late, ...] = ()
    input_delays: Mapping[str, Expression] = field(default_factory=dict)
    drag: ca.SX = field(default_factory=lambda: ca.SX(0, 2))
    side_force: ca.SX = field(default_factory=lambda: ca.SX(0, 0))
    side_rate: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    side_torque: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    side_held: ca.SX = field(default_factory=lambda: ca.SX(0, 1))

    @property
    def delays_of_inputs(self) -> ca.SX:
        """How late each input acts, (m, 1)."""
        return ca.vertcat(*[ca.SX(self.input_delays.get(n, 0.0)) for n in self.input_names])

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(state.name for state in self.states)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(signal.name for signal in self.inputs)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(signal.name for signal in self.outputs)

    def with_output(self, signal: Signal, row: ca.SX, reference: ca.SX) -> Realisation:
        """Return the realisation with one more output row X − reference top."""
        return replace(
            self,
            outputs=(*self.outputs, signal),
            C=ca.vertcat(self.C, row),
            R=ca.vertcat(self.R, reference),
        )


def realise(string: String) -> Realisation:
    """Return the first-order equations of a string; all states are outputs.

    Raises
    ------
    InputError
        If a name is used twice.
    """
    names = list(string.coordinates)
    free = [i for i, name in enumerate(names) if name not in string.imposed]
    inverse = _inverse(string.mass[free, free])
    count = len(free)
    a, t, drag = (ca.SX(2 * count, width) for width in (2 * count, 4, 2))
    reference = ca.SX(2 * count, 4)
    for i in range(count):
        a[2 * i, 2 * i + 1] = 1
    a[1::2, 0::2] = -(inverse @ string.stiffness[free, free])
    a[1::2, 1::2] = -(inverse @ string.damping[free, free])
    for k, top in enumerate(TOP):
        if top in string.imposed:
            column = names.index(top)
            t[1::2, 2 * k] = -(inverse @ string.stiffness[free, column])
            t[1::2, 2 * k + 1] = -(inverse @ string.damping[free, column])
            drag[1::2, k] = -(inverse @ string.mass[free, column])
    states = []
    for row, i in enumerate(free):
        quantity = string.coordinates[names[i]]
        states += [Signal(names[i], quantity), Signal(f"d{names[i]}", RATES[quantity])]
        usual = TOP[0] if quantity == "length" else TOP[1]
        followed = string.reference.get(names[i], usual)
        if followed is not None:
            place = 2 * TOP.index(followed)
            reference[2 * row, place] = 1
            reference[2 * row + 1, place + 1] = 1
    load = ca.SX(2 * count, 2)
    for k, coordinate in enumerate(BIT):
        load[1::2, k] = -inverse[:, free.index(names.index(coordinate))]
    sides = len(string.sides)
    side_force, side_rate = ca.SX(2 * count, sides), ca.SX(sides, 2 * count + 1)
    for k, side in enumerate(string.sides):
        shares = ca.vertcat(*[ca.SX(side.weights.get(names[i], 0.0)) for i in free])
        side_force[1::2, k], side_rate[k, 1:-1:2] = inverse @ shares, shares.T
        if TOP[1] in string.imposed:
            side_rate[k, -1] = side.weights.get(TOP[1], 0.0)
    b = ca.SX(2 * count, len(string.inputs))
    inputs = []
    for k, (name, coordinate) in enumerate(string.inputs.items()):
        if coordinate in string.imposed:
            wanted = "a coordinate whose motion is not imposed"
            raise InputError(f"input {name}", coordinate, wanted)
        b[1::2, k] = inverse[:, free.index(names.index(coordinate))]
        inputs.append(Signal(name, EFFORTS[string.coordinates[coordinate]]))
    made = Realisation(
        tuple(states), tuple(inputs), tuple(states), a, load, b, t,
        ca.SX(ca.Sparsity.diag(2 * count)) * 0 + ca.SX.eye(2 * count), reference,
        drag=drag, side_force=side_force, side_rate=side_rate,
        side_torque=ca.vertcat(ca.SX(0, 1), *(side.torque for side in string.sides)),
        side_held=ca.vertcat(ca.SX(0, 1), *(side.held for side in string.sides)),
    )  # fmt: skip
    for name, (quantity, weights) in string.outputs.items():
        # What an imposed end has moved is in the reference of all that hangs from it.
        free_ones = {state: w for state, w in weights.items() if state not in string.imposed}
        made = made.with_output(Signal(name, quantity), *weighted(made, name, free_ones))
    _check_names(made)
    return made


def weighted(made: Realisation, name: str, weights: object) -> tuple[ca.SX, ca.SX]:
    """Return the rows of C and R of a weighted sum of states."""
    row = ca.SX(1, len(made.states))
    for state, factor in dict(weights).items():  # type: ignore[call-overload]
        if state not in made.state_names:
            raise InputError(f"output {name}", state, f"of {', '.join(made.state_names)}")
        row[0, made.state_names.index(state)] = factor
    # Every state is an output, in its own place: its reference is known.
    return row, row @ made.R[: len(made.states), :]


def _inverse(mass: ca.SX) -> ca.SX:
    """Return the inverse of a mass matrix, each part that is joined to no other by itself.

    What moves along the string thus has no place where it turns, not even one that is zero.
    """
    joined = scipy.sparse.csr_array(np.array(ca.DM(mass.sparsity(), 1)))
    count, parts = scipy.sparse.csgraph.connected_components(joined, directed=False)
    inverse = ca.SX(*mass.shape)
    for part in range(count):
        places = np.flatnonzero(parts == part).tolist()
        inverse[places, places] = _inverse_of_part(mass[places, places])
    return inverse


def _inverse_of_part(mass: ca.SX) -> ca.SX:
    """Return the inverse of a mass matrix.

    Coordinates whose rows are numbers are eliminated in numbers, and only what is left of
    the others is inverted in symbols.
    """
    size = mass.shape[0]
    plain = [i for i in range(size) if mass[i, :].is_constant() and mass[:, i].is_constant()]
    other = [i for i in range(size) if i not in plain]
    if not plain:
        return ca.inv(mass)
    first = ca.SX(_in_numbers(ca.DM(mass[plain, plain])))
    if not other:
        return first
    across = first @ mass[plain, other]
    last = ca.inv(mass[other, other] - mass[other, plain] @ across)
    inverse = ca.SX(size, size)
    inverse[plain, plain] = first + across @ last @ across.T
    inverse[plain, other] = -across @ last
    inverse[other, plain] = -(last @ across.T)
    inverse[other, other] = last
    return inverse


def _in_numbers(mass: ca.DM) -> ca.DM:
    """Return the inverse of a matrix of numbers, sharpened.

    Modes of a string that do not act on each other are told by the bit's place instead of a
    coordinate of their own: only in a sharp inverse are they seen not to.
    """
    matrix = np.asarray(mass.full(), dtype=np.longdouble)
    inverse = np.linalg.inv(mass.full()).astype(np.longdouble)
    for _ in range(3):
        inverse = inverse + inverse @ (np.eye(len(matrix), dtype=np.longdouble) - matrix @ inverse)
    return ca.DM(inverse.astype(float))


def _check_names(made: Realisation) -> None:
    for what, names in (
        ("states", made.state_names),
        ("inputs", made.input_names),
        ("outputs", made.output_names),
    ):
        twice = [name for i, name in enumerate(names) if name in names[:i]]
        if twice:
            raise InputError(what, twice[0], "a name that is used once")
