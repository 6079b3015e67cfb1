"""The linear delayed plant (Eqs. 22-26), derived from the plant's expressions."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca

from drillctrl.base.arrays import FloatArray
from drillctrl.drilling.bit_rock import (
    BitRock,
    Contact,
    kinematics,
    steady_delay,
    steady_depth,
    steady_load,
    switched,
)
from drillctrl.drilling.plant import (
    Evaluator,
    Plant,
    by_form,
    evaluator,
    expressions,
    paper_plant,
)

BIT_STATES = 4


class _SteadyBit(NamedTuple):
    """The bit about steady drilling, in symbols: what it meets, and how that follows X."""

    depth_now: ca.SX
    depth_then: ca.SX
    load_now: ca.SX
    load_depth: ca.SX


@by_form
def _steady_bit(plant: Plant) -> _SteadyBit:
    """Differentiate depth of cut and load by the bit's four states, now and τ ago.

    The state-dependent delay is removed by the implicit function theorem: with g the
    condition on the delay, δτ = −(g_X δX + g_Xd δXd)/g_τ.
    """
    form = expressions(plant)
    now, then = ca.SX.sym("now", BIT_STATES), ca.SX.sym("then", BIT_STATES)
    delay, cut = ca.SX.sym("delay"), ca.SX.sym("cut")
    bit = kinematics(form.c, ca.vertsplit(now), ca.vertsplit(then), delay)

    def load(depth: ca.SX) -> Any:
        # Cutting goes on, the flat is pressed and rubs: the branch of steady drilling.
        contact = Contact(depth, 1.0, 1.0)
        bears = form.bit.load(form.c, contact, bit.rates, form.q)
        return ca.vertcat(bears.weight_on_bit, bears.torque_on_bit)

    def follows(value: ca.SX, variable: ca.SX) -> ca.SX:
        dtau = -ca.jacobian(bit.turned, variable) / ca.jacobian(bit.turned, delay)
        slope: ca.SX = ca.jacobian(value, variable) + ca.jacobian(value, delay) @ dtau
        return slope

    found = [
        follows(bit.depth, now),
        follows(bit.depth, then),
        follows(load(bit.depth), now),
        ca.jacobian(load(cut), cut),
    ]
    nothing = ca.SX.zeros(BIT_STATES)
    for symbol, value in (
        (now, nothing),
        (then, nothing),
        (delay, steady_delay(form.c)),
        (cut, steady_depth(form.c)),
    ):
        found = ca.substitute(found, [symbol], [value])
    return _SteadyBit(*map(ca.densify, found))


@by_form
def bit_response(plant: Plant) -> Evaluator:
    """Return p → W0 (2, 4), w (2, 1), r (1, 4), τ0: what the bit answers about steady drilling.

    Its excess load is W0 X + w r X(t − τ0), X its own four states.
    """
    form, bit = expressions(plant), _steady_bit(plant)
    return evaluator(form, [bit.load_now, bit.load_depth, bit.depth_then, steady_delay(form.c)])


def bit_responses(bit: BitRock, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what a bit answers at many points, whatever it hangs on.

    Parameters
    ----------
    bit : BitRock
        The law.
    rows : array, (N, k)
        The groups in the order of `GROUP_NAMES`, then the law's own parameters.

    Returns
    -------
    now, then : array, (N, 2, 4)
        Excess of weight and torque per state of the bit, now and τ0 ago.
    delay : array, (N,)
        τ0.
    """
    now, load, past, delay = bit_response(paper_plant(bit))(rows)
    return now, load @ past, delay.ravel()


def linear_depth(plant: Plant) -> tuple[Any, ...]:
    """Return c1, c2, d0 of the linear depth of cut d0 + c1 X + c2 Xd (Eqs. 17, 19).

    X and Xd are the bit's four states.
    """
    bit = _steady_bit(plant)
    return bit.depth_now, bit.depth_then, steady_depth(expressions(plant).c)


@by_form
def linearisation(plant: Plant) -> ca.Function:
    """Linearise a plant about steady drilling (Eqs. 22, 23, 25, 26).

    Returns
    -------
    Function
        p → A0 (n, n), L (n, 1), R (1, n), B (n, m), C (q, n), τ0, delays of the inputs (m, 1)
        and, for every late term, its delay and matrix: X' = A0 X + L R X(t − τ0) + B u + …,
        Y = C X. The bit meets its own past in one signal, the depth of cut, so that the delayed
        matrix has rank one.
    """
    form = expressions(plant)
    structure = form.structure
    bit = _steady_bit(plant)
    pick = ca.SX.eye(structure.A.shape[0])[:BIT_STATES, :]
    outputs = [
        ca.densify(structure.A + structure.E @ bit.load_now @ pick),
        ca.densify(structure.E @ bit.load_depth),
        ca.densify(bit.depth_then @ pick),
        ca.densify(structure.B),
        ca.densify(structure.C),
        steady_delay(form.c),
        ca.densify(structure.delays_of_inputs),
    ]
    for late in structure.late:
        outputs += [late.delay, ca.densify(late.matrix)]
    return ca.Function("linearisation", [form.parameters], outputs)


@by_form
def linearisation_sensitivity(plant: Plant) -> ca.Function:
    """Return p → ∂(vec A0, vec L R, vec B, τ0)/∂p, stacked by rows, columns as in p."""
    form = expressions(plant)
    a0, left, right, b, _, tau, *_ = linearisation(plant)(form.parameters)
    stacked = ca.vertcat(ca.vec(a0), ca.vec(left @ right), ca.vec(b), tau)
    return ca.Function(
        "sensitivity",
        [form.parameters],
        [ca.densify(ca.jacobian(stacked, form.parameters))],
        ["parameters"],
        ["jacobian"],
    )


class LinearArrays(NamedTuple):
    """Linear plants of one form at N sets of parameters.

    Attributes
    ----------
    A0 : array, (N, n, n)
    left, right : array, (N, n, 1) and (N, 1, n)
        Factors of the delayed matrix.
    B, C : array, (N, n, m) and (N, q, n)
    delay : array, (N,)
        τ0.
    input_delays : array, (N, m)
        How late the inputs act.
    late : tuple of (delay (N,), matrix (N, n, n))
        Further delayed terms.
    """

    A0: FloatArray
    left: FloatArray
    right: FloatArray
    B: FloatArray
    C: FloatArray
    delay: FloatArray
    input_delays: FloatArray
    late: tuple[tuple[FloatArray, FloatArray], ...]

    @property
    def one_delay(self) -> bool:
        """Whether nothing is late but the rock's face."""
        return not self.late and not self.input_delays.any()


@by_form
def _linear(plant: Plant) -> Evaluator:
    form = expressions(plant)
    return evaluator(form, list(linearisation(plant)(form.parameters)))


def linear_arrays(plant: Plant, table: FloatArray) -> LinearArrays:
    """Return the linear plants at rows of parameters, (N, k)."""
    values = _linear(plant)(table)
    count = len(table)
    late = tuple((values[i].reshape(count), values[i + 1]) for i in range(7, len(values), 2))
    a0, left, right, b, c, tau, inputs = values[:7]
    delays = inputs.reshape(count, -1)
    return LinearArrays(a0, left, right, b, c, tau.reshape(count), delays, late)


@by_form
def rhs_function(plant: Plant) -> ca.Function:
    """Return the nonlinear motion (X, Xd, τ, u, p) → X', with switches as in Eqs. 4-6.

    Signals that arrive late are not in it.
    """
    form = expressions(plant)
    structure = form.structure
    n, m = structure.B.shape
    state, then, inputs = ca.SX.sym("X", n), ca.SX.sym("Xd", n), ca.SX.sym("u", m)
    delay = ca.SX.sym("tau")
    bit = kinematics(form.c, ca.vertsplit(state), ca.vertsplit(then), delay)
    load = form.bit.load(form.c, switched(bit.depth, bit.rates), bit.rates, form.q)
    steady = steady_load(form.bit, form.c, form.q)
    excess = ca.vertcat(*[a - b for a, b in zip(load, steady, strict=True)])
    rhs = structure.A @ state + structure.E @ excess + structure.B @ inputs
    return ca.Function(
        "rhs",
        [state, then, delay, inputs, form.parameters],
        [ca.densify(rhs)],
        ["state", "delayed_state", "delay", "inputs", "parameters"],
        ["rhs"],
    )
