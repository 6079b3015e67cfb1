"""Charts of real strings, against counts on the exact string and on its finite elements."""

import dataclasses
import json
import math
import re

import numpy as np
import pytest

from drillctrl import (
    Damping,
    DriveMachine,
    InputError,
    Rig,
    RigPoint,
    as_case,
    chart,
    cli,
    count_right_of,
    driven_plant,
    exact_loop,
    rule_control,
    steady_state,
    string_preset,
    string_rig,
)
from drillctrl.strings.changed import changed_case, changed_rig

BIT = (
    *("rock_strength", "contact_strength", "bit_radius", "wearflat_length", "blades"),
    *("cutter_inclination", "friction_coefficient", "bit_geometry"),
)
POINT = (120 * math.pi / 30, 10 / 3600)
SPEED, RATE = ("speed", 60, 180), ("rop", 5, 40)


def paper():
    return as_case(RigPoint(string_preset("paper-string"), *POINT))


def turned(delay=0.0):
    rig = string_preset("vertical-3000")
    machine = DriveMachine(2900.0, delay=delay, lag=0.005 if delay else 0.0)
    control = rule_control("soft-torque", machine, rig.string)
    return as_case(RigPoint(rig, *POINT), driven_plant(rig, control))


def said(drawn, position, at):
    """Return how many roots the nearest line says are right of the axis, and where it is."""
    places = np.array([line.position for line in drawn.lines])
    line = drawn.lines[int(np.argmin(np.abs(places - position)))]
    gap = np.abs(line.at - at).min(initial=np.inf)
    return line.position, gap, int(line.counts[np.searchsorted(line.at, at)])


@pytest.mark.long(but=1)
@pytest.mark.parametrize("case", [paper(), turned(), turned(0.02)])
def test_counts_are_those_of_the_exact_characteristic_function(case):
    """Another function and another contour; the drive's delay is in it."""
    drawn = chart(case, SPEED, RATE)
    assert drawn.method == "receptance"
    assert all(region.confirmed for region in drawn.regions[:12])
    rng = np.random.default_rng(3)
    for x, y in zip(rng.uniform(60, 180, 4), rng.uniform(5, 40, 4), strict=True):
        position, _, count = said(drawn, x, y)
        point = RigPoint(case.rig, position * math.pi / 30, y / 3600)
        loop = exact_loop(as_case(point, case.plant))
        assert loop.count_right_of(0.0, 300.0) == count, (position, y)


@pytest.mark.long
def test_stable_places_are_stable_and_others_are_not():
    drawn = chart(paper(), SPEED, RATE)
    rng = np.random.default_rng(1)
    for x, y in zip(rng.uniform(60, 180, 40), rng.uniform(5, 40, 40), strict=True):
        position, _, count = said(drawn, x, y)
        assert drawn.unstable_roots(position, y) == count


@pytest.mark.parametrize("name", ["p", "case2"])
def test_feedback_at_the_bit_counts_as_in_the_reduced_plant(name):
    gains = {"p": ([-1.5], None), "case2": ([-3.0, -1.0], [-0.4, -0.2])}[name]
    drawn = chart(paper(), ("speed", 100, 180), ("rop", 5, 20), name, *gains)
    assert drawn.method == "receptance"
    rng = np.random.default_rng(5)
    for x, y in zip(rng.uniform(100, 180, 8), rng.uniform(5, 20, 8), strict=True):
        position, gap, count = said(drawn, x, y)
        # The reduced plant is a few thousandths off: no place near a boundary tells.
        if gap > 0.5:
            assert count_right_of(drawn.plane.system(position, y), 0.0).count == count


def test_gains_as_axes():
    drawn = chart(paper(), ("K1_1", -2.0, 0.0), ("K1_2", -3.0, 0.0), "pd")
    for x, y in ((-1.5, -0.4), (-0.3, -2.5)):
        position, _, count = said(drawn, x, y)
        assert count_right_of(drawn.plane.system(position, y), 0.0).count == count


@pytest.mark.long
def test_weight_and_rate_show_the_same_boundary():
    case = paper()
    by_rate = chart(case, SPEED, RATE)
    by_weight = chart(case, SPEED, ("wob", 15.0, 80.0))
    # Lines at the same speeds: those of the first, even grid.
    lines = {line.position: line for line in by_weight.lines}
    compared = 0
    for line in by_rate.lines:
        if line.position not in lines:
            continue
        for at in line.at:
            weight = steady_state(
                RigPoint(case.rig, line.position * math.pi / 30, at / 3600)
            ).weight_on_bit
            if 15e3 < weight < 80e3:
                assert np.abs(lines[line.position].at - weight / 1e3).min() < 1e-6
                compared += 1
    assert compared > 20


@pytest.mark.long
def test_depth_and_speed(monkeypatch):
    """Along the speed there is no closed form: counts, and Newton's method at the edge."""
    # A string a line, each with its own finite elements.
    monkeypatch.setattr("drillctrl.charts.chart._STRINGS", 5)
    drawn = chart(turned(), ("depth", 2000, 2200), ("speed", 120, 180), tolerance=5e-2)
    assert drawn.method == "counting"
    line = drawn.lines[len(drawn.lines) // 2]
    rig = changed_rig(drawn.plane.rig_point.rig, depth=line.position)
    assert rig.string.length == pytest.approx(line.position)
    for speed in (130.0, 150.0, 170.0):
        point = RigPoint(rig, speed * math.pi / 30, POINT[1])
        loop = exact_loop(changed_case(drawn.plane.case, point))
        assert loop.count_right_of(0.0, 300.0) == int(line.counts[np.searchsorted(line.at, speed)])


@pytest.mark.long
def test_mud_bears_on_weight_alone():
    drawn = chart(paper(), ("depth", 1000, 1400), ("mud", 1000, 2000), tolerance=1e-2)
    assert all(not line.at.size for line in drawn.lines)
    light, heavy = (changed_rig(string_preset("paper-string"), mud=m) for m in (1000.0, 2000.0))
    assert heavy.submerged_weight / light.submerged_weight == pytest.approx(6.0 / 7.0)
    assert heavy.torsional_stiffness == light.torsional_stiffness


def test_pipe_comes_at_the_top():
    rig = string_preset("vertical-3000")
    deeper = changed_rig(rig, depth=rig.string.length + 100.0).string
    assert deeper.length == pytest.approx(rig.string.length + 100.0)
    assert deeper.sections[-2:] == rig.string.sections[-2:]
    per_metre = (deeper.mass - rig.string.mass) / 100.0
    assert per_metre == pytest.approx(rig.string.sections[0].mass_per_metre, rel=1e-3)
    with pytest.raises(InputError, match=r"depth = 100.*between|in \["):
        changed_rig(rig, depth=100.0)


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main(list(arguments))
    caught = capsys.readouterr()
    return stop.value.code, caught.out, caught.err


@pytest.mark.long
def test_command_line(capsys):
    axes = ("--x", "speed=60:180 rpm", "--y", "rop=5:40 m/h")
    code, out, _ = run(
        capsys, "chart", "--rig", "vertical-3000", *axes, "--structure", "soft-torque", "--json"
    )
    fields = json.loads(out)
    assert code == 0
    assert fields["structure"] == "soft-torque"
    assert fields["method"] == "receptance"
    assert 0.0 < fields["stable_area"] < 120 * 35


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("vertical-3000", "speed=60:180 rpm", "rop=5:40 m/h"), "free to turn"),
        (("paper-string", "depth=100:4000 m", "rop=5:40 m/h"), r"lower limit, m\) = 100"),
        (("paper-string", "mud=1000:4000 kg/m3", "rop=5:40 m/h"), r"upper limit, kg/m³\) = 4000"),
        (("table1", "depth=1000:4000 m", "rop=5:40 m/h"), "a string of sections"),
    ],
)
def test_bad_axes(capsys, arguments, message):
    rig, x, y = arguments
    speed = () if x.startswith("speed") else ("--speed", "120 rpm")
    free = ("--structure", "constant-torque") if rig == "vertical-3000" else ()
    code, out, err = run(capsys, "chart", "--rig", rig, *speed, "--x", x, "--y", y, *free)
    assert code == 2
    assert not out
    assert len(err.strip().splitlines()) == 1
    assert re.search(message, err), err


def test_undamped_strings_are_refused():
    rig = string_preset("paper-string")
    bare = string_rig(
        dataclasses.replace(rig.string, damping=Damping(0.0, 0.0, 0.0)),
        **{f.name: getattr(rig, f.name) for f in dataclasses.fields(Rig) if f.name in BIT},
    )
    with pytest.raises(InputError, match="damping of the string = none"):
        chart(as_case(RigPoint(bare, *POINT)), SPEED, RATE)
