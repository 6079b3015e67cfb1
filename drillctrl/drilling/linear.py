"""The linear delayed plant (Eqs. 22-26), derived from the plant's expressions."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.drilling.bit_rock import (
    Contact,
    Rates,
    kinematics,
    steady_delay,
    steady_depth,
    steady_load,
    switched,
)
from drillctrl.drilling.plant import Plant, by_form, expressions

BIT_STATES = 4


@by_form
def linear_bit(plant: Plant) -> ca.Function:
    """Linearise depth of cut and load about steady drilling: p → c1, c2, Jd, Jr, d0.

    Returns
    -------
    Function
        c1, c2 (1, 4): rows of the depth of cut d0 + c1 Xb + c2 Xb(t − τ0) of the bit's four
        states (Eqs. 17, 19); Jd (2, 1), Jr (2, 2): derivatives of the load by the depth and
        by Z', Φ'; d0.

    Notes
    -----
    The state-dependent delay is removed by the implicit function theorem: with g the
    condition on the delay, δτ = −(g_X δX + g_Xd δXd)/g_τ.
    """
    form = expressions(plant)
    now, then = ca.SX.sym("now", BIT_STATES), ca.SX.sym("then", BIT_STATES)
    delay, depth, rates = ca.SX.sym("delay"), ca.SX.sym("depth"), ca.SX.sym("rates", 2)
    bit = kinematics(form.c, ca.vertsplit(now), ca.vertsplit(then), delay)

    def row(variable: ca.SX) -> ca.SX:
        dtau = -ca.jacobian(bit.turned, variable) / ca.jacobian(bit.turned, delay)
        return ca.densify(ca.jacobian(bit.depth, variable) + ca.jacobian(bit.depth, delay) @ dtau)

    # Cutting goes on, the flat is pressed and rubs: the branch that steady drilling is on.
    contact = Contact(depth, 1.0, 1.0)
    load = ca.vertcat(*form.bit.load(form.c, contact, Rates(*ca.vertsplit(rates)), form.q))
    slopes = [ca.densify(ca.jacobian(load, variable)) for variable in (depth, rates)]
    steady = (
        (depth, steady_depth(form.c)),
        (rates, ca.vertcat(form.c.penetration_rate, form.c.rotary_speed)),
    )
    for symbol, value in steady:
        slopes = ca.substitute(slopes, [symbol], [value])
    outputs = [row(now), row(then), *slopes, steady_depth(form.c)]
    names = ["c1", "c2", "Jd", "Jr", "d0"]
    return ca.Function("linear_bit", [form.parameters], outputs, ["p"], names)


@by_form
def linearisation(plant: Plant) -> ca.Function:
    """Linearise a plant about steady drilling (Eqs. 22, 23, 25, 26).

    Returns
    -------
    Function
        p → A0 (n, n), L (n, 1), R (1, n), B (n, m), C (q, n), τ0 and, for every late term, its
        delay and matrix: X' = A0 X + L R X(t − τ0) + B u + …, Y = C X. The bit meets its own
        past in one signal, the depth of cut, so that the delayed matrix has rank one.
    """
    form = expressions(plant)
    structure = form.structure
    c1, c2, jd, jr, _ = linear_bit(plant)(form.parameters)
    n = structure.A.shape[0]
    pick = ca.SX.eye(n)[:BIT_STATES, :]
    feels = jd @ c1
    feels[:, 1] = feels[:, 1] + jr[:, 0]
    feels[:, 3] = feels[:, 3] + jr[:, 1]
    outputs = [
        ca.densify(structure.A + structure.E @ feels @ pick),
        ca.densify(structure.E @ jd),
        ca.densify(c2 @ pick),
        ca.densify(structure.B),
        ca.densify(structure.C),
        steady_delay(form.c),
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
    late : tuple of (delay (N,), matrix (N, n, n))
        Further delayed terms.
    """

    A0: FloatArray
    left: FloatArray
    right: FloatArray
    B: FloatArray
    C: FloatArray
    delay: FloatArray
    late: tuple[tuple[FloatArray, FloatArray], ...]


def linear_arrays(plant: Plant, table: FloatArray) -> LinearArrays:
    """Return the linear plants at rows of parameters, (N, k)."""
    count = table.shape[0]
    function = linearisation(plant)
    mapped = function if count == 1 else function.map(count)
    values = []
    for i, value in enumerate(mapped(table.T)):
        rows, columns = function.size_out(i)
        full = value.full().reshape(rows, count, columns)
        values.append(np.ascontiguousarray(full.transpose(1, 0, 2)))
    late = tuple((values[i].reshape(count), values[i + 1]) for i in range(6, len(values), 2))
    a0, left, right, b, c, tau = values[:6]
    return LinearArrays(a0, left, right, b, c, tau.reshape(count), late)


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
