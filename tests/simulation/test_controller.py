"""The controller as software, and what the rig is told to do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.drilling.point import OperatingPoint
from drillctrl.drilling.structures import soft_torque
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario

POINT = OperatingPoint(10.0, 2.5, 14.0)
GAINS = ("case1", [-3.82], [3.61])
KICK = {"dx": 1.0, "dtheta": 1.0}
TIMES = np.linspace(0.0, 20.0, 801)


def theta(controller, **options):
    return simulate(POINT, controller, duration=20.0, initial=KICK, **options).at(TIMES).theta


@pytest.mark.parametrize(
    ("name", "sizes", "order"),
    [
        ("period", (0.02, 0.01, 0.005), 1),
        ("actuator_lag", (0.02, 0.01, 0.005), 1),
        ("measurement_delay", (0.02, 0.01, 0.005), 1),
    ],
)
def test_imperfections_vanish_with_their_size(name, sizes, order):
    ideal = theta(Controller(*GAINS))
    apart = [abs(theta(Controller(*GAINS, **{name: size})) - ideal).max() for size in sizes]
    ratios = np.array(apart[:-1]) / apart[1:]
    np.testing.assert_allclose(ratios, 2.0**order, rtol=0.25)


@pytest.mark.parametrize("age", [0.001, 0.005, 0.05])
def test_breaks_that_two_delays_bring_at_once_do_not_stop_a_run(age):
    # A rate fed back late and later: a kick is seen after m ages and k delays, in any order.
    point = OperatingPoint(6.0, 1.0, 14.0)
    control = Controller("case2", [-9.389, 3.46], [10.0, -1.1557], measurement_delay=age)
    run = simulate(point, control, duration=5.0, initial={"dtheta": 0.01})
    assert run.status == "done"
    times = np.linspace(1.0, 5.0, 301)
    now, then = run.at(times - age), run.at(times - age - point.delay)
    law = -9.389 * now.theta + 3.46 * now.dtheta + 10.0 * then.theta - 1.1557 * then.dtheta
    np.testing.assert_allclose(run.at(times).torque, law, atol=1e-9)


def test_sampled_command_is_the_law_at_the_samples():
    controller = Controller(*GAINS, period=0.1, activation=1.0)
    run = simulate(POINT, controller, duration=10.0, initial=KICK)
    samples = 1.0 + 0.1 * np.arange(60)
    measured = run.at(samples).theta
    delayed = run.at(samples - POINT.delay).theta
    applied = run.at(samples + 0.05).torque
    np.testing.assert_allclose(applied, -3.82 * measured + 3.61 * delayed, atol=1e-9)
    assert not run.at(np.linspace(0.0, 0.99, 10)).torque.any()


def test_after_saturation_the_command_is_the_law_at_once():
    run = simulate(
        POINT, Controller(*GAINS, limit=0.5), duration=40.0, initial={"dtheta": -9.0}, rtol=1e-10
    )
    times = np.linspace(POINT.delay, 40.0, 4001)
    now, then = run.at(times), run.at(times - POINT.delay)
    law = np.clip(-3.82 * now.theta + 3.61 * then.theta, -0.5, 0.5)
    np.testing.assert_allclose(now.torque, law, atol=1e-9)
    assert (abs(law) == 0.5).any()
    assert (abs(law) < 0.5).any()
    assert any(e.name == "stick" for e in run.events)


def test_limits_hold_and_are_reached():
    limited = Controller(*GAINS, limit=0.3)
    run = simulate(POINT, limited, duration=20.0, initial=KICK)
    assert run.summary.max_abs_u == pytest.approx(0.3)
    ideal = theta(Controller(*GAINS))
    np.testing.assert_allclose(theta(Controller(*GAINS, limit=1e6)), ideal, atol=1e-9)


@pytest.mark.parametrize("rate_limit", [None, 50.0])
def test_a_held_command_at_its_limit_is_saturated(rate_limit):
    """Held beyond the limit, or within it where it is limited as it is taken."""
    period = 0.01
    limited = Controller(*GAINS, limit=0.3, period=period, rate_limit=rate_limit)
    run = simulate(POINT, limited, duration=20.0, initial=KICK, rtol=1e-6)
    given = abs(run.at(period * (np.arange(2000) + 0.5)).torque)
    assert given.max() == pytest.approx(0.3)
    share = float((given == 0.3).mean())
    assert 0.02 < share < 0.9
    found = sum(b - a for a, b in run.phases("saturated")) / 20.0
    assert found == pytest.approx(share, abs=1e-9)
    continuous = simulate(POINT, Controller(*GAINS, limit=0.3), duration=20.0, initial=KICK)
    near = sum(b - a for a, b in continuous.phases("saturated")) / 20.0
    assert found == pytest.approx(near, abs=0.03)


@pytest.mark.parametrize(
    "limits",
    [
        {"limit": 0.3},
        {"limit": 0.3, "delay": "current"},
        {"limit": 0.3, "actuator_lag": 0.05},
        {"rate_limit": 1.0, "actuator_lag": 0.05},
    ],
    ids=str,
)
def test_saturation_is_located_so_the_order_stays(limits):
    def run(rtol):
        controller = Controller(*GAINS, **limits)
        return simulate(POINT, controller, duration=20.0, initial=KICK, rtol=rtol, atol=0.1 * rtol)

    exact = run(1e-12).at(TIMES).dtheta
    coarse, fine = run(1e-6), run(1e-10)
    errors = [abs(r.at(TIMES).dtheta - exact).max() for r in (coarse, fine)]
    order = np.log(errors[0] / errors[1]) / np.log(fine.steps / coarse.steps)
    assert 4.5 < order < 6.5
    met = [[e.time for e in r.events if e.name == "saturate"] for r in (coarse, fine)]
    assert len(met[0]) >= 1
    np.testing.assert_allclose(met[0], met[1], atol=1e-5)
    for start, end in fine.phases("saturated"):
        inside = fine.at(np.linspace(start, end, 20)[1:-1]).torque
        if "actuator_lag" not in limits:
            np.testing.assert_allclose(abs(inside), 0.3, rtol=1e-12)


def test_rate_limit_sampled_and_of_the_actuator():
    sampled = Controller(*GAINS, period=0.05, rate_limit=1.0)
    held = simulate(POINT, sampled, duration=10.0, initial=KICK)
    steps = np.diff(held.at(0.025 + 0.05 * np.arange(190)).torque)
    assert abs(steps).max() == pytest.approx(0.05, rel=1e-9)
    lagging = Controller(*GAINS, actuator_lag=0.05, rate_limit=1.0)
    torque = simulate(POINT, lagging, duration=10.0, initial=KICK).at(TIMES[:401]).torque
    assert 0.9 < (abs(np.diff(torque)) / np.diff(TIMES[:401])).max() < 1.0 + 1e-6


def test_noise_is_repeatable_and_seeded():
    def motion(seed):
        return theta(Controller(*GAINS, period=0.1, noise={"theta": 0.05}, seed=seed))

    np.testing.assert_array_equal(motion(1), motion(1))
    assert abs(motion(1) - motion(2)).max() > 1e-3


def test_delay_of_small_motion_is_fixed_or_current_alike():
    def run(delay, size):
        controller = Controller(*GAINS, delay=delay)
        initial = {"dx": size, "dtheta": size}
        return simulate(POINT, controller, duration=20.0, initial=initial, rtol=1e-11)

    apart = [
        abs(run("fixed", size).at(TIMES).theta - run("current", size).at(TIMES).theta).max()
        for size in (1e-1, 1e-2)
    ]
    assert apart[0] / apart[1] == pytest.approx(100.0, rel=0.2)


def test_schedule_changes_the_gains():
    later = Controller("p", [0.0], schedule=((5.0, [-2.0], None),))
    run = simulate(POINT, later, duration=10.0, initial=KICK).at([4.0, 6.0])
    np.testing.assert_allclose(run.torque, [0.0, -2.0 * run.theta[1]], atol=1e-12)


@pytest.mark.parametrize("duration", [0.0, 10.0])
def test_changes_lead_to_the_steady_state_of_the_new_point(duration):
    start, goal = OperatingPoint(10.0, 1.0, 14.0), OperatingPoint(12.0, 1.1, 18.0)
    change = Change(5.0, duration, goal.omega0, goal.penetration_rate, goal.psi)
    run = simulate(start, duration=900.0, scenario=Scenario(changes=(change,)))
    end = run.at(np.linspace(890.0, 900.0, 50))
    np.testing.assert_allclose(start.omega0 + end.dtheta, goal.omega0, rtol=2e-2)
    np.testing.assert_allclose(start.penetration_rate + end.dx, goal.penetration_rate, rtol=2e-2)
    depth = 2.0 * np.pi * goal.delta0
    np.testing.assert_allclose(end.depth, depth, rtol=1e-2)
    # The wear flat stays the starting point's.
    np.testing.assert_allclose(end.weight_on_bit, goal.psi * depth + start.lam, rtol=1e-2)


def test_what_is_no_controller_is_refused(point_c):
    for other in (soft_torque(), "case1", 3.0):
        with pytest.raises(InputError, match="controller = "):
            simulate(point_c, other)


def test_a_run_that_took_no_step_is_not_settled(point_c):
    run = simulate(point_c, duration=1.0, max_steps=1)
    none = replace(run, history=type(run.history)(*(part[:1] for part in run.history)))
    assert none.steps == 0
    assert not none.summary.settled
