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
import numpy.typing as npt

from drillctrl.drilling.point import OperatingPoint

FloatArray = npt.NDArray[np.float64]
Expression = Any  # casadi.SX, or a float where every argument is one

STATE_NAMES = ("x", "dx", "theta", "dtheta")
INPUT_NAMES = ("axial", "torque")
PARAMETER_NAMES = ("omega0", "delta0", "psi", "eta", "xi", "kappa", "blades", "lam", "beta")
RIG_PARAMETER_NAMES = (
    "mass",
    "inertia",
    "axial_stiffness",
    "torsional_stiffness",
    "axial_damping",
    "torsional_damping",
    "rock_strength",
    "contact_strength",
    "bit_radius",
    "wearflat_length",
    "cutter_inclination",
    "friction_coefficient",
    "bit_geometry",
    "submerged_weight",
    "blades",
    "rotary_speed",
    "penetration_rate",
)


class Coefficients(NamedTuple):
    """What the equations of motion multiply, in any consistent set of units."""

    mass: Expression
    inertia: Expression
    axial_damping: Expression
    torsional_damping: Expression
    axial_stiffness: Expression
    torsional_stiffness: Expression
    cutting_force: Expression
    cutting_torque: Expression
    wear_force: Expression
    wear_torque: Expression
    weight: Expression
    rotary_speed: Expression
    penetration_rate: Expression
    blades: Expression


def rig_coefficients(rig: Any) -> Coefficients:
    """Return the coefficients in SI (Eqs. 1, 3) from names as in `RIG_PARAMETER_NAMES`."""
    cutting = rig.rock_strength * rig.bit_radius
    wear = rig.contact_strength * rig.bit_radius * rig.wearflat_length
    return Coefficients(
        mass=rig.mass,
        inertia=rig.inertia,
        axial_damping=rig.axial_damping,
        torsional_damping=rig.torsional_damping,
        axial_stiffness=rig.axial_stiffness,
        torsional_stiffness=rig.torsional_stiffness,
        cutting_force=cutting * rig.cutter_inclination,
        cutting_torque=cutting * rig.bit_radius / 2,
        wear_force=wear,
        wear_torque=wear * rig.bit_radius * rig.friction_coefficient * rig.bit_geometry / 2,
        weight=rig.submerged_weight,
        rotary_speed=rig.rotary_speed,
        penetration_rate=rig.penetration_rate,
        blades=rig.blades,
    )


def dimensionless_coefficients(point: Any) -> Coefficients:
    """Return the dimensionless coefficients (Eqs. 15, 16) from `PARAMETER_NAMES`."""
    return Coefficients(
        mass=1.0,
        inertia=1.0,
        axial_damping=2 * point.xi * point.eta,
        torsional_damping=2 * point.kappa,
        axial_stiffness=point.eta**2,
        torsional_stiffness=1.0,
        cutting_force=point.psi,
        cutting_torque=1.0,
        wear_force=point.lam,
        wear_torque=point.beta,
        weight=0.0,
        rotary_speed=point.omega0,
        penetration_rate=point.delta0 * point.omega0,
        blades=point.blades,
    )


def ramp(y: Expression) -> Expression:
    """R(y) of Eq. 4, with slope 1 at y = 0 as seen from the cutting side."""
    return ca.if_else(y >= 0, y, 0)


def heaviside(y: Expression) -> Expression:
    """H(y) of Eq. 5."""
    return ca.if_else(y >= 0, 1, 0)


class BitRock(NamedTuple):
    """Weight on bit and torque on bit (Eq. 2), each cutting plus friction."""

    weight_on_bit: Expression
    torque_on_bit: Expression


class Contact(NamedTuple):
    """How the bit meets the rock: the arguments of Eq. 3 once its switches are decided.

    Attributes
    ----------
    cut : expression
        R(d) H(Φ'), depth of the rock that is being cut.
    pressed : expression
        H(d) H(Z'), share of the wear-flat force that acts; at Z' = 0 anything in [0, 1].
    direction : expression
        sgn(Φ'); at Φ' = 0 anything in [-1, 1].
    """

    cut: Expression
    pressed: Expression
    direction: Expression


def contact_load(c: Coefficients, contact: Contact) -> BitRock:
    """Return the bit-rock interaction (Eqs. 2, 3) on one branch of its switches."""
    return BitRock(
        c.cutting_force * contact.cut + c.wear_force * contact.pressed,
        c.cutting_torque * contact.cut + c.wear_torque * contact.direction * contact.pressed,
    )


def bit_rock(
    c: Coefficients, depth: Expression, axial_rate: Expression, rotary_rate: Expression
) -> BitRock:
    """Return the bit-rock interaction (Eqs. 2-6).

    Parameters
    ----------
    c : Coefficients
        Cutting and wear-flat coefficients.
    depth : expression
        Total depth of cut over all blades, d.
    axial_rate, rotary_rate : expression
        Z' and Φ', velocities of the bit.
    """
    contact = Contact(
        cut=ramp(depth) * heaviside(rotary_rate),
        pressed=heaviside(depth) * heaviside(axial_rate),
        direction=ca.sign(rotary_rate),
    )
    return contact_load(c, contact)


class Kinematics(NamedTuple):
    """What the bit did during the delay, and its velocities now.

    Attributes
    ----------
    depth : expression
        d, total depth of cut (Eqs. 7, 9).
    turned : expression
        Φ(t) − Φ(t − τ) (Eq. 8).
    axial_rate, rotary_rate : expression
        Z' and Φ'.
    """

    depth: Expression
    turned: Expression
    axial_rate: Expression
    rotary_rate: Expression


def kinematics(c: Coefficients, now: Any, then: Any, delay: Expression) -> Kinematics:
    """Return depth of cut, angle turned and velocities (Eqs. 7-9).

    Parameters
    ----------
    c : Coefficients
        Speeds imposed at the top end, and number of blades.
    now, then : record
        Perturbations X(t) and X(t − τ) by name, as in `STATE_NAMES`.
    delay : expression
        τ.
    """
    return Kinematics(
        depth=c.blades * (c.penetration_rate * delay + now.x - then.x),
        turned=c.rotary_speed * delay + now.theta - then.theta,
        axial_rate=c.penetration_rate + now.dx,
        rotary_rate=c.rotary_speed + now.dtheta,
    )


def equations_of_motion(
    c: Coefficients,
    stretch: Expression,
    twist: Expression,
    axial_rate: Expression,
    rotary_rate: Expression,
    load: BitRock,
    axial_force: Expression,
    torque: Expression,
) -> tuple[Expression, Expression]:
    """Return the axial and the angular acceleration of the bit (Eq. 1, with actuators).

    Parameters
    ----------
    c : Coefficients
        Inertia, damping, stiffness and weight.
    stretch, twist : expression
        z − V0 t and φ − Ω0 t.
    axial_rate, rotary_rate : expression
        Velocities of the bit.
    load : BitRock
        Weight on bit and torque on bit.
    axial_force, torque : expression
        Actuator force and torque on the bit.
    """
    axial = c.weight - load.weight_on_bit - c.axial_damping * axial_rate
    angular = -load.torque_on_bit - c.torsional_damping * rotary_rate
    return (
        (axial - c.axial_stiffness * stretch + axial_force) / c.mass,
        (angular - c.torsional_stiffness * twist + torque) / c.inertia,
    )


def steady_depth(c: Coefficients) -> Expression:
    """d0 = 2π V0/Ω0, total depth of cut per revolution in steady drilling (Eq. 11)."""
    return 2 * np.pi * (c.penetration_rate / c.rotary_speed)


def steady_delay(c: Coefficients) -> Expression:
    """2π/(n Ω0), the delay of steady drilling (Eq. 18)."""
    return 2 * np.pi / (c.blades * c.rotary_speed)


def steady_load(c: Coefficients) -> BitRock:
    """Weight on bit and torque on bit in steady drilling (Eqs. 2, 3, 10, 11)."""
    return bit_rock(c, steady_depth(c), c.penetration_rate, c.rotary_speed)


def steady_offsets(c: Coefficients) -> tuple[Expression, Expression]:
    """z0 and φ0 of Eq. 12: the stretch and twist at which nothing accelerates."""
    axial, angular = equations_of_motion(
        c, 0.0, 0.0, c.penetration_rate, c.rotary_speed, steady_load(c), 0.0, 0.0
    )
    return axial * c.mass / c.axial_stiffness, angular * c.inertia / c.torsional_stiffness


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


def _named(names: tuple[str, ...]) -> tuple[ca.SX, Any]:
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
    state, now = _named(STATE_NAMES)
    delayed_state, then = _named(STATE_NAMES)
    inputs, u = _named(INPUT_NAMES)
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
    parameters, point = _named(PARAMETER_NAMES)
    state, now = _named(STATE_NAMES)
    delayed_state, then = _named(STATE_NAMES)
    inputs, u = _named(INPUT_NAMES)
    top_vector, top = _named(("x", "theta"))
    contact_vector, record = _named(Contact._fields)
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
    vector, point = _named(PARAMETER_NAMES)
    return _plant(dimensionless_coefficients(point), vector, PARAMETER_NAMES)


@functools.cache
def dimensional_plant() -> Plant:
    """Return the plant in SI, parameters in the order of `RIG_PARAMETER_NAMES`."""
    vector, rig = _named(RIG_PARAMETER_NAMES)
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
    parameters, point = _named(PARAMETER_NAMES)
    state, now = _named(STATE_NAMES)
    delayed_state, then = _named(STATE_NAMES)
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
