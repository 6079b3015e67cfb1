"""Friction of the string on the wall: elements with impulses, energy, rest, files."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drillctrl import (
    Damping,
    DrillString,
    InputError,
    Material,
    RigPoint,
    Scenario,
    Section,
    SteppedRun,
    Wall,
    as_case,
    check_rig,
    load_rig,
    paper_plant,
    save_rig,
    simulate,
    string_preset,
    string_rig,
)
from drillctrl.drilling.drive import TopDrive
from drillctrl.simulation.structure import structure_of
from drillctrl.strings.elements import elements
from drillctrl.strings.model import PipeString

LENGTH, SPEED, KICK = 2000.0, 2.0, 8.0
STEEL = Material(8000.0, 200e9, 77e9)
PIPE = Section("pipe", "pipe", LENGTH, 0.127, 0.108, material=STEEL)
RUBBED = Wall(0.2, side_force=60.0)
STICKY = dataclasses.replace(RUBBED, static_factor=0.4)


def string_with(wall):
    return DrillString((dataclasses.replace(PIPE, wall=wall),), Damping(0.1, 0.1, 2e-4))


def off_rock(wall, blocks=(), **resolution):
    """A string that hardly cuts, and its unit of time in seconds."""
    rig = string_rig(
        string_with(wall),
        rock_strength=1e6,
        contact_strength=0.0,
        bit_radius=0.1,
        wearflat_length=0.0,
        cutter_inclination=0.6,
        friction_coefficient=0.6,
        bit_geometry=1.0,
    )
    plant = paper_plant(string=PipeString(rig.string, **resolution), blocks=blocks)
    return as_case(RigPoint(rig, SPEED, 1e-5), plant), rig.time_scale


def swing(wall, duration=8.0, frequency=None, **options):
    """A swing in the first torsional mode, by KICK at the bit; and its unit of time."""
    case, unit = off_rock(wall, torsional_frequency=frequency)
    line = string_with(None).torsion
    mode = math.sqrt(2.0 / (LENGTH * line.stretches[0].mean().mass))
    start = Scenario(initial={"dtheta": KICK * unit, "dtheta1": KICK * unit / mode}, alone=True)
    return simulate(case, scenario=start, duration=duration / unit, rtol=1e-6, **options), unit


def swing_of_elements(times, size, slip, most=1.0):
    """Angle of the bit on elements, by an implicit solver, with friction made smooth.

    At rest it is ``most`` times what it is sliding.
    """
    chain = elements(string_with(RUBBED).torsion, size)
    count = chain.height.size - 1
    mass, damping, stiffness = (
        sum(np.diag(part, k) for part, k in ((own[:-1], 0), (tie[:-1], 1), (tie[:-1], -1)))
        for own, tie in zip(chain.diagonal, chain.beside, strict=True)
    )
    own = np.full(count, size)
    own[0] *= 0.5
    torque = RUBBED.friction_factor * RUBBED.side_force * 0.5 * PIPE.outer_diameter * own
    inverse, nothing = np.linalg.inv(mass), np.zeros((count, count))

    def rates(_, state):
        angle, rate = np.split(state, 2)
        turning = (rate + SPEED) / slip
        more = (most - 1.0) * np.exp(-((turning / 8.0) ** 2))
        friction = torque * (1.0 - np.tanh(turning) * (1.0 + more))
        return np.concatenate([rate, inverse @ (friction - damping @ rate - stiffness @ angle)])

    def slopes(_, state):
        turning = np.clip((state[count:] + SPEED) / slip, -60.0, 60.0)
        more = (most - 1.0) * np.exp(-((turning / 8.0) ** 2))
        falls = (1.0 + more) / np.cosh(turning) ** 2 - np.tanh(turning) * more * turning / 32.0
        falls *= torque / slip
        lower = inverse @ np.hstack([stiffness, damping + np.diag(falls)])
        return np.vstack([np.hstack([nothing, np.eye(count)]), -lower])

    first = KICK * np.cos(0.5 * np.pi * chain.height[:-1] / LENGTH)
    start = np.concatenate([np.zeros(count), first])
    options = {"method": "BDF", "jac": slopes, "rtol": 1e-5, "atol": 1e-6}
    return solve_ivp(rates, (0.0, times[-1]), start, t_eval=times, **options).y[0]


@pytest.fixture(scope="module")
def rubbed():
    return swing(RUBBED)


def test_a_swing_decays_as_that_of_elements_with_friction_made_smooth(rubbed):
    run, unit = rubbed
    times = np.arange(1.0, 6.0)
    theirs = swing_of_elements(times, 50.0, 2e-3)
    # What parts and elements leave open is a hundredth of the swing.
    np.testing.assert_allclose(run.at(times / unit).theta, theirs, atol=0.02)


@pytest.mark.long
def test_what_holds_more_at_rest_stands_longer_as_elements_do():
    run, unit = swing(STICKY, duration=1.2, frequency=40.0)
    times = np.array([0.6, 1.2])
    theirs = swing_of_elements(times, 100.0, 4e-3, most=2.0)
    mine = run.at(times / unit).theta
    np.testing.assert_allclose(mine, theirs, atol=0.004)
    plain = swing(RUBBED, duration=1.2)[0].at(times / unit).theta
    assert mine[1] > plain[1] + 0.05
    assert run.unsettled == 0


@pytest.mark.parametrize(("wall", "most"), [(RUBBED, 1.0), (STICKY, 2.0)])
def test_the_bit_s_own_part_breaks_away_at_its_torque_at_rest(wall, most):
    case, unit = off_rock(wall)
    start = Scenario("rest")
    run = simulate(case, scenario=start, duration=6.0 / unit, rtol=1e-6, max_step=1e-3 / unit)
    arrays = run.structure.arrays
    (freed,) = [event.time for event in run.events if event.name == "release"][:1]
    times = np.append(np.linspace(0.0, freed, 2001)[:-1], freed + 1e-6)
    motion = run.at(times, (*run.state_names, "ddtheta", "torque_on_bit"))
    step = np.searchsorted(run.history.real[:, 0], motion.times, side="right") - 1
    torques = run.history.real[step][:, 1 - len(arrays.side_torque) :].T
    moved = arrays.A[3] @ np.array([getattr(motion, name) for name in run.state_names])
    own = motion.ddtheta - moved - arrays.side_force[3, 1:] @ torques
    friction = own / arrays.E[3, 1] + arrays.top_torque - arrays.side_torque[1:].sum()
    friction = (friction - motion.torque_on_bit) / arrays.side_torque[0]
    assert most * 0.95 < friction[:-1].max() <= most * (1.0 + 1e-9)
    assert friction[-1] == pytest.approx(1.0)


def test_halving_the_steps_of_friction_changes_little():
    times = np.linspace(1.0, 7.9, 30) / swing(RUBBED)[1]
    runs = (swing(RUBBED, max_step=step)[0] for step in (np.inf, 0.01, 0.005))
    own, coarse, fine = (run.at(times).theta for run in runs)
    assert abs(coarse - fine).max() < 5e-4
    assert abs(own - fine).max() < 1e-3


def test_friction_takes_what_the_swing_loses(rubbed):
    run, unit = rubbed
    string = string_with(RUBBED)
    line = PipeString(string).resolved.torsion
    arrays = run.structure.arrays
    names = ["theta", *(n for n in run.state_names if n.startswith("theta") and n != "theta")]
    motion = run.on_steps(4, names=(*run.state_names, "ddtheta"))
    angles = np.array([getattr(motion, name) for name in names])
    rates = np.array([getattr(motion, f"d{name}") for name in names]) / unit
    mass, damping, stiffness = (m[:-1, :-1] for m in line.matrices)
    energy = 0.5 * (
        np.einsum("it,ij,jt->t", rates, mass, rates)
        + np.einsum("it,ij,jt->t", angles, stiffness, angles)
    )
    step = np.minimum(
        np.searchsorted(run.history.real[:, 0], motion.times, side="right") - 1, run.steps
    )
    parts, scale = len(arrays.side_torque) - 1, run.rig.torsional_stiffness
    torques = run.history.real[step][:, -parts:].T
    shares = arrays.side_rate[1:, [run.state_names.index(f"d{name}") for name in names]]
    power = scale * (torques * (shares @ rates)).sum(axis=0)
    # What the bit's own part takes is left of its acceleration.
    moved = arrays.A[3] @ np.array([getattr(motion, name) for name in run.state_names])
    own = motion.ddtheta - moved - arrays.side_force[3, 1:] @ torques
    power -= scale * own / arrays.E[3, 1] * rates[0]
    power -= np.einsum("it,ij,jt->t", rates, damping, rates)
    worked = np.trapezoid(power, motion.times * unit)
    assert energy[-1] < 0.1 * energy[0]
    assert energy[-1] - energy[0] == pytest.approx(worked, rel=2e-3)


@pytest.mark.parametrize(("share", "stands"), [(1.9, True), (2.1, False)])
def test_a_string_at_rest_holds_up_to_the_sum_of_friction(share, stands):
    case, unit = off_rock(RUBBED, (TopDrive(inertia_ratio=5.0),), torsional_frequency=3.0)
    torque = case.plant.string.string.wall_torque / case.rig.torsional_stiffness
    run = SteppedRun(
        case, outputs=("phi",), inputs=("drive",), period=0.5, duration=160.0, rtol=1e-5
    )
    while run.goes_on:
        # Without the torque that friction takes in steady drilling the string comes to rest; then
        # it is turned back, slowly.
        back = 1.0 + (share - 1.0) * min(max((run.time - 40.0) / 60.0, 0.0), 1.0)
        run.hold([-back * torque])
        run.advance()
    end = run.result().at([39.9, 159.9])
    rates = np.array([end.dphi, end.dtheta]) / unit + SPEED
    # The drive still swings on the uppermost part of the string.
    assert abs(rates[:, 0]).max() < 0.03
    if stands:
        assert abs(rates[0, 1]) < 1e-3
        assert rates[1, 1] == 0.0
    else:
        assert rates[:, 1].max() < -1.0


def test_while_all_slides_forward_nothing_is_added():
    start = Scenario(initial={"dtheta": 0.3})
    plain, rubbed = (
        simulate(off_rock(wall)[0], scenario=start, duration=1.0, rtol=1e-6)
        for wall in (None, RUBBED)
    )
    parts = len(rubbed.structure.arrays.side_torque) - 1
    np.testing.assert_array_equal(rubbed.history.real[:, -parts:], 0.0)
    np.testing.assert_allclose(rubbed.history.real[:, :-parts], plain.history.real, atol=1e-10)


def test_steady_drilling_twists_the_string_by_what_lies_below():
    case, _ = off_rock(RUBBED)
    string, structure = case.plant.string.string, structure_of(case)
    bit = structure.arrays.steady[1] * case.rig.torsional_stiffness
    stiffness = STEEL.shear * math.pi * (PIPE.outer_diameter**4 - PIPE.inner_diameter**4) / 32.0
    twist = LENGTH * (bit + 0.5 * string.wall_torque) / stiffness
    # Damping takes its part, 0.1 1/s of the inertia that turns.
    twist += 0.5 * 0.1 * SPEED * LENGTH**2 * STEEL.density / STEEL.shear
    assert structure.rest[0][2] == pytest.approx(twist, rel=1e-3)
    assert structure.arrays.top_torque * case.rig.torsional_stiffness == pytest.approx(
        bit + string.wall_torque
    )


@pytest.mark.parametrize("start", ["rest", "stick"])
def test_a_string_with_friction_sets_off(start):
    run = simulate(off_rock(RUBBED)[0], scenario=Scenario(start), duration=20.0, rtol=1e-5)
    assert run.status == "done"


def test_torques_follow_from_weight_and_hole():
    string = dataclasses.replace(
        string_with(Wall(0.25, inclination=math.radians(30.0))), mud_density=1200.0
    )
    assert string.wall_torque == pytest.approx(0.25 * 0.5 * string.submerged_weight * 0.0635)
    assert string_with(RUBBED).wall_torque == pytest.approx(0.2 * 60.0 * 0.0635 * LENGTH)


def test_a_rig_with_friction_is_written_and_read(tmp_path):
    rig = string_preset("vertical-3000")
    walls = Wall(0.2, inclination=0.5), STICKY
    sections = tuple(
        dataclasses.replace(section, wall=walls[i % 2])
        for i, section in enumerate(rig.string.sections)
    )
    rig = dataclasses.replace(rig, string=dataclasses.replace(rig.string, sections=sections))
    save_rig(rig, tmp_path / "rig.toml")
    again = load_rig(tmp_path / "rig.toml")
    assert again == rig
    assert check_rig(again).to_dict()["wall_torque"] == rig.string.wall_torque


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("friction_factor = 0.2", "inclination or side_force"),
        ('inclination = "20 deg"', "friction_factor"),
        ('friction_factor = 3.0\ninclination = "20 deg"', "friction_factor"),
        ('friction_factor = 0.3\nstatic_factor = 0.2\ninclination = "20 deg"', "static_factor"),
        ('static_factor = 0.2\ninclination = "20 deg"', "friction_factor"),
        ('friction_factor = 0.2\ninclination = "20 deg"\nside_force = "9 N/m"', "inclination"),
    ],
)
def test_friction_that_is_not_whole_is_refused(tmp_path, line, named):
    path = tmp_path / "rig.toml"
    save_rig(string_preset("vertical-3000"), path)
    path.write_text(path.read_text() + line + "\n")
    with pytest.raises(InputError, match=named):
        load_rig(path)


def test_a_run_goes_on_with_its_friction(rubbed):
    run, unit = rubbed
    times = np.linspace(4.1, 7.9, 20) / unit
    past = Scenario(swing(RUBBED, duration=4.0)[0].past())
    rest = simulate(off_rock(RUBBED)[0], scenario=past, duration=4.0 / unit, rtol=1e-6)
    after = rest.at(times - 4.0 / unit).theta
    np.testing.assert_allclose(after, run.at(times).theta, atol=1e-6)
