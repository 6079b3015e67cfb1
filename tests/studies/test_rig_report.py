"""The report of a rig: what it says, for whom, and that it is the same each time."""

from __future__ import annotations

import datetime
import json
import re
from dataclasses import replace
from math import exp, pi

import numpy as np
import pytest
from click.testing import CliRunner

from drillctrl import InputError, RigPoint, cli, load_rig, rig_report, table1
from drillctrl.base.language import FIELD
from drillctrl.cli.report import _date as printed_date
from drillctrl.studies.rig_report_figure import plot_thresholds

POINT = RigPoint(table1(), 150 * pi / 30, 20 / 3600)


def words(page):
    return re.sub(
        r"<[^>]+>", " ", re.sub(r"base64,[^\"]*|<style>.*?</style>", "", page, flags=re.S)
    )


@pytest.fixture(scope="module")
def found():
    return rig_report(POINT, name="my rig", date="2026-11-29", mapped=False)


@pytest.mark.long
def test_it_names_what_a_rig_has_and_no_theory(found):
    page = found.to_html()
    told = words(page)
    for wanted in ("my rig", "150 rpm", "20 m/h", "60 MPa", "2026-11-29", "kN on bit", "drillctrl"):
        assert wanted.replace("kN on bit", "Weight on bit") in told, wanted
    assert not set("αωδψκξηθτρ") & set(told)
    assert "abscissa" not in told
    # One file: what it shows is in it.
    assert not re.findall(r"(?:src|href)=\"(?!data:)", page)
    assert "http" not in re.sub(r"base64,[^\"]*", "", page)


@pytest.mark.long
def test_the_same_input_makes_the_same_page(found):
    again = rig_report(POINT, name="my rig", date="2026-11-29", mapped=False)
    assert again.to_html() == found.to_html()


def test_weight_and_torque_are_those_of_cutting_and_rubbing(found):
    rig = POINT.rig
    depth = POINT.penetration_rate * 2.0 * pi / POINT.rotary_speed
    a, flat = rig.bit_radius, rig.contact_strength * rig.bit_radius * rig.wearflat_length
    weight = rig.cutter_inclination * rig.rock_strength * a * depth + flat
    assert found.to_dict()["weight_on_bit"] == pytest.approx(weight)
    assert f"Weight on bit   {weight / 1e3:.3g} kN" in re.sub(
        r"\s\s+", "   ", words(found.to_html())
    )


def test_settings_are_the_gains_with_the_sign_of_a_drive(found):
    design = found.design
    assert found.recommended
    stiffness, time = POINT.rig.torsional_stiffness, POINT.rig.time_scale
    P = -design.K1[0, 1] * stiffness * time
    told = words(found.to_html())
    assert f"{P / 1e3:.3g} kN·m·s/rad" in told


@pytest.mark.long
def test_field_units_are_used_throughout():
    page = words(rig_report(replace(POINT, units="field"), mapped=False).to_html())
    for wanted in ("65.62 ft/h", "8.702 ksi", "klbf", "kft·lbf·s/rad", "8.504 in"):
        assert wanted in page, wanted
    assert not re.search(r"\d (kN|m/h|mm|MPa|t|kg·m²)\b", page)


@pytest.mark.long
def test_the_map_stands_on_it():
    found = rig_report(RigPoint(table1(), 170 * pi / 30, 20 / 3600), "p")
    assert found.map is not None
    assert "With other settings" in found.to_html()
    assert found.calm
    assert found.summary().startswith("Drill as planned")


@pytest.mark.long
def test_a_drive_is_set_by_its_rule(monkeypatch):
    rig = load_rig("vertical-3000")
    # The runs of a long string take half a minute and are tested with the simulator.
    monkeypatch.setattr("drillctrl.studies.rig_report._MOST_SECONDS", 1.0)
    monkeypatch.setattr("drillctrl.studies.rig_report._COUNTS_OF_STRING", (2, 2))
    found = rig_report(RigPoint(rig, 120 * pi / 30, 10 / 3600))
    pipe = rig.string.torsion.wave_impedance
    omega = 2.0 * pi * found.check.torsional[0].frequency
    P, I = 4.0 * pipe, omega**2 * rig.drive.inertia  # noqa: E741
    first = found.summary().splitlines()[0]
    told = [float(text) for text in re.findall(r"[PI] to ([\d.]+) kN", first)]
    np.testing.assert_allclose(told, [P / 1e3, I / 1e3], rtol=5e-3)
    page = words(found.to_html())
    assert "Top drive" in page
    assert "1 s of simulated motion tell, at each of 4 points" in page
    assert (found.map.against.name, found.map.controller.name) == ("stiff", "soft-torque")


def test_the_edge_is_where_the_torque_falls_as_steeply_as_the_drive_stands():
    ax = plot_thresholds({"stiff": 50.0}, 5.0, 2000.0, 12.0, FIELD)
    line = ax.lines[0]
    x, y = line.get_xdata()[10], line.get_ydata()[10]
    speed, drop = x * pi / 30.0, y * 1e3 * 4.4482216152605 * 0.3048
    assert drop / 5.0 * exp(-speed / 5.0) == pytest.approx(50.0)


@pytest.mark.parametrize(
    ("options", "blamed"),
    [
        (("--out", "r.html"), "--rig"),
        (("--rig", "table1", "--speed", "150 rpm", "--rop", "20 m/h", "--out", "r.pdf"), "--out"),
        (
            ("--rig", "table1", "--speed", "150 rpm", "--rop", "20 m/h", "--out", "r.html",
             "--structure", "soft-torque"),
            "--structure",
        ),
    ],
)  # fmt: skip
def test_bad_input_is_named(tmp_path, monkeypatch, options, blamed):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"^{blamed} "):
        CliRunner().invoke(cli.cli, ["report", *options], catch_exceptions=False)
    assert not list(tmp_path.iterdir())


def test_a_date_is_printed_only_where_it_is_asked_for(monkeypatch):
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    assert printed_date(None) == ""
    assert printed_date("spud") == "spud"
    apart = datetime.date.fromisoformat(printed_date("today")) - datetime.date.today()
    assert abs(apart.days) <= 1


@pytest.mark.long
def test_the_verb_writes_the_page_and_one_object(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    out = tmp_path / "r.html"
    options = ["--rig", "table1", "--speed", "150 rpm", "--rop", "20 m/h", "--no-map"]
    done = CliRunner().invoke(
        cli.cli, ["report", *options, "--workers", "1", "--json", "--out", str(out)]
    )
    fields = json.loads(done.stdout)
    assert fields["schema"] == "drillctrl/report/1"
    assert fields["date"] == "1970-01-02"
    assert "1970-01-02" in out.read_text("utf-8")
