"""Real strings on the command line."""

import dataclasses
import json
import math

import pytest

from drillctrl import RigPoint, cli, rule_control, simulate, string_preset
from drillctrl.simulation.drive_control import law_controller


def test_a_string_is_a_rig_like_any_other(capsys):
    point = ("--rig", "paper-string", "--speed", "180 rpm", "--rop", "5 m/h")
    with pytest.raises(SystemExit) as stop:
        cli.main(["analyze", *point, "--json"])
    assert stop.value.code == 0
    fields = json.loads(capsys.readouterr().out)
    # By the exact loop: no root right of the axis, and this one.
    assert fields["stable"]
    assert fields["spectral_abscissa"] == pytest.approx(-0.0257, abs=1e-3)
    assert fields["certificate"]["agrees"]
    assert fields["rig"]["parameters"]["torsional_stiffness"] == pytest.approx(938.096, abs=1e-3)


@pytest.fixture
def call(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(list(map(str, arguments)))
        said = capsys.readouterr()
        return stop.value.code, said.out, said.err

    return run


PIPE = """
[bit]
diameter = "8.5 in"
blades = 4
wearflat_length = "1.2 mm"
cutter_inclination = 0.6
friction_coefficient = 0.6
geometry = 1.0

[rock]
strength = "60 MPa"
contact_strength = "60 MPa"

[[sections]]
type = "pipe"
length = "900 m"
outer_diameter = "127 mm"
inner_diameter = "108 mm"
"""
WHERE = ("--rig", "vertical-3000", "--speed", "120 rpm", "--rop", "5 m/h")


def test_a_run_under_a_law_of_the_drive_is_that_of_the_law(call):
    options = ("--structure", "z-torque", "--measurement-delay", "20 ms", "--limit", "60 kN*m")
    code, said, _ = call("simulate", *WHERE, *options, "--duration", "2 s", "--json")
    assert code == 0
    fields = json.loads(said)
    rig = string_preset("vertical-3000")
    machine = dataclasses.replace(rig.drive, delay=0.02, torque_limit=60e3)
    where = RigPoint(dataclasses.replace(rig, drive=machine), 4.0 * math.pi, 5 / 3600)
    control = rule_control("z-torque", machine, rig.string)
    case, controller = law_controller(where, control)
    run = simulate(
        case, controller, duration=2.0 / rig.time_scale, initial={"dx": 1.0, "dtheta": 1.0}
    )
    for name in ("bit_speed_min", "bit_speed_max", "max_abs_u"):
        assert fields[name] == pytest.approx(getattr(run.summary, name), rel=1e-6)
    code, said, _ = call("simulate", *WHERE, *options[:2], "--duration", "2 s", "--json")
    # Without the delay it moves otherwise.
    assert json.loads(said)["max_abs_u"] != pytest.approx(fields["max_abs_u"], rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*WHERE, "--structure", "stiff", "--noise", "phi=1"), "--noise"),
        ((*WHERE, "--structure", "stiff", "--limit", "1 kN*m"), "torque limit"),
        ((*WHERE, "--structure", "stiff", "--measurement-delay", "20"), "--measurement-delay"),
        (("--structure", "stiff"), "--rig"),
        (("--rig", "paper-string", *WHERE[2:], "--structure", "stiff"), "[top_drive]"),
        (("--rig", "paper-string", *WHERE[2:], "--structure", "constant-torque"), "[top_drive]"),
        (("--structure", "constant-torque"), "--rig"),
        ((*WHERE, "--K1", "1"), "--structure"),
    ],
)
def test_what_does_not_fit_a_run_under_a_drive_is_said_in_one_line(call, arguments, message):
    code, said, error = call("simulate", *arguments)
    assert (code, said) == (2, "")
    assert message in error
    assert error.count("\n") == 1


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    "verb", [("simulate", "--duration", "0.1 s"), ("analyze",)], ids=lambda verb: verb[0]
)
def test_a_top_drive_is_stiff_where_no_law_is_named(call, tmp_path, verb):
    rig = tmp_path / "rig.toml"
    rig.write_text(PIPE.replace("900 m", "300 m") + '[top_drive]\ninertia = "2900 kg*m^2"\n')
    where = ("--rig", rig, *WHERE[2:])
    code, said, error = call(*verb, *where, "--json")
    assert code == 0
    assert "top drive is stiff" in error
    stiff, constant = (
        json.loads(call(*verb, *where, "--json", "--structure", law)[1])
        for law in ("stiff", "constant-torque")
    )
    fields = json.loads(said)
    for each in (fields, stiff, constant):
        del each["elapsed_seconds"]
    assert fields == stiff
    assert constant["structure"] is None
    assert constant != stiff


def test_shapes_of_modes(call, tmp_path):
    """A uniform pipe alone, held above: node of the 2nd torsional mode at 2/3 of its length."""
    path, plot = tmp_path / "pipe.toml", tmp_path / "modes.png"
    path.write_text(PIPE)
    point = ("--rig", path, "--speed", "180 rpm", "--rop", "1 m/h")
    code, said, _ = call("analyze", *point, "--plot", plot, "--figure", "modes")
    assert code == 0
    assert "2nd torsional: still 600 m down" in said
    assert "3rd torsional: still 360, 720 m down" in said
    assert max(map(len, said.splitlines())) <= 80
    assert plot.stat().st_size > 10_000
    code, said, _ = call("analyze", *point, "--json")
    shape = json.loads(said)["modes"][1]["shape"]
    known = [math.sin(1.5 * math.pi * depth / 900.0) for depth in shape["depths"]]
    sign = math.copysign(1.0, shape["amplitudes"][-1] * known[-1])
    assert [sign * a for a in shape["amplitudes"]] == pytest.approx(known, abs=2e-3)
    code, _, error = call("analyze", "--figure", "shapes")
    assert code == 2
    assert "--figure" in error
