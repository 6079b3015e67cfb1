"""Laws of a drive designed on what the bit does where it drills."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from drillctrl import (
    DriveMachine,
    InputError,
    RigPoint,
    cli,
    drive_control,
    mode_slopes,
    soft_torque_control,
    string_preset,
)
from drillctrl.base.language import SI
from drillctrl.designs import drive_design, drive_load
from drillctrl.designs.drive_load import bit_load
from drillctrl.designs.drive_motion import drive_motion
from drillctrl.designs.drive_trials import DriveTrials
from drillctrl.designs.trials import STARTS, Trial
from drillctrl.simulation.outcome import Figures
from drillctrl.simulation.status import Outcome
from drillctrl.strings.bit_load import BitAnswer, BitLoad
from drillctrl.strings.drives import compare_drives

RIG = replace(string_preset("paper-string"), drive=DriveMachine(2900.0, 60e3, delay=0.02))
LINE = RIG.string.torsion
SPEED = 80.0 * np.pi / 30.0
WHERE = RigPoint(RIG, SPEED, 15.0 / 3600.0)
SHAKEN, SIZE, SPACING = 3.8, 600.0, 0.01


ANSWERS = [BitAnswer(f, 0.1, -3.0 + 2.0j, 1.0, True) for f in (0.45, 1.7)]


def load(answers=ANSWERS):
    """A bit that shakes its string at one frequency, a whole number of times."""
    times = SPACING * np.arange(10_000)
    return BitLoad(SPEED, tuple(answers), SPACING, SIZE * np.sin(2 * np.pi * SHAKEN * times))


@pytest.fixture(scope="module")
def laws():
    """For the string alone, and for the bit that shakes it."""
    return [drive_control("dynamic-0", RIG, bit=bit) for bit in (None, load())]


@pytest.mark.long
def test_the_forced_swing_is_that_of_one_wave_by_hand(laws):
    """Two ports by their transfer matrix, the drive at the top and the bit's own answer below."""
    s = np.array([2j * np.pi * SHAKEN])
    matrix, _ = LINE.scaled_transfer(s)
    for law in laws:
        speed, torque = law.ends(s)
        moment = matrix[:, 1, 0] * speed + matrix[:, 1, 1] * s * torque
        turned = matrix[:, 0, 0] * speed + matrix[:, 0, 1] * s * torque
        z = moment / (s * turned) - 4.0 + 2.0j
        assert load().forced_swing(LINE, law) == pytest.approx(SIZE / abs(z[0]) / SPEED, rel=2e-3)
    assert load().main_frequency(LINE, laws[0]) == pytest.approx(SHAKEN, rel=0.1)


def test_the_power_of_a_wave_is_half_its_square():
    hertz = np.linspace(0.5, 10.0, 4000)
    assert np.trapezoid(load().power(hertz), hertz) == pytest.approx(SIZE**2 / 2.0, rel=0.02)
    # A twentieth of it everywhere up to 15 Hz.
    assert load().shaking(np.array([9.0])) == pytest.approx(SIZE**2 / 40.0 / 15.0, rel=0.02)


def test_the_answer_is_the_least_that_any_swing_may_have():
    two = (
        BitAnswer(0.5, 0.1, 10.0 + 1.0j, 2.0, True),
        BitAnswer(0.5, 0.45, 11.0 + 3.0j, 9.0, True),
        BitAnswer(2.0, 0.1, -300.0 + 0j, 200.0, False),
    )
    assert load(two).answer([0.1, 0.5, 5.0]).tolist() == [2.0 + 3.0j] * 3
    assert load(two[2:]).answer(1.0) == 0.0


def test_a_law_for_the_bit_lets_it_swing_less_than_one_for_the_string(laws):
    string, bit = (load().forced_swing(LINE, law) for law in laws)
    assert bit < string
    # Less swing is not bought by standing less than the rules do.
    slopes = [
        min(mode.slope for mode in mode_slopes(LINE, law, 4))
        for law in (laws[1], drive_control("soft-torque", RIG))
    ]
    assert slopes[0] >= 0.999 * slopes[1]
    assert min(load().damping_left(mode) for mode in mode_slopes(LINE, laws[1])) > 0.0
    soft = drive_control("soft-torque", RIG, bit=load())
    first = drive_control("soft-torque", RIG).speed.numerator[1] / RIG.drive.inertia
    others = [
        soft_torque_control(RIG.drive, LINE.wave_impedance, np.sqrt(first) / (2 * np.pi), times)
        for times in (1.0, 6.0)
    ]
    assert load().mean_square(LINE, soft) <= min(load().mean_square(LINE, o) for o in others)


def test_what_is_measured_comes_in_units_of_the_rig_and_is_kept(monkeypatch, tmp_path):
    asked = []

    def response(case, frequency, amplitude, **options):
        asked.append((frequency / (2 * np.pi * RIG.time_scale), amplitude))
        return SimpleNamespace(value=-0.01 + 0.02j, error=np.float64(0.005))

    orbit = SimpleNamespace(broken=None, spacing=0.1, torque_samples=np.array([1.0, -1.0]))
    monkeypatch.setattr(drive_load, "BitResponse", SimpleNamespace)
    monkeypatch.setattr(drive_load, "AxialOrbit", SimpleNamespace)
    monkeypatch.setattr(drive_load, "bit_response", response)
    monkeypatch.setattr(drive_load, "axial_orbit", lambda case: orbit)
    found = bit_load(WHERE, keep=tmp_path)
    # Exact modes of this string, top held: the first and the fourth.
    assert [f for f, _ in asked] == pytest.approx([0.44799, 0.44799, 4.6179, 4.6179], rel=1e-3)
    assert {swing for _, swing in asked} == {0.1, 0.45}
    unit = np.sqrt(RIG.inertia * RIG.torsional_stiffness)
    assert found.answers[0].value == pytest.approx((-0.01 + 0.02j) * unit)
    assert found.torque == pytest.approx(np.array([1.0, -1.0]) * RIG.torsional_stiffness)
    assert bit_load(WHERE, keep=tmp_path).answers == found.answers
    assert len(asked) == 4


def test_a_point_where_the_bit_bounces_without_bound_is_refused(monkeypatch):
    orbit = SimpleNamespace(broken=Outcome.DIVERGES)
    monkeypatch.setattr(drive_load, "AxialOrbit", SimpleNamespace)
    monkeypatch.setattr(drive_load, "bit_response", lambda *a, **k: None)
    monkeypatch.setattr(drive_load, "axial_orbit", lambda case: orbit)
    with pytest.raises(InputError, match="has a motion to design on"):
        bit_load(WHERE)


def test_what_would_make_it_quiet_is_run(laws, monkeypatch):
    """Made-up runs: quiet from 100 rpm or 8 m/h on."""

    def quiet(where, drive, most):
        return where.rotary_speed >= 1.2 * SPEED or where.penetration_rate <= 8.0 / 3600.0

    monkeypatch.setattr("drillctrl.designs.drive_motion.law_is_quiet", quiet)
    drives = compare_drives(RIG, laws[1:]).drives

    def motion(swing):
        end = Figures(Outcome.BOUNCES, swing, 0.0, 1.0, 1.0)
        return drive_motion(
            WHERE, load(), drives, DriveTrials(drives[0], (Trial(STARTS[0], end, end),))
        )

    found = motion(0.6)
    assert found.quieter == {"speed": 1.25, "rate": 0.5}
    assert "1.25 times the speed or 0.5 times the feed" in " ".join(found.text(SI).split())
    assert max(map(len, found.text(SI).splitlines())) <= 80
    assert motion(0.2).quieter is None


@pytest.mark.long
def test_the_answer_says_what_it_was_designed_on_and_whether_it_was_tried(monkeypatch, capsys):
    monkeypatch.setattr(drive_design, "bit_load", lambda *arguments, **options: load())
    point = ["--rig", "vertical-3000", "--speed", "80 rpm", "--rop", "15 m/h", "--trials", "none"]
    law = ["design", *point, "--structure", "soft-torque", "--objective", "drilling"]
    with pytest.raises(SystemExit):
        cli.main([*law, "--json"])
    fields = json.loads(capsys.readouterr().out)
    assert fields["objective"] == "drilling"
    assert set(fields["on_motion"]["forced_swing"]) == {"soft-torque", "stiff", "absorbing"}
    assert fields["recommended"] is None
    assert "not tried on the nonlinear motion; of the string alone" in fields["reason"]
    assert fields["trials"] == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("design", "--structure", "dynamic-1", "--objective", "drilling"), "used at a point"),
        (("design", "--structure", "dynamic-1", "--objective", "exact"), "drilling or worst-case"),
        (("design", "--structure", "dynamic-1", "--kick", "0.3"), "--kick"),
        (("compare", "--structures", "stiff", "--objective", "drilling"), "used at a point"),
        (
            ("design", "--structure", "stiff", "--objective", "drilling", "--speed", "80 rpm",
             "--rop", "15 m/h"), "stiff has nothing to tune",
        ),
    ],
)  # fmt: skip
def test_bad_input_is_one_line(arguments, message, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main([*arguments, "--rig", "vertical-3000"])
    caught = capsys.readouterr()
    assert stop.value.code == 2
    assert not caught.out
    assert message in caught.err


def test_what_is_not_known_of_the_bit_is_said(laws):
    drives = compare_drives(RIG, laws[1:]).drives
    vague = ANSWERS[0]._replace(known=False)

    def told(answers):
        return " ".join(drive_motion(WHERE, load(answers), drives).text(SI).split())

    assert "not known" not in told(ANSWERS)
    assert "not known at 1 of 2: the others stand for it" in told([vague, ANSWERS[1]])
    assert "not known at 1 of 1: taken as none" in told([vague])
    # With nothing known slopes are those of the string alone.
    assert load([vague]).damping_left(drives[0].modes[0].slope) == drives[0].modes[0].slope.slope
