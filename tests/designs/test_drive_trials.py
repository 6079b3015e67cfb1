"""Laws of a drive on the nonlinear motion: the best of what was tried is the answer."""

import json
from dataclasses import replace

import numpy as np
import pytest

from drillctrl import DriveMachine, RigPoint, cli, compare_drives, simulate, string_preset
from drillctrl.designs import drive_design
from drillctrl.designs.drive_trials import DriveTrials, best_tried, drive_trials, trials_text
from drillctrl.designs.trials import STARTS, Trial
from drillctrl.simulation.drive_control import law_controller
from drillctrl.simulation.outcome import Figures
from drillctrl.simulation.status import Outcome

MACHINE = DriveMachine(2900.0, torque_limit=60e3, delay=0.02)
RIG = replace(string_preset("paper-string"), drive=MACHINE)
WHERE = RigPoint(RIG, 130.0 * np.pi / 30.0, 8.0 / 3600.0)


@pytest.fixture(scope="module")
def drives():
    return compare_drives(RIG, ["soft-torque", "z-torque"]).drives


def tried(drive, *swings, ends=None):
    """Made-up trials beside a stiff drive with a swing of 0.4."""
    stiff = Figures(Outcome.ORBIT, 0.4, 0.0, 1.0, 1.0)
    ends = ends or [Outcome.ORBIT] * len(swings)
    return DriveTrials(
        drive,
        tuple(
            Trial(start, Figures(end, swing, 0.0, 1.0, 1.0), stiff, "under a stiff drive")
            for start, swing, end in zip(STARTS, swings, ends, strict=True)
        ),
    )


def test_what_swings_least_and_harms_from_no_start_is_best(drives):
    soft, z = drives
    calm, wild = tried(soft, 0.30, 0.31, 0.30), tried(z, 0.1, 0.1, 0.45)
    assert wild.verdict.refused
    assert "instead of 0.4" in wild.verdict.reason
    assert best_tried([wild, calm]) is calm
    quiet = tried(z, 0.10, 0.11, 0.12)
    assert best_tried([calm, quiet]) is quiet
    back = tried(z, None, 0.1, 0.1, ends=[Outcome.TURNS_BACK, Outcome.ORBIT, Outcome.ORBIT])
    assert back.verdict.refused
    assert "; under a stiff drive" in back.verdict.reason
    assert best_tried([back, wild]) is wild
    # Of swings that are alike, what stands more.
    pair = [tried(soft, 0.10, 0.10, 0.10), tried(z, 0.11, 0.11, 0.11)]
    assert best_tried(pair).drive is max(drives, key=lambda drive: drive.weakest.slope)
    text = trials_text([wild, calm], "a place")
    assert "Refused: z-torque, after a kick back" in text
    assert "Best of these in the trials: soft-torque" in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.long
def test_trials_are_runs_of_the_law_with_its_delay_and_limit(drives, monkeypatch):
    """The small start once more, by hand and to a closer tolerance."""
    monkeypatch.setattr("drillctrl.designs.drive_trials.STARTS", STARTS[:1])
    monkeypatch.setattr("drillctrl.designs.drive_trials._PERIODS", 6.0)
    found = drive_trials(WHERE, drives[:1])[0]
    assert [trial.start.name for trial in found.trials] == ["small"]
    assert {trial.beside for trial in found.trials} == {"under a stiff drive"}
    case, controller = law_controller(WHERE, drives[0].control)
    _, point = case.physics("a run")
    seconds = 6.0 / drives[0].modes[0].slope.mode_frequency
    run = simulate(
        case, controller, duration=seconds / RIG.time_scale,
        scenario=STARTS[0].scenario(), rtol=1e-7,
    )  # fmt: skip
    at = np.linspace(0.75, 1.0, 3000) * run.times[-1]
    speed = point.omega0 + run.at(at, ("dtheta",)).dtheta
    swing = np.ptp(speed) / (2.0 * speed.mean())
    assert found.trials[0].controlled.swing == pytest.approx(swing, abs=0.01)


def test_the_best_is_tried_out_of_a_stick_and_what_turns_back_no_further(drives, monkeypatch):
    """Runs are made up: soft torque helps but out of a stick, Z-torque turns back from a kick."""
    made = []

    def run(task):
        place, (_, law, start, _) = task
        made.append((law.name, start.name))
        swing = {"stiff": 0.4, "soft-torque": 0.1, "z-torque": 0.1}[law.name]
        back = (law.name, start.name) in (("z-torque", "kick"), ("soft-torque", "stick"))
        end = Outcome.TURNS_BACK if back else Outcome.ORBIT
        return place, Figures(end, None if back else swing, 0.0, 1.0, 1.0)

    monkeypatch.setattr("drillctrl.designs.drive_trials._run", run)
    soft, z = drive_trials(WHERE, drives)
    assert [trial.start.name for trial in soft.trials] == ["small", "kick", "back", "stick"]
    assert [trial.start.name for trial in z.trials] == ["small", "kick"]
    assert len(made) == len(set(made))
    assert soft.verdict.recommended
    assert "under the stiff drive: after a long stick the bit turns back" in soft.verdict.reason
    assert soft.swing == 0.1
    text = trials_text([soft, z], "a place")
    assert "not run" in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.long
def test_the_answer_of_a_dynamic_design_is_the_best_that_was_tried(monkeypatch):
    """Runs are made up here: the tuned Z-torque swings least, the dynamic law turns back."""
    swings = {"dynamic-0": 0.5, "z-torque-tuned": 0.1, "z-torque": 0.2, "soft-torque": 0.3}

    def runs(where, measured, workers):
        assert [drive.control.name for drive in measured] == list(swings)
        return tuple(tried(d, *[swings[d.control.name]] * 3) for d in measured)

    monkeypatch.setattr(drive_design, "drive_trials", runs)
    found = drive_design.design_drive(WHERE, "dynamic-0", trials=True)
    fields = found.to_dict()
    assert fields["structure"] == "z-torque-tuned"
    assert fields["asked"] == "dynamic-0"
    assert fields["recommended"] is True
    assert [each["structure"] for each in fields["trials"]] == [
        "z-torque-tuned", "dynamic-0", "z-torque", "soft-torque",
    ]  # fmt: skip
    assert [each["recommended"] for each in fields["trials"]] == [True, False, True, True]
    assert "In trial runs it did better than dynamic-0." in " ".join(found.summary().split())
    swings = dict.fromkeys(swings, 0.6)
    found = drive_design.design_drive(WHERE, "dynamic-0", trials=True)
    assert not found.recommended
    assert found.summary().startswith("Refused: ")


def test_a_comparison_at_a_point_begins_with_the_runs_and_writes_them(
    monkeypatch, tmp_path, capsys
):
    monkeypatch.setattr("drillctrl.designs.drive_trials.STARTS", STARTS[:1])
    monkeypatch.setattr("drillctrl.designs.drive_trials._PERIODS", 1.0)
    point = ["--rig", "vertical-3000", "--speed", "120 rpm", "--rop", "10 m/h"]
    file = tmp_path / "drives.json"
    with pytest.raises(SystemExit):
        cli.main(["compare", *point, "--structures", "stiff,soft-torque", "--out", str(file)])
    assert capsys.readouterr().out.startswith("Trial runs at 120 rpm, 10 m/h")
    written = json.loads(file.read_text())
    assert [each["structure"] for each in written["trials"]] == ["stiff", "soft-torque"]
    assert written["best"] in ("stiff", "soft-torque")
