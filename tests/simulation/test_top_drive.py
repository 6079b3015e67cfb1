"""A string under its top drive: waves travel, return and die as a long line says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.drilling.case import as_case
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.simulation.drive_control import law_controller
from drillctrl.simulation.report import simulation_summary
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.strings.drill_string import Damping, DrillString
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.drive_rules import (
    pi_control,
    soft_torque_control,
    stiff_control,
)
from drillctrl.strings.presets import string_preset
from drillctrl.strings.rig import string_rig
from drillctrl.strings.section import Material, Section
from tests.simulation.speed_loop import speed_loop

LENGTH, SPEED = 2500.0, math.sqrt(77e9 / 8000.0)
TRANSIT = LENGTH / SPEED
POLAR = math.pi / 32.0 * (0.127**4 - 0.108**4)
IMPEDANCE = POLAR * math.sqrt(77e9 * 8000.0)


def pipe(inertia=None):
    """A lossless pipe whose bit turns without friction or feed, so that it is a free end."""
    section = Section("pipe", "pipe", LENGTH, 0.127, 0.108, material=Material(8000.0, 200e9, 77e9))
    string = DrillString((section,), Damping(torsional=0.0, axial=0.0, retardation=0.0))
    drive = None if inertia is None else DriveMachine(inertia)
    rig = string_rig(
        string, drive=drive, bit_radius=0.1, blades=4, rock_strength=60e6,
        contact_strength=60e6, wearflat_length=1e-3, cutter_inclination=0.6,
        friction_coefficient=0.0, bit_geometry=1.0,
    )  # fmt: skip
    return RigPoint(rig, 10.0, 0.0)


def faster(where, controller=None, seconds=8.0):
    """Speed of the bit, rad/s, after the set point has risen by 1 rad/s at t = 0."""
    time = where.rig.time_scale
    scenario = Scenario(changes=(Change(0.0, omega0=11.0 * time),))
    run = simulate(
        where, controller, duration=seconds / time, scenario=scenario, rtol=1e-7, max_steps=400_000
    )
    assert run.status == "done"
    at = np.linspace(0.0, seconds, 40_001)
    return at, run.at(np.minimum(at / time, run.times[-1]), ("dtheta",)).dtheta / time


def mean(at, speed, low, high):
    inside = (at >= low * TRANSIT) & (at <= high * TRANSIT)
    return float(np.trapezoid(speed[inside], at[inside]) / np.ptp(at[inside]))


def test_a_wave_takes_the_transit_time():
    """Into its own impedance the drive sends one step; what the bit has turned says when."""
    where = pipe(0.2)
    controller = speed_loop(where, pi_control(DriveMachine(0.2), IMPEDANCE, 0.0))
    at, speed = faster(where, controller, 4.0 * TRANSIT)
    turned = float(np.trapezoid(speed, at))
    own = 0.2 / (2.0 * IMPEDANCE)
    assert 4.0 * TRANSIT - turned - own == pytest.approx(TRANSIT, rel=1e-3)


def test_the_first_period_is_four_transits():
    """Under a drive that nothing moves, by the largest harmonic of what the first mode does."""
    where, periods = pipe(5e7), 12
    time = where.rig.time_scale
    end = 4.0 * periods * TRANSIT
    run = simulate(
        where, duration=end / time, initial={"theta1": 0.02}, rtol=1e-7, max_steps=400_000
    )
    assert run.status == "done"
    at = np.linspace(0.0, end, 60_001)
    theta = run.at(np.minimum(at / time, run.times[-1]), ("theta1",)).theta1
    window = np.sin(math.pi * at / end) ** 2 * theta
    trial = np.linspace(0.99, 1.01, 401) / (4.0 * TRANSIT)
    sizes = [abs(np.exp(-2j * math.pi * f * at) @ window) for f in trial]
    assert 1.0 / trial[int(np.argmax(sizes))] == pytest.approx(4.0 * TRANSIT, rel=1e-3)


def test_an_imposed_step_is_refused_where_inertia_hangs_on_it():
    for change in (Change(1.0, omega0=5.0), Change(1.0, penetration_rate=0.1)):
        with pytest.raises(InputError, match="inertia"):
            simulate(pipe(), duration=2.0, scenario=Scenario(changes=(change,)))


@pytest.mark.parametrize("times", [4.0, 1.0])
def test_a_resistance_returns_the_part_that_its_impedance_says(times):
    """|r| = 0.6 for four times the pipe's impedance, nothing for the pipe's own."""
    where = pipe(0.2)
    control = pi_control(DriveMachine(0.2), times * IMPEDANCE, 0.0)
    at, speed = faster(where, speed_loop(where, control), 5.0 * TRANSIT)
    share = times / (times + 1.0)
    back = (times - 1.0) / (times + 1.0)
    assert mean(at, speed, 1.2, 2.8) == pytest.approx(2.0 * share, rel=1e-3)
    second = mean(at, speed, 3.2, 4.8)
    assert 1.0 - second / (2.0 * share) == pytest.approx(back, abs=1e-3)


def test_a_drive_of_large_inertia_is_an_imposed_speed():
    point, kick = OperatingPoint(5.0, 0.5, 14.0), {"dx": 0.5, "dtheta": -1.0}
    times = np.linspace(0.0, 20.0, 200)
    held = simulate(point, duration=20.0, initial=kick, rtol=1e-9).at(times)
    apart = []
    for ratio in (1e3, 1e4):
        plant = paper_plant(blocks=(TopDrive(inertia_ratio=ratio),))
        free = simulate(as_case(point, plant), duration=20.0, initial=kick, rtol=1e-9).at(times)
        apart.append(abs(free.theta - held.theta).max())
    assert apart[1] < 1e-2
    assert apart[0] / apart[1] == pytest.approx(10.0, rel=0.1)


def test_the_drive_stays_within_its_torque_and_is_sampled():
    where = RigPoint(string_preset("vertical-3000"), 12.0, 15.0 / 3600.0)
    rig = where.rig
    machine = DriveMachine(2900.0, torque_limit=30e3, delay=2e-3, lag=5e-3)
    control = stiff_control(machine, 340.0)
    controller = speed_loop(where, control, period=10e-3)
    scenario = Scenario(changes=(Change(0.5, omega0=20.0 * rig.time_scale),))
    run = simulate(where, controller, duration=3.0, scenario=scenario, rtol=1e-5)
    assert "torque is constant" not in simulation_summary(run)
    assert "torque is constant" in simulation_summary(simulate(where, duration=0.1))
    steady = run.steady_load[1] * rig.torsional_stiffness
    largest = abs(run.motion.drive).max() * rig.torsional_stiffness
    assert largest == pytest.approx(30e3 - steady, rel=1e-3)
    weak = stiff_control(DriveMachine(2900.0, torque_limit=0.5 * steady), 340.0)
    counting = DriveMachine(2900.0, encoder_counts=1000)
    for there, bad, name in (
        (where, weak, "torque limit"),
        (where, stiff_control(counting, 340.0), "encoder_counts"),
        (pipe(), control, "rig"),
        (where, soft_torque_control(machine, 340.0, 0.2, compensated=500.0), "compensated"),
    ):
        with pytest.raises(InputError, match=name):
            law_controller(there, bad)
