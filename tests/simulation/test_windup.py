"""A drive at its torque limit: its integral gives way, and it recovers without lost turns."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drillctrl.base.errors import InputError
from drillctrl.drilling.case import as_case
from drillctrl.drilling.point import RigPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.drive_control import law_controller
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.simulation.structure import structure_of
from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.drive_rules import soft_torque_control, stiff_control, z_torque_control
from drillctrl.strings.presets import string_preset
from drillctrl.strings.rig import string_rig
from drillctrl.strings.section import Section

LIMIT = 20e3
MACHINE = DriveMachine(2900.0, torque_limit=LIMIT)


def free_string():
    """A string whose bit turns without friction or feed."""
    section = Section("pipe", "pipe", 800.0, 0.127, 0.108)
    rig = string_rig(
        DrillString((section,)), drive=DriveMachine(2900.0), bit_radius=0.1, blades=4,
        rock_strength=60e6, contact_strength=60e6, wearflat_length=1e-3,
        cutter_inclination=0.6, friction_coefficient=0.0, bit_geometry=1.0,
    )  # fmt: skip
    return RigPoint(rig, 10.0, 0.0)


def test_the_integral_gives_way_as_its_equations_say():
    """Against the string's matrices and a law that is written here, in SI, by another method."""
    where = free_string()
    control = stiff_control(MACHINE, 302.0)
    proportional, integral = 50.0 * 302.0, 5.0 * 2900.0
    tracking = proportional / integral
    case, controller = law_controller(where, control)
    time, unit = where.rig.time_scale, where.rig.torsional_stiffness
    start, seconds = -4.0, np.linspace(0.05, 1.5, 60)
    run = simulate(case, controller, duration=1.5 / time, initial={"dphi": start * time}, rtol=1e-9)
    assert run.status == "done"
    assert run.phases("saturated")

    plain = structure_of(as_case(where))
    a, b = plain.arrays.A, plain.arrays.B[:, plain.input_names.index("drive")]
    speed = plain.state_names.index("dphi")

    def rates(_, y):
        turning = y[speed] / time
        wanted = y[-1] - proportional * turning
        given = min(max(wanted, -LIMIT), LIMIT)
        own = -integral * turning - (wanted - given) / tracking
        return [*(a @ y[:-1] + b * given / unit), own * time]

    first = np.zeros(len(a) + 1)
    first[speed] = start * time
    found = solve_ivp(
        rates, (0.0, 1.5 / time), first, "RK45", seconds / time, rtol=1e-9, atol=1e-12,
        max_step=0.02,
    )  # fmt: skip
    ours = run.at(seconds / time, ("dphi",)).dphi
    np.testing.assert_allclose(ours, found.y[speed], atol=2e-6 * abs(start) * time)


def over(control, **options):
    """How far the top runs beyond a set point that rises by 8 rad/s, rad/s; the run."""
    where = RigPoint(string_preset("vertical-3000"), 12.0, 15.0 / 3600.0)
    case, controller = law_controller(where, control, **options)
    time = where.rig.time_scale
    scenario = Scenario(changes=(Change(0.5, omega0=20.0 * time),))
    run = simulate(case, controller, duration=8.0 / time, scenario=scenario, rtol=1e-5)
    assert run.status == "done"
    motion = run.at(np.linspace(0.0, run.times[-1], 1001), ("dphi", "drive"))
    spare = (LIMIT * 1.5 - run.steady_load[1] * where.rig.torsional_stiffness) / (
        where.rig.torsional_stiffness
    )
    assert abs(motion.drive).max() <= spare * (1.0 + 1e-9)
    return float(motion.dphi.max()) / time - 8.0, run


@pytest.mark.parametrize("period", [None, 0.01])
def test_a_step_against_the_limit_is_recovered_from(period):
    machine = DriveMachine(2900.0, torque_limit=1.5 * LIMIT, delay=2e-3, lag=5e-3)
    control = stiff_control(machine, 340.0)
    kept, _ = over(control, period=period)
    wound, run = over(control, period=period, tracking=math.inf)
    assert kept < 0.7
    assert wound > 3.0 * kept
    if period is None:
        assert run.phases("saturated")


def test_a_law_within_its_limit_is_as_it_was():
    machine = DriveMachine(2900.0, torque_limit=60e3, lag=5e-3)
    control = soft_torque_control(machine, 340.0, 0.19)
    where = RigPoint(string_preset("vertical-3000"), 12.0, 15.0 / 3600.0)
    ends = []
    for tracking in (None, math.inf):
        case, controller = law_controller(where, control, tracking=tracking)
        run = simulate(case, controller, duration=3.0, initial={"dtheta": -0.5}, rtol=1e-6)
        assert not run.phases("saturated")
        ends.append(run.at([3.0]).dtheta[0])
    assert ends[0] == ends[1]


def test_z_torque_gives_way_too_and_bad_times_are_named():
    where = free_string()
    _, controller = law_controller(where, z_torque_control(MACHINE, 302.0))
    assert controller.back_calculation["law_integral"] > 0.0
    with pytest.raises(InputError, match="tracking"):
        law_controller(where, stiff_control(MACHINE, 302.0), tracking=0.0)
    with pytest.raises(InputError, match="back_calculation"):
        Controller("p", [1.0], back_calculation={"theta": -1.0})
    odd = Controller("p", [1.0], limit=1.0, back_calculation={"nothing": 1.0})
    with pytest.raises(InputError, match="nothing"):
        simulate(where, odd, duration=1.0)
