"""What the page shows is what the functions compute, by the API or by another route."""

import json
import math
import shlex

import numpy as np
import pytest

from drillctrl import (
    Controller,
    RigPoint,
    as_case,
    chart,
    cli,
    close_loop,
    design,
    drive_control,
    driven_plant,
    loop_transfer,
    plant_system,
    preset_structure,
    simulate_starts,
    string_preset,
    table1,
    vibration_map,
)
from drillctrl.designs.design import analyze
from drillctrl.explorer.answers import answer
from drillctrl.explorer.rig_text import complaints, rig_as_text, rig_from_text
from drillctrl.explorer.state import read_asked
from drillctrl.spectrum import characteristic

RIG = table1()
POINT = RigPoint(RIG, 120 * math.pi / 30, 20 / 3600)
K1, K2 = [-2000.0, -600.0], [1500.0, 300.0]
SCALE = np.array([RIG.torsional_stiffness, RIG.torsional_stiffness * RIG.time_scale])
CASE2 = {
    "rig": {"name": "table1", "text": None},
    "speed": 120,
    "rop": 20,
    "structure": "case2",
    "K1": K1,
    "K2": K2,
}
FREE = {**CASE2, "structure": None}
DRIVEN_RIG = {"rig": {"name": "vertical-3000", "text": None}}
DRIVEN = {**FREE, **DRIVEN_RIG, "structure": "soft-torque"}
FOOT, POUND = 0.3048, 0.45359237 * 9.80665
FIELD = {
    **CASE2,
    "units": "field",
    "rop": 20 / FOOT,
    "rock_strength": 60e6 * 0.0254**2 / POUND / 1e3,
    "K1": [gain / FOOT / POUND for gain in K1],
    "K2": [gain / FOOT / POUND for gain in K2],
}
GROUPS = {"rig": None, "omega0": 10.0, "delta0": 1.75, "psi": 14.0, "structure": None}
GAINS = ("case2", np.array(K1) / SCALE, np.array(K2) / SCALE)


def ask(view, state, **options):
    """Return what is answered, and what was told on the way."""
    told = []
    question = json.dumps({"view": view, "state": state, "options": options})
    found = json.loads(answer(question, lambda *words: told.append(words)))
    assert "error" not in found, found
    return found["result"], told


def printed(command, capsys, *options):
    """Return the JSON that a command line prints."""
    with pytest.raises(SystemExit) as stop:
        cli.main([*shlex.split(command)[1:], "--json", *options])
    assert stop.value.code == 0
    return json.loads(capsys.readouterr().out)


def run(python):
    """Run a program and return its names."""
    names = {}
    exec(python, names)
    return names


def test_roots_are_those_of_analyze_by_api_command_and_program(capsys):
    found, _ = ask("roots", CASE2)
    alpha = analyze(POINT, *GAINS).spectral_abscissa
    assert found["data"]["spectral_abscissa"] == pytest.approx(alpha, rel=1e-12)
    growth = alpha / RIG.time_scale
    assert found["rightmost"] == pytest.approx(growth, rel=1e-12)
    assert max(found["series"][1]["x"]) == pytest.approx(growth, rel=1e-3)
    assert f"doubles every {math.log(2) / growth:.3g} s" in found["sentence"]
    typed = printed(found["command"], capsys)["spectral_abscissa"]
    assert typed == pytest.approx(alpha, rel=1e-10)
    assert run(found["python"])["result"].spectral_abscissa == pytest.approx(alpha, rel=1e-10)


def test_a_stable_point_says_how_fast_vibrations_die_away():
    found, _ = ask("roots", GROUPS)
    assert found["stable"] is False
    found, _ = ask("roots", {**FREE, "speed": 200})
    assert found["stable"] is True
    assert found["sentence"].startswith("Stable: a vibration at ")


def test_a_window_of_field_units_is_told_the_same_in_them(capsys):
    found, plain = ask("roots", FIELD)[0], ask("roots", CASE2)[0]
    assert found["rightmost"] == pytest.approx(plain["rightmost"], rel=1e-9)
    for unit in ("ft/h", "ksi", "ft*lbf/rad", "--units field"):
        assert unit in found["command"]
    alpha = found["data"]["spectral_abscissa"]
    assert printed(found["command"], capsys)["spectral_abscissa"] == pytest.approx(alpha, rel=1e-9)
    ran = run(found["python"])["result"]
    assert ran.spectral_abscissa == pytest.approx(alpha, rel=1e-9)
    assert "ft/h" in ran.summary()
    found, _ = ask("motion", FIELD, duration=5, start="small")
    plain, _ = ask("motion", CASE2, duration=5, start="small")
    units = [column["unit"] for column in found["columns"]]
    assert units == ["s", "rpm", "ft/h", "klbf", "kft·lbf", "kft·lbf"]
    for column, other, factor in zip(
        found["columns"][1:4],
        plain["columns"][1:4],
        (1.0, 1 / FOOT, 1 / POUND),
        strict=True,
    ):
        told, si = np.array(column["values"]), np.array(other["values"])
        np.testing.assert_allclose(told, factor * si, rtol=1e-4, atol=1e-4 * np.ptp(told))


def test_a_chart_and_a_law_in_field_units(capsys):
    feet = [10.0 / FOOT, 30.0 / FOOT]
    found, _ = ask("chart", FIELD, x=[100.0, 200.0], y=feet)
    own = chart(POINT, ("speed", 100, 200), ("rop", 10, 30), *GAINS)
    assert found["data"]["stable_area"] == pytest.approx(own.stable_area / FOOT, rel=5e-3)
    assert "ft/h" in found["command"]
    offered = {
        s["name"]: s["gains"] for s in ask("describe", {**FIELD, **DRIVEN_RIG})[0]["structures"]
    }
    plain = {s["name"]: s["gains"] for s in ask("describe", DRIVEN)[0]["structures"]}
    for gain, si in zip(offered["stiff"], plain["stiff"], strict=True):
        assert gain["unit"].startswith("ft·lbf")
        assert gain["value"] == pytest.approx(si["value"] / FOOT / POUND)
    gains = [gain["value"] for gain in offered["soft-torque"]]
    moved = {**FIELD, **DRIVEN_RIG, "structure": "soft-torque", "K1": gains, "K2": None}
    law = read_asked(moved).law
    assert law.speed.numerator[-1] == pytest.approx(-plain["soft-torque"][0]["value"])


def test_nyquist_is_the_ratio_of_the_two_determinants():
    """1 + L = det Δ of the closed loop over det Δ of the open one."""
    found, _ = ask("nyquist", CASE2)
    plant = plant_system(POINT)
    closed = close_loop(plant, preset_structure("case2"), *GAINS[1:])
    omega = np.array(found["omega"][::100])
    opened, shut = (
        np.linalg.det(characteristic.matrix(system, 1j * omega)) for system in (plant, closed)
    )
    loop = np.array(found["real"][::100]) + 1j * np.array(found["imag"][::100])
    assert np.abs(1.0 + loop - shut / opened).max() < 1e-5 * np.abs(shut / opened).max()
    np.testing.assert_allclose(
        found["frequency"][0], found["omega"][0] / RIG.time_scale / 2 / math.pi
    )
    assert run(found["python"])["L"].shape == (1000,)


def test_nyquist_of_a_string_misses_no_resonance():
    """No frequency of thousands comes nearer to −1, and where it is seen it has no gaps."""
    state = {"rig": {"name": "paper-string", "text": None}, "speed": 120.0, "rop": 20.0,
             "structure": "case2", "K1": [3.0, 50.0], "K2": [0.0, 0.0]}  # fmt: skip
    found, _ = ask("nyquist", state)
    asked = read_asked(state)
    plant = asked.case.system(asked.structure.inputs)
    omega = np.geomspace(found["omega"][0], found["omega"][-1], 6000)
    dense = np.abs(1.0 + loop_transfer(plant, *asked.feedback, omega)).min()
    assert found["distance"] < 1.001 * dense
    drawn = np.array(found["real"]) + 1j * np.array(found["imag"])
    assert np.abs(np.diff(drawn)).max() < 0.1


def test_reflection_is_that_of_a_wave_at_an_impedance():
    """(Z − ζ)/(Z + ζ) with Z = J s + Kp + Ki/s."""
    kp, ki = 1100.0, 700.0
    found, _ = ask("reflection", {**DRIVEN, "K1": [-ki, -kp]})
    rig = string_preset("vertical-3000")
    s = 2j * math.pi * np.array(found["frequency"])
    impedance, pipe = rig.drive.inertia * s + kp + ki / s, rig.string.torsion.wave_impedance
    wanted = np.abs((impedance - pipe) / (impedance + pipe))
    assert [series["name"] for series in found["series"]] == ["soft-torque", "stiff", "z-torque"]
    np.testing.assert_allclose(found["series"][0]["magnitude"], wanted, rtol=1e-5)
    assert found["modes"][0] == pytest.approx(0.2, abs=0.1)
    np.testing.assert_allclose(np.abs(run(found["python"])["r"]), wanted, rtol=1e-5)


def test_the_chart_is_that_of_chart(capsys):
    axes = {"x": [100.0, 200.0], "y": [10.0, 30.0]}
    found, _ = ask("chart", CASE2, **axes)
    own = chart(POINT, ("speed", 100, 200), ("rop", 10, 30), *GAINS)
    assert found["data"]["stable_area"] == pytest.approx(own.stable_area, rel=5e-3)
    area = sum(
        0.5 * abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(p, [*p[1:], p[0]], strict=True)))
        for p in found["strips"]
    )
    assert area == pytest.approx(own.stable_area, rel=5e-3)
    assert printed(found["command"], capsys)["stable_area"] == pytest.approx(
        own.stable_area, rel=1e-6
    )
    assert run(found["python"])["result"].stable_area == pytest.approx(own.stable_area, rel=1e-6)


def test_a_simulation_is_that_of_simulate_starts(capsys):
    found, told = ask("simulate", CASE2, duration=20, start="kick")
    own = simulate_starts(
        POINT, Controller(*GAINS), starts=["kick"], duration=20 / RIG.time_scale
    ).runs[0]
    assert found["outcome"] == own.figures.outcome
    assert found["data"]["swing"] == pytest.approx(own.figures.swing, rel=1e-9)
    columns = {column["name"]: column["values"] for column in found["columns"]}
    times = np.array(columns["time"])
    own_speed = own.simulation.in_rig_units(times).bit_speed * 30 / math.pi
    np.testing.assert_allclose(columns["bit speed"], own_speed, rtol=1e-4, atol=1e-3)
    assert told[0] == (0.0, 20.0, "simulating")
    typed = printed(found["command"], capsys)
    assert typed["swing"] == pytest.approx(own.figures.swing, rel=1e-6)
    ran = run(found["python"])["run"]
    assert ran.summary.bit_speed_max == pytest.approx(own.simulation.summary.bit_speed_max)


def test_what_follows_the_hand_is_the_same_motion_in_short():
    short, _ = ask("motion", FREE, duration=10, start="small")
    full, _ = ask("simulate", FREE, duration=10, start="small")
    assert short["columns"] == full["columns"]
    assert short["data"] is None


@pytest.mark.long
def test_a_map_is_that_of_vibration_map():
    found, told = ask("map", FREE, x=[80, 160], y=[10, 30], counts=[2, 2])
    own = vibration_map(POINT, ("speed", 80, 160), ("rop", 10, 30), counts=(2, 2), refine=0)
    assert found["outcomes"] == own.uncontrolled.outcomes.tolist()
    np.testing.assert_allclose(found["swing"], own.uncontrolled.swing, rtol=1e-6)
    assert found["points"] == [[80, 10], [80, 30], [160, 10], [160, 30]]
    assert told[-1][:2] == (4, 4)
    assert "--x 'speed=80:160:2 rpm'" in found["command"]


def test_gains_within_bounds_are_those_of_design(capsys):
    state = {**CASE2, "structure": "p", "K1": [0.0], "K2": None, "speed": 200}
    found, _ = ask("gains", state, bounds=[[-3000.0, 500.0]], trials=False)
    point = RigPoint(RIG, 200 * math.pi / 30, 20 / 3600)
    bounds = {"K1": (-3000 / SCALE[0], 500 / SCALE[0])}
    own = design(point, "p", bounds=bounds, trials=False)
    assert found["K1"] == pytest.approx((own.K1.ravel() * SCALE[0]).tolist(), rel=1e-5)
    assert -3000.0 <= found["K1"][0] <= 500.0
    typed = printed(found["command"], capsys)
    assert typed["K1"] == pytest.approx(own.K1.ravel().tolist(), rel=1e-6)


def test_a_driven_string_is_analysed_with_its_law():
    found, _ = ask("roots", DRIVEN)
    rig = string_preset("vertical-3000")
    point = RigPoint(rig, 120 * math.pi / 30, 20 / 3600)
    own = analyze(as_case(point, driven_plant(rig, drive_control("soft-torque", rig))))
    assert found["data"]["spectral_abscissa"] == pytest.approx(own.spectral_abscissa, rel=1e-6)
    assert "--structure soft-torque" in found["command"]


def test_a_sketch_of_the_roots_is_that_of_the_analysis():
    """It comes first where analysing takes longer than a drag, and says that it is one."""
    for state in (DRIVEN, CASE2):
        sketch, whole = (ask("roots", state, **options)[0] for options in ({"rough": True}, {}))
        assert sketch["rightmost"] == pytest.approx(whole["rightmost"], rel=1e-6)
        assert sketch["sentence"] == f"{whole['sentence'][:-1]}; being checked …"
        for drawn, exact in zip(sketch["series"], whole["series"], strict=True):
            for axis in ("x", "y"):
                size = np.abs(exact[axis]).max()
                assert drawn[axis] == pytest.approx(exact[axis], abs=1e-4 * size)
        assert "data" not in sketch


@pytest.mark.long
def test_a_law_is_designed_once_for_all_points_of_a_rig():
    """Its design takes seconds, and each drag of the point asks for it."""
    state = {**DRIVEN, "structure": "observer-2", "K1": None}
    laws = [read_asked({**state, "rop": rop}).law for rop in (5.0, 6.0)]
    assert laws[0] is laws[1]
    own = drive_control("observer-2", string_preset("vertical-3000"))
    assert laws[0] == own


def test_strings_stand_side_by_side():
    rigs = [{"name": name, "text": None} for name in ("table1", "deep-5000")]
    found, told = ask("strings", FREE, rigs=rigs)
    deep = string_preset("deep-5000").string
    assert [row["name"] for row in found["rows"]] == ["table1", "deep-5000"]
    assert found["rows"][1]["length"] == pytest.approx(deep.length)
    assert sum(s["length"] for s in found["rows"][1]["sections"]) == pytest.approx(deep.length)
    assert [words[2] for words in told] == ["table1", "deep-5000"]


def test_what_is_offered_is_in_the_rigs_units():
    found, _ = ask("describe", FREE)
    gains = {s["name"]: s["gains"] for s in found["structures"]}
    assert list(gains) == [None, "p", "case1", "pd", "case2"]
    assert [g["unit"] for g in gains["pd"]] == ["N·m/rad", "N·m·s/rad"]
    assert gains["pd"][1]["high"] == pytest.approx(5.0 * SCALE[1])
    assert [g["matrix"] for g in gains["case1"]] == ["K1", "K2"]
    found, _ = ask("describe", DRIVEN)
    assert found["drive"] is True
    assert found["structures"][0]["name"] == "stiff"


STRING = """\
[[sections]]
name = "dp"
type = "drill pipe"
length = "3000 m"
outer_diameter = "5 in"
inner_diameter = "108 mm"

[[sections]]
name = "dc"
type = "collar"
length = "200 m"
outer_diameter = "171 mm"
inner_diameter = "71 mm"

[bit]
diameter = "12 1/4 in"
blades = 6
wearflat_length = "1.2 mm"
cutter_inclination = 0.6
friction_coefficient = 0.6
geometry = 1.0

[rock]
strength = "60 MPa"
contact_strength = "60 MPa"
"""


def test_everything_wrong_in_a_rig_file_is_told_with_its_line():
    assert complaints(STRING, "a.toml") == ()
    wrong = (
        STRING.replace('"3000 m"', '"3000 s"')
        .replace('"171 mm"', '"60 mm"')
        .replace('diameter = "12', 'diametr = "12')
        .replace("= 6", "= 6.5")
        .replace('"60 MPa"\ncontact', '"60 kN"\ncontact')
    )
    found = complaints(wrong, "a.toml")
    lines = wrong.splitlines()
    named = {lines[c.line - 1].partition(" =")[0] for c in found}
    assert named >= {"length", "inner_diameter", "diametr", "blades", "strength"}
    assert all("a.toml" in c.text or "dc" in c.text for c in found)
    assert any("did you mean diameter" in c.text for c in found)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a = [", None),
        ("a = 1\nb = ]", 2),
        ("x = " + "[" * 5000, None),
        ("x = " + "9" * 5000, None),
        ("mass = '34 t'\nrubbish = 1", 2),
        ("[bit]\n[bit]", 2),
    ],
)
def test_what_is_no_rig_is_told(text, line):
    found = complaints(text, "a.toml")
    assert found
    assert line in [c.line for c in found]
    assert all("\n" not in c.text for c in found)


@pytest.mark.parametrize("tally", ["/etc/passwd", "tally.csv", "../tally.csv", "/dev/zero"])
def test_a_rig_of_the_page_reads_no_other_file(tally, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tally.csv").write_text("name,type,length,OD,ID\nsecret,collar,1 m,1 in,0.5 in\n")
    text = f"sections = {tally!r}\n" + STRING.partition("\n[bit]")[1] + STRING.partition("[bit]")[2]
    found = complaints(text, "a.toml")
    assert [c.line for c in found] == [1]
    assert "must be tables, [[sections]]" in found[0].text


def test_a_rig_with_a_tally_beside_it_becomes_one_text(tmp_path):
    sound = rig_from_text(STRING, "a.toml")
    (tmp_path / "tally.csv").write_text(
        "name,type,length [m],OD [in],ID [mm]\ndp,drill pipe,3000,5,108\n"
        "dc,collar,200,6.73228346456693,71\n"
    )
    (tmp_path / "rig.toml").write_text(
        'sections = "tally.csv"\n[bit]' + STRING.partition("[bit]")[2]
    )
    again = rig_from_text(rig_as_text(str(tmp_path / "rig.toml")), "rig.toml")
    assert again.inertia == pytest.approx(sound.inertia, rel=1e-9)
    assert [s.kind for s in again.string.sections] == ["pipe", "collar"]
