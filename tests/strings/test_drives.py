"""Drives and what they leave the bit: published numbers, finite elements, argument principle."""

import dataclasses
import math

import control
import numpy as np
import pytest

from drillctrl import (
    DriveControl,
    DriveMachine,
    FallingTorque,
    InputError,
    Transfer,
    characteristic_roots,
    count_growing,
    critical_slopes,
    drive_delay_margin,
    dynamic_drive_control,
    mode_slopes,
    observer_drive_control,
    pi_control,
    rule_control,
    soft_torque_control,
    spectral_abscissa,
    stiff_control,
    transfer_control,
    weakest_slope,
    z_torque_control,
)
from drillctrl.strings.drill_string import Damping, DrillString
from drillctrl.strings.drive_design import stretched
from drillctrl.strings.presets import paper_string
from tests.strings.finite_drive import driven_string, root_near

STRING = dataclasses.replace(paper_string().string, damping=Damping(0.0, 0.0, 0.0))
LINE = STRING.torsion
PIPE = LINE.wave_impedance
FIRST = 0.447990
MACHINE = DriveMachine(2900.0)
LATE = DriveMachine(2900.0, torque_limit=60e3, delay=0.02)
FILTERED = dataclasses.replace(LATE, lag=0.005, encoder=0.002)


def long_string(length, retardation=0.0):
    pipe, collars = paper_string().string.sections
    pipe = dataclasses.replace(pipe, length=length - collars.length)
    return DrillString((pipe, collars), Damping(0.1, 0.1, retardation))


LONG = long_string(2500.0)


@pytest.fixture(scope="module")
def second_order():
    return dynamic_drive_control(LONG.torsion, LATE, 2)


def test_impedance_of_the_pipe_and_reflection_at_the_tuned_frequency():
    assert pytest.approx(302.376, abs=5e-4) == PIPE
    s = 2j * np.pi * FIRST
    for times, returned in ((4.0, 0.600), (2.0, 1 / 3), (50.0, 0.961)):
        control = soft_torque_control(MACHINE, PIPE, FIRST, times)
        assert abs(control.reflection(s, PIPE)) == pytest.approx(returned, abs=5e-4)
    matched = rule_control("soft-torque-matched", MACHINE, STRING)
    assert abs(matched.reflection(s, PIPE)) < 1e-3


def test_slopes_at_which_modes_grow():
    found = critical_slopes(LINE, stiff_control(MACHINE, PIPE), 7.5)
    assert [t.slope for t in found] == pytest.approx([9.08, 9.92, 6.74, 3.18, 0.88, 0.12], abs=6e-3)
    assert [t.frequency for t in found[:2]] == pytest.approx([0.449, 1.69], abs=5e-3)
    soft = soft_torque_control(MACHINE, PIPE, FIRST)
    found = critical_slopes(LINE, soft, 7.5)
    assert [t.slope for t in found] == pytest.approx(
        [41.7, 112.5, 57.3, 1.056, 0.59, 0.26, 0.07, 0.01], abs=6e-2
    )
    assert [t.frequency for t in found[:3]] == pytest.approx([0.408, 0.458, 0.485], abs=6e-4)
    assert [t.grows for t in found[:4]] == [True, False, True, True]
    by_mode = mode_slopes(LINE, soft, 4)
    assert [m.slope for m in by_mode] == pytest.approx([41.7, 1.056, 0.59, 0.26], abs=6e-2)
    assert [m.mode_frequency for m in by_mode[:2]] == pytest.approx([FIRST, 1.689519], rel=1e-4)


def test_an_imposed_speed_is_a_drive_without_bounds():
    heavy = critical_slopes(LINE, pi_control(DriveMachine(1e8), 1e9, 0.0), 3.0)
    held = critical_slopes(LINE, None, 3.0)
    assert [t.frequency for t in heavy] == pytest.approx([t.frequency for t in held], rel=1e-3)
    assert [t.slope for t in held] == pytest.approx([0.0, 0.0], abs=1e-3)


def test_rules_by_their_definitions():
    fastest = rule_control("soft-torque-fastest", MACHINE, STRING)
    kp, ki = 2.0 * math.sqrt(2900.0 * 938.096), 2900.0 * 938.096 / 115.541
    assert fastest.speed.numerator == pytest.approx((kp, ki), rel=1e-5)
    # Lumped: (s² + 1)(j s² + d s + k) + j s² … has the double pair of real part −1/(2√j).
    j = 2900.0 / 115.541
    roots = np.roots([j, 2 * math.sqrt(j), 1 + 2 * j, 2 * math.sqrt(j), j])
    assert roots.real == pytest.approx(-0.5 / math.sqrt(j), abs=1e-6)
    z_torque = z_torque_control(dataclasses.replace(MACHINE, lag=0.005, encoder=0.002), PIPE)
    returned = np.abs(z_torque.reflection(2j * np.pi * np.geomspace(0.05, 1.0, 30), PIPE))
    assert returned == pytest.approx(0.6, abs=0.06)
    with pytest.raises(InputError, match="structure = softer"):
        rule_control("softer", MACHINE, STRING)


@pytest.mark.parametrize("machine", [LATE, FILTERED])
@pytest.mark.parametrize("name", ["stiff", "soft-torque", "z-torque"])
def test_critical_slopes_are_roots_of_finite_elements(name, machine):
    line = long_string(2500.0, 2e-4).torsion
    law = rule_control(name, machine, long_string(2500.0, 2e-4))
    slopes = mode_slopes(line, law, 3)
    for mode in slopes:
        loop = driven_string(line, law, mode.slope)
        root = root_near(loop, 2j * np.pi * mode.frequency)
        assert root == pytest.approx(2j * np.pi * mode.frequency, rel=1e-4)
    least = min(mode.slope for mode in slopes)
    for slope in (0.99 * least, 1.01 * least):
        grown = 2 * sum(mode.slope < slope for mode in slopes)
        assert count_growing(line, law, slope, 1.7) == grown


@pytest.mark.parametrize("name", ["stiff", "z-torque", "dynamic-2"])
def test_the_weakest_of_all_modes_by_counting(name, second_order):
    """It may be far above the first four, which the table tells."""
    law = second_order if name == "dynamic-2" else rule_control(name, LATE, LONG)
    weakest = weakest_slope(LONG.torsion, law)
    assert weakest.frequency > 4.5
    assert weakest.slope < min(mode.slope for mode in mode_slopes(LONG.torsion, law, 4))
    counted = [count_growing(LONG.torsion, law, x * weakest.slope, 30.0) for x in (0.99, 1.01)]
    assert counted[0] == 0
    assert counted[1] in (2, 4)
    assert weakest_slope(LONG.torsion, law, 3.0).frequency < 3.0
    # What no slope sets off has none.
    heavy = dataclasses.replace(LONG, damping=Damping(20.0, 0.1, 0.0)).torsion
    assert weakest_slope(heavy, rule_control("z-torque", MACHINE, LONG), 3.0) is None


@pytest.mark.parametrize("name", ["soft-torque", "soft-torque-matched", "z-torque"])
def test_margin_of_the_delay_by_roots_of_finite_elements(name):
    string = long_string(1500.0, 2e-4)
    law = rule_control(name, FILTERED, string)
    margin = drive_delay_margin(string.torsion, law)
    assert 0.005 < margin < 0.3
    for share, grows in ((0.97, False), (1.03, True)):
        loop = driven_string(string.torsion, law, delay=law.machine.delay + share * margin)
        # What turns as one has a root at 0 whatever is done.
        assert (spectral_abscissa(loop) > 1e-5) == grows


def test_an_unstable_drive_is_told():
    law = soft_torque_control(dataclasses.replace(LATE, delay=0.5), PIPE, 0.25)
    assert count_growing(LONG.torsion, law) > 0
    assert spectral_abscissa(driven_string(LONG.torsion, law)) > 0.01
    assert math.isnan(drive_delay_margin(LONG.torsion, law))
    unstable = transfer_control(MACHINE, ([500.0], [1.0, -1.0]))
    assert count_growing(LONG.torsion, unstable) > 0


def test_a_law_of_ones_own():
    s = control.tf("s")
    law = transfer_control(MACHINE, 1200.0 + 3000.0 / s)
    plain = pi_control(MACHINE, 1200.0, 3000.0)
    at = np.array([0.3j, 2j, 1.0 + 4j])
    assert law.impedance(at) == pytest.approx(plain.impedance(at), rel=1e-12)
    assert transfer_control(MACHINE, ([1200.0, 3000.0], [1.0, 0.0])).speed == law.speed
    for wrong, message in (
        (control.tf([1.0], [1.0, 1.0], 0.01), "continuous"),
        (control.tf([[[1.0], [1.0]]], [[[1.0], [1.0]]]), "one of each"),
        (3.0, "pair"),
        (([1.0, 0.0, 0.0], [1.0]), "degree"),
        (([math.nan], [1.0]), "numbers"),
        (([1.0], [0.0]), "not zero"),
    ):
        with pytest.raises(InputError, match=message):
            transfer_control(MACHINE, wrong)


def test_what_a_drive_may_not_be():
    with pytest.raises(InputError, match="compensated inertia"):
        pi_control(MACHINE, 1200.0, 10.0, 2500.0)
    with pytest.raises(InputError, match="delay 0.02 s"):
        pi_control(LATE, 1200.0, 10.0, 1000.0)
    pi_control(FILTERED, 1200.0, 10.0, 1000.0)
    with pytest.raises(InputError, match="compensated inertia = 3000"):
        DriveControl("own", MACHINE, Transfer((-3000.0, 1.0)))
    with pytest.raises(InputError, match="torque limit"):
        DriveMachine(2900.0, torque_limit=0.0)
    with pytest.raises(InputError, match="order"):
        dynamic_drive_control(LINE, MACHINE, 5)


@pytest.mark.long
def test_second_order_stands_twice_what_soft_torque_does(second_order):
    """Over lengths of ±20 %, with a drive of 20 ms and a torque limit; each with its own soft."""
    soft = rule_control("soft-torque", LATE, LONG)
    known = min(mode.slope for mode in mode_slopes(LONG.torsion, soft, 4))
    assert known == pytest.approx(36.6, abs=0.1)
    for length in np.linspace(2000.0, 3000.0, 5):
        string = long_string(length)
        line, own = string.torsion, rule_control("soft-torque", LATE, string)
        slopes = mode_slopes(line, second_order, 4)
        least = min(mode.slope for mode in slopes)
        assert least > 3.3 * known
        assert least > 2.0 * min(mode.slope for mode in mode_slopes(line, own, 4))
        assert count_growing(line, second_order) == 0
        # No root of these four modes grows up to there, however many samples missed.
        end = 4.5 * mode_slopes(line, None, 1)[0].mode_frequency
        assert count_growing(line, second_order, 0.99 * least, end) == 0
    assert second_order.speed.excess == 0
    assert len(second_order.speed.poles) == 3
    assert drive_delay_margin(LONG.torsion, second_order) > 0.01


def test_where_no_dynamic_law_is_stable_it_is_soft_torque():
    """A lossless string under a late drive: its high modes grow with any that does more."""
    late = DriveMachine(1500.0, 30e3, 0.05, 0.01, 0.005)
    line = dataclasses.replace(LONG, damping=Damping(0.0, 0.0, 0.0)).torsion
    law = dynamic_drive_control(line, late, 2)
    assert (law.name, law.machine) == ("dynamic-2", late)
    first = mode_slopes(line, None, 1)[0].mode_frequency
    soft = soft_torque_control(late, PIPE, first)
    assert law.impedance(3j) == pytest.approx(soft.impedance(3j), rel=1e-4)
    assert count_growing(line, law) == 0


def test_second_order_by_roots_of_finite_elements(second_order):
    line = LONG.torsion
    slopes = mode_slopes(line, second_order, 4)
    least = min(slopes, key=lambda mode: mode.slope)
    # A mode that no slope makes grow has no frequency to look at.
    for mode in (mode for mode in slopes if mode.frequency is not None):
        root = root_near(driven_string(line, second_order, mode.slope), 2j * np.pi * mode.frequency)
        assert root == pytest.approx(2j * np.pi * mode.frequency, rel=3e-4)
    assert least.frequency is not None
    assert only_turns_as_a_whole(driven_string(line, second_order))


def only_turns_as_a_whole(system):
    """Whether all else decays: the angle of all of it together is nobody's, a root at 0."""
    roots = [root.value for root in characteristic_roots(system, -5e-3)]
    return len(roots) == 1 and abs(roots[0]) < 1e-3 and roots[0].real < 1e-6


@pytest.mark.parametrize("count", [1, 2])
def test_an_observer_of_the_first_modes(count):
    """It stands more than soft torque; by roots of finite elements too."""
    line = LONG.torsion
    law = observer_drive_control(line, LATE, count)
    soft = rule_control("soft-torque", LATE, LONG)
    least, known = (min(m.slope for m in mode_slopes(line, each)) for each in (law, soft))
    assert least > (1.0, 1.0, 1.3)[count] * known
    assert count_growing(line, law) == 0
    assert only_turns_as_a_whole(driven_string(line, law))
    # Estimates of angle, of modes, their rates, and the lag; and the integral of speed.
    assert len(law.torque.poles) == 2 * (1 + count) + 1
    assert len(law.speed.poles) == 2 * (1 + count) + 2
    first = mode_slopes(line, law)[0]
    root = root_near(driven_string(line, law, first.slope), 2j * np.pi * first.frequency)
    assert root == pytest.approx(2j * np.pi * first.frequency, rel=3e-4)
    swing, _ = law.saturating_swing(np.array([m.mode_frequency for m in mode_slopes(line, None)]))
    assert swing >= 10 * np.pi / 30


def test_what_an_observer_may_not_be():
    with pytest.raises(InputError, match="modes"):
        observer_drive_control(LONG.torsion, LATE, 4)
    weak = dataclasses.replace(LATE, torque_limit=10.0)
    with pytest.raises(InputError, match="observer-1"):
        observer_drive_control(LONG.torsion, weak, 1)


def test_a_stretched_string_is_as_much_longer():
    for factor in (0.8, 1.0, 1.2):
        assert stretched(LINE, factor).length == pytest.approx(1200.0 * factor)
        assert stretched(LINE, factor).stretches[1] == LINE.stretches[1]


def test_speeds_from_which_a_falling_torque_is_stood():
    law = FallingTorque(2000.0, 5.0)
    speed = law.threshold_speed(30.0)
    torque = [2000.0 * math.exp(-(speed + h) / 5.0) for h in (-1e-4, 1e-4)]
    assert (torque[0] - torque[1]) / 2e-4 == pytest.approx(30.0, rel=1e-8)
    assert law.slope(speed) == pytest.approx(30.0)
    assert law.threshold_speed(1e4) == 0.0
    assert law.threshold_speed(0.0) == math.inf


def test_a_swing_that_takes_the_whole_torque():
    law = stiff_control(LATE, PIPE)
    speed, frequency = law.saturating_swing(np.array([0.2, 0.4]))
    omega = 2 * np.pi * 0.2
    # The larger gain is the integral's, at the lower frequency.
    assert frequency == 0.2
    assert speed * math.hypot(50.0 * PIPE, 5.0 * 2900.0 / omega) == pytest.approx(60e3, rel=1e-9)
    assert stiff_control(MACHINE, PIPE).saturating_swing(np.array([1.0])) is None
