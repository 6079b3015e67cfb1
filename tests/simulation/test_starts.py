"""Several starts in one call: each begins as it says, and the worst is told."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.cli import main
from drillctrl.drilling.case import as_case
from drillctrl.drilling.motion import kicked_states, stuck_states
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import table1
from drillctrl.motion.response import turned_case
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.drive_control import law_controller
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import STOOD, Scenario
from drillctrl.simulation.starts import possible_starts, simulate_starts
from drillctrl.simulation.structure import structure_of
from drillctrl.strings.drive_rules import transfer_control
from drillctrl.strings.presets import string_preset

HARMLESS = OperatingPoint(14.0, 0.5, 14.0)


def at(rig, rpm, rop):
    return RigPoint(rig, rpm * 2.0 * math.pi / 60.0, rop / 3600.0)


def test_each_start_begins_as_it_says():
    found = simulate_starts(HARMLESS, duration=10.0, rtol=1e-6)
    begin = {run.start: run.simulation.at([0.0]) for run in found.runs}
    v0, omega0 = HARMLESS.penetration_rate, HARMLESS.omega0
    for name, feed, speed in (("small", 0.05, 0.1), ("kick", 0.5, 0.5), ("back", 0.5, -0.5)):
        assert begin[name].dx[0] == pytest.approx(feed * v0)
        assert begin[name].dtheta[0] == pytest.approx(speed * omega0)
    for name in ("rest", "stick"):
        assert begin[name].dx[0] == -v0
        assert begin[name].dtheta[0] == -omega0
    # The top end has gone on while the bit stood.
    assert begin["stick"].theta[0] == pytest.approx(-STOOD * omega0)
    assert begin["stick"].x[0] == pytest.approx(-STOOD * v0)


def test_a_string_is_wound_up_without_shaking():
    """The state moves on as b, so A (a + b t) + E (load − steady) is b at both ends."""
    arrays = structure_of(as_case(at(string_preset("paper-string"), 120.0, 20.0))).arrays
    first, last = stuck_states(arrays, 2.0)
    rate = 0.5 * (last - first)
    for state in (first, last):
        missing = rate - arrays.A @ state
        # The rock bears what the bit lacks, and nothing else is missing.
        missing -= arrays.E @ np.linalg.solve(arrays.E[[1, 3]], missing[[1, 3]])
        np.testing.assert_allclose(missing, 0.0, atol=1e-9 * abs(arrays.A @ state).max())
    np.testing.assert_allclose(last[[1, 3]], rate[[0, 2]])
    # Without inertia the uppermost pipe would bear what the lumped spring does.
    assert rate[2] == pytest.approx(-at(table1(), 120.0, 20.0).operating_point().omega0, rel=0.01)


def test_from_rest_the_turning_of_the_top_goes_down_the_string():
    where = at(string_preset("paper-string"), 120.0, 20.0)
    unit = where.rig.time_scale
    run = simulate(where, scenario=Scenario("rest"), duration=0.3 / unit, rtol=1e-6)
    still, _ = run.structure.rest
    top = -np.array([0.0, run.structure.penetration_rate, 0.0, run.structure.omega0])
    arrays = run.structure.arrays
    # Nothing accelerates before: no strain, no load.
    rates = arrays.A @ still - arrays.E @ arrays.steady + arrays.T @ top
    assert abs(rates[1::2]).max() < 1e-8 * abs(arrays.A @ still).max()
    found = run.case.plant.string.resolved.torsion
    names = ["dtheta", *(f"dtheta{i + 1}" for i in range(found.shapes.shape[1] - 2))]
    motion = run.at([0.15 / unit], names)
    moved = np.array([getattr(motion, name)[0] for name in names]) / unit
    turning = where.rotary_speed + found.shapes[:, :-1] @ moved
    depth = found.height[-1] - found.height
    front = 0.15 * math.sqrt(77e9 / 8000.0)
    behind = (depth > 50.0) & (depth < front - 150.0)
    ahead = (depth > front + 150.0) & (depth < 950.0)
    np.testing.assert_allclose(turning[behind], where.rotary_speed, rtol=0.03)
    np.testing.assert_allclose(turning[ahead], 0.0, atol=0.03 * where.rotary_speed)
    assert abs(1.0 + run.at([0.3 / unit]).dtheta[0] / run.structure.omega0) < 0.01


def test_the_worst_is_told():
    calm = simulate_starts(HARMLESS, starts=("small", "kick"), duration=30.0, rtol=1e-6)
    assert calm.calm
    swings = [run.figures.swing for run in calm.runs]
    assert calm.worst.figures.swing == max(swings)
    found = simulate_starts(at(table1(), 120.0, 20.0), duration=150.0, rtol=1e-6)
    outcomes = {run.start: str(run.figures.outcome) for run in found.runs}
    assert outcomes["small"] == "orbit"
    assert outcomes["stick"] == "turns-back"
    assert found.worst.start == "stick"
    assert not found.calm
    assert found.to_dict()["worst"] == {"start": "stick", "outcome": "turns-back"}


def test_a_drive_that_is_free_to_turn_has_no_rest():
    where = at(string_preset("vertical-3000"), 120.0, 20.0)
    assert possible_starts(where) == ("small", "kick", "back", "stick")
    with pytest.raises(InputError, match="start = rest"):
        simulate_starts(where, starts=("rest",), duration=1.0)
    for names in ((), ("kick", "kick"), ("moon",)):
        with pytest.raises(InputError, match="start"):
            simulate_starts(HARMLESS, starts=names, duration=1.0)


def test_nor_has_one_under_a_law_whose_states_are_no_outputs():
    rig = string_preset("vertical-3000")
    own = transfer_control(rig.drive, ([1e3, 1e3], [1.0, 4.0, 6.0, 4.0, 1.0]))
    case, _ = law_controller(at(rig, 60.0, 10.0), own)
    assert len(case.plant.state_names) > len(case.plant.output_names)
    assert "rest" not in possible_starts(case)


def test_the_command_says_so(capsys, tmp_path):
    rig = ("--rig", "table1", "--rop", "20 m/h", "--duration", "21.1 s", "--rtol", "1e-6")
    arguments = ["simulate", *rig, "--speed", "120 rpm", "--starts", "small,stick"]
    out = ("--out", str(tmp_path / "worst.csv"), "--every", "0.2 s")
    with pytest.raises(SystemExit) as stop:
        main([*arguments, "--json", "--require-stable", *out])
    assert stop.value.code == 3
    fields = json.loads(capsys.readouterr().out)
    assert fields["outcome"] == "turns-back"
    assert fields["worst"] == {"start": "stick", "outcome": "turns-back"}
    assert [run["start"] for run in fields["starts"]] == ["small", "stick"]
    rows = (tmp_path / "worst.csv").read_text().splitlines()
    times = [float(row.split(",")[0]) for row in rows[2:]]
    steps = np.diff(times)
    np.testing.assert_allclose(steps, 0.2, rtol=1e-9)
    with pytest.raises(SystemExit) as stop:
        main([*arguments, "--require-stable"])
    assert stop.value.code == 3
    told = capsys.readouterr().out
    assert told.startswith("Worst: stick, the bit turns backwards")
    with pytest.raises(SystemExit) as stop:
        main(["simulate", *rig, "--speed", "150 rpm", "--starts", "small", "--require-stable"])
    assert stop.value.code == 0


@pytest.mark.parametrize("feedback", [{"measurement_delay": 0.2}, {}, {"measurement_delay": 1.5}])
def test_feedback_that_looks_back_into_the_stick(feedback):
    """Times rise, and what is fed back late is what the bit did then."""
    point = OperatingPoint(2.95, 0.37, 14.14)
    controller = Controller("case1", [-0.3], [0.4], **feedback)
    run = simulate(point, controller, duration=4.0, scenario=Scenario(start="stick"), rtol=1e-9)
    assert (np.diff(run.times) > 0.0).all()
    late = feedback.get("measurement_delay", 0.0)
    at = np.linspace(0.01, 3.9, 50)

    def angle(times):
        # Before t = 0 the bit stands still, against the frame of steady drilling.
        found = run.at(np.maximum(times, 0.0), ("theta",)).theta
        since = np.maximum(times, -STOOD)
        stood = np.where(times < 0.0, -point.omega0 * since, 0.0)
        return found + stood

    wanted = -0.3 * angle(at - late) + 0.4 * angle(at - late - point.delay)
    np.testing.assert_allclose(run.at(at, ("torque",)).torque, wanted, atol=1e-6)


@pytest.mark.parametrize("name", ["paper-string", "vertical-3000"])
def test_a_kick_moves_a_string_with_its_bit(name):
    """A bit alone gives its speed away at once; kicked with its string it swings back."""
    case = as_case(at(string_preset(name), 120.0, 10.0))
    structure = structure_of(case)
    kick = structure.kicked(0.3 * structure.penetration_rate, 0.5 * structure.omega0)
    assert kick[[1, 3]] == pytest.approx([0.3 * structure.penetration_rate, 0.5 * structure.omega0])
    place = structure.state_names.index
    assert not kick[
        [place(n) for n in structure.state_names if f"d{n}" in structure.state_names]
    ].any()
    if name == "vertical-3000":
        assert kick[place("dphi")] == 0.0
    swings = []
    for scenario in (
        Scenario(kick=(0.0, 0.5)),
        Scenario(initial={"dtheta": 0.5 * structure.omega0}, alone=True),
    ):
        run = simulate(case, duration=5.0, scenario=scenario, rtol=1e-5)
        later = run.at(np.linspace(1.0, 5.0, 200)).dtheta / structure.omega0
        swings.append(float(np.abs(later).max()))
    assert 0.25 < swings[0] < 0.5
    assert swings[1] < 0.02


def test_a_speed_of_the_bit_is_a_kick_of_its_string():
    """By name or as a share it is the same; filters and a hook stay as they are."""
    where = at(string_preset("vertical-3000"), 120.0, 10.0)
    case, _ = law_controller(where, transfer_control(where.rig.drive, ([1e3, 1e3], [1.0, 4.0])))
    structure = structure_of(case)
    feed, speed = 0.3 * structure.penetration_rate, 0.2 * structure.omega0
    runs = [
        simulate(case, duration=1e-3, scenario=scenario)
        for scenario in (
            Scenario(initial={"dx": feed, "dtheta": speed}),
            Scenario(kick=(0.3, 0.2)),
            Scenario(initial={"dx": feed}, kick=(0.0, 0.2)),
        )
    ]
    states = [run.at([0.0], structure.state_names) for run in runs]
    first, *others = [
        np.array([getattr(state, n)[0] for n in structure.state_names]) for state in states
    ]
    for other in others:
        np.testing.assert_allclose(other, first, atol=1e-9 * abs(first).max())
    moves = {n for n, value in zip(structure.state_names, first, strict=True) if value}
    assert {"dx", "dtheta", "dx1", "dtheta1"} < moves
    assert all(name.startswith(("dx", "dtheta")) for name in moves)


def test_a_bit_whose_turning_is_imposed_takes_its_string_along_the_axis():
    case = turned_case(at(string_preset("paper-string"), 120.0, 10.0), 3.0)
    free = structure_of(as_case(at(string_preset("paper-string"), 120.0, 10.0)))
    led, known = structure_of(case), free.kicked(1.0, 0.0)
    kick = led.kicked(1.0, 0.5)
    assert kick[3] == 0.5
    for i, name in enumerate(led.state_names):
        if name != "dtheta":
            assert kick[i] == pytest.approx(known[free.state_names.index(name)], rel=1e-6)


def test_a_string_that_cannot_follow_its_bit_is_not_kicked():
    """Pushed by the bit and held by nothing it runs off, faster and faster."""
    names = ("x", "dx", "theta", "dtheta", "x1", "dx1")
    pushed = np.zeros((6, 6))
    pushed[[0, 2, 4], [1, 3, 5]] = 1.0
    pushed[5, 0] = 4.0
    load = np.zeros((6, 2))
    load[[1, 3], [0, 1]] = -1.0
    arrays = SimpleNamespace(A=pushed, E=load)
    with pytest.raises(InputError, match=r"kick = 0\.2: must be 0 where"):
        kicked_states(arrays, names, 0.2, 0.0)
    np.testing.assert_array_equal(kicked_states(arrays, names, 0.0, 0.3), [0, 0, 0, 0.3, 0, 0])
    held = pushed.copy()
    held[5, 4] = -4.0
    arrays = SimpleNamespace(A=held, E=load)
    np.testing.assert_allclose(kicked_states(arrays, names, 0.2, 0.0), [0, 0.2, 0, 0, 0, 0.2])
