"""The physics, written once as CasADi expressions (Eqs. 1-9, 14-21, 33).

`bit_rock` and `equations_of_motion` hold the whole model. The dimensional plant, the
dimensionless plant, the steady state and the linear delayed plant all come from them by
substitution and differentiation.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from drillctrl.drilling.bit_rock import BitRock, Contact, bit_rock, contact_load, kinematics
from drillctrl.drilling.coefficients import (
    INPUT_NAMES,
    PARAMETER_NAMES,
    RIG_PARAMETER_NAMES,
    STATE_NAMES,
    Coefficients,
    Expression,
    dimensionless_coefficients,
    rig_coefficients,
)
from drillctrl.drilling.steady import steady_delay, steady_load, steady_offsets
from drillctrl.drilling.string import equations_of_motion


@dataclass(frozen=True, eq=False)
class Plant:
    """A nonlinear plant with one state-dependent delay, as CasADi SX expressions.

    The motion is X' = ``rhs``, a function of X, Xd, τ, u and p, where Xd = X(t − τ) and τ
    solves ``delay_condition`` = 0. All are perturbations of the steady state X = 0, u = 0,
    τ = ``steady_delay``. A user's plant is `dataclasses.replace` of another with some
    expressions rewritten.

    Attributes
    ----------
    state, delayed_state : SX, (n, 1)
        X and Xd.
    delay : SX
        τ.
    inputs : SX, (m, 1)
        u.
    parameters : SX, (k, 1)
        p.
    rhs : SX, (n, 1)
        The right-hand side.
    delay_condition : SX
        Zero at the true τ.
    steady_delay : SX
        τ0 as a function of p.
    state_names, input_names, parameter_names : tuple of str
        Names in order.
    """

    state: ca.SX
    delayed_state: ca.SX
    delay: ca.SX
    inputs: ca.SX
    parameters: ca.SX
    rhs: ca.SX
    delay_condition: ca.SX
    steady_delay: ca.SX
    state_names: tuple[str, ...]
    input_names: tuple[str, ...]
    parameter_names: tuple[str, ...]


def named(names: tuple[str, ...]) -> tuple[ca.SX, Any]:
    """Return a vector of symbols and a record that holds them by name."""
    vector = ca.vertcat(*[ca.SX.sym(name) for name in names])
    record = NamedTuple("record", [(name, Any) for name in names])  # type: ignore[misc]
    return vector, record(*ca.vertsplit(vector))


def _perturbed_motion(
    c: Coefficients, now: Any, u: Any, load: BitRock, top: Any = None
) -> tuple[Expression, Expression]:
    """Return x'' and θ'': what the steady state balances is taken off both sides.

    ``top`` is what the top end has moved beyond V0 t and Ω0 t, by name (x, theta).
    """
    excess = BitRock(*(a - b for a, b in zip(load, steady_load(c), strict=True)))
    stretch = now.x if top is None else now.x - top.x
    twist = now.theta if top is None else now.theta - top.theta
    return equations_of_motion(
        c._replace(weight=0.0), stretch, twist, now.dx, now.dtheta, excess, u.axial, u.torque
    )


def _plant(c: Coefficients, parameters: ca.SX, parameter_names: tuple[str, ...]) -> Plant:
    state, now = named(STATE_NAMES)
    delayed_state, then = named(STATE_NAMES)
    inputs, u = named(INPUT_NAMES)
    delay = ca.SX.sym("tau")
    bit = kinematics(c, now, then, delay)
    load = bit_rock(c, bit.depth, bit.axial_rate, bit.rotary_rate)
    axial, angular = _perturbed_motion(c, now, u, load)
    return Plant(
        state=state,
        delayed_state=delayed_state,
        delay=delay,
        inputs=inputs,
        parameters=parameters,
        rhs=ca.vertcat(now.dx, axial, now.dtheta, angular),
        delay_condition=bit.turned - 2 * np.pi / c.blades,
        steady_delay=steady_delay(c),
        state_names=STATE_NAMES,
        input_names=INPUT_NAMES,
        parameter_names=parameter_names,
    )


@functools.cache
def branch_functions() -> tuple[ca.Function, ...]:
    """Return the dimensionless model on one branch of its switches, for event-driven use.

    Returns
    -------
    acceleration : Function
        (X, u, top, contact, p) → (x'', θ''), with ``top`` the motion of the top end beyond
        V0 t and Ω0 t, (x, θ), and ``contact`` a `Contact`.
    load : Function
        (contact, p) → weight and torque on bit.
    depth, turned : Function
        (X, Xd, τ, p) → depth of cut (Eqs. 7, 9); angle turned beyond 2π/n (Eq. 8).
    rates : Function
        (X, p) → Z', Φ'.
    rest : Function
        p → x and θ of an unloaded bit at rest while the top end is at V0 t and Ω0 t.
    """
    parameters, point = named(PARAMETER_NAMES)
    state, now = named(STATE_NAMES)
    delayed_state, then = named(STATE_NAMES)
    inputs, u = named(INPUT_NAMES)
    top_vector, top = named(("x", "theta"))
    contact_vector, record = named(Contact._fields)
    delay = ca.SX.sym("tau")
    c = dimensionless_coefficients(point)
    bit = kinematics(c, now, then, delay)
    load = contact_load(c, Contact(*record))
    motion = _perturbed_motion(c, now, u, load, top)
    angle = bit.turned - 2 * np.pi / c.blades
    offsets = steady_offsets(c)
    arguments = [state, delayed_state, delay, parameters]
    return (
        ca.Function(
            "acceleration",
            [state, inputs, top_vector, contact_vector, parameters],
            [ca.vertcat(*motion)],
        ),
        ca.Function("load", [contact_vector, parameters], [ca.vertcat(*load)]),
        ca.Function("depth", arguments, [bit.depth]),
        ca.Function("turned", arguments, [angle]),
        ca.Function("rates", [state, parameters], [ca.vertcat(bit.axial_rate, bit.rotary_rate)]),
        ca.Function("rest", [parameters], [ca.vertcat(-offsets[0], -offsets[1])]),
    )


@functools.cache
def dimensionless_plant() -> Plant:
    """Return the dimensionless plant, parameters in the order of `PARAMETER_NAMES`."""
    vector, point = named(PARAMETER_NAMES)
    return _plant(dimensionless_coefficients(point), vector, PARAMETER_NAMES)


@functools.cache
def dimensional_plant() -> Plant:
    """Return the plant in SI, parameters in the order of `RIG_PARAMETER_NAMES`."""
    vector, rig = named(RIG_PARAMETER_NAMES)
    return _plant(rig_coefficients(rig), vector, RIG_PARAMETER_NAMES)


@functools.cache
def rhs_function(plant: Plant) -> ca.Function:
    """Return the CasADi function (X, Xd, τ, u, p) → X'."""
    return ca.Function(
        "rhs",
        [plant.state, plant.delayed_state, plant.delay, plant.inputs, plant.parameters],
        [plant.rhs],
        ["state", "delayed_state", "delay", "inputs", "parameters"],
        ["rhs"],
    )
