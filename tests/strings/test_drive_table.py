"""Laws of a drive over depth."""

import csv
import json

import pytest

from drillctrl import (
    InputError,
    cli,
    drive_table,
    mode_slopes,
    rule_control,
    string_preset,
    weakest_slope,
)
from drillctrl.strings.changed import changed_rig

RIG = string_preset("vertical-3000")


def test_each_depth_has_the_law_of_its_own_string():
    found = drive_table(RIG, "soft-torque", [2000.0, 2500.0])
    assert found.stable
    laws = []
    for depth, drive in zip(found.depths, found.drives, strict=True):
        string = changed_rig(RIG, depth=depth).string
        assert string.length == pytest.approx(depth)
        law = rule_control("soft-torque", RIG.drive, string)
        assert drive.control == law
        assert drive.weakest == weakest_slope(string.torsion, law)
        assert drive.smallest_slope == min(m.slope for m in mode_slopes(string.torsion, law))
        laws.append(law)
    halfway = changed_rig(RIG, depth=2250.0).string.torsion
    assert found.between == (min(weakest_slope(halfway, law).slope for law in laws),)


@pytest.fixture
def call(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(["table", *map(str, arguments)])
        said = capsys.readouterr()
        return stop.value.code, said.out, said.err

    return run


@pytest.mark.long
def test_the_table_on_the_command_line(call, tmp_path):
    options = ("--rig", "vertical-3000", "--structure", "stiff", "--depth", "6000:8000:2 ft")
    out, plot = tmp_path / "laws.csv", tmp_path / "laws.png"
    code, said, _ = call(*options, "--out", out, "--plot", plot, "--json")
    assert code == 0
    nodes = json.loads(said)["nodes"]
    assert [node["depth"] for node in nodes] == pytest.approx([1828.8, 2438.4])
    rows = list(csv.DictReader(out.read_text().splitlines()))
    slopes = [float(row["weakest_slope"]) for row in rows]
    assert slopes == [node["weakest_slope"] for node in nodes]
    above = [float(c) for c in rows[0]["speed_numerator"].split()]
    assert above == nodes[0]["law"]["speed"]["numerator"]
    assert plot.stat().st_size > 10_000
    code, said, _ = call(*options)
    assert "Stable with a free bit" in said
    assert max(map(len, said.splitlines())) <= 80


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--structure", "stiff", "--depth", "1:2:2 km"), "--rig"),
        (("--rig", "vertical-3000", "--structure", "stiff"), "--depth"),
        (("--rig", "vertical-3000", "--structure", "stiff", "--depth", "9:99:2 km"), "depth"),
        (("--rig", "vertical-3000", "--structure", "stiff", "--depth", "2:3:2 rpm"), "--depth"),
        (
            ("--rig", "vertical-3000", "--structure", "stiff", "--depth", "2 km", "--seed", "3"),
            "--seed",
        ),
        (
            ("--rig", "vertical-3000", "--structure", "stiff", "--depth", "2 km", "--mud", "1 sg"),
            "mud bears on weights",
        ),
        (("--rig", "paper-string", "--structure", "stiff", "--depth", "2 km"), "[top_drive]"),
        (("--omega0", "9", "--delta0", "2", "--depth", "2:3:2 km"), "--depth"),
        (
            ("--rig", "vertical-3000", "--structure", "stiff", "--depth", "2 km", "--out", "a.txt"),
            "--out",
        ),
    ],
)
def test_what_is_wrong_is_said_in_one_line(call, arguments, message):
    code, said, error = call(*arguments)
    assert (code, said) == (2, "")
    assert message in error
    assert error.count("\n") == 1


def test_depths_that_are_none():
    with pytest.raises(InputError, match="rising"):
        drive_table(RIG, "stiff", [3000.0, 2000.0])
    with pytest.raises(InputError, match="imposed"):
        drive_table(string_preset("paper-string"), "stiff", [3000.0])
