"""Results in rig units, and the rock face, against the equations in SI and the depth of cut."""

from __future__ import annotations

import numpy as np
import pytest

from drillctrl import RigPoint, steady_state, table1
from drillctrl.base.errors import InputError
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.export import export_motion
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Scenario

POINT = OperatingPoint(10.0, 2.5, 14.0)
BOUNCING = OperatingPoint(4.0, 4.0, 30.0)
RIG = table1()
RIG_POINT = RigPoint(RIG, 10.0 / RIG.time_scale, 2.5 * 10.0 * RIG.axial_scale / RIG.time_scale)


@pytest.fixture(scope="module")
def on_a_rig():
    controller = Controller("p", [-0.3])
    return simulate(RIG_POINT, controller, duration=60.0, initial={"dtheta": -4.0}, rtol=1e-9)


def test_newtons_law_holds_in_si(on_a_rig):
    # Away from the ends of steps, where the interpolant's accelerations jump a little.
    times = np.linspace(0.3, 59.0, 4001) * RIG.time_scale
    h = 1e-4 * RIG.time_scale
    before, now, after = (on_a_rig.in_rig_units(times + d) for d in (-h, 0.0, h))
    steady = steady_state(RIG_POINT)
    moving = ~(before.stuck | after.stuck | before.held | after.held)
    smooth = moving & (before.contact == after.contact)
    assert smooth.sum() > 3000
    ax = (after.penetration_rate - before.penetration_rate) / (2.0 * h)
    rate = now.penetration_rate - RIG_POINT.penetration_rate
    force = (
        steady.weight_on_bit
        - now.weight_on_bit
        + now.axial_force
        - RIG.axial_stiffness * now.axial_displacement
        - RIG.axial_damping * rate
    )
    np.testing.assert_allclose((RIG.mass * ax)[smooth], force[smooth], atol=2e-5 * abs(force).max())
    turning = (after.bit_speed - before.bit_speed) / (2.0 * h)
    torque = (
        steady.torque_on_bit
        - now.torque_on_bit
        + now.control_torque
        - RIG.torsional_stiffness * now.angular_displacement
        - RIG.torsional_damping * (now.bit_speed - RIG_POINT.rotary_speed)
    )
    np.testing.assert_allclose(
        (RIG.inertia * turning)[smooth], torque[smooth], atol=2e-5 * abs(torque).max()
    )


def test_steady_drilling_has_the_loads_of_the_rig():
    motion = simulate(RIG_POINT, duration=1.0).in_rig_units()
    steady = steady_state(RIG_POINT)
    np.testing.assert_allclose(motion.weight_on_bit, steady.weight_on_bit, rtol=1e-9)
    np.testing.assert_allclose(motion.torque_on_bit, steady.torque_on_bit, rtol=1e-9)
    np.testing.assert_allclose(motion.delay, steady.delay, rtol=1e-9)
    np.testing.assert_allclose(motion.depth_of_cut, steady.depth_of_cut, rtol=1e-9)
    np.testing.assert_allclose(motion.bit_speed, RIG_POINT.rotary_speed, rtol=1e-12)


def test_cut_power_is_that_of_the_rock(on_a_rig):
    # ε a² d/2 is the torque of the cutters, ε a ζ d their force (Eq. 3): one depth for both.
    motion = on_a_rig.in_rig_units()
    cutting = motion.contact & ~motion.stuck & ~motion.held & (motion.penetration_rate > 0.0)
    flat = RIG.contact_strength * RIG.bit_radius * RIG.wearflat_length
    depth = (motion.weight_on_bit - flat) / (
        RIG.rock_strength * RIG.bit_radius * RIG.cutter_inclination
    )
    np.testing.assert_allclose(depth[cutting], motion.depth_of_cut[cutting], rtol=1e-9)


def test_files_of_a_rig_state_their_units(on_a_rig, tmp_path):
    export_motion(on_a_rig, tmp_path / "motion.csv")
    lines = (tmp_path / "motion.csv").read_text().splitlines()
    assert "weight_on_bit in N" in lines[0]
    names = lines[1].split(",")
    rows = np.genfromtxt(lines[2:], delimiter=",")[:, : names.index("contact")]
    times = rows[:, names.index("times")]
    assert times[-1] == pytest.approx(60.0 * RIG.time_scale)
    with pytest.raises(InputError, match="RigPoint"):
        simulate(POINT, duration=1.0).in_rig_units()


@pytest.mark.long(but=1)
@pytest.mark.parametrize("cutting", ["multiple", "single"])
@pytest.mark.parametrize("start", ["t = 0", "past"])
def test_the_rock_face_is_what_is_cut(cutting, start):
    options = {"cutting": cutting, "rtol": 1e-10}
    run = simulate(BOUNCING, duration=12.0, initial={"dx": 1.0, "dtheta": 1.0}, **options)
    if start == "past":
        run = simulate(BOUNCING, duration=4.0, scenario=Scenario(start=run.past(8.0)), **options)
    lost = {e.name for e in run.events} & {"loss", "return"}
    assert lost == {"loss", "return"}
    for time in np.linspace(0.01, run.duration, 41):
        face = run.rock_face(time)
        now = run.at([time])
        if cutting == "single" or now.contact[0]:
            ahead = BOUNCING.blades * face.height[0]
            assert ahead == pytest.approx(float(now.depth[0]), abs=1e-7)
        assert (face.passes >= 1).all()
        # One pitch ahead is the groove in which the next blade is now; a bit that stands
        # has cut a wall there.
        if now.contact[0] and not now.stuck[0]:
            assert face.height[-1] == pytest.approx(0.0, abs=1e-7)
            assert face.passes[-1] == 1


def test_in_steady_drilling_the_face_is_a_screw():
    face = simulate(POINT, duration=2.0).rock_face(1.7, count=5)
    np.testing.assert_allclose(face.height, 2.5 * (2.0 * np.pi / 4.0 - face.angle), atol=1e-9)


def test_deepest_of_all_passes_is_never_above_the_last():
    kick = {"dx": 1.0, "dtheta": 1.0}
    run = simulate(BOUNCING, duration=2.4, initial=kick, cutting="multiple")
    face = run.rock_face(2.4)
    assert (face.passes > 1).any()
    single = simulate(BOUNCING, duration=2.4, initial=kick, cutting="single").rock_face(2.4)
    assert (face.height <= single.height + 1e-6).all()
