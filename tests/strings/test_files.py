"""Rig files that hold a string, and what they are refused for."""

import dataclasses

import pytest

from drillctrl import (
    DriveMachine,
    InputError,
    changed_rig,
    cli,
    load_rig,
    read_tally,
    save_rig,
    string_preset,
)
from drillctrl.strings.rig import WeightControl

BIT = """
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
"""
STRING = """
[mud]
density = "10 ppg"

[damping]
torsional = 0.2

[[sections]]
name = "upper pipe"
pipe = '5" 19.5#'
joints = 200

[[sections]]
type = "collar"
length = "500 ft"
outer_diameter = "8 in"
inner_diameter = "2 13/16 in"
"""
TOP_DRIVE = '[top_drive]\ninertia = "2900 kg*m^2"\n'
TALLY = """\
name,type,joints,length [ft],OD [in],ID [in],tool joint OD [in],tool joint ID [in],\
tool joint length,weight,material
pipe,DP,100,3150,5,4.276,6.625,3.75,0.55 m,31 kg/m,steel
collars,DC,,600,8,2.8125,,,,,
"""


def written(folder, text, name="rig.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_sections_in_the_file(tmp_path):
    text = BIT + STRING
    rig = load_rig(written(tmp_path, text))
    upper, collars = rig.string.sections
    assert upper.length == pytest.approx(200 * 9.6)
    assert upper.kind == "pipe"
    assert collars.length == pytest.approx(152.4)
    assert collars.outer_diameter == pytest.approx(0.2032)
    assert rig.string.mud_density == pytest.approx(1198.26, abs=0.01)
    assert rig.string.damping.torsional == 0.2
    assert rig.bit_radius == pytest.approx(0.10795)
    assert rig.drive is None
    driven = load_rig(written(tmp_path, text + TOP_DRIVE))
    assert driven.drive == DriveMachine(2900.0)
    whole = (
        TOP_DRIVE + 'torque_limit = "60 kN*m"\ndelay = "20 ms"\nlag = "5 ms"\nencoder = "2 ms"\n'
    )
    machine = load_rig(written(tmp_path, text + whole)).drive
    assert machine == DriveMachine(2900.0, 60e3, 0.02, 0.005, 0.002)


def test_a_tally_beside_the_file(tmp_path):
    written(tmp_path, TALLY, "tally.csv")
    rig = load_rig(written(tmp_path, 'sections = "tally.csv"\n' + BIT))
    pipe, collars = rig.string.sections
    assert pipe.length == pytest.approx(3150 * 0.3048)
    assert pipe.joints == 100
    assert pipe.tool_joint.length == 0.55
    assert pipe.mass_per_metre == pytest.approx(31.0)
    assert collars.tool_joint is None
    assert read_tally(tmp_path / "tally.csv") == rig.string.sections


def test_presets_are_rigs_too():
    assert load_rig("paper-string") == string_preset("paper-string")
    assert load_rig("table1").mass == 3.4e4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("500 ft", "-500 ft"), "= -500 ft: must be a finite number in (0, 20000] m"),
        (("outer_diameter =", "outer_diametre ="), "key in section 2"),
        (
            ('inner_diameter = "2 13/16 in"', 'inner_diameter = "9 in"'),
            "= 9 in: must be below its OD,",
        ),
        (("500 ft", "500 kg"), "length in section 2"),
        (("8.5 in", "85 in"), "bit.diameter"),
        (("joints = 200", "joints = 2.5"), "joints in section 1"),
        (('5" 19.5#', '5" 19.6#'), "pipe = "),
        (('type = "collar"', 'type = "color"'), "type in section 2"),
        (("[rock]", "[stone]"), "key in"),
        (('strength = "60 MPa"\ncontact', "contact"), "strength in"),
        (("[[sections]]", "[[section]]"), "key in"),
        (
            ("[mud]", '[top_drive]\ninertia = "2900 kg*m^2"\ndelay = "20 m"\n[mud]'),
            "top_drive.delay",
        ),
        (
            ("[mud]", '[top_drive]\ninertia = "2900 kg*m^2"\ndelay = "-20 ms"\n[mud]'),
            "delay of the drive",
        ),
        (
            ("[mud]", '[top_drive]\ninertia = "2900 kg*m^2"\nlagg = "20 ms"\n[mud]'),
            "did you mean lag?",
        ),
        (
            ("[mud]", '[top_drive]\ndelay = "20 ms"\n[mud]'),
            "inertia in [top_drive]",
        ),
        (("torsional = 0.2", "torsional = -0.2"), "damping.torsional"),
        (("torsional = 0.2", 'torsional = "0.2 s"'), "damping.torsional"),
        (("geometry = 1.0", ""), "geometry in [bit]"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, change, message):
    text = BIT + STRING
    assert change[0] in text
    with pytest.raises(InputError) as caught:
        load_rig(written(tmp_path, text.replace(*change)))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "at least one section"),
        (TALLY.splitlines()[0], "at least one section"),
        (TALLY.replace("OD [in]", "outside [in]", 1), "column of"),
        (TALLY.replace(",DC,,600", ",DC,600"), "cells"),
        (TALLY.replace("length [ft]", "length", 1), "length in row 2"),
        (TALLY.replace("31 kg/m", "31 kg"), "weight in row 2"),
        (TALLY.replace(",3.75,", ",,"), "tool_joint_inner_diameter in row 2"),
    ],
)
def test_a_wrong_tally_is_refused(tmp_path, text, message):
    with pytest.raises(InputError, match="must be") as caught:
        read_tally(written(tmp_path, text, "tally.csv"))
    assert message in str(caught.value)


@pytest.mark.parametrize("name", ["paper-string", "vertical-3000", "deep-5000"])
def test_a_saved_string_loads_as_it_was(tmp_path, name):
    for rig in (string_preset(name), changed_rig(string_preset(name), depth=2345.6789, mud=1357.9)):
        fed = dataclasses.replace(rig, weight_control=WeightControl(30e3, 1e-7))
        for each in (rig, fed):
            save_rig(each, tmp_path / "rig.toml")
            assert load_rig(tmp_path / "rig.toml") == each


def test_a_file_of_ones_own_begins_as_a_preset(tmp_path, capsys):
    path = tmp_path / "my-rig.toml"
    for source in ("vertical-3000", path):
        with pytest.raises(SystemExit) as stop:
            cli.main(["rig", "check", str(source), "--out", str(path)])
        assert stop.value.code == 0
        said = capsys.readouterr().out
        assert "drill pipe: 2726.4 m" in said
    with pytest.raises(SystemExit) as stop:
        cli.main(["rig", "check", "table1", "--out", str(tmp_path / "rig.json")])
    assert stop.value.code == 2
    assert "--out = " in capsys.readouterr().err


def test_all_that_is_missing_is_told_at_once(tmp_path):
    (tmp_path / "rig.toml").write_text('sections = "tally.csv"\n[bit]\nblades = 4\n[rock]\n')
    with pytest.raises(InputError) as told:
        load_rig(tmp_path / "rig.toml")
    for name in ("diameter", "wearflat_length", "geometry in [bit]", "strength, contact_strength"):
        assert name in str(told.value)
    (tmp_path / "tally.csv").write_text("name,length [m],OD [mm]\na,10,\nb,20,30\n")
    with pytest.raises(InputError) as told:
        read_tally(tmp_path / "tally.csv")
    assert "type, outer_diameter, inner_diameter in row 2" in str(told.value)
    assert "type, inner_diameter in row 3" in str(told.value)
