"""What `rig check` says of a string, by the exact line as second route."""

import json
import math

import numpy as np
import pytest
import scipy.optimize

from drillctrl import InputError, check_rig, cli, load_rig, string_preset, table1
from drillctrl.strings.figure import plot_rig
from drillctrl.strings.words import rig_summary


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main(list(arguments))
    captured = capsys.readouterr()
    return stop.value.code, captured.out, captured.err


@pytest.mark.parametrize("name", ["paper-string", "vertical-3000", "deep-5000"])
@pytest.mark.parametrize("kind", ["torsional", "axial"])
def test_modes_are_roots_of_the_exact_string(name, kind):
    rig = string_preset(name)
    line = rig.string.torsion if kind == "torsional" else rig.string.tension
    for mode in getattr(check_rig(rig), kind):
        rate = 2.0 * math.pi * mode.frequency

        def residual(s):
            value = line.bit_stiffness(complex(*s))
            return value.real, value.imag

        start = rate * np.array([-mode.damping_ratio, 1.0])
        root = complex(*scipy.optimize.root(residual, start, tol=1e-12).x)
        assert abs(root) == pytest.approx(rate, rel=1e-4)
        assert -root.real / abs(root) == pytest.approx(mode.damping_ratio, rel=2e-3)


def test_a_uniform_rod_has_the_modes_of_the_textbook(tmp_path):
    text = """
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
        [damping]
        torsional = 0.3
        axial = "0.2 1/s"
        kelvin_voigt = 1e-3
        [mud]
        density = "785 kg/m^3"
        [[sections]]
        type = "pipe"
        length = "2 km"
        outer_diameter = "127 mm"
        inner_diameter = "108 mm"
        youngs_modulus = "200 GPa"
        shear_modulus = "80 GPa"
        density = "7850 kg/m^3"
    """
    path = tmp_path / "rod.toml"
    path.write_text("\n".join(row.strip() for row in text.splitlines()))
    found = check_rig(load_rig(path))
    area = math.pi / 4.0 * (0.127**2 - 0.108**2)
    polar = math.pi / 32.0 * (0.127**4 - 0.108**4)
    weight = 2000.0 * area * 7850.0 * 9.80665
    assert found.length == 2000.0
    assert found.weight_in_air == pytest.approx(weight)
    assert found.buoyed_weight == pytest.approx(0.9 * weight)
    assert found.impedance == pytest.approx(polar * math.sqrt(80e9 * 7850.0))
    for modes, modulus, viscous in ((found.torsional, 80e9, 0.3), (found.axial, 200e9, 0.2)):
        for mode in modes:
            frequency = (2 * mode.number - 1) / 8000.0 * math.sqrt(modulus / 7850.0)
            rate = 2.0 * math.pi * frequency
            assert mode.frequency == pytest.approx(frequency, rel=1e-6)
            assert mode.damping_ratio == pytest.approx(
                viscous / (2.0 * rate) + 1e-3 * rate / 2.0, rel=1e-3
            )
            # A quarter, three quarters … of a wave from the top end to the bit.
            wave = np.sin((2 * mode.number - 1) * math.pi / 2.0 * mode.places / 2000.0)
            assert mode.shape == pytest.approx(wave / wave[0], abs=1e-4)


def test_a_lumped_rig_has_one_mode_each_way():
    found = check_rig(table1())
    assert found.length is None
    (mode,) = found.torsional
    assert mode.frequency == pytest.approx(math.sqrt(938.0 / 116.0) / (2.0 * math.pi))
    assert mode.damping_ratio == pytest.approx(32.9 / (2.0 * math.sqrt(938.0 * 116.0)))
    assert "torsional 0.4526 Hz (5 %)" in rig_summary(found)
    with pytest.raises(InputError, match="a rig with a string"):
        plot_rig(found)


@pytest.mark.parametrize("name", ["table1", "paper-string", "vertical-3000", "deep-5000"])
def test_the_verb_fits_a_terminal_and_prints_json(capsys, name):
    status, out, err = run(capsys, "rig", "check", name)
    assert (status, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 80
    fields = json.loads(run(capsys, "rig", "check", name, "--json")[1])
    assert fields["modes"]["torsional"][0]["frequency"] > 0.1
    assert fields["lumped"]["torsional_stiffness"] > 100.0


def test_names_of_modes():
    modes = check_rig(string_preset("deep-5000")).torsional
    assert [m.name for m in modes[:4]] == [
        "1st torsional",
        "2nd torsional",
        "3rd torsional",
        "4th torsional",
    ]
    assert modes[10].name == "11th torsional"


def test_the_picture_shows_every_section_and_mode(capsys, tmp_path):
    figure = plot_rig(check_rig(string_preset("vertical-3000")))
    string, torsional, axial = figure.axes
    assert {text.get_text() for text in string.texts} == {
        "drill pipe", "heavy-weight", "collars", "bit", "top drive"
    }  # fmt: skip
    for ax in (torsional, axial):
        curves = [line for line in ax.lines if len(line.get_xdata()) > 2]
        assert len(curves) == 3
        assert all(line.get_xdata()[-1] == 0.0 for line in curves)
    path = tmp_path / "string.png"
    assert run(capsys, "rig", "check", "deep-5000", "--plot", str(path))[0] == 0
    assert path.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("rig", "check", "none.toml"), "presets table1, paper-string, vertical-3000, deep-5000"),
        (("rig", "check"), "FILE|PRESET"),
        (("rig", "check", "table1", "--plot", "a.gif"), "--plot = a.gif"),
        (("rig", "chekc", "table1"), "chekc"),
    ],
)
def test_what_is_wrong_is_one_line(capsys, arguments, message):
    status, out, err = run(capsys, *arguments)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert message in err
