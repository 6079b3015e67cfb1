"""A run that goes on from what another has left behind."""

from __future__ import annotations

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.simulation import advance
from drillctrl.simulation.begin import resized
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.strings.presets import string_preset

POINT = OperatingPoint(10.0, 2.5, 14.0)
GAINS = ("case1", [-3.82], [3.61])
KICK = {"dx": 1.0, "dtheta": 1.0}
STOPPED = {"dtheta": -9.0}
BOUNCING = OperatingPoint(4.0, 4.0, 30.0)


def apart(whole, rest, start):
    times = np.linspace(start, whole.duration, 1500)
    a, b = whole.at(times), rest.at(np.minimum(times - start, rest.duration))
    return max(abs(getattr(a, n) - getattr(b, n)).max() for n in ("x", "dtheta", "delay", "torque"))


def held_at(motion):
    return bool(motion.stuck[0]), bool(motion.held[0]), bool(motion.contact[0])


@pytest.mark.parametrize(
    ("point", "start", "state"),
    [
        (POINT, 0.3, (True, False, True)),
        (POINT, 13.1, (False, False, True)),
        (BOUNCING, 2.3, (False, False, False)),
        (BOUNCING, 2.7, (True, False, True)),
        (BOUNCING, 3.0, (False, False, False)),
    ],
    ids=str,
)
@pytest.mark.parametrize("cutting", ["multiple", "single"])
def test_the_rest_of_a_motion_with_stick_and_bounce_is_the_same(point, start, state, cutting):
    kick = STOPPED if point is POINT else KICK
    options = {"cutting": cutting, "rtol": 1e-11}
    end = start + (20.0 if point is POINT else 3.0)
    whole = simulate(point, duration=end, initial=kick, **options)
    assert held_at(whole.at([start])) == state
    going_on = Scenario(start=whole.past(start))
    rest = simulate(point, duration=end - start, scenario=going_on, **options)
    assert apart(whole, rest, start) < 1e-7
    later = [e for e in whole.events if e.time > start]
    assert [e.name for e in rest.events] == [e.name for e in later]
    assert len(later) > 4
    np.testing.assert_allclose(
        [e.time + start for e in rest.events], [e.time for e in later], atol=1e-7
    )


@pytest.mark.parametrize("extra", [{}, {"actuator_lag": 0.1, "rate_limit": 2.0}], ids=str)
def test_delayed_signals_and_actuators_belong_to_the_past(extra):
    controller = Controller(*GAINS, measurement_delay=0.3, **extra)
    whole = simulate(POINT, controller, duration=30.0, initial=KICK, rtol=1e-10)
    rest = simulate(
        POINT, controller, duration=20.0, scenario=Scenario(start=whole.past(10.0)), rtol=1e-10
    )
    assert apart(whole, rest, 10.0) < 1e-8


def test_switching_on_later_is_a_past_under_a_controller():
    late = Controller(*GAINS, activation=60.0)
    whole = simulate(POINT, late, duration=90.0, initial=KICK, rtol=1e-10)
    open_loop = simulate(POINT, duration=60.0, initial=KICK, rtol=1e-10)
    start = Scenario(start=open_loop.past())
    rest = simulate(POINT, Controller(*GAINS), duration=30.0, scenario=start, rtol=1e-10)
    assert apart(whole, rest, 60.0) < 1e-7


def test_a_past_of_a_past():
    first = simulate(POINT, duration=20.0, initial=KICK, rtol=1e-10)
    second = simulate(POINT, duration=10.0, scenario=Scenario(start=first.past(9.0)), rtol=1e-10)
    third = simulate(POINT, duration=8.0, scenario=Scenario(start=second.past(3.0)), rtol=1e-10)
    assert apart(first, third, 12.0) < 1e-8


@pytest.mark.parametrize(("point", "kick"), [(BOUNCING, KICK), (POINT, STOPPED)], ids=str)
def test_a_past_without_what_nothing_looks_at(point, kick):
    """The rest is the same, and a chain of runs holds no more and more."""
    run = whole = simulate(point, duration=3.0, initial=kick)
    for _ in range(3):
        past, every = run.past(kept=0.0), whole.past()
        run = simulate(point, duration=3.0, scenario=Scenario(start=past))
        whole = simulate(point, duration=3.0, scenario=Scenario(start=every))
        assert np.array_equal(run.motion.x, whole.motion.x)
        assert np.array_equal(run.motion.torque_on_bit, whole.motion.torque_on_bit)
        assert past.known < 4.0
    assert len(past.real) < 0.5 * len(every.real)
    late = Controller("case1", [-3.82], [3.61], measurement_delay=20.0)
    with pytest.raises(InputError, match="known for 20"):
        simulate(point, late, duration=1.0, scenario=Scenario(start=past))
    # What a run does not know that goes on from there, the next does not know either.
    short = simulate(point, duration=0.5, scenario=Scenario(start=past)).past()
    assert short.known == pytest.approx(past.known + 0.5)
    with pytest.raises(InputError, match="known for 20"):
        simulate(point, late, duration=1.0, scenario=Scenario(start=short))
    enough = run.past(kept=2.5)
    assert 2.5 <= enough.known < 6.0


def test_room_is_made_for_what_a_run_adds_to_its_past(monkeypatch):
    """A long past takes no time of the run: its steps foretell nothing."""
    whole = simulate(POINT, duration=400.0, initial=KICK, rtol=1e-11)
    assert whole.steps > 8192
    rooms = []

    def heard(history, room, used):
        rooms.append(room)
        return resized(history, room, used)

    monkeypatch.setattr(advance, "resized", heard)
    run = simulate(POINT, duration=200.0, scenario=Scenario(start=whole.past()), rtol=1e-11)
    assert rooms
    assert max(rooms) < 1.5 * (whole.steps + run.steps)


def test_a_past_that_does_not_fit_is_refused():
    run = simulate(POINT, duration=10.0, initial=KICK)
    other = OperatingPoint(11.0, 2.5, 14.0)
    with pytest.raises(InputError, match="start"):
        simulate(other, duration=1.0, scenario=Scenario(start=run.past()))
    with pytest.raises(InputError, match="model"):
        simulate(POINT, duration=1.0, scenario=Scenario(start=run.past()), model="linear")
    with pytest.raises(InputError, match="time"):
        run.past(11.0)
    speed = float(run.at([5.0]).dtheta[0]) + POINT.omega0
    kicked = Scenario(start=run.past(5.0), initial={"dtheta": -speed - 0.1})
    with pytest.raises(InputError, match="turn back"):
        simulate(POINT, duration=1.0, scenario=kicked)
    changed = Scenario(changes=(Change(2.0, omega0=11.0),))
    run = simulate(POINT, duration=10.0, scenario=changed)
    with pytest.raises(InputError, match="changed"):
        run.past(3.0)


def test_a_run_of_a_string_goes_on_from_its_past():
    """Coefficients that a string of pipe has no use for are no numbers, which equal nothing."""
    where = RigPoint(string_preset("paper-string"), 15.0, 0.003)
    whole = simulate(where, duration=4.0, initial={"dtheta": 1.0})
    first = simulate(where, duration=2.0, initial={"dtheta": 1.0})
    rest = simulate(where, duration=2.0, scenario=Scenario(start=first.past()))
    assert apart(whole, rest, 2.0) < 1e-5
