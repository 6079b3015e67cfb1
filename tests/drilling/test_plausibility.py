import math
from dataclasses import replace

import pytest

from drillctrl import RigPoint, plausibility_notes, table1
from drillctrl.cli import main

RPM = math.pi / 30


def test_the_rig_of_the_paper_is_plausible_where_rigs_drill():
    for rpm in (30, 60, 120, 300):
        for rate in (0, 5, 30):
            assert plausibility_notes(RigPoint(table1(), rpm * RPM, rate / 3600)) == ()


@pytest.mark.parametrize(
    ("changes", "rpm", "rate", "note"),
    [
        ({}, 10, 45 / 60, "a cut of 4500 mm a turn"),
        ({"bit_radius": 12.25 * 0.0254}, 120, 20 / 3600, "a bit of 24.5 in; is 12.25 in its diam"),
        ({"rock_strength": 10 * 6894.757}, 120, 1 / 3600, "a rock strength of 0.06895 MPa"),
        ({}, 2000, 20 / 3600, "a rotary speed of 2000 rpm"),
        ({"contact_strength": 60e9}, 120, 20 / 3600, "kN is more than strings carry"),
        ({"bit_radius": 1e-2}, 120, 1 / 3600, "a bit radius of 10 mm"),
    ],
)
def test_numbers_that_no_rig_has_are_named(changes, rpm, rate, note):
    rig = replace(table1(), **changes)
    assert any(note in text for text in plausibility_notes(RigPoint(rig, rpm * RPM, rate)))


def test_the_command_line_says_so_and_goes_on(capsys):
    arguments = ["--rig", "table1", "--rop", "20 m/h", "--rock-strength", "100 psi"]
    with pytest.raises(SystemExit) as ended:
        main(["analyze", *arguments, "--speed", "120 rpm", "--json"])
    assert ended.value.code == 0
    out, err = capsys.readouterr()
    assert out.startswith("{")
    assert err.startswith("drillctrl: note: a rock strength of 0.6895 MPa")
