"""What must hold whatever the motion: energy, rock, contact loads, order, small motion."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from drillctrl.drilling.case import as_case
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.string import TOP
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Scenario
from drillctrl.strings.model import PipeString
from drillctrl.strings.presets import string_preset

NAMES = ("x", "dx", "theta", "dtheta")
KICK = {"dx": 1.0, "dtheta": 1.0}
# Table 1 at 60 rpm and 20 m/h: bit bounce.
BOUNCE = OperatingPoint(2.209568, 0.329848, 14.14, 1.596, 0.0506, 0.0499, lam=10.55)
RUNS = {
    "stick-slip": (OperatingPoint(10.0, 2.5, 14.0), None, 120.0),
    "controlled": (OperatingPoint(10.0, 2.5, 14.0), Controller("case1", [-3.82], [3.61]), 20.0),
    "bounce": (BOUNCE, None, 120.0),
}
# Closed Newton-Cotes weights on nine points.
BOOLE = np.array([989, 5888, -928, 10496, -4540, 10496, -928, 5888, 989]) / 28350.0


@pytest.fixture(scope="module", params=RUNS)
def run(request):
    point, controller, duration = RUNS[request.param]
    return simulate(point, controller, duration=duration, initial=KICK, rtol=1e-9)


def integral(run, motion, values):
    """Integrate over the run, step by step."""
    lengths = np.diff(run.times)
    return float((values.reshape(-1, 9) @ BOOLE * lengths).sum())


def test_energy_balance(run):
    point, motion = run.point, run.on_steps(9)
    weight, torque = run.steady_load
    power = motion.dx * (weight - motion.weight_on_bit) + motion.dtheta * (
        torque - motion.torque_on_bit + motion.torque
    )
    power -= 2.0 * point.xi * point.eta * motion.dx**2 + 2.0 * point.kappa * motion.dtheta**2
    ends = run.at([0.0, run.times[-1]])
    energy = 0.5 * (ends.dx**2 + ends.dtheta**2 + (point.eta * ends.x) ** 2 + ends.theta**2)
    size = integral(run, motion, abs(power))
    assert integral(run, motion, power) == pytest.approx(energy[1] - energy[0], abs=1e-8 * size)


def test_momentum_balance(run):
    point, motion = run.point, run.on_steps(9)
    weight, torque = run.steady_load
    ends = run.at([0.0, run.times[-1]])
    push = weight - motion.weight_on_bit - 2.0 * point.xi * point.eta * motion.dx
    push -= point.eta**2 * motion.x
    turn = torque - motion.torque_on_bit + motion.torque - 2.0 * point.kappa * motion.dtheta
    turn -= motion.theta
    for force, speed in ((push, ends.dx), (turn, ends.dtheta)):
        size = integral(run, motion, abs(force))
        assert integral(run, motion, force) == pytest.approx(speed[1] - speed[0], abs=1e-8 * size)


def test_energy_balance_of_a_string_of_pipe():
    """By the string's own matrices, which the integrator has only as those of X' = A X."""
    rig = string_preset("paper-string")
    where = RigPoint(rig, 80.0 * np.pi / 30.0, 20.0 / 3600.0)
    run = simulate(where, duration=12.0, scenario=Scenario("stick"), rtol=1e-7)
    assert {"advance", "hold", "release", "stick"} <= {event.name for event in run.events}
    coefficients = Coefficients(*as_case(where).motion().q[: len(Coefficients._fields)])
    string = PipeString(rig.string).build(coefficients, None)
    names = [name for name in string.coordinates if name not in TOP]
    inner = [list(string.coordinates).index(name) for name in names]
    mass, damping, stiffness = (
        np.array(ca.evalf(matrix))[np.ix_(inner, inner)]
        for matrix in (string.mass, string.damping, string.stiffness)
    )
    rates = [f"d{name}" for name in names]
    motion = run.on_steps(9, names=(*rates, "weight_on_bit", "torque_on_bit"))
    moving = np.stack([getattr(motion, name) for name in rates])
    weight, torque = run.steady_load
    power = motion.dx * (weight - motion.weight_on_bit)
    power += motion.dtheta * (torque - motion.torque_on_bit)
    power -= (moving * (damping @ moving)).sum(axis=0)
    ends = run.at([0.0, run.times[-1]])
    speeds = np.stack([getattr(ends, name) for name in rates])
    places = np.stack([getattr(ends, name) for name in names])
    energy = 0.5 * (speeds * (mass @ speeds) + places * (stiffness @ places)).sum(axis=0)
    size = integral(run, motion, abs(power))
    assert integral(run, motion, power) == pytest.approx(energy[1] - energy[0], abs=1e-8 * size)


def test_depth_and_loads_are_what_rock_can_bear(run):
    motion, point = run.on_steps(9), run.point
    size = 2.0 * np.pi * point.delta0
    assert motion.depth[motion.contact].min() > -1e-8 * size
    assert not motion.weight_on_bit[~motion.contact].any()
    assert not motion.torque_on_bit[~motion.contact].any()
    assert motion.pressed.min() >= -1e-9
    assert motion.pressed.max() <= 1.0 + 1e-9
    stuck = motion.stuck
    limit = motion.depth + point.beta * motion.pressed
    assert (motion.torque_on_bit[stuck] <= limit[stuck] + 1e-7 * size).all()
    assert (motion.torque_on_bit[stuck] >= -point.beta - 1e-7 * size).all()
    assert (point.omega0 + motion.dtheta).min() > -1e-8 * point.omega0


def test_rock_removed_is_the_integral_of_the_depth(run):
    """∫ d/n dΦ is what lies between the faces over the last and the first blade pitch."""
    point, motion = run.point, run.on_steps(9)
    pitch = 2.0 * np.pi / point.blades
    speed = point.omega0 + motion.dtheta
    removed = integral(run, motion, np.maximum(motion.depth, 0.0) / point.blades * speed)
    face = point.penetration_rate * motion.times + motion.x
    face -= np.minimum(motion.depth, 0.0) / point.blades
    angle = point.omega0 * motion.times + motion.theta
    keep = angle >= angle[-1] - pitch
    new, where = face[keep], angle[keep]
    last = np.sum(0.5 * (new[1:] + new[:-1]) * np.diff(where))
    last += new[0] * (where[0] - (angle[-1] - pitch))
    first = -0.5 * point.delta0 * pitch**2
    assert removed == pytest.approx(last - first, rel=2e-4)


def test_bounce_is_one():
    point, _, duration = RUNS["bounce"]
    run = simulate(point, duration=duration, initial=KICK, rtol=1e-9)
    names = {event.name for event in run.events}
    assert {"stick", "release", "loss", "return"} <= names
    assert run.status == "done"


def test_cutting_models_agree_until_contact_is_lost():
    point = RUNS["bounce"][0]
    both = [
        simulate(point, duration=120.0, initial=KICK, cutting=cutting, rtol=1e-10)
        for cutting in ("single", "multiple")
    ]
    loss = next(event.time for event in both[1].events if event.name == "loss")
    times = np.linspace(0.0, loss, 200)
    np.testing.assert_array_equal(both[0].at(times[:-1]).x, both[1].at(times[:-1]).x)
    end = min(run.times[-1] for run in both)
    assert abs(both[0].at([end]).x - both[1].at([end]).x)[0] > 1e-3


def test_difference_from_the_linear_model_shrinks_with_the_square():
    point = OperatingPoint(10.0, 1.75, 14.0)
    apart = []
    for size in (1e-1, 1e-2, 1e-3):
        initial = dict.fromkeys(NAMES, size)
        runs = [
            simulate(point, duration=20.0, initial=initial, model=model, rtol=1e-12, atol=1e-15)
            for model in ("linear", "nonlinear")
        ]
        a, b = (run.at(np.linspace(1.0, 20.0, 300)) for run in runs)
        apart.append(max(abs(getattr(a, n) - getattr(b, n)).max() for n in NAMES))
    ratios = np.array(apart[:-1]) / apart[1:]
    np.testing.assert_allclose(ratios, 100.0, rtol=0.1)


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_order_of_convergence_is_five(model):
    """Fixed steps, on the dense output, across the breaks that the start sends on."""
    point = OperatingPoint(10.0, 1.75, 14.0)
    times = np.linspace(0.0, 10.0, 500)
    exact = simulate(point, duration=10.0, initial=KICK, model=model, rtol=1e-13, atol=1e-15)
    errors = []
    for h in (0.02, 0.01, 0.005):
        run = simulate(
            point, duration=10.0, initial=KICK, model=model, rtol=0.1, atol=1.0, max_step=h
        )
        errors.append(abs(run.at(times).x - exact.at(times).x).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.min() > 4.4


def test_tolerance_is_honoured_through_stick_and_slip():
    point = RUNS["stick-slip"][0]
    exact = simulate(point, duration=120.0, initial=KICK, rtol=1e-13, atol=1e-15).at([120.0])
    errors = []
    for rtol in (1e-5, 1e-7, 1e-9, 1e-11):
        end = simulate(point, duration=120.0, initial=KICK, rtol=rtol).at([120.0])
        errors.append(max(abs(getattr(end, n) - getattr(exact, n))[0] for n in NAMES))
    falls = np.array(errors[:-1]) / errors[1:]
    assert falls.min() > 20.0
    assert errors[-1] < 1e-7
