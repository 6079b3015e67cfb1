"""Bad input is refused in one line; a run that cannot go on returns what it has."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario

POINT = OperatingPoint(10.0, 2.5, 14.0)


@pytest.mark.parametrize(
    "arguments",
    [
        {"rtol": -1e-6},
        {"rtol": float("nan")},
        {"atol": -1.0},
        {"duration": 1e12},
        {"duration": float("inf")},
        {"duration": 0.0},
        {"initial": {"dtheta": -11.0}},
        {"initial": {"speed": 1.0}},
        {"initial": {"x": float("nan")}},
        {"model": "cubic"},
        {"cutting": "double"},
        {"max_step": 0.0},
        {"max_steps": 0},
    ],
    ids=str,
)
def test_simulate_refuses(arguments):
    with pytest.raises(InputError) as caught:
        simulate(POINT, **arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "arguments",
    [
        {"K1": [1.0, 2.0]},
        {"K1": [float("nan")]},
        {"K1": [1.0], "activation": -1.0},
        {"K1": [1.0], "delay": "guessed"},
        {"K1": [1.0], "period": 0.0},
        {"K1": [1.0], "limit": -3.0},
        {"K1": [1.0], "rate_limit": 1.0},
        {"K1": [1.0], "noise": {"theta": 0.1}},
        {"K1": [1.0], "schedule": ((5.0, [1.0], None), (4.0, [1.0], None))},
    ],
    ids=str,
)
def test_controller_refuses(arguments):
    with pytest.raises(InputError) as caught:
        Controller("case1", **arguments)
    assert "\n" not in str(caught.value)


def test_scenario_refuses():
    with pytest.raises(InputError, match="changes"):
        Scenario(changes=(Change(5.0, 3.0, omega0=2.0), Change(6.0, omega0=3.0)))
    with pytest.raises(InputError, match="start"):
        Scenario(start="flying")
    with pytest.raises(InputError, match="time"):
        Change(float("nan"))


def test_instants_outside_the_run_are_refused():
    run = simulate(POINT, duration=1.0)
    with pytest.raises(InputError, match="times"):
        run.at([1.5])


def test_step_limit_returns_what_there_is():
    run = simulate(POINT, duration=100.0, initial={"dx": 1.0}, max_steps=50)
    assert run.status == "step limit"
    assert 50 <= run.steps <= 52
    assert 0.0 < run.times[-1] < 100.0
    assert np.isfinite(run.motion.x).all()


def test_reverse_rotation_ends_the_run_if_asked():
    point = OperatingPoint(2.209568, 0.329848, 14.14, 1.596, 0.0506, 0.0499, lam=10.55)
    kick = {"dx": 0.1, "dtheta": 0.1}
    run = simulate(point, duration=300.0, initial=kick, cutting="single", backwards="stop")
    assert run.status == "reverse rotation"
    assert 0.0 < run.times[-1] < 300.0
    assert point.omega0 + run.motion.dtheta[-1] == pytest.approx(0.0, abs=1e-9)


def test_steady_drilling_stays_steady_and_pickles():
    run = simulate(POINT, duration=5.0)
    assert abs(run.motion.x).max() < 1e-12
    copy = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(copy.motion.theta, run.motion.theta)
    assert copy.summary == run.summary
