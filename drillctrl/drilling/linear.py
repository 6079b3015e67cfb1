"""The linear delayed plant: the physics differentiated about steady drilling."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import casadi as ca
import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.delay.system import DelaySystem
from drillctrl.drilling.bit_rock import kinematics
from drillctrl.drilling.coefficients import PARAMETER_NAMES, STATE_NAMES, dimensionless_coefficients
from drillctrl.drilling.plant import Plant, dimensionless_plant, named
from drillctrl.drilling.point import OperatingPoint


@functools.cache
def linearisation(plant: Plant) -> ca.Function:
    """Linearise a plant about its steady state: p → A1, A2, B, τ0 (Eqs. 22, 23, 25, 26).

    The state-dependent delay is removed by the implicit function theorem: with g the
    delay condition, δτ = −(g_X δX + g_Xd δXd)/g_τ. The delayed state is at rest in the
    steady state, so τ moves the motion through the right-hand side alone.
    """
    to_steady = [
        (plant.state, ca.SX.zeros(plant.state.shape)),
        (plant.delayed_state, ca.SX.zeros(plant.state.shape)),
        (plant.inputs, ca.SX.zeros(plant.inputs.shape)),
        (plant.delay, plant.steady_delay),
    ]

    def total(variable: ca.SX) -> ca.SX:
        f, g = plant.rhs, plant.delay_condition
        dtau = -ca.jacobian(g, variable) / ca.jacobian(g, plant.delay)
        return ca.densify(ca.jacobian(f, variable) + ca.jacobian(f, plant.delay) @ dtau)

    outputs = [total(plant.state), total(plant.delayed_state), total(plant.inputs)]
    for symbol, value in to_steady:
        outputs = ca.substitute(outputs, [symbol], [value])
    return ca.Function(
        "linearisation",
        [plant.parameters],
        [*outputs, plant.steady_delay],
        ["parameters"],
        ["A1", "A2", "B", "tau0"],
    )


@functools.cache
def linear_depth() -> ca.Function:
    """Return p → rows c1, c2 of the linear depth of cut 2πδ0 + c1 X + c2 Xd (Eqs. 17, 19)."""
    parameters, point = named(PARAMETER_NAMES)
    state, now = named(STATE_NAMES)
    delayed_state, then = named(STATE_NAMES)
    delay = ca.SX.sym("tau")
    c = dimensionless_coefficients(point)
    bit = kinematics(c, now, then, delay)

    def total(variable: ca.SX) -> ca.SX:
        dtau = -ca.jacobian(bit.turned, variable) / ca.jacobian(bit.turned, delay)
        return ca.jacobian(bit.depth, variable) + ca.jacobian(bit.depth, delay) @ dtau

    rows = ca.densify(ca.vertcat(total(state), total(delayed_state)))
    return ca.Function("linear_depth", [parameters], [rows])


@functools.cache
def linearisation_sensitivity(plant: Plant) -> ca.Function:
    """Return p → ∂(vec A1, vec A2, vec B, τ0)/∂p, stacked by rows, columns as in p."""
    linear = linearisation(plant)
    stacked = ca.vertcat(*[ca.vec(value) for value in linear(plant.parameters)])
    return ca.Function(
        "sensitivity",
        [plant.parameters],
        [ca.densify(ca.jacobian(stacked, plant.parameters))],
        ["parameters"],
        ["jacobian"],
    )


def parameter_vector(point: OperatingPoint) -> FloatArray:
    """Return the groups of a point in the order of `PARAMETER_NAMES`, shape (9,)."""
    return np.array([getattr(point, name) for name in PARAMETER_NAMES], dtype=float)


def plant_system(
    point: OperatingPoint,
    inputs: Sequence[str] = ("torque",),
    plant: Plant | None = None,
) -> DelaySystem:
    """Return the linear delayed plant at an operating point (Eqs. 23, 25, 26, 34, 35).

    Parameters
    ----------
    point : OperatingPoint
        Its groups are the plant's parameters.
    inputs : sequence of str
        Which of the plant's inputs are driven: ``"torque"`` (the paper's u), ``"axial"``.
    plant : Plant, optional
        A plant with the same parameters as `dimensionless_plant`, which is the default.

    Returns
    -------
    DelaySystem
        All states are outputs.
    """
    plant = dimensionless_plant() if plant is None else plant
    for name in inputs:
        if name not in plant.input_names:
            raise InputError("inputs", name, f"among {', '.join(plant.input_names)}")
    a1, a2, b, tau0 = (value.full() for value in linearisation(plant)(parameter_vector(point)))
    driven = [plant.input_names.index(name) for name in inputs]
    return DelaySystem(
        a1,
        (a2,),
        (float(tau0[0, 0]),),
        b[:, driven],
        np.eye(a1.shape[0]),
        state_names=plant.state_names,
        input_names=tuple(inputs),
        output_names=plant.state_names,
    )
