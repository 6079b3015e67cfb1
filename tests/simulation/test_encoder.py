"""An encoder at the top drive: what it counts, and that laws without samples refuse it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.drive_control import free_drive, law_controller, simulate_drive
from drillctrl.simulation.stepping import SteppedRun
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.drive_rules import stiff_control
from drillctrl.strings.drive_sampled import sampled_drive
from drillctrl.strings.files import load_rig
from drillctrl.strings.saving import save_rig
from tests.simulation.test_windup import free_string

MACHINE = DriveMachine(2900.0, torque_limit=20e3, delay=0.004)
PERIOD = 0.01


def counting(counts):
    where = free_string()
    machine = dataclasses.replace(MACHINE, encoder_counts=counts)
    return dataclasses.replace(where, rig=dataclasses.replace(where.rig, drive=machine))


def test_it_tells_whole_counts_and_what_was_counted_over_a_period():
    """Against the motion, read when the run is over: its angle on the drill floor in counts."""
    where = counting(1000)
    time = where.rig.time_scale
    case, around = free_drive(where)
    run = SteppedRun(
        case, ("dphi", "phi"), ("drive",), period=PERIOD / time, duration=0.5 / time,
        initial={"dphi": 0.3 * time}, rtol=1e-7, **around,
    )  # fmt: skip
    told, at = [], []
    while run.goes_on:
        at.append(run.time - MACHINE.delay / time)
        told.append(run.outputs())
        run.hold([0.0])
        run.advance()
    late = np.array(at)[2:]
    step, spin = math.tau / 1000, where.rotary_speed * time
    phi, before = (
        run.result().at(late - lag, ("phi",)).phi + spin * (late - lag)
        for lag in (0.0, PERIOD / time)
    )
    counts, past = np.floor(phi / step), np.floor(before / step)
    speed, angle = np.array(told)[2:].T
    np.testing.assert_allclose(angle, counts * step - spin * late, atol=1e-9)
    np.testing.assert_allclose(speed, (counts - past) * step * time / PERIOD - spin, atol=1e-9)
    assert np.unique(counts - past).size > 1


def test_a_fine_encoder_is_none_and_a_coarse_one_shakes_the_drive():
    law = sampled_drive(stiff_control(MACHINE, 302.0), period=PERIOD, limit=20e3)
    torques = []
    for counts in (None, 10_000_000, 500):
        where = counting(counts)
        time = where.rig.time_scale
        run = simulate_drive(where, law, duration=1.0 / time, initial={"dphi": 0.3 * time})
        torques.append(run.at(np.linspace(0.2, 1.0, 400) / time, ("drive",)).drive)
    smooth, fine, coarse = torques
    size = abs(smooth).max()
    # Half a period older.
    assert abs(fine - smooth).max() < 0.2 * size
    assert abs(coarse - smooth).max() > 2.0 * abs(fine - smooth).max()


def test_laws_without_samples_refuse_it(tmp_path):
    where = counting(4096)
    with pytest.raises(InputError, match="encoder_counts of the drive = 4096"):
        law_controller(where, stiff_control(where.rig.drive, 302.0))
    path = tmp_path / "rig.toml"
    save_rig(where.rig, path)
    assert "encoder_counts = 4096" in path.read_text()
    assert load_rig(path).drive == where.rig.drive
    with pytest.raises(InputError, match="encoder counts"):
        DriveMachine(2900.0, encoder_counts=0)
    signals = ("theta",), ("torque",)
    with pytest.raises(InputError, match="no top drive"):
        SteppedRun(OperatingPoint(10.0, 2.5, 14.0), *signals, period=0.1, duration=1.0, encoder=0.1)
