"""What drives do to the modes of a string, against computed tables."""

import dataclasses

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.strings.drill_string import Damping
from drillctrl.strings.presets import paper_string
from drillctrl.strings.speed_control import (
    SpeedControl,
    critical_slopes,
    soft_torque_control,
    stiff_control,
)

LINE = dataclasses.replace(paper_string().string, damping=Damping(0.0, 0.0, 0.0)).torsion
PIPE = LINE.wave_impedance
FIRST = 0.447990


def test_impedance_of_the_pipe_and_reflection_at_the_tuned_frequency():
    assert pytest.approx(302.376, abs=5e-4) == PIPE
    s = 2j * np.pi * FIRST
    for times, returned in ((4.0, 0.600), (2.0, 1 / 3), (50.0, 0.961)):
        control = soft_torque_control(2900.0, PIPE, FIRST, times)
        assert abs(control.reflection(s, PIPE)) == pytest.approx(returned, abs=5e-4)


def test_slopes_at_which_modes_grow():
    found = critical_slopes(LINE, stiff_control(2900.0, PIPE), 7.5)
    assert [t.slope for t in found] == pytest.approx([9.08, 9.92, 6.74, 3.18, 0.88, 0.12], abs=6e-3)
    assert [t.frequency for t in found[:2]] == pytest.approx([0.449, 1.69], abs=5e-3)
    found = critical_slopes(LINE, soft_torque_control(2900.0, PIPE, FIRST), 7.5)
    assert [t.slope for t in found] == pytest.approx(
        [41.7, 112.5, 57.3, 1.056, 0.59, 0.26, 0.07, 0.01], abs=6e-2
    )
    assert [t.frequency for t in found[:3]] == pytest.approx([0.408, 0.458, 0.485], abs=6e-4)


def test_an_imposed_speed_is_a_drive_without_bounds():
    heavy = critical_slopes(LINE, SpeedControl(1e8, 1e9), 3.0)
    held = critical_slopes(LINE, None, 3.0)
    assert [t.frequency for t in heavy] == pytest.approx([t.frequency for t in held], rel=1e-3)
    assert [t.slope for t in held] == pytest.approx([0.0, 0.0], abs=1e-3)


def test_most_of_the_inertia_may_not_be_compensated():
    with pytest.raises(InputError, match="compensated inertia"):
        SpeedControl(2900.0, 1200.0, 10.0, 2500.0)
