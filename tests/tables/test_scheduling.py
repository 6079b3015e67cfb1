from dataclasses import replace

import control
import numpy as np
import pytest

from drillctrl import (
    Change,
    Controller,
    InputError,
    OperatingPoint,
    Scenario,
    analyze,
    dimensionless_grid,
    linear_axis,
    scheduled_controller,
    simulate,
    table,
)
from drillctrl.simulation.controller import ScheduleEntry
from drillctrl.tables.scheduling import course, scheduled

START = OperatingPoint(10.0, 1.5, 12.0)
HARDER = Scenario(initial={"dtheta": 1.0}, changes=(Change(30.0, duration=6.0, psi=24.0),))


@pytest.fixture(scope="module")
def rocks():
    """Gains over the rock's strength and the depth of cut."""
    return table(
        dimensionless_grid(10.0, linear_axis("delta0", 1, 3, 2), linear_axis("psi", 12, 24, 3)),
        "case1",
        trials=False,
    )


def test_course_of_a_scenario():
    scenario = Scenario(changes=(Change(10.0, duration=4.0, omega0=20.0), Change(20.0, psi=7.0)))
    found = course(START, scenario, np.array([0.0, 12.0, 15.0, 21.0]))
    rate = START.penetration_rate
    assert found[:, 0] == pytest.approx([10.0, 15.0, 20.0, 20.0])
    assert found[:, 1] == pytest.approx(rate / found[:, 0])
    assert found[:, 2] == pytest.approx([12.0, 12.0, 12.0, 7.0])


def test_gains_follow_the_rock_and_the_motion_settles(rocks):
    controller = scheduled(rocks, START, HARDER, interval=1.0)
    times, K1, K2 = controller.gain_sets()
    assert times.tolist() == [0.0, *np.linspace(31.0, 36.0, 6)]
    before, after = (rocks.gains_at(10.0, 1.5, psi) for psi in (12.0, 24.0))
    assert K1[0].sum() == pytest.approx(before[0].item())
    assert K1[-1].sum() == pytest.approx(after[0].item(), rel=1e-6)
    assert K2[-1].sum() == pytest.approx(after[1].item(), rel=1e-6)
    run = simulate(START, controller, scenario=HARDER, duration=120.0)
    assert run.status == "done"
    late = run.at(np.linspace(110.0, 120.0, 200))
    assert np.ptp(late.theta) < 1e-4 * np.ptp(run.on_steps(3).theta)
    # In the harder rock the gains that were looked up decay faster than those of the start.
    rock = OperatingPoint(10.0, 1.5, 24.0)
    alphas = [analyze(rock, "case1", *gains).spectral_abscissa for gains in (after, before)]
    assert alphas[0] < 0.0
    assert alphas[0] < alphas[1] - 0.05


def test_a_controller_that_learns_late_switches_late(rocks):
    late = scheduled(rocks, START, Scenario(changes=(Change(5.0, psi=24.0),)), late=2.0)
    assert late.gain_sets()[0].tolist() == [0.0, 7.0]


@pytest.fixture(scope="module")
def speeds():
    """Gains over the rotary speed."""
    return table(
        dimensionless_grid(linear_axis("omega0", 6, 12, 5), 1.0, 14.0), "case2", trials=False
    )


@pytest.mark.parametrize(("before", "after"), [(6.0, 12.0), (12.0, 6.0)])
@pytest.mark.parametrize("options", [{}, {"period": 0.01}, {"measurement_delay": 0.002}])
def test_the_delay_follows_the_rotary_speed(speeds, before, after, options):
    point = OperatingPoint(before, 6.0 / before, 14.0)
    ramp = Change(10.0, duration=5.0, omega0=after)
    scenario = Scenario(initial={"dtheta": 0.01}, changes=(ramp,))
    controller = scheduled(speeds, point, scenario, interval=1.0, **options)
    run = simulate(point, controller, scenario=scenario, duration=40.0)
    assert run.status == "done"

    def deviation(times):
        # The bit's angle, and rate, beyond what the top end turns after the ramp.
        motion, turned = run.at(times), (after - before) * (times - 12.5)
        return np.column_stack([motion.theta - turned, motion.dtheta - (after - before)])

    times = np.linspace(16.0, 39.0, 50)
    old = options.get("measurement_delay", 0.0)
    if "period" in options:
        times = options["period"] * np.round(times / options["period"])
        old = 0.0
    late = replace(point, omega0=after).delay
    K1, K2 = (np.ravel(K) for K in controller.schedule[-1][1:3])
    wanted = deviation(times - old) @ K1 + deviation(times - old - late) @ K2
    found = run.at(times + 0.5 * options.get("period", 0.0)).torque
    assert np.abs(found - wanted).max() < 1e-6
    # It settles; with the delay of the start the bit would come to turn backwards.
    assert np.ptp(deviation(np.linspace(35.0, 40.0, 99))[:, 0]) < 2e-3


def test_gains_may_bring_a_delay_of_their_own():
    later = ScheduleEntry(1.0, [-2.0], [2.0], 0.3)
    given = Controller("case1", [-3.0], [3.0], schedule=(later, (2.0, [-1.0], [1.0])))
    assert given.delays(0.25).tolist() == [0.25, 0.3, 0.25]
    for wrong in (
        {"schedule": (later,), "delay": "current"},
        {"schedule": (later._replace(delay=-1.0),)},
        {"schedule": ((1.0,),)},
    ):
        with pytest.raises(InputError, match="schedule"):
            Controller("case1", [-3.0], [3.0], **wrong)


def python_control_command(found, point, scenario, run, period, ahead=lambda times: 0.0):
    """Return what the python-control system commands for what a run measured, and did command.

    ``ahead`` is what the top end has turned beyond what it did at the start.
    """
    times = np.arange(int(run.times[-1] / period)) * period
    places = course(point, scenario, times + 2e-9)
    measured = [run.at(times).theta - ahead(times)]
    if len(found.structure.outputs) == 2:
        measured.append(run.at(times).dtheta - (places[:, 0] - point.omega0))
    system = scheduled_controller(found.structure, found.gains_at, 4, 5.0, period, limit=3.0)
    response = control.input_output_response(system, times, np.vstack([*measured, places.T]))
    # The first sample is taken before a kick.
    later = times > 1.5 * point.delay
    return times[later], np.ravel(response.outputs)[later], run.at(times + period / 2).torque[later]


def test_the_same_table_in_python_control_through_a_formation_change(rocks):
    period = START.delay / 16
    harder = Scenario(initial={"dtheta": 1.0}, changes=(Change(8.0, psi=24.0),))
    ours = scheduled(rocks, START, harder, period=period, limit=3.0)
    run = simulate(START, ours, scenario=harder, duration=16.0)
    times, theirs, held = python_control_command(rocks, START, harder, run, period)
    assert np.abs(theirs - held).max() < 1e-9
    # Other gains are used after the change, and they matter.
    kept = scheduled(rocks, START, Scenario(), period=period, limit=3.0)
    other = simulate(START, kept, scenario=harder, duration=16.0)
    assert np.abs(other.at(times).theta - run.at(times).theta).max() > 1e-3


def test_the_same_table_in_python_control_through_a_change_of_speed(speeds):
    point = OperatingPoint(6.0, 1.0, 14.0)
    period = point.delay / 32
    faster = Scenario(initial={"dtheta": 0.1}, changes=(Change(8.0, 4.0, omega0=12.0),))
    ours = scheduled(speeds, point, faster, period=period, limit=3.0)
    run = simulate(point, ours, scenario=faster, duration=20.0)

    def ahead(times):
        ramp = np.clip(times - 8.0, 0.0, 4.0)
        return 6.0 * ramp**2 / 8.0 + 6.0 * np.maximum(times - 12.0, 0.0)

    times, theirs, held = python_control_command(speeds, point, faster, run, period, ahead)
    # In the ramp one looks up twice in a unit of time, the other at each sample.
    calm = (times < 8.0) | (times > 12.0 + point.delay)
    assert np.abs(theirs - held)[calm].max() < 1e-9
    assert np.abs(held).max() > 1.0
