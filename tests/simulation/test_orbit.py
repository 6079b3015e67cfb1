"""The stick-slip orbit of Fig. 14, and the controllers of Figs. 13 and 15."""

from __future__ import annotations

import numpy as np
import pytest

from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Scenario

POINT = OperatingPoint(10.0, 2.5, 14.0)
KICK = {"dx": 1.0, "dtheta": 1.0}

# A first-order fixed-step scheme with impulses for friction, written apart from this package
# in absolute coordinates, with 5e4 to 1e5 steps per unit of time.
BRUTE_FORCE = {
    "period": 7.78534,
    "stick_fraction": 0.141687,
    "bit_speed_max": 21.83304,
    "axial_min": -40.0500,
    "axial_max": 29.10195,
    "delay_max": 2.461296,
    "axial_stick_fraction": 0.015688,
}


@pytest.fixture(scope="module")
def orbit():
    return simulate(POINT, duration=400.0, initial=KICK, rtol=1e-9)


def over_one_period(run):
    """Figures over whole periods, which do not depend on where the last quarter starts."""
    sticks = [event.time for event in run.events if event.name == "stick"]
    start, end = sticks[-5], sticks[-1]
    share = {}
    for phase in ("stuck", "held"):
        inside = [max(0.0, min(b, end) - max(a, start)) for a, b in run.phases(phase)]
        share[phase] = sum(inside) / (end - start)
    return (end - start) / 4.0, share["stuck"], share["held"]


def test_orbit_agrees_with_an_independent_computation(orbit):
    summary = orbit.summary
    period, stuck, held = over_one_period(orbit)
    found = {**summary.as_dict(), "stick_fraction": stuck, "axial_stick_fraction": held}
    for name, value in BRUTE_FORCE.items():
        assert found[name] == pytest.approx(value, rel=5e-5), name
    assert summary.period == pytest.approx(period, rel=1e-8)
    assert summary.bit_speed_min == 0.0
    assert not summary.lost_contact
    assert not summary.settled


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-11])
def test_orbit_is_independent_of_tolerance(orbit, rtol):
    other = simulate(POINT, duration=200.0, initial=KICK, rtol=rtol)
    error = 100.0 * (rtol + orbit.rtol)
    for mine, reference in zip(over_one_period(other), over_one_period(orbit), strict=True):
        assert mine == pytest.approx(reference, rel=error)
    assert other.summary.axial_min == pytest.approx(orbit.summary.axial_min, rel=error)
    assert other.summary.delay_max == pytest.approx(orbit.summary.delay_max, rel=error)


def test_orbit_is_independent_of_the_longest_step(orbit):
    other = simulate(POINT, duration=150.0, initial=KICK, max_step=0.01)
    mine, reference = over_one_period(other), over_one_period(orbit)
    np.testing.assert_allclose(mine, reference, rtol=100.0 * other.rtol)


def test_start_from_rest_reaches_the_same_orbit(orbit):
    other = simulate(POINT, duration=150.0, scenario=Scenario(start="rest"))
    np.testing.assert_allclose(over_one_period(other), over_one_period(orbit), rtol=1e-6)
    first = other.at([0.0])
    assert first.weight_on_bit[0] == pytest.approx(0.0, abs=1e-9)
    assert first.depth[0] == pytest.approx(0.0, abs=1e-9)


def test_linear_and_nonlinear_part_company_near_70():
    linear = simulate(POINT, duration=100.0, initial=KICK, model="linear")
    nonlinear = simulate(POINT, duration=100.0, initial=KICK)
    times = np.arange(0.0, 100.0, 0.05)
    apart = abs(linear.at(times).theta - nonlinear.at(times).theta)
    assert apart[times < 55.0].max() < 1.0
    assert apart[times > 75.0].max() > 5.0
    assert 60.0 < nonlinear.events[0].time < 75.0


def test_control_of_fig_15_settles_the_orbit():
    controller = Controller("case1", [-3.82], [3.61], activation=150.0)
    run = simulate(POINT, controller, duration=300.0, initial=KICK)
    assert any(event.name == "stick" for event in run.events)
    assert run.summary.settled
    assert run.summary.period is None
    assert run.summary.stick_fraction == 0.0
    assert max(event.time for event in run.events) < 170.0
    before = run.at(np.linspace(0.0, 149.9, 100))
    assert not before.torque.any()


@pytest.mark.parametrize(
    ("structure", "K1", "K2", "largest_x", "largest_u"),
    [
        ("case1", [-1.981], [0.426], 33.47, 4.41),
        ("case2", [-5.03, -4.91], [-1.67, -0.31], 2.71, 4.91),
    ],
)
def test_linear_responses_of_fig_13(structure, K1, K2, largest_x, largest_u):
    point = OperatingPoint(10.0, 12.0, 14.0)
    controller = Controller(structure, K1, K2)
    run = simulate(point, controller, duration=200.0, initial=KICK, model="linear")
    assert abs(run.on_steps(9).x).max() == pytest.approx(largest_x, abs=0.005)
    assert run.summary.max_abs_u == pytest.approx(largest_u, abs=0.005)


@pytest.mark.parametrize(
    ("omega0", "delta0", "stable"),
    [(10.0, 1.0, True), (5.1, 1.75, True), (10.0, 1.75, False), (5.1, 0.25, False)],
)
def test_points_of_fig_8(omega0, delta0, stable):
    point = OperatingPoint(omega0, delta0, 14.0)
    run = simulate(point, duration=400.0, initial={"dx": 0.01, "dtheta": 0.01}, model="linear")
    late, early = run.at(np.linspace(350, 400, 500)), run.at(np.linspace(100, 150, 500))
    assert (abs(late.theta).max() < abs(early.theta).max()) == stable


def test_growth_at_point_c_is_the_rightmost_root():
    run = simulate(OperatingPoint(10.0, 1.75, 14.0), duration=900.0, initial=KICK, model="linear")
    root = 0.009760358069533952 + 0.893071668324663j
    period = 2.0 * np.pi / root.imag
    # A damped mode that is 0.0165 further left has died by then to 4e-6.
    a, b = run.at([700.0, 700.0 + period]).x
    assert b / a == pytest.approx(np.exp(root.real * period), rel=1e-4)


def test_unloved_speeds_of_table_1():
    """120 rpm and 20 m/h: axial stick-slip alone."""
    point = OperatingPoint(
        4.419136734242274, 0.16492388559202803, 14.14, 1.596, 0.0506, 0.0499, lam=10.55
    )
    summary = simulate(point, duration=300.0, initial={"dx": 0.1, "dtheta": 0.1}).summary
    assert summary.stick_fraction == 0.0
    assert 0.1 < summary.axial_stick_fraction < 0.3
    assert not summary.lost_contact
    assert summary.bit_speed_min / point.omega0 * 120.0 == pytest.approx(118.3, abs=0.2)
    assert summary.bit_speed_max / point.omega0 * 120.0 == pytest.approx(121.9, abs=0.2)
