import math

import numpy as np
import pytest

from drillctrl import Controller, OperatingPoint, RigPoint, simulate, steady_state, table1
from drillctrl.simulation.loads import loads
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.report import simulation_fields, simulation_summary


def at(rpm, rate):
    return RigPoint(table1(), rpm * math.pi / 30, rate / 3600)


def test_mean_weight_balances_the_mean_stretch_of_the_string():
    # Over whole periods, and roughly over many, acceleration and damping average to nothing.
    run = simulate(at(120, 20), duration=300.0, initial={"dx": 1.0, "dtheta": 1.0})
    point = run.point
    times = np.linspace(225.0, 300.0, 40_001)
    weight, torque = run.steady_load
    motion = run.at(times)
    found = loads(run)
    assert found.weight_ratio == pytest.approx(
        1.0 - point.eta**2 * motion.x.mean() / weight, abs=2e-3
    )
    assert found.torque_ratio == pytest.approx(1.0 - motion.theta.mean() / torque, abs=2e-3)
    assert found.weight_ratio < 0.99
    assert found.off_rock_fraction == 0.0


def test_loads_of_a_rig_are_those_in_newtons():
    run = simulate(at(80, 30), duration=100.0, initial={"dx": 1.0, "dtheta": 1.0})
    steady = steady_state(at(80, 30))
    seconds = np.linspace(0.75, 1.0, 100_001) * 100.0 * run.rig.time_scale
    motion = run.in_rig_units(seconds)
    found = loads(run)
    assert found.weight_ratio == pytest.approx(
        motion.weight_on_bit.mean() / steady.weight_on_bit, rel=5e-3
    )
    assert found.torque_peak == pytest.approx(
        motion.torque_on_bit.max() / steady.torque_on_bit, rel=2e-2
    )
    # Off the rock nothing presses.
    assert found.off_rock_fraction == pytest.approx((motion.weight_on_bit == 0.0).mean(), abs=5e-3)


def test_a_bit_that_falls_behind_is_named():
    run = simulate(at(60, 30), duration=300.0, initial={"dx": 1.0, "dtheta": 1.0})
    assert figures(run).outcome == "does-not-keep-up"
    fields = simulation_fields(run)
    assert fields["outcome"] == "does-not-keep-up"
    assert fields["weight_ratio"] > 2.0
    # The string presses because the bit is behind: 14 times the steady weight is that of x.
    tail = run.at(np.linspace(225.0, 300.0, 200_001))
    weight, _ = run.steady_load
    assert fields["weight_ratio"] == pytest.approx(
        1.0 - run.point.eta**2 * tail.x.mean() / weight, rel=0.05
    )


def test_a_kick_below_what_is_resolved_settles():
    run = simulate(at(150, 20), duration=100.0, initial={"dx": 1e-12})
    assert run.summary.settled
    assert figures(run).outcome == "settles"
    assert "Axial      0 to 0 mm" in simulation_summary(run)
    # Nothing that is resolved is taken for rest.
    kicked = simulate(OperatingPoint(10.0, 2.5, 14.0), duration=5.0, initial={"dx": 1e-6})
    assert not kicked.summary.settled


def test_gains_that_act_like_a_relay_are_named():
    relay = Controller("pd", [0.0, -1e9], limit=1.0)
    run = simulate(at(120, 20), relay, duration=100.0, initial={"dx": 0.1}, max_steps=20_000)
    assert run.status == "step limit"
    text = simulation_summary(run)
    assert "act like\n" in text
    assert "a relay and chatter" in text
    assert max(map(len, text.splitlines())) <= 80
    # Sampled it needs few steps, and a speed is beyond what the next sample can mend where
    # |K| T > 2: only the sign of what is fed back reaches the plant.
    for gains, jumps in (([0.0, -1e9], 0.5), ([-2000.0, -2000.0], 0.5), ([-3.0, -2.0], None)):
        sampled = Controller("pd", gains, limit=1.0, period=0.05)
        run = simulate(at(120, 20), sampled, duration=40.0, initial={"dx": 0.1})
        assert run.status == "done"
        told = " ".join(simulation_summary(run).split())
        assert ("act like a relay" in told) == (jumps is not None)
        if jumps is not None:
            samples = run.at(np.arange(30.025, 40.0, 0.05)).torque
            assert (samples[1:] * samples[:-1] < 0.0).mean() > jumps
            assert (np.abs(samples) == 1.0).mean() > 0.9
