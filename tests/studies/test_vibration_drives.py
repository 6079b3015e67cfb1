"""Maps of a string under laws of its top drive, and the threshold of torsional damping."""

from __future__ import annotations

import json
from dataclasses import replace
from math import pi

import numpy as np
import pytest

from drillctrl import (
    Controller,
    Damping,
    DrillString,
    DriveMachine,
    InputError,
    RigPoint,
    Section,
    as_case,
    changed_rig,
    drive_control,
    drive_table,
    driven_plant,
    law_controller,
    load_laws,
    simulate,
    string_rig,
    table1,
    torsional_modes,
    torsional_threshold,
    vibration_map,
)
from drillctrl.charts.plane import make_plane
from drillctrl.cli import main
from drillctrl.drilling.friction import FreeBit
from drillctrl.motion.response import BitResponse
from drillctrl.motion.swing import ModeAt
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.starts import start_named
from drillctrl.spectrum.pseudospectral import approximate_roots
from drillctrl.strings.named_roots import named_roots
from drillctrl.strings.slopes import mode_slopes
from drillctrl.studies.vibration_threshold import law_growth, torsional_field

STRING = DrillString(
    (
        Section("pipe", "pipe", 300.0, 0.127, 0.1086),
        Section("collars", "collar", 60.0, 0.17, 0.07),
    ),
    Damping(axial=0.5, torsional=0.2),
)
RIG = string_rig(
    STRING, drive=DriveMachine(1500.0, torque_limit=30e3), bit_radius=0.108, blades=4,
    rock_strength=60e6, contact_strength=60e6, wearflat_length=1e-3, cutter_inclination=0.6,
    friction_coefficient=0.6, bit_geometry=1.0,
)  # fmt: skip
POINT = RigPoint(RIG, 120 * pi / 30, 10 / 3600)
QUICK = {"counts": (2, 2), "refine": 0, "starts": ("kick",), "duration": 30.0}
SPEED, ROP = ("speed", 80.0, 160.0), ("rop", 5.0, 15.0)


@pytest.fixture(scope="module")
def found():
    return vibration_map(
        POINT, SPEED, ROP, drive_control("soft-torque", RIG), drive_control("z-torque", RIG),
        **QUICK,
    )  # fmt: skip


@pytest.mark.parametrize(("column", "law"), [("", "soft-torque"), ("against_", "z-torque")])
def test_each_column_is_what_runs_under_its_law_do(found, column, law):
    columns = found.columns()
    k = next(i for i in range(4) if (columns["speed"][i], columns["rop"][i]) == (80.0, 15.0))
    where = RigPoint(RIG, 80 * pi / 30, 15 / 3600)
    case, controller = law_controller(where, drive_control(law, RIG))
    start = start_named("kick").scenario()
    run = simulate(case, controller, duration=30.0, scenario=start, rtol=1e-6)
    assert columns[f"{column}swing"][k] == pytest.approx(figures(run).swing, rel=1e-6)
    assert columns[f"{column}outcome"][k] == str(figures(run).outcome)


def test_the_difference_is_between_the_two_laws(found):
    figure = found.plot(("swing",), difference=True)
    titles = [ax.get_title() for ax in figure.axes if ax.get_title()]
    assert titles == [
        "z-torque drive",
        "soft-torque drive",
        "change from left to right",
    ]
    told = found.to_dict()
    assert (told["structure"], told["against"]) == ("soft-torque", "z-torque")
    assert set(told["outcomes"]) == {"against", "controlled"}
    assert "under z-torque, under soft-torque" in found.summary().replace("\n", " ")


@pytest.mark.long
def test_a_rig_with_a_top_drive_is_held_by_a_stiff_one():
    alone = vibration_map(POINT, SPEED, ROP, **QUICK)
    stiff = vibration_map(POINT, SPEED, ROP, drive_control("stiff", RIG), **QUICK)
    np.testing.assert_array_equal(alone.uncontrolled.swing, stiff.controlled.swing)
    assert alone.to_dict()["against"] == "stiff"


@pytest.mark.long
def test_laws_of_a_table_are_those_of_each_depth(tmp_path):
    made = drive_table(RIG, "soft-torque", [300.0, 420.0])
    (tmp_path / "laws.csv").write_text(made.to_csv())
    (tmp_path / "laws.json").write_text(json.dumps(made.to_dict()))
    for name in ("laws.csv", "laws.json"):
        laws = load_laws(tmp_path / name, RIG.drive)
        for depth in (300.0, 350.0, 370.0, 420.0):
            assert laws.at(depth).speed == made.laws.at(depth).speed
    quick = {**QUICK, "duration": 10.0}
    found = vibration_map(POINT, SPEED, ("depth", 300.0, 420.0), made.laws, made.laws, **quick)
    k = next(i for i, at in enumerate(found.points.tolist()) if at == [80.0, 420.0])
    deep = RigPoint(changed_rig(RIG, depth=420.0), 80 * pi / 30, 10 / 3600)
    case, controller = law_controller(deep, made.drives[1].control)
    start = start_named("kick").scenario()
    run = simulate(case, controller, duration=10.0, scenario=start, rtol=1e-6)
    assert found.controlled.swing[k] == pytest.approx(figures(run).swing, rel=1e-6)
    with pytest.raises(InputError, match="table"):
        load_laws(tmp_path / "none.csv", RIG.drive)
    (tmp_path / "bad.csv").write_text("depth,stable,\n1,2\n")
    with pytest.raises(InputError, match="laws of a top drive"):
        load_laws(tmp_path / "bad.csv", RIG.drive)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--against", "stiff"), "--against"),
        (("--structure", "stiff"), "--structure"),
        (("--rig", "table1", "--structure", "stiff"), "rig"),
        (("--structure", "pd", "--K1", "-1,-1", "--against", "pd; K3=1"), "--against"),
    ],
)
def test_bad_input_is_refused(capsys, arguments, named):
    where = ("--speed", "120 rpm", "--rop", "20 m/h") if "table1" in arguments else ()
    with pytest.raises(SystemExit) as stop:
        main(["map", *arguments, *where])
    error = capsys.readouterr().err
    assert stop.value.code == 2
    assert named in error
    assert error.count("\n") == 1


@pytest.mark.long
def test_torsion_loses_its_damping_where_the_threshold_along_speed_has_it():
    """On a rig with little damping of its own, which the bit takes away at low speed."""
    rig = replace(table1(), torsional_damping=14.0)
    where = RigPoint(rig, 120 * pi / 30, 20 / 3600)
    (edge,) = torsional_threshold(where, "speed", least=0.9, most=1.2).thresholds
    low, high = edge.low * 120, edge.high * 120
    axes = ("speed", low - 6.0, high + 6.0), ("rop", 19.9, 20.1)
    gains = Controller("pd", [0.0, -0.5])
    quick = {"counts": (2, 2), "refine": 0, "starts": ("small",), "duration": 5.0}
    found = vibration_map(where, *axes, gains, threshold=True, **quick)
    free, held = found.threshold.growth
    assert edge.decays == "above"
    assert (free[0] > 0.0).all()
    assert (free[1] < 0.0).all()
    # Gains on the bit's speed damp by what they are, whatever the bit answers.
    finite = np.isfinite(free)
    unit = 1.0 / rig.time_scale
    np.testing.assert_allclose((held - free)[finite], -0.25 * unit, rtol=0.1)
    assert found.to_dict()["threshold"]["grows"][0][0] == [True, True]


@pytest.fixture
def answering(monkeypatch):
    """Return what lets the bit answer at once with a share of an impedance, N m s/rad."""

    def let(answer):
        unit = RIG.torsional_stiffness * RIG.time_scale
        none = np.zeros(0, complex)

        def answered(case, frequency, swing, **options):
            assert case.rig.drive is None
            return BitResponse(frequency, swing, answer / unit, 0.0, none, none, 1.0, 1.0, 0, 0, 1)

        monkeypatch.setattr("drillctrl.studies.vibration_threshold.bit_response", answered)

    return let


@pytest.mark.parametrize("law", ["stiff", "soft-torque", "z-torque"])
def test_torsion_under_a_law_grows_as_its_roots_and_critical_slopes_say(law):
    """A free bit has the roots of the string; one that falls by a critical slope has none left."""
    control, line = drive_control(law, RIG), STRING.torsion
    slopes = [mode for mode in mode_slopes(line, control, 4) if mode.frequency is not None]
    weakest = min(slope.slope for slope in slopes)
    assert law_growth(line, control, -weakest) == pytest.approx(0.0, abs=1e-6)
    assert law_growth(line, control, -1.05 * weakest) > 0.0 > law_growth(line, control, 0.0)
    # The same roots of a string of finite elements, and the first of them by name.
    free, grown = (
        as_case(POINT, driven_plant(RIG, control, FreeBit())),
        law_growth(line, control, 0),
    )
    rates = approximate_roots(free.system()).real / RIG.time_scale
    assert np.abs(rates / grown - 1.0).min() < 1e-2
    (first, *_) = [m.value for m in named_roots(free).roots if m.mode.kind == "torsional"]
    assert grown >= first.real - 1e-6


def test_a_string_under_a_drive_loses_its_damping_by_its_law(answering):
    """A bit that takes more than a stiff drive damps, and less than soft torque does."""
    line, laws = STRING.torsion, [drive_control(name, RIG) for name in ("stiff", "soft-torque")]
    stiff, soft = (min(m.slope for m in mode_slopes(line, law, 4)) for law in laws)
    assert stiff < soft
    taken = 0.5 * (stiff + soft)
    answering(-taken)
    found = vibration_map(POINT, SPEED, ROP, laws[1], threshold=True, **QUICK)
    against, held = found.threshold.growth
    np.testing.assert_allclose(against, law_growth(line, laws[0], -taken))
    np.testing.assert_allclose(held, law_growth(line, laws[1], -taken))
    assert (against > 0.0).all()
    assert (held < 0.0).all()


def test_a_string_of_sections_has_one_at_fewer_points(monkeypatch):
    """Its bit takes ten seconds to answer; here it takes so much damping at once."""
    taken = 0.5

    def answered(case, mode, swing, **options):
        none = np.zeros(0, complex)
        response = BitResponse(mode.root.imag, swing, -taken, 0.0, none, none, 1.0, 1.0, 0, 0, 1)
        return ModeAt(response, mode.with_response(-taken), 0.0)

    monkeypatch.setattr("drillctrl.studies.vibration_threshold.mode_at", answered)
    alone = replace(POINT, rig=replace(RIG, drive=None))
    case = as_case(alone)
    plane = make_plane(case, SPEED, ROP, None, None, None)
    found = torsional_field(plane, (30, 20), lambda x, y: (plane.case_at(x, y), (None,)))
    (growth,) = found.growth
    assert growth.shape == (7, 5)
    (mode,) = torsional_modes(case)
    wanted = mode.with_response(-taken).real / alone.rig.time_scale
    np.testing.assert_allclose(growth, wanted)
