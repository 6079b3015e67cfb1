"""Designs on the motion that is drilled with, beside runs and roots by other routes."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drillctrl import (
    Controller,
    Drilling,
    Exact,
    InputError,
    RigPoint,
    as_case,
    cli,
    compare,
    design,
    feed,
    preset_structure,
    simulate,
    spectral_abscissa,
    string_preset,
    table1,
    torsional_system,
)
from drillctrl.designs.authority import Candidate, irregular
from drillctrl.designs.controlled_swings import controlled_swings
from drillctrl.designs.motion_design import NONE_HELP
from drillctrl.designs.quieter import quieter
from drillctrl.designs.swings import Swing, cost_of_gains, measured_swings, swing_families
from drillctrl.designs.trials import STARTS, Trial, trial_run
from drillctrl.designs.verdict import Verdict, judge
from drillctrl.motion.torsion import torsional_modes
from drillctrl.simulation.outcome import Figures
from drillctrl.simulation.status import Outcome

# Where small swings grow with the damping taken away, and decay with some more.
RATES = [(120, 20, 0.05), (120, 10, -0.02), (100, 30, -0.02)]
QUICK = Drilling(kick=0.1)


def at(rpm, rop):
    """Return a point of Table 1's rig, rpm and m/h."""
    return RigPoint(table1(), rpm * math.pi / 30.0, rop / 3600.0)


@pytest.fixture(scope="module")
def quiet():
    """120 rpm, 50 m/h, where a kick leads to a swing of 0.40 without control."""
    patch = pytest.MonkeyPatch()
    patch.setattr("drillctrl.designs.motion_design.SHARES", (0.25, 0.125))
    limit = 0.94e3 / table1().torsional_stiffness
    found = design(at(120, 50), "pd", objective=QUICK, surroundings={"limit": limit})
    patch.undo()
    return found


def to_a_millionth(low, high):
    """Numbers without the smallest that there are: a spring of 1e-323 is none."""
    return st.floats(low, high).map(lambda value: round(value, 6))


@given(
    st.builds(complex, to_a_millionth(-0.35, 0.35), to_a_millionth(-0.35, 0.35)),
    to_a_millionth(0.5, 2.0),
    to_a_millionth(-1.0, 0.5),
    to_a_millionth(-1.0, 0.0),
)
@settings(max_examples=30, deadline=None)
def test_the_torsional_loop_of_one_degree_of_freedom(value, frequency, spring, damper):
    case = as_case(at(120, 20))
    system = torsional_system(case, value, frequency)
    structure = preset_structure("pd")
    swing = Swing(0, 1, 0.1, frequency, value, 0.0, 0.0, 0.0)
    (made,) = controlled_swings(case, QUICK, [swing], structure, np.array([spring, damper]))
    damping = 2.0 * case.point.kappa + value.real
    stiffness = 1.0 - frequency * value.imag
    roots = np.roots([1.0, damping - damper, stiffness - spring])
    assert made.growth == pytest.approx(roots.real.max(), abs=1e-8)
    free = np.roots([1.0, damping, stiffness])
    assert spectral_abscissa(system) == pytest.approx(free.real.max(), abs=1e-8)


def test_modes_of_a_string_that_gains_leave_alone_and_one_that_they_make_grow():
    case = as_case(RigPoint(string_preset("vertical-3000"), 5.0, 0.005))
    (first,) = torsional_modes(case)
    structure = preset_structure("case2")
    swing = Swing(0, 1, 0.1, first.root.imag, 0j, 0.0, 0.0, 0.0)
    gains = [np.array([0.0, 0.0, 0.0, late]) for late in (0.0, -5.0)]
    free, made = (controlled_swings(case, QUICK, [swing], structure, k)[0] for k in gains)
    # The whole string turns freely, which is no vibration.
    assert complex(free.growth, free.frequency) == pytest.approx(first.root, abs=1e-3)
    assert free.in_band
    assert not free.spoils
    # So late a damper feeds the fast modes.
    assert made.growth > 1.0
    assert made.mode > 10
    assert made.spoils


def test_gains_that_move_the_frequency_cost():
    case = as_case(at(120, 20))
    structure = preset_structure("case2")
    families = swing_families(
        case, QUICK, [Swing(0, 1, 0.1, 1.0, -0.05 + 0j, 0.0, 0.0, 0.0)], structure
    )
    cost = cost_of_gains(families, 1.0)
    rng = np.random.default_rng(1)
    for _ in range(5):
        gains = 1e-4 * rng.standard_normal(4)
        value, slope = cost(gains)
        ahead = [cost(gains + 1e-7 * e)[0] for e in np.eye(4)]
        np.testing.assert_allclose(slope, (np.array(ahead) - value) / 1e-7, rtol=1e-3, atol=1e-7)
        roots = np.linalg.eigvals(families[0].system.A0)
        root = roots[np.argmax(roots.imag)]
        # Newton on the characteristic equation of the loop, from the root without gains.
        s, tau, k = root, case.point.delay, gains
        (a, b), own = (k[0] + k[2] * np.exp(-s * tau), k[1] + k[3] * np.exp(-s * tau)), 0.0
        own = s * s + (2.0 * case.point.kappa - 0.05) * s + 1.0 - (a + b * s)
        shift = -own / (2.0 * s + 2.0 * case.point.kappa - 0.05)
        size = 0.01 * 10.0 / 4.0 * float(np.sum((gains / structure.upper) ** 2))
        assert value - size == pytest.approx(shift.imag**2, rel=1e-3, abs=1e-14)


def rate_of(run, frequency):
    """Return the growth rate of the bit's swing at a frequency, from windows of four periods."""
    window = 8.0 * math.pi / frequency
    count = int(run.times[-1] // window)
    logs = []
    for k in range(1, count):
        times = np.linspace(k * window, (k + 1) * window, 2001)
        speed = run.at(times, ("dtheta",)).dtheta
        weight = 1.0 - np.cos(2.0 * math.pi * (times - times[0]) / window)
        logs.append(math.log(abs(np.mean(weight * speed * np.exp(-1j * frequency * times)))))
    return np.polyfit(window * np.arange(1, count), logs, 1)[0]


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("rpm", "rop", "damper"), [(120, 20, 0.05), (120, 10, -0.02), (100, 30, -0.02)]
)
def test_growth_with_control_is_that_of_the_simulator(rpm, rop, damper):
    case = as_case(at(rpm, rop))
    (swing,) = measured_swings(case, Drilling(kick=0.03))
    structure = preset_structure("pd")
    gains = np.array([0.0, damper])
    (made,) = controlled_swings(case, QUICK, [swing], structure, gains)
    speed = 0.04 * case.point.omega0
    controller = Controller(structure, *structure.gains(gains))
    run = simulate(
        case,
        controller,
        duration=100.0,
        initial={"dx": 0.1 * case.point.penetration_rate, "dtheta": speed},
    )
    measured = rate_of(run, made.frequency)
    assert made.growth == pytest.approx(measured, rel=0.25, abs=0.005)
    assert made.growth * measured > 0.0


@pytest.mark.long
def test_a_design_on_the_motion_holds_from_other_starts(quiet):
    assert quiet.recommended is True
    assert quiet.on_motion.growth < -0.1
    assert all(each.in_band for each in quiet.on_motion.swings)
    assert len(quiet.trials) > len(STARTS)
    point = quiet.point
    controller = quiet.controller(limit=1.0)
    for feed_kick, speed_kick in ((0.3, 0.6), (-0.5, -0.4), (0.8, 0.3)):
        initial = {
            "dx": feed_kick * point.penetration_rate,
            "dtheta": speed_kick * point.omega0,
        }
        run = simulate(quiet.case, controller, duration=200.0, initial=initial)
        tail = point.omega0 + run.at(np.linspace(150.0, 200.0, 20001), ("dtheta",)).dtheta
        # Without control it swings by 0.40 after a kick, by 0.08 from a quiet start.
        assert np.ptp(tail) / (2.0 * tail.mean()) < 0.08


def test_what_is_told(quiet):
    text = quiet.summary()
    assert "the motion that is drilled with" in text
    assert "smooth drilling is unstable" in text
    assert "mode 1, swing 0.03" in text
    fields = json.loads(json.dumps(quiet.to_dict(), allow_nan=False))
    assert fields["objective"]["name"] == "drilling"
    assert fields["on_motion"]["growth_rate"] == quiet.on_motion.growth
    assert len(fields["on_motion"]["swings"]) == 2


@pytest.mark.long
def test_an_unstable_point_is_designed_for_its_motion(monkeypatch):
    monkeypatch.setattr("drillctrl.designs.motion_design.SHARES", (0.125,))
    monkeypatch.setattr("drillctrl.designs.drilling._AMPLITUDES", ())
    found = design(at(120, 20), "pd", bounds={"K1_1": (-1, 1), "K1_2": (-1, 1)})
    assert isinstance(found.objective, Drilling)
    assert "no gains were found with which smooth drilling is stable" in found.on_motion.why
    assert found.recommended is True
    # Out of a stick, after which the bit turns backwards without control.
    stick = next(trial for trial in found.trials if trial.start.name == "stick")
    assert stick.uncontrolled.outcome == "turns-back"
    assert stick.controlled.swing < 0.02
    smooth = design(at(150, 20), "pd", trials=False)
    assert isinstance(smooth.objective, Exact)
    assert smooth.on_motion is None


@pytest.mark.long
def test_structures_are_compared_on_the_motion(monkeypatch):
    monkeypatch.setattr("drillctrl.designs.motion_design.SHARES", (0.125,))
    monkeypatch.setattr("drillctrl.designs.drilling._AMPLITUDES", ())
    found = compare(at(120, 50), ("pd",), region=None, duration=20.0)
    row = next(row for row in found.rows if row.label == "pd")
    fields = row.to_dict()
    assert fields["recommended"] is True
    assert fields["largest_swing"] < 0.08
    assert fields["torsional_growth"] < -0.2
    assert "good" in found.summary()


@pytest.mark.long
def test_nothing_is_recommended_where_nothing_helps(capsys, monkeypatch):
    monkeypatch.setattr("drillctrl.designs.drilling._AMPLITUDES", ())
    monkeypatch.setattr("drillctrl.designs.motion_design.SHARES", (0.125,))
    point = ("--rig", "table1", "--speed", "60 rpm", "--rop", "20 m/h")
    aims = ("--objective", "drilling", "--kick", "0.9", "--limit", "0.9 kN*m")
    with pytest.raises(SystemExit) as stop:
        cli.main(["design", *point, *aims, "--structure", "pd", "--require-stable", "--json"])
    fields = json.loads(capsys.readouterr().out)
    assert stop.value.code == 3
    assert fields["recommended"] is False
    assert {change["kind"] for change in fields["quieter"]} == {"speed", "feed"}
    for change in fields["quieter"]:
        assert change["swing"] <= 0.3


@pytest.mark.long
def test_gains_that_are_none_are_called_so(monkeypatch):
    """Stiffness alone cannot damp; runs from irregular motion differ by chance, not by its gain."""
    monkeypatch.setattr("drillctrl.designs.drilling._AMPLITUDES", ())
    monkeypatch.setattr("drillctrl.designs.motion_design.SHARES", (1.0,))
    found = design(at(60, 20), "p", objective=Drilling())
    assert abs(found.K1.item()) < 1e-6 * 10.0
    assert found.verdict.refused
    assert found.verdict.reason == NONE_HELP


@pytest.mark.long
def test_a_quieter_motion_is_the_nearest_that_runs_show():
    found = {change.kind: change for change in quieter(as_case(at(60, 20)))}
    faster = found["speed"]
    one_step_less = at(60 * (faster.value - 0.1), 20)
    swings = [trial_run(as_case(one_step_less), None, start).swing for start in STARTS]
    assert max(swings) > 0.3
    for change in found.values():
        case = as_case(change.where)
        assert trial_run(case, None, STARTS[2]).swing <= change.swing


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--objective", "drilling", "--kick", "2"], "kick"),
        (["--objective", "drilling", "--epsilon", "0.1"], "--epsilon"),
        (["--objective", "drilling", "--delta0", "0"], "delta0"),
        (["--kick", "0.2"], "--kick"),
        (["--limit", "-1"], "limit"),
    ],
)
def test_bad_input_is_one_line(arguments, words, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["design", *arguments])
    told = capsys.readouterr().err
    assert stop.value.code == 2
    assert words in told
    assert len(told.strip().splitlines()) == 1


def test_axial_feedback_has_no_torsional_loop():
    with pytest.raises(InputError, match="structure = feed.*theta"):
        design(at(120, 20), feed(), objective=QUICK)


def figures(swing, outcome=Outcome.ORBIT):
    return Figures(outcome, swing, 0.0, 1.0, 1.0)


def test_swings_that_decay_sooner_are_a_good_of_quiet_motions_only():
    alike = [Trial(STARTS[0], figures(0.015), figures(0.015))]
    assert judge(alike, False).recommended is False
    assert judge(alike, False, (-0.3, -0.02)).recommended is True
    assert judge(alike, False, (0.1, 0.2)).recommended is False
    stick = figures(1.0, Outcome.STICK_SLIP)
    assert judge([Trial(STARTS[0], stick, stick)], False, (-0.3, 0.1)).recommended is False


def test_candidates_that_runs_tell_apart():
    def candidate(*swings):
        trials = tuple(Trial(STARTS[0], figures(swing), figures(0.5)) for swing in swings)
        return Candidate(1.0, None, -0.1, True, (), verdict=Verdict(True, "", trials))

    assert irregular([candidate(0.25, 0.6)])
    assert irregular([candidate(0.5), candidate(0.25)])
    assert not irregular([candidate(0.25, 0.26), candidate(0.9)])
