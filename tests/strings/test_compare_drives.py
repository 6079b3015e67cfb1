"""Drives side by side, on the command line too; roots by finite elements."""

import json
import math

import numpy as np
import pytest

from drillctrl import InputError, cli, compare_drives, string_preset, table1
from drillctrl.strings.drive_roots import drive_roots
from drillctrl.strings.drive_rules import rule_control
from tests.strings.finite_drive import driven_string
from tests.strings.test_drives import FILTERED, LATE, long_string

RIG = """
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

[top_drive]
inertia = "2900 kg*m^2"
delay = "20 ms"
torque_limit = "60 kN*m"

[damping]
torsional = 0.1
kelvin_voigt = 0.0

[[sections]]
type = "pipe"
length = "2300 m"
outer_diameter = "127 mm"
inner_diameter = "108 mm"
youngs_modulus = "200 GPa"
shear_modulus = "77 GPa"
density = "8000 kg/m^3"

[[sections]]
type = "collar"
length = "200 m"
outer_diameter = "152.4 mm"
inner_diameter = "57.2 mm"
youngs_modulus = "200 GPa"
shear_modulus = "77 GPa"
density = "8000 kg/m^3"
"""


@pytest.fixture
def run(tmp_path, capsys):
    path = tmp_path / "rig.toml"
    path.write_text(RIG)

    def call(*arguments, rig=path):
        with pytest.raises(SystemExit) as stop:
            cli.main(["compare", "--rig", str(rig), *map(str, arguments)])
        said = capsys.readouterr()
        return stop.value.code, said.out, said.err

    return call


@pytest.mark.parametrize("machine", [LATE, FILTERED])
@pytest.mark.parametrize("name", ["stiff", "soft-torque", "z-torque"])
def test_roots_with_a_free_bit_are_those_of_finite_elements(name, machine):
    string = long_string(1500.0, 2e-4)
    law = rule_control(name, machine, string)
    found = drive_roots(string.torsion, law, 3.0)
    system = driven_string(string.torsion, law, element_length=25.0)
    assert len(found) >= 3
    for root in found:
        omega = 2 * math.pi * root.frequency
        ratio = root.damping_ratio
        s = complex(-ratio * omega, omega * math.sqrt(1 - ratio**2))
        delta = s * np.eye(system.order) - system.A0
        delta = delta - system.delayed[0] * np.exp(-s * system.delays[0])
        # The smallest singular value is next to none where s is a root, and only there.
        here = np.linalg.svd(delta, compute_uv=False)[-1]
        delta = delta + 0.05 * omega * np.eye(system.order)
        assert here < 0.02 * np.linalg.svd(delta, compute_uv=False)[-1]


@pytest.mark.long
def test_table_and_fields(run, tmp_path):
    names = ("stiff", "soft-torque", "dynamic-2")
    plot, out = tmp_path / "drives.png", tmp_path / "drives.csv"
    code, said, _ = run("--structures", ",".join(names), "--plot", plot, "--out", out, "--json")
    assert code == 0
    fields = json.loads(said)
    assert [drive["structure"] for drive in fields["drives"]] == list(names)
    stiff, soft, dynamic = fields["drives"]
    assert fields["impedance"] == pytest.approx(302.376, abs=1e-3)
    assert fields["top_drive"]["torque_limit"] == 60e3
    assert soft["smallest_critical_slope"] == pytest.approx(36.6, abs=0.1)
    assert dynamic["smallest_critical_slope"] > 2 * soft["smallest_critical_slope"]
    assert all(drive["stable"] and drive["delay_margin"] > 0.0 for drive in fields["drives"])
    for drive in fields["drives"]:
        assert [mode["number"] for mode in drive["modes"]] == [1, 2, 3, 4]
        assert all(mode["damping_ratio"] > 0.003 for mode in drive["modes"])
        # Torque 2 kN m exp(−Ω/5): its slope at the threshold is the critical one.
        for mode in drive["modes"]:
            assert drive["weakest_mode"]["critical_slope"] <= mode["critical_slope"]
            slope = 400.0 * math.exp(-mode["threshold_speed"] / 5.0)
            assert slope == pytest.approx(mode["critical_slope"], rel=1e-9)
    at = np.interp(0.25, *(stiff["reflection"][n] for n in ("frequencies", "magnitudes")))
    assert at == pytest.approx(stiff["modes"][0]["reflection"], abs=2e-3)
    assert plot.stat().st_size > 10_000
    assert len(out.read_text().splitlines()) == 1 + 3 * 4


def test_a_table_for_people(run):
    code, said, _ = run(
        "--structures", "stiff,soft-torque", "--drop", "4 kN*m", "--decay", "60 rpm"
    )
    assert code == 0
    assert "1st torsional, 0.250 Hz" in said
    assert "falls by 4 kN·m over 60 rpm" in said
    assert "23.81" in said
    assert "weakest of all to 30 Hz" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--structures", "stiff,p"), "--structures = p"),
        (("--structures", "dynamic-7"), "structure = dynamic-7"),
        (("--structures", "stiff", "--drop", "4 rpm"), "--drop"),
        (("--structures", "stiff", "--decay", "-4 rpm"), "decay"),
        (("--structures", "stiff", "--duration", "100"), "--duration"),
        (("--structures", "stiff", "--out", "a.html"), "--out"),
        (
            ("--structures", "p", "--speed", "120 rpm", "--rop", "5 m/h", "--drop", "1 N*m"),
            "--drop",
        ),
    ],
)
def test_what_is_wrong_is_said_in_one_line(run, arguments, message):
    code, said, error = run(*arguments)
    assert (code, said) == (2, "")
    assert message in error
    assert error.count("\n") == 1


def test_a_rig_without_a_drive_is_refused(run):
    code, _, error = run("--structures", "stiff", rig="paper-string")
    assert code == 2
    assert "[top_drive]" in error
    with pytest.raises(InputError, match="lumped"):
        compare_drives(table1(), ["stiff"])
    with pytest.raises(InputError, match="at least one"):
        compare_drives(string_preset("vertical-3000"), [])


def test_the_first_sentence_says_what_to_set_and_how_fast_to_turn():
    """P and I of the law that stands most, and the largest of its threshold speeds."""
    found = compare_drives(string_preset("vertical-3000"), ["stiff", "soft-torque"])
    best = max(found.drives, key=lambda drive: drive.smallest_slope)
    first = " ".join(found.summary().split("\n\n")[0].split())
    speed = max(mode.threshold_speed for mode in best.modes) * 30.0 / math.pi
    assert first.startswith("Set P to ")
    assert best.control.name in first
    assert f"stay above {speed:.3g} rpm with it" in first
