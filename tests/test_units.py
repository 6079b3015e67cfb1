"""`--units`: the same results in the words of the audience, and the same JSON for all."""

import csv
import json
import re
from dataclasses import replace
from math import pi

import numpy as np
import pytest
from click.testing import CliRunner

from drillctrl import (
    Controller,
    InputError,
    RigPoint,
    analyze,
    chart,
    cli,
    load_rig,
    simulate,
    table1,
    torsional_modes,
    vibration_map,
)
from drillctrl.base.units import FORCE, SPEED, TORQUE, to_si
from drillctrl.drilling.gain_units import gain_texts
from drillctrl.drilling.structures import as_structure

SI = RigPoint(table1(), 150 * pi / 30, 20 / 3600)
FIELD, SYMBOLS = (replace(SI, units=name) for name in ("field", "dimensionless"))
RIG = ("--rig", "table1", "--speed", "150 rpm", "--rop", "20 m/h")
OF_SI = re.compile(r"\d (?:m/h|mm|kN|MPa|N·m|kN·m)\b")
OF_RIGS = re.compile(r"\d (?:m/h|mm|kN|MPa|rpm|ft/h|klbf|Hz|s)\b")


def invoke(*arguments):
    return CliRunner().invoke(cli.cli, list(arguments), catch_exceptions=False)


def test_units_change_nothing_that_is_computed():
    assert SI == FIELD == SYMBOLS
    told = [analyze(point, "p", [-2.0]).to_dict() for point in (SI, FIELD, SYMBOLS)]
    for fields in told:
        fields.pop("elapsed_seconds")
    assert told[0] == told[1] == told[2]


@pytest.mark.parametrize("verb", [("analyze",), ("simulate", "--duration", "1 s")])
def test_summaries_speak_one_language(verb):
    field, plain = (invoke(*verb, *RIG, "--units", n).stdout for n in ("field", "dimensionless"))
    assert "65.6" in field
    assert "ft/h" in field
    assert not OF_SI.search(field)
    assert "ω0 =" in plain
    # How long the computer took is in seconds.
    assert not OF_RIGS.search(plain.partition("Effort")[0])


def test_json_stays_as_it_is():
    told = [
        json.loads(invoke("analyze", *RIG, "--json", "--units", n).stdout) for n in ("si", "field")
    ]
    for fields in told:
        fields.pop("elapsed_seconds")
    assert told[0] == told[1]


def test_gains_in_pounds_and_feet_are_the_same_gains():
    structure, case = as_structure("pd"), analyze(FIELD).case
    (texts,) = gain_texts(structure, np.array([[-2.0, -1.0]]), case.plant, case.rig, case.language)
    stiffness, time = SI.rig.torsional_stiffness, SI.rig.time_scale
    for text, si, per in zip(
        texts, (-2 * stiffness, -stiffness * time), ("/rad", "·s/rad"), strict=True
    ):
        number, unit = text.split(" ")
        assert unit.endswith(per)
        plain = unit.removesuffix(per).replace("kft·lbf", "klbf*ft").replace("ft·lbf", "lbf*ft")
        assert to_si("x", f"{number} {plain}", TORQUE) == pytest.approx(si, rel=5e-3)


def test_charts_have_axes_of_the_field():
    low, high = (3600.0 * to_si("x", f"{value} ft/h", SPEED) for value in (20, 120))
    field = chart(FIELD, ("speed", 100, 180), ("rop", 20, 120), tolerance=1e-2)
    si = chart(SI, ("speed", 100, 180), ("rop", low, high), tolerance=1e-2)
    assert field.plane.y.unit == "ft/h"
    assert field.stable_area / 100 == pytest.approx(si.stable_area / (high - low), rel=1e-6)
    assert field.plot().get_ylabel() == "rate of penetration, ft/h"
    assert "8.702 ksi" in field.plot().get_title()
    weights = chart(FIELD, ("speed", 100, 180), ("wob", "12 kN", "20 kN"), tolerance=1e-1)
    assert to_si("x", f"{weights.plane.y.low!r} klbf", FORCE) == pytest.approx(12e3)


def test_a_motion_is_drawn_in_inches_and_feet():
    run = simulate(FIELD, Controller("p", [-2.0]), duration=5.0, initial={"dx": 1.0})
    drawn = run.plot("my rig")
    assert [ax.get_ylabel() for ax in drawn.axes] == [
        "bit displacement, in",
        "bit speed, rpm",
        "control torque, kft·lbf",
    ]
    inches = drawn.axes[0].lines[0].get_ydata()[-1]
    assert inches * 0.0254 == pytest.approx(run.in_rig_units().axial_displacement[-1], abs=1e-12)
    assert "ft·lbf/rad" in drawn.axes[0].get_title().replace("\n", " ")


def test_a_table_of_a_motion_says_its_units(tmp_path):
    rows = {}
    for units in ("si", "field"):
        out = tmp_path / f"{units}.csv"
        invoke("simulate", *RIG, "--duration", "1 s", "--every", "0.5 s", "--out", str(out),
               "--units", units)  # fmt: skip
        comment, *lines = out.read_text("utf-8").splitlines()
        rows[units] = list(csv.DictReader(lines))[-1]
    assert "weight_on_bit in klbf" in comment
    newton = to_si("x", f"{rows['field']['weight_on_bit']} klbf", FORCE)
    assert newton == pytest.approx(float(rows["si"]["weight_on_bit"]))
    turns = float(rows["field"]["bit_speed"]) * pi / 30.0
    assert turns == pytest.approx(float(rows["si"]["bit_speed"]))


def test_a_map_has_rows_in_the_units_of_its_axes():
    quick = {"counts": (2, 2), "refine": 0, "starts": ("small",), "duration": 20.0}
    found = vibration_map(FIELD, ("speed", 140, 160), ("rop", "20 ft/h", "60 ft/h"), **quick)
    assert sorted(set(found.columns()["rop"])) == pytest.approx([20.0, 60.0])
    same = vibration_map(SI, ("speed", 140, 160), ("rop", "20 ft/h", "60 ft/h"), **quick)
    np.testing.assert_allclose(found.columns()["swing"], same.columns()["swing"], rtol=1e-6)


def test_the_answer_of_a_bit_is_told_in_the_units_asked_for():
    told = invoke("bit", *RIG, "--amplitudes", "0.1", "--units", "field").stdout
    damping = torsional_modes(SI, 1)[0].damping * SI.rig.torsional_stiffness * SI.rig.time_scale
    in_feet = damping / (0.3048 * 4.4482216152605)
    own = f"its own damping, seen at the bit, is {in_feet:.4g} ft·lbf·s/rad"
    assert own in " ".join(told.split())


def test_a_string_and_its_drive_are_told_in_feet():
    told = invoke("rig", "check", "vertical-3000", "--units", "field").stdout
    assert "9842.52 ft" in told
    assert "12.25 in" in told
    assert not re.search(r"\d (?:mm|m|kN|t|kg/m|kg/m³|N·m/rad|MPa)\b", told)
    drive = invoke("compare", "--rig", "vertical-3000", "--structures", "stiff", "--units", "field")
    pipe = load_rig("vertical-3000").string.torsion.wave_impedance
    assert f"{pipe / (0.3048 * 4.4482216152605):.4g} ft·lbf·s" in drive.stdout


def test_bare_numbers_on_an_axis_are_in_the_units_told(tmp_path):
    told = [
        json.loads(invoke("chart", "--rig", "table1", "--x", "speed=140:160", "--y", y, "--json",
                          "--units", units).stdout)
        for y, units in (("rop=20:40", "field"), ("rop=20:40 ft/h", "si"))
    ]  # fmt: skip
    areas = [
        t["stable_area"] / (t["y"]["high"] - t["y"]["low"]) for t in (f["axes"] | f for f in told)
    ]
    assert areas[0] == pytest.approx(areas[1], rel=1e-3)
    points = [fields["operating_point"]["delta0"] for fields in told]
    assert points[0] == pytest.approx(points[1])


@pytest.mark.parametrize(
    "options", [("--units", "field"), ("--units", "si"), (*RIG, "--units", "metric")]
)
def test_units_without_a_meaning_are_refused(options):
    with pytest.raises(InputError, match=r"^--units = "):
        invoke("analyze", *options)
