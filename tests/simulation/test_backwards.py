"""A bit that turns back: against a program written from the convention, and through any start."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drillctrl import Controller, InputError, OperatingPoint, RigPoint, Scenario, simulate, table1
from drillctrl.simulation.outcome import figures
from tests.simulation.fixed_step import BEHIND, THETA, X, motion

POINT = OperatingPoint(5.0, 0.2, 10.0, xi=0.1)
# Torque that feeds the swing until the bit turns back.
FED, KICK = 0.4, {"dx": 0.2, "dtheta": 3.0}
CONTROLLER = Controller("pd", [0.0, FED])


def test_a_bit_that_turns_back_moves_as_the_convention_says():
    run = simulate(POINT, CONTROLLER, duration=8.0, initial=KICK, rtol=1e-10)
    assert run.status == "done"
    assert run.summary.reversals == len(run.phases("behind")) >= 1
    errors = []
    for dt in (4e-5, 2e-5):
        found = motion(POINT, gains=(0.0, FED), kick=tuple(KICK.values()), end=8.0, dt=dt)
        rows = found.rows
        times = np.arange(len(rows)) * found.gap
        mine = run.at(np.minimum(times, 8.0), ("x", "theta"))
        errors.append(max(abs(rows[:, X] - mine.x).max(), abs(rows[:, THETA] - mine.theta).max()))
    # It turns back by 0.04 rad, and the plain program is of first order.
    assert rows[:, BEHIND].max() > 0.04
    assert errors[1] < 3e-4
    assert errors[1] < 0.7 * errors[0]


def test_weight_goes_on_where_the_bit_turns_back_and_torque_where_it_cuts_on():
    run = simulate(POINT, CONTROLLER, duration=8.0, initial=KICK, rtol=1e-10)
    (back,) = [event.time for event in run.events if event.name == "reverse"]
    (on,) = [event.time for event in run.events if event.name == "resume"]
    times = np.array([back - 1e-6, back + 1e-6, on - 1e-6, on + 1e-6])
    motion = run.at(times)
    np.testing.assert_allclose(motion.weight_on_bit[0], motion.weight_on_bit[1], rtol=1e-5)
    np.testing.assert_allclose(motion.weight_on_bit[2], motion.weight_on_bit[3], rtol=1e-5)
    # Behind, the wear flats alone bear torque, either way.
    inside = run.at(np.linspace(back, on, 501)[1:-1])
    assert abs(inside.torque_on_bit).max() <= POINT.beta * (1.0 + 1e-9)
    assert motion.torque_on_bit[1] < 0.0 < motion.torque_on_bit[2]
    assert motion.torque_on_bit[3] > motion.torque_on_bit[2] + 0.5 * motion.depth[3]
    # The face is that of where it turned back: the delay grows with time.
    np.testing.assert_allclose(np.diff(inside.delay), np.diff(inside.times), rtol=1e-6)


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_run_goes_on_from_the_midst_of_turning_back(share):
    scenario = Scenario(start="stick")
    where = RigPoint(table1(), 4.0 * math.pi, 20 / 3600)
    whole = simulate(where, duration=12.0, scenario=scenario, rtol=1e-10)
    ((begin, end),) = whole.phases("behind")
    when = begin + share * (end - begin)
    first = simulate(where, duration=when, scenario=scenario, rtol=1e-10)
    second = simulate(where, duration=12.0 - when, scenario=Scenario(start=first.past()))
    times = np.linspace(0.0, second.duration, 300)
    for name in ("x", "theta"):
        there = getattr(whole.at(times + when), name)
        np.testing.assert_allclose(getattr(second.at(times), name), there, atol=1e-7)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("cutting", ["multiple", "single"])
def test_no_run_breaks_off_because_the_bit_turns_back(cutting):
    rng = np.random.default_rng(7)
    reversals = 0
    for _ in range(25):
        speed, rate = rng.uniform(5.0, 19.0), rng.uniform(5.0, 60.0) / 3600.0
        where = RigPoint(table1(), speed, rate)
        gains = [rng.uniform(-1.0, 1.0), rng.uniform(0.0, 2.0)]
        period = [None, 0.05][int(rng.integers(2))]
        controller = Controller(
            "pd", gains, limit=float(rng.choice([1.0, 3.0, 10.0])), period=period
        )
        start = {"dx": rng.uniform(-0.5, 0.5), "dtheta": rng.uniform(-1.5, 2.0)}
        tolerance = 10.0 ** rng.uniform(-9.0, -5.0)
        options = {"duration": 40.0, "initial": start, "rtol": tolerance, "cutting": cutting}
        run = simulate(where, controller, **options)
        assert run.status in ("done", "diverges"), (where, controller, options)
        reversals += run.summary.reversals
    assert reversals > 25


def test_a_bit_that_turns_back_as_it_sets_off_cuts_on_where_it_turned():
    where = RigPoint(table1(), 16.374292285980058, 0.0014169194868292984)
    controller = Controller("case2", [2.7076, 2.6534], [-2.1661, -0.5415], limit=1.0)
    start = Scenario("rest")
    # Not without end if it stands where the face behind it begins.
    run = simulate(where, controller, scenario=start, duration=4.0, rtol=1e-9, time_limit=60.0)
    assert run.status == "done"
    ((back, resumed),) = (run.phases("behind")[0],)
    assert back == 0.0
    times = np.linspace(resumed + 1.0, 4.0, 101)[1:]
    motion = run.at(times, ("theta", "delay", "dtheta"))
    forward = (run.point.omega0 + motion.dtheta > 0.0) & (motion.delay < times - resumed)
    assert forward.sum() > 20
    earlier = run.at((times - motion.delay)[forward], ("theta",))
    turned = run.point.omega0 * motion.delay[forward] + motion.theta[forward] - earlier.theta
    np.testing.assert_allclose(turned, 0.5 * math.pi, atol=1e-6)


def test_energy_of_a_bit_that_turns_back():
    run = simulate(POINT, CONTROLLER, duration=8.0, initial=KICK, rtol=1e-10)
    motion = run.on_steps(9)
    weight, torque = run.steady_load
    power = motion.dx * (weight - motion.weight_on_bit)
    power += motion.dtheta * (torque - motion.torque_on_bit + motion.torque)
    p = POINT
    power -= 2.0 * p.xi * p.eta * motion.dx**2 + 2.0 * p.kappa * motion.dtheta**2
    ends = run.at([0.0, 8.0])
    energy = 0.5 * (ends.dx**2 + ends.dtheta**2 + (p.eta * ends.x) ** 2 + ends.theta**2)
    work = np.trapezoid(power, motion.times)
    assert work == pytest.approx(energy[1] - energy[0], rel=1e-4)


def test_what_is_told_and_switched():
    run = simulate(POINT, CONTROLLER, duration=8.0, initial=KICK)
    assert figures(run).outcome == "turns-back"
    assert figures(run).swing is not None
    stopped = simulate(POINT, CONTROLLER, duration=8.0, initial=KICK, backwards="stop")
    assert stopped.status == "reverse rotation"
    assert stopped.times[-1] == pytest.approx(run.phases("reverse")[0][0], abs=1e-6)
    with pytest.raises(InputError, match="backwards = around.*rest, stop"):
        simulate(POINT, duration=1.0, backwards="around")
