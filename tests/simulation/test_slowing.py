"""Laws of any order in the simulator, and the speed at which stick-slip begins under them."""

import dataclasses
import math

import numpy as np
import pytest

from drillctrl import (
    Damping,
    DrillString,
    DriveMachine,
    FallingTorque,
    InputError,
    RigPoint,
    as_case,
    drive_control,
    driven_plant,
    rule_control,
    simulate,
    slow_down,
    string_preset,
    string_rig,
)
from drillctrl.simulation.drive_control import law_controller
from tests.simulation.speed_loop import speed_loop

RPM = math.pi / 30
BIT = {
    "bit_radius": 0.108,
    "blades": 4,
    # A rock so soft that cutting excites nothing: what falls with the speed is left.
    "rock_strength": 1e6,
    "contact_strength": 60e6,
    "wearflat_length": 1.2e-3,
    "cutter_inclination": 0.6,
    "friction_coefficient": 0.6,
    "bit_geometry": 1.0,
}
MACHINE = DriveMachine(2900.0, torque_limit=60e3, delay=0.02)


def rig(machine=MACHINE, length=2500.0, retardation=1e-3):
    pipe, collars = string_preset("paper-string").string.sections
    pipe = dataclasses.replace(pipe, length=length - collars.length)
    string = DrillString((pipe, collars), Damping(0.1, 0.1, retardation))
    return string_rig(string, drive=machine, **BIT)


WHERE = RigPoint(rig(), 100 * RPM, 1e-4 / 3600)


def test_a_law_of_two_terms_is_the_pi_controller():
    """The controller that feeds angle and speed back is another route to the same motion."""
    bare = rig(DriveMachine(2900.0))
    where = RigPoint(bare, 100 * RPM, 1e-4 / 3600)
    control = rule_control("soft-torque", MACHINE, bare.string)
    kick = {"dtheta": 0.3 * 100 * RPM * bare.time_scale}
    seconds = 12.0 / bare.time_scale
    known = simulate(where, speed_loop(where, control), duration=seconds, initial=kick)
    case, controller = law_controller(where, control)
    found = simulate(case, controller, duration=seconds, initial=kick)
    at = np.linspace(0.0, seconds, 600)
    one, other = (run.at(at, ("dtheta",)).dtheta for run in (known, found))
    assert np.ptp(one) > 0.1
    assert one == pytest.approx(other, abs=1e-5)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("name", ["z-torque", "dynamic-1"])
def test_a_law_with_states_of_its_own_moves_as_where_the_plant_closes_it(name):
    bare = rig(DriveMachine(2900.0))
    where = RigPoint(bare, 100 * RPM, 1e-4 / 3600)
    control = drive_control(name, bare)
    kick = {"dtheta": 0.3 * 100 * RPM * bare.time_scale}
    seconds = 12.0 / bare.time_scale
    known = simulate(as_case(where, driven_plant(bare, control)), duration=seconds, initial=kick)
    case, controller = law_controller(where, control)
    found = simulate(case, controller, duration=seconds, initial=kick)
    at = np.linspace(0.0, seconds, 600)
    one, other = (run.at(at, ("dtheta",)).dtheta for run in (known, found))
    assert np.ptp(one) > 0.1
    assert one == pytest.approx(other, abs=1e-5)


@pytest.fixture(scope="module")
def slowed():
    speeds = np.array([110.0, 90.0, 70.0, 50.0, 30.0]) * RPM
    return {
        name: slow_down(WHERE, drive_control(name, WHERE.rig), speeds, hold=40.0)
        for name in ("soft-torque", "z-torque", "dynamic-2")
    }


@pytest.mark.long
def test_the_designed_law_keeps_the_bit_turning_at_lower_speeds(slowed):
    """With the same delay of 20 ms and limit of 60 kN m."""
    soft, z, best = (slowed[name] for name in ("soft-torque", "z-torque", "dynamic-2"))
    # Its swings grow from steps of the set speed too, above where steady turning is unstable.
    assert soft.stick_slip >= 70 * RPM
    assert z.stick_slip == pytest.approx(50 * RPM)
    assert best.stick_slip == 0.0
    assert best.status == "done"
    assert best.swings.max() < 0.1
    assert best.linear < z.linear < soft.linear


@pytest.mark.long
def test_a_string_of_today_with_the_usual_damping():
    """3000 m: soft torque sticks at 45 rpm, Z-torque at 25, the designed law at neither."""
    today = string_preset("vertical-3000").with_rock_strength(1e6)
    today = dataclasses.replace(today, drive=MACHINE)
    where = RigPoint(today, 100 * RPM, 1e-4 / 3600)

    def swing(control, *speeds):
        given = [speed * RPM for speed in speeds]
        return slow_down(where, control, given, hold=40.0).swings[-1]

    soft, z, law = (drive_control(n, today) for n in ("soft-torque", "z-torque", "dynamic-2"))
    assert swing(soft, 55.0, 45.0) > 1.0
    assert swing(z, 35.0, 25.0) > 1.0
    assert swing(law, 35.0, 25.0) < 0.3
    # The set speed comes back under a load: the integral does so in a minute or less.
    ki = law.speed.numerator[-1] / law.speed.denominator[-2]
    kp = abs(law.speed(1e-4j) - ki / 1e-4j)
    assert kp / ki < 60.0


@pytest.mark.long
def test_above_the_linear_threshold_nothing_grows(slowed):
    for run in slowed.values():
        quiet = run.swings[(run.speeds > 1.1 * run.linear)]
        assert quiet.max(initial=0.0) < 0.1


def test_a_bit_that_stands_does_not_turn_smoothly():
    """Its drive has the torque that drilling takes, and lacks torque and swing to free it again."""
    weak = rig(DriveMachine(1000.0, torque_limit=1500.0, delay=0.02), length=1000.0)
    found = slow_down(
        RigPoint(weak, 45.0 * RPM, 1e-4 / 3600), drive_control("stiff", weak),
        [45.0 * RPM, 10.0 * RPM], falling=FallingTorque(6000.0, 2.0), hold=30.0,
    )  # fmt: skip
    assert found.status == "done"
    assert 1.0 < found.swings[0] < math.inf
    assert found.swings[1] == math.inf
    assert found.to_dict()["swings"][1] is None
    assert found.stick_slip == pytest.approx(45.0 * RPM)


def test_bad_speeds():
    control = rule_control("stiff", MACHINE, WHERE.rig.string)
    with pytest.raises(InputError, match="speeds"):
        slow_down(WHERE, control, [10.0, -1.0])
