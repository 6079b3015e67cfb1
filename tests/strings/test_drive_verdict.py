"""Laws of a drive are asked of the string itself before they are recommended or exported."""

import json
import math

import numpy as np
import pytest
import scipy.linalg

from drillctrl import (
    Damping,
    DrillString,
    DriveMachine,
    InputError,
    Section,
    SteppedDrive,
    cli,
    compare_drives,
    drive_control,
    pi_control,
    rule_control,
    sampled_drive,
    sampled_radius,
    sampled_slope,
    sampled_slopes,
    string_preset,
    transfer_control,
    weakest_slope,
)
from drillctrl.strings.elements import elements
from tests.strings.test_drives import LONG, long_string

RIG = string_preset("vertical-3000")


def grows(line, law, slope, seconds=160.0):
    """Whether a string in elements swings up under the stepped law, step by step."""
    chain = elements(line, 60.0)
    size = chain.diagonal.shape[1]
    mass, damping, stiffness = (
        np.diag(own) + np.diag(beside, 1) + np.diag(beside, -1)
        for own, beside in zip(chain.diagonal, chain.beside, strict=True)
    )
    mass[-1, -1] += law.machine.inertia
    damping[0, 0] -= slope
    inverse = np.linalg.inv(mass)
    a = np.zeros((2 * size + 1, 2 * size + 1))
    a[:size, size:-1] = np.eye(size)
    a[size:-1, :size], a[size:-1, size:-1] = -inverse @ stiffness, -inverse @ damping
    a[size:-1, -1] = inverse[:, -1]
    moved = scipy.linalg.expm(law.period * a)
    state, steps, u = np.zeros(2 * size + 1), SteppedDrive(law), 0.0
    state[size] = 1e-3
    sizes = []
    for _ in range(int(seconds / law.period)):
        u = steps.step(state[2 * size - 1], 0.0, u, 0.0)
        state[-1] = u
        state = moved @ state
        sizes.append(np.abs(state[size:-1]).max())
        if sizes[-1] > 10.0:
            return True
    half = len(sizes) // 2
    return max(sizes[-half // 2 :]) > max(sizes[half : half + half // 2])


@pytest.mark.parametrize("length", [700.0, 3000.0])
def test_what_a_sampled_law_stands_is_what_its_steps_show(length):
    """On the string in elements, with the law that is exported, for a short and a long string."""
    string = long_string(length, 2e-4)
    line = string.torsion
    control = rule_control("soft-torque", DriveMachine(2900.0), string)
    for period in (0.05, 0.25):
        law = sampled_drive(control, period=period, limit=1e9)
        stands = sampled_slope(law, line)
        if not stands:
            assert (length, period) == (700.0, 0.25)
            assert grows(line, law, 0.0)
            continue
        assert [grows(line, law, factor * stands) for factor in (0.9, 1.3)] == [False, True]


@pytest.mark.parametrize("name", ["paper pipe", "deep-5000"])
def test_sampled_fast_a_law_stands_what_the_exact_string_says(name):
    machine = DriveMachine(2900.0)
    if name == "paper pipe":
        line = LONG.torsion
        control = pi_control(machine, 4.0 * line.wave_impedance, 9000.0)
    else:
        rig = string_preset(name)
        line, control = rig.string.torsion, drive_control("soft-torque", rig)
    law = sampled_drive(control, period=1e-3, limit=1e6)
    known = weakest_slope(line, control).slope
    assert sampled_slope(law, line) == pytest.approx(known, rel=0.01)


def test_a_period_that_endless_pipe_stands_and_the_string_does_not_is_refused():
    law = sampled_drive(drive_control("soft-torque", RIG), period=1.0, limit=40e3)
    assert sampled_radius(law, RIG.string.torsion.wave_impedance) < 1.0
    with pytest.raises(InputError, match="under a stiff drive 40.3"):
        sampled_slopes(law, RIG)
    fast = sampled_drive(drive_control("soft-torque", RIG), period=0.01, limit=40e3)
    assert sampled_slopes(fast, RIG)[0] == pytest.approx(117.7, abs=0.5)


def test_laws_that_take_from_the_string_are_refused():
    """Whoever made them: a drive that holds hardly, one that swings up, one like a rule's."""
    pipe = RIG.string.torsion.wave_impedance
    machine = RIG.drive
    laws = [
        pi_control(machine, 0.02 * pipe, 0.0, name="slack"),
        transfer_control(machine, ([4.0 * pipe, -2000.0], [1.0, 0.0]), name="wrong sign"),
        transfer_control(machine, ([4.0 * pipe, 3000.0], [1.0, 0.0]), name="like soft torque"),
    ]
    slack, wrong, like = compare_drives(RIG, laws).drives
    assert [drive.verdict.recommended for drive in (slack, wrong, like)] == [False, False, True]
    assert slack.stable
    assert not wrong.stable
    assert slack.weakest.slope < slack.verdict.stiff.slope
    fields = wrong.to_dict()
    assert fields["recommended"] is False
    assert "swing up by themselves" in fields["reason"]


def test_without_damping_a_law_is_not_refused_for_what_no_string_has():
    """Soft torque on the paper's pipe takes less from high modes than 1 % of the pipe's ζ."""
    pipe = Section("pipe", "pipe", 1000.0, 0.127, 0.108)
    string = DrillString((pipe,), Damping(0.0, 0.0, 0.0))
    machine = DriveMachine(2900.0)
    line = string.torsion
    from drillctrl.strings.drive_verdict import drive_verdict

    found = drive_verdict(line, pi_control(machine, 4.0 * line.wave_impedance, 2e4))
    assert found.weakest.slope < found.stiff.slope < math.inf
    assert found.recommended


@pytest.mark.long
def test_refusals_on_the_command_line(tmp_path, capsys):
    def call(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main([*arguments])
        return stop.value.code, *capsys.readouterr()

    harmful = ("--rig", "deep-5000", "--structure", "observer-3")
    law = tmp_path / "law.json"
    code, told, _ = call("design", *harmful, "--require-stable", "--out", str(law))
    assert code == 3
    assert json.loads(law.read_text())["recommended"] is False
    law.unlink()
    assert told.startswith("Refused: observer-3, the weakest mode stands 4.679 N·m·s at 1.85 Hz")
    assert max(map(len, told.splitlines()[:2])) <= 80
    out = tmp_path / "law.c"
    code, told, said = call(
        "table", *harmful, "--out", str(out), "--period", "1 ms", "--limit", "40 kN*m"
    )
    assert (code, told) == (2, "")
    assert "--structure = observer-3: must be a law that does no harm" in said
    soft = ("--rig", "vertical-3000", "--structure", "soft-torque", "--limit", "40 kN*m")
    code, told, said = call("table", *soft, "--out", str(out), "--period", "1 s")
    assert (code, told) == (2, "")
    assert "--period = 1 s: must be shorter: with it the string stands 1.7" in said
    assert not list(tmp_path.iterdir())
