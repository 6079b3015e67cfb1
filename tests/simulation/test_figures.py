"""Figures show the motion that they say they show."""

from __future__ import annotations

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.base.figure import new_axes
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.figure import (
    plot_against_linear,
    plot_phase_portrait,
    plot_rock_face,
    plot_signal,
)
from drillctrl.simulation.run import simulate

POINT = OperatingPoint(10.0, 2.5, 14.0)
KICK = {"dx": 1.0, "dtheta": 1.0}


@pytest.fixture(scope="module")
def stick_slip():
    return simulate(POINT, duration=100.0, initial=KICK)


def shaded(ax):
    return [patch for patch in ax.patches if patch.get_alpha() is not None]


def test_sticks_and_limits_are_shaded(stick_slip):
    ax = new_axes()
    assert plot_signal(stick_slip, "bit_speed", ax) is ax
    sticks = stick_slip.phases("stuck")
    assert len(shaded(ax)) == len(sticks) > 2
    assert shaded(ax)[0].get_x() == pytest.approx(sticks[0][0])
    assert shaded(ax)[0].get_width() == pytest.approx(sticks[0][1] - sticks[0][0])
    line = ax.lines[0]
    np.testing.assert_allclose(
        line.get_ydata()[-1], POINT.omega0 + stick_slip.motion.dtheta[-1], rtol=1e-12
    )
    limited = simulate(
        POINT, Controller("case1", [-3.82], [3.61], limit=0.3), duration=20.0, initial=KICK
    )
    assert len(shaded(plot_signal(limited, "torque"))) == len(limited.phases("saturated")) > 0
    last = limited.plot().axes[-1].get_ylabel()
    assert last.replace("\n", " ") == "control torque u, dimensionless"


def test_the_portrait_marks_where_the_bit_stands(stick_slip):
    ax = plot_phase_portrait(stick_slip, since=60.0)
    lines = {line.get_label(): line for line in ax.lines}
    heights = lines["torsional stick"].get_ydata()
    np.testing.assert_allclose(heights[np.isfinite(heights)], -POINT.omega0, atol=1e-12)
    x, y = (lines["end"].get_xdata()[0], lines["end"].get_ydata()[0])
    end = stick_slip.at([100.0])
    assert (x, y) == (end.theta[0], end.dtheta[0])
    assert plot_phase_portrait(stick_slip, "axial").get_xlabel().startswith("bit displacement x")


def test_small_motion_lies_on_the_linear_one():
    runs = [
        simulate(POINT, duration=5.0, initial={"dx": 1e-4, "dtheta": 1e-4}, model=model)
        for model in ("nonlinear", "linear")
    ]
    ax = plot_against_linear(*runs, "theta")
    other, one = ax.lines
    there = np.interp(one.get_xdata(), other.get_xdata(), other.get_ydata())
    np.testing.assert_allclose(one.get_ydata(), there, atol=1e-6)


def test_the_face_begins_with_the_depth_of_cut(stick_slip):
    ax = plot_rock_face(stick_slip, 42.0)
    depth = float(stick_slip.at([42.0]).depth[0])
    face = next(line for line in ax.lines if line.get_label() == "rock face")
    assert 4.0 * face.get_ydata()[0] == pytest.approx(depth, abs=1e-7)
    assert face.get_xdata()[-1] == pytest.approx(90.0)


def test_unknown_names_are_refused(stick_slip):
    with pytest.raises(InputError, match="signal"):
        plot_signal(stick_slip, "speed")
    with pytest.raises(InputError, match="plane"):
        plot_phase_portrait(stick_slip, "bending")
