"""Gains are tried on the nonlinear motion, and refused where they do harm.

Swings are those of a program of its own with fixed steps (see each test).
"""

import json
import math

import numpy as np
import pytest

from drillctrl import (
    Controller,
    Exact,
    OperatingPoint,
    RigPoint,
    analyze,
    cli,
    design,
    load_table,
    plant_system,
    save_table,
    simulate,
    table,
    table1,
)
from drillctrl.designs.trials import (
    STANDING,
    STARTS,
    Trial,
    trial_duration,
    uncontrolled_runs,
)
from drillctrl.designs.verdict import judge, with_engagement
from drillctrl.simulation.outcome import Figures, figures
from drillctrl.simulation.status import Outcome
from drillctrl.tables.grid import Axis, Grid

POINT_C = OperatingPoint(omega0=10.0, delta0=1.75, psi=14.0)


def at(rpm, rop):
    """Return a point of Table 1's rig, rpm and m/h."""
    return RigPoint(table1(), rpm * 2.0 * math.pi / 60.0, rop / 3600.0)


@pytest.fixture(scope="module")
def refused():
    """120 rpm, 20 m/h, case2: the gains of least α turn the bit backwards."""
    return design(at(120, 20), "case2", objective=Exact())


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("rpm", "rop", "free"), [(120, 20, 0.015), (100, 10, 0.011), (120, 50, 0.10)]
)
def test_swing_without_control(rpm, rop, free):
    small = uncontrolled_runs(at(rpm, rop).operating_point())["small"]
    assert small.swing == pytest.approx(free, abs=0.005 if free == 0.10 else 0.0006)


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("rpm", "rop", "swing", "digits"),
    [
        (120, 20, 0.015, 0.0005),
        (100, 10, 0.011, 0.0005),
        (80, 30, 0.24, 0.005),
        (120, 50, 0.07, 0.005),
    ],
)
def test_swing_with_plain_damping(rpm, rop, swing, digits):
    tried = analyze(at(rpm, rop), "pd", [0.0, -0.5], [0.0, 0.0], trials=True)
    assert tried.trials[0].start.name == "small"
    assert tried.trials[0].controlled.swing == pytest.approx(swing, abs=digits)


@pytest.mark.long
def test_plain_damping_is_judged_by_what_it_does():
    helps = analyze(at(120, 50), "pd", [0.0, -0.5], [0.0, 0.0], trials=True)
    assert helps.spectral_abscissa > 0.0
    assert helps.recommended is True
    assert helps.summary().startswith("Recommended")
    assert "swings less than without control" in helps.reason
    idle = analyze(at(120, 20), "pd", [0.0, -0.5], [0.0, 0.0], trials=True)
    assert idle.recommended is False
    assert "no measurable good" in idle.reason


@pytest.mark.long
def test_harmful_gains_are_refused_first(refused):
    assert refused.recommended is False
    assert [trial.controlled.outcome for trial in refused.trials] == ["turns-back"] * 3
    assert [trial.uncontrolled.outcome for trial in refused.trials] == ["orbit"] * 3
    first, *rest = refused.summary().splitlines()
    assert first.startswith("REFUSED")
    assert "turns backwards" in first
    # The reason may go on in a second line.
    assert any("no gains are offered" in line for line in rest[:2])
    assert any(line.startswith("Feedback") and "(refused)" in line for line in rest)


@pytest.mark.parametrize(
    ("rpm", "rop", "structure", "ends"),
    [
        (100, 10, "case2", "diverges"),
        (80, 30, "case1", "turns-back"),
        (80, 30, "case2", "diverges"),
    ],
)
def test_gains_of_least_abscissa_refused(rpm, rop, structure, ends):
    result = design(at(rpm, rop), structure, objective=Exact())
    assert result.trials[0].controlled.outcome == ends
    assert result.recommended is False


@pytest.mark.long(but=1)
@pytest.mark.parametrize("structure", ["case1", "case2"])
@pytest.mark.parametrize("point", [at(150, 20), POINT_C], ids=["150 rpm", "C"])
def test_stabilising_gains_recommended(point, structure):
    result = design(point, structure)
    assert result.recommended is True
    moving, standing = result.trials[: len(STARTS)], result.trials[len(STARTS) :]
    assert {trial.controlled.outcome for trial in moving} == {"settles"}
    assert [trial.start.name for trial in standing] == ["rest", "stick"]
    # What such gains do to a bit that stands still is told with them.
    worse = any(
        trial.controlled.outcome == "turns-back" and trial.uncontrolled.outcome != "turns-back"
        for trial in standing
    )
    assert ("switch them on once the bit turns" in result.verdict.reason) == worse


@pytest.mark.long
def test_point_f_of_the_paper():
    point = OperatingPoint(omega0=10.0, delta0=12.0, psi=14.0)
    # case1 settles after a push forward, but after a kick back it bounces, and falls behind the
    # feed, which presses it ever harder.
    case1 = design(point, "case1")
    assert [trial.controlled.outcome for trial in case1.trials] == [
        "settles",
        "settles",
        "does-not-keep-up",
    ]
    assert case1.stable
    assert case1.recommended is False
    assert design(point, "case2").recommended is True
    # Without control the bit comes to a standstill.
    assert {trial.uncontrolled.outcome for trial in case1.trials} == {"stalls"}


def test_modes_that_are_worse(refused):
    (mode,) = refused.modes_worse
    assert mode.kind == "torsional"
    # Each is a root of its loop, and neither is the axial one.
    for system, s in ((refused.plant, mode.open_loop), (refused.system(), mode.root)):
        delta = s * np.eye(4) - system.A0
        for delay, matrix in zip(system.delays, system.delayed, strict=True):
            delta = delta - matrix * np.exp(-s * delay)
        assert np.linalg.svd(delta, compute_uv=False)[-1] < 1e-8
    assert mode.open_loop.real < 0.0 < mode.root.real
    # The string's own torsional mode, κ = 0.05: −κ ± i.
    assert mode.open_loop == pytest.approx(-0.05 + 1.0j, abs=0.02)
    assert not design(at(150, 20), "case1", trials=False).modes_worse


def test_json(refused):
    fields = json.loads(json.dumps(refused.to_dict(), allow_nan=False))
    assert fields["recommended"] is False
    assert fields["reason"] == refused.reason
    assert [trial["start"] for trial in fields["trials"]] == ["small", "kick", "back"]
    for trial in fields["trials"]:
        for side in ("controlled", "uncontrolled"):
            names = {"outcome", "swing", "stick_fraction", "feed", "max_abs_u"}
            assert trial[side].keys() == names
    assert fields["modes_worse"][0]["kind"] == "torsional"


@pytest.mark.parametrize("trials", [False, None])
def test_untried(trials):
    result = design(POINT_C, "p", trials=trials)
    assert result.recommended is None
    assert result.trials == ()
    first = result.summary().splitlines()[0]
    assert first.startswith("Not tried")


def test_no_nonlinear_model():
    result = design(plant_system(POINT_C), "case1")
    assert result.recommended is None
    assert "no nonlinear model" in result.reason


@pytest.fixture
def run(capsys):
    """The command line in this process: its exit status and what it prints."""

    def called(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(list(arguments))
        return stop.value.code, capsys.readouterr().out

    return called


@pytest.mark.long
def test_exit_codes(run):
    rig = ("--rig", "table1", "--rop", "20 m/h", "--speed", "120 rpm", "--structure", "case2")
    status, out = run("design", *rig, "--require-stable", "--objective", "exact")
    assert status == 3
    assert out.startswith("REFUSED")
    assert run("analyze", "--structure", "p", "--K1", "-1.5", "--require-stable")[0] == 0
    status, out = run("design", "--structure", "p", "--trials", "none", "--json")
    assert (status, json.loads(out)["recommended"]) == (0, None)
    assert run("design", "--trials", "some")[0] == 2


@pytest.mark.long
def test_stable_but_refused_fails_require_stable(run):
    # Near the gains of least α at F: stable, and lost after a kick back.
    point = ("--omega0", "10", "--delta0", "12", "--psi", "14", "--structure", "case1")
    best = design(OperatingPoint(omega0=10.0, delta0=12.0, psi=14.0), "case1", trials=False)
    gains = ("--K1", repr(float(best.K1[0, 0])), "--K2", repr(float(best.K2[0, 0])))
    status, out = run("analyze", *point, *gains, "--require-stable", "--json")
    assert (status, json.loads(out)["stable"], json.loads(out)["recommended"]) == (0, True, None)
    status, out = run("analyze", *point, *gains, "--require-stable", "--trials", "all", "--json")
    assert (status, json.loads(out)["stable"], json.loads(out)["recommended"]) == (3, True, False)


FINE = Figures(Outcome.SETTLES, 0.0, 0.0, 1.0, 1.0)
SWINGS = Figures(Outcome.ORBIT, 0.2, 0.0, 1.0, 1.0)
BROKEN, TURNS, GROWS = (
    Figures(outcome, None, None, None, 1.0)
    for outcome in (Outcome.UNDECIDED, Outcome.TURNS_BACK, Outcome.DIVERGES)
)


@pytest.mark.parametrize(
    ("mine", "free", "stable", "recommended", "words"),
    [
        (FINE, SWINGS, True, True, "settles from a small disturbance"),
        (SWINGS, SWINGS, False, False, "no measurable good"),
        (SWINGS, SWINGS, True, False, "does not settle"),
        (Figures(Outcome.ORBIT, 0.23, 0.0, 1.0, 1.0), SWINGS, False, False, "swings more"),
        (Figures(Outcome.ORBIT, 0.17, 0.0, 1.0, 1.0), SWINGS, False, True, "swings less"),
        (Figures(Outcome.STICK_SLIP, 0.2, 0.1, 1.0, 1.0), SWINGS, False, False, "sticks for 10 %"),
        (Figures(Outcome.LATE, 0.2, 0.0, 0.8, 1.0), SWINGS, False, False, "falls behind"),
        (BROKEN, SWINGS, True, False, "before it can tell"),
        (Figures(Outcome.STALLS, None, 1.0, 0.0, 1.0), SWINGS, True, False, "stands still"),
        (SWINGS, Figures(Outcome.STALLS, None, 1.0, 0.0, 0.0), False, True, "stands still"),
        (TURNS, GROWS, True, False, "turns backwards"),
    ],
)  # fmt: skip
def test_judgement(mine, free, stable, recommended, words):
    verdict = judge([Trial(STARTS[0], mine, free)], stable)
    assert verdict.recommended is recommended
    assert words in verdict.reason


def test_small_basin_is_said():
    lost = Figures(Outcome.STICK_SLIP, 1.0, 0.1, 1.0, 1.0)
    verdict = judge([Trial(STARTS[0], FINE, lost), Trial(STARTS[1], lost, lost)], True)
    assert verdict.recommended is True
    assert "settles from a small disturbance, but after a kick forward" in verdict.reason
    assert "every start" not in verdict.reason


def test_a_small_basin_at_the_limit_is_told_and_is_that_of_the_runs(best_c, run):
    """α = −0.81; a limit of 0.05 is enough after a small disturbance, too little after a kick."""
    assert best_c.spectral_abscissa < -0.8
    assert best_c.tried(limit=0.05).verdict.reason.startswith(
        "the motion settles from a small disturbance, but after a kick forward"
    )
    gains = ("--K1", repr(best_c.K1[0, 0].item()), "--K2", repr(best_c.K2[0, 0].item()))
    for start, limit, ends in (
        ("small", "0.05", "settles"),
        ("kick", "0.05", "stick-slip"),
        ("kick", "2", "settles"),
    ):
        options = ("--structure", "case1", *gains, "--limit", limit, "--start", start)
        code, out = run("simulate", *options, "--duration", "600", "--json")
        assert (code, json.loads(out)["outcome"]) == (0, ends)


def test_what_settles_from_the_three_starts_and_not_from_rest_does_not_contradict_itself():
    verdict = judge([Trial(start, FINE, SWINGS) for start in STARTS], True)
    usual = "settles from a small disturbance and from kicks forward and back by half the speed"
    assert verdict.reason.endswith(usual)
    back = Figures(Outcome.TURNS_BACK, None, None, None, 1.0)
    said = with_engagement(verdict, [Trial(STANDING[0], back, SWINGS)], "switch them on late")
    late = "but switch them on late: after a start from rest"
    assert said.reason.startswith(f"{verdict.reason}; {late}")
    assert "every start" not in said.reason


def test_outcomes_of_runs():
    linear = simulate(POINT_C, duration=1.0, initial={"dtheta": 1.0})
    assert figures(linear).max_abs_u == 0.0
    # The sign of the feedback turned: θ' is driven.
    driven = Controller("pd", [0.0, 5.0], [0.0, 0.0])
    ends = {figures(simulate(POINT_C, driven, duration=50.0, initial={"dtheta": sign})).outcome
            for sign in (-1.0, 1.0)}  # fmt: skip
    assert ends <= {"turns-back", "diverges"}
    # Cut short for want of steps, it proves nothing.
    short = simulate(POINT_C, duration=50.0, initial={"dtheta": 1.0}, max_steps=50)
    assert figures(short).outcome == "undecided"
    assert figures(short).swing is None


def test_settled_run_by_its_linear_decay():
    # −α T = 0.049 · 300: long settled; the swing is what is left of it.
    point = at(150, 20).operating_point()
    assert trial_duration(point) == pytest.approx(15.0 / point.kappa)
    found = uncontrolled_runs(point)
    assert found.pop("stick").outcome == "turns-back"
    assert {name: f.outcome for name, f in found.items()} == dict.fromkeys(
        [*(start.name for start in STARTS), "rest"], "settles"
    )
    assert all(f.swing < 1e-3 and f.feed == pytest.approx(1.0, abs=1e-3) for f in found.values())


@pytest.fixture(scope="module")
def tried_table():
    """150 rpm and 160 rpm at 20 and 50 m/h, case2."""
    speed = Axis("rotary_speed", (150 * math.pi / 30, 160 * math.pi / 30))
    rate = Axis("penetration_rate", (20 / 3600,))
    return table(Grid((speed, rate, Axis("rock_strength", (60e6,))), table1()), "case2")


@pytest.mark.long
def test_table_refuses_by_node(tried_table, tmp_path):
    assert tried_table.refused.tolist() == [False, True]
    assert (tried_table.gains[1] == 0.0).all()
    assert tried_table.gains[0].any()
    # Without control that node is stable all the same, but nothing is vouched for beside it.
    assert not tried_table.stable_at(4.7, 0.125, 14.14).any()
    assert "REFUSED by trial runs" in tried_table.summary()
    rows = tried_table.to_dict()["rows"]
    assert [row["refused"] for row in rows] == [False, True]
    assert rows[0]["reason"] is None
    assert "turns backwards" in rows[1]["reason"]
    for ending in ("csv", "json"):
        path = tmp_path / f"gains.{ending}"
        save_table(tried_table, path)
        again = load_table(path)
        assert again.refusals == tried_table.refusals
        assert again.tried
        assert "turns backwards" in path.read_text()


def test_table_untried():
    grid = Grid((Axis("omega0", (10.0,)), Axis("delta0", (1.75,)), Axis("psi", (14.0,))), POINT_C)
    untried = table(grid, "p", trials=False)
    assert not untried.tried
    assert not untried.refusals
    assert "not tried" in untried.summary()
