"""`design` for the law of a top drive: the numbers of `compare`, and the point's own roots."""

import json

import pytest

from drillctrl import (
    DriveControl,
    Transfer,
    cli,
    compare_drives,
    design_drive,
    mode_slopes,
    string_preset,
)
from drillctrl.drilling.point import RigPoint
from drillctrl.strings.drive_design import stretched

RIG = "vertical-3000"


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main(list(arguments))
    caught = capsys.readouterr()
    return stop.value.code, caught.out, caught.err


def test_it_is_what_compare_says_of_the_law(capsys):
    code, out, _ = run(capsys, "design", "--rig", RIG, "--structure", "z-torque", "--json")
    fields = json.loads(out)
    known = compare_drives(string_preset(RIG), ["z-torque"]).drives[0]
    assert code == 0
    assert fields["structure"] == "z-torque"
    assert fields["smallest_critical_slope"] == pytest.approx(known.smallest_slope)
    assert fields["delay_margin"] == pytest.approx(known.delay_margin)
    assert fields["drilling"] is None
    assert fields["stable"]


@pytest.mark.long
def test_at_a_point_the_rock_is_in_it(capsys):
    """At 120 rpm cutting excites the axial modes, whatever turns the string."""
    point = ("--speed", "120 rpm", "--rop", "10 m/h")
    code, out, _ = run(
        capsys, "design", "--rig", RIG, *point, "--structure", "soft-torque", "--require-stable",
        "--trials", "none",
    )  # fmt: skip
    assert code == 3
    assert "vibration GROWS" in out
    assert "Kp 1.376 kN·m·s/rad, Ki 3.163 kN·m/rad" in out
    found = design_drive(RigPoint(string_preset(RIG), 160 * 0.10471976, 5 / 3600), "soft-torque")
    assert found.stable
    assert found.to_dict()["drilling"]["structure"] == "soft-torque"


@pytest.mark.long
def test_the_design_holds_for_strings_as_much_shorter_and_longer(capsys):
    """Prepared for others, it stands more on the worst of them, and hardly less on its own."""
    string = string_preset(RIG).string.torsion
    least = []
    for error in ("0.0", "0.3"):
        arguments = ("--structure", "dynamic-0", "--depth-error", error, "--json")
        code, out, _ = run(capsys, "design", "--rig", RIG, *arguments)
        assert code == 0
        law = json.loads(out)["law"]
        sides = [Transfer(**law[side]) for side in ("speed", "torque")]
        control = DriveControl("found", string_preset(RIG).drive, *sides)
        lines = [stretched(string, factor) for factor in (0.7, 1.0, 1.3)]
        least.append([min(m.slope for m in mode_slopes(line, control)) for line in lines])
    assert least[0] != least[1]
    assert least[0][1] >= 0.95 * least[1][1]
    assert min(least[1]) >= min(least[0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--rig", RIG, "--structure", "z-torque", "--bound", "K1=-1:1"), "--bound"),
        (("--rig", "paper-string", "--structure", "stiff"), "with a [top_drive]"),
        (("--structure", "stiff"), "--rig = (missing)"),
        (("--rig", RIG, "--structure", "stiff", "--depth-error", "0.1"), "--depth-error"),
        (("--rig", RIG, "--structure", "dynamic-1", "--depth-error", "0.9"), "length_error"),
        (("--structure", "p", "--depth-error", "0.1"), "--depth-error"),
        (("--rig", RIG, "--structure", "dynamic-9"), "dynamic-9"),
        (("--rig", RIG, "--speed", "9 rpm", "--rop", "1 m/h", "--structure", "p"), "free to turn"),
    ],
)
def test_bad_input_is_one_line(capsys, arguments, message):
    code, out, err = run(capsys, "design", *arguments)
    assert code == 2
    assert not out
    assert message in err
    assert len([line for line in err.splitlines() if "note" not in line]) == 1
