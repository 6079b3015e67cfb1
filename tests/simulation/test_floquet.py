"""Floquet multipliers against spectral roots, returns of a long run, and each other."""

from __future__ import annotations

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.delay.closing import close_loop
from drillctrl.delay.instrumentation import with_actuator_lag
from drillctrl.drilling.case import plant_system
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.floquet import floquet, multipliers_at
from drillctrl.simulation.orbits import limit_cycle
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.spectrum.roots import dominant_roots

POINT = OperatingPoint(10.0, 2.5, 14.0)
LATE = OperatingPoint(5.0, 4.0, 14.0)
CASE2 = ([-5.03, -4.91], [4.0, 1.0])


@pytest.fixture(scope="module")
def stick_slip():
    return simulate(POINT, duration=150.0, initial={"dtheta": 1.0}, rtol=1e-11)


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize(
    ("name", "gains", "lag"),
    [("case1", ([-3.82], [3.61]), 0.0), ("case2", CASE2, 0.0), ("case1", ([-3.82], [3.61]), 0.05)],
)
def test_at_rest_they_are_exponentials_of_the_spectral_roots(model, name, gains, lag):
    controller = Controller(name, *gains, actuator_lag=lag)
    run = simulate(POINT, controller, duration=20.0, rtol=1e-11, model=model)
    # Any time will do: no motion, no period of its own.
    time = 1.3
    found, residuals = multipliers_at(run, 10.0, time, size=1e-4, directions=8)
    plant = plant_system(POINT)
    plant = with_actuator_lag(plant, "torque", lag) if lag else plant
    roots = [
        root.value
        for root in dominant_roots(close_loop(plant, controller.feedback, *gains, POINT.delay))
    ]
    for root in roots[:2]:
        expected = np.exp(root * time)
        assert abs(found - expected).min() < 1e-6
    assert abs(found[0]) == pytest.approx(np.exp(roots[0].real * time), abs=1e-7)
    assert residuals[0] < 1e-7


def test_the_stick_slip_orbit_attracts(stick_slip):
    found = floquet(stick_slip)
    assert found.trivial_error < 1e-6
    assert found.multipliers[0] == pytest.approx(1.0, abs=1e-6)
    assert found.largest == pytest.approx(0.14984, abs=2e-5)
    assert (found.residuals < 1e-6).all()


@pytest.mark.long
def test_what_is_left_out_goes_with_the_square_of_the_size(stick_slip):
    coarse, fine = (floquet(stick_slip, size=size).trivial_error for size in (4e-4, 1e-4))
    assert coarse / fine == pytest.approx(16.0, rel=0.05)


@pytest.mark.long
def test_they_depend_neither_on_the_section_nor_on_the_start(stick_slip):
    found = floquet(stick_slip)
    period = found.period
    other, _ = multipliers_at(stick_slip, found.section - 1.3 * period - 0.3, period, seed=5)
    np.testing.assert_allclose(other[:2], found.multipliers[:2], atol=5e-6)


def test_the_largest_is_the_rate_at_which_returns_close():
    run = simulate(LATE, duration=400.0, initial={"dtheta": -1.0}, rtol=1e-11)
    orbit, found = limit_cycle(run, 200.0), floquet(run)
    assert orbit.multiplier == pytest.approx(0.50, abs=0.01)
    assert found.largest == pytest.approx(orbit.multiplier, abs=1e-4)
    assert found.period == pytest.approx(orbit.period, rel=1e-7)


@pytest.mark.parametrize("period", [0.1, 0.4])
def test_at_rest_under_samples_they_are_the_growth_of_a_run(period):
    """Of θ from one map to the next, where the slowest three are left: a linear recurrence."""
    law = {"K1": [-3.82], "K2": [3.61], "period": period, "measurement_delay": 0.3 * period}
    controller = Controller("case1", **law)
    rest = simulate(POINT, controller, duration=3.0, rtol=1e-11)
    time = 0.4
    found, residuals = multipliers_at(rest, 5.0 * period, time, size=1e-4, directions=8)
    assert residuals[0] < 1e-7
    run = simulate(
        POINT, controller, duration=24.0, initial={"dtheta": 1.0}, model="linear", rtol=1e-12
    )
    theta = run.at(np.arange(8.0, 24.0, time)).theta
    before = np.stack([theta[2:-1], theta[1:-2], theta[:-3]], axis=1)
    recurrence, *_ = np.linalg.lstsq(before, theta[3:], rcond=None)
    roots = np.roots([1.0, *-recurrence])
    for root in found[:3]:
        assert abs(roots - root).min() < 1e-4
    if period == time:
        settled = simulate(POINT, controller, duration=40.0, initial={"dtheta": 0.1}, rtol=1e-10)
        again = floquet(settled, directions=8)
        assert again.trivial_error is None
        assert again.period == pytest.approx(time)
        assert again.largest == pytest.approx(abs(found[0]), abs=1e-6)


@pytest.mark.long
def test_an_orbit_under_fast_samples_is_nearly_that_of_the_continuous_law():
    apart, errors = [], []
    for period in (None, 0.1, 0.05):
        controller = Controller("pd", [0.0, 0.05], period=period)
        run = simulate(POINT, controller, duration=120.0, initial={"dtheta": 1.0}, rtol=1e-9)
        found = floquet(run, directions=4)
        apart.append(found.largest)
        errors.append(found.trivial_error)
    assert abs(np.array(apart[1:]) - apart[0]).max() < 3e-3
    assert max(errors) < 3e-3
    assert errors[2] < 0.7 * errors[1]


def test_what_has_no_orbit_is_refused(stick_slip):
    settling = simulate(
        POINT, Controller("case1", [-3.82], [3.61]), duration=60.0, initial={"dtheta": 1.0}
    )
    with pytest.raises(InputError, match="run"):
        floquet(settling)
    for options, named in (
        ({"noise": {"theta": 1e-3}}, "controller"),
        ({"delay": "current"}, "delay"),
    ):
        sampled = Controller("case1", [-3.82], [3.61], period=0.1, **options)
        with pytest.raises(InputError, match=named):
            floquet(simulate(POINT, sampled, duration=5.0, initial={"dtheta": 1.0}))
    late = Scenario(initial={"dtheta": 1.0}, changes=(Change(50.0, omega0=9.0),))
    with pytest.raises(InputError, match="changed"):
        floquet(simulate(POINT, duration=80.0, scenario=late))
    with pytest.raises(InputError, match="directions"):
        floquet(stick_slip, directions=0)
