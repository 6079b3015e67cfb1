"""A string that is fed by its weight: balances, limits, and a bit that cannot be overloaded."""

from __future__ import annotations

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.drilling.case import as_case
from drillctrl.drilling.hoist import Hoist
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.simulation.loads import loads
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.strings.check import check_rig
from drillctrl.strings.files import load_rig
from drillctrl.strings.words import rig_summary
from tests.simulation.test_balance import BOOLE

POINT = OperatingPoint(5.0, 0.5, 14.0)
CALM = OperatingPoint(20.0, 1.0, 14.0, kappa=0.2)
# 60 rpm and 30 m/h of table 1, where an imposed feed presses on the bit ever more.
HARD = OperatingPoint(2.2095, 0.4947, 14.14, 1.596, 0.0506, 0.0499, lam=10.55)


def fed(point=POINT, **values):
    return as_case(point, paper_plant(blocks=(Hoist(**values),)))


def test_energy_goes_where_the_equations_say():
    values = {"hoist_mass": 0.7, "hoist_damping": 3.0, "hoist_stiffness": 0.2}
    run = simulate(fed(HARD, **values), duration=40.0, initial={"dx": 0.5}, rtol=1e-10)
    assert run.status == "done"
    assert {"hold", "loss"} & {event.name for event in run.events}
    names = ("x", "dx", "hook", "dhook", "weight_on_bit")
    lengths = np.diff(run.times)
    times = (run.times[:-1, None] + lengths[:, None] * np.linspace(0.0, 1.0, 9)).ravel()
    inside = run.on_steps(9, names=names)
    np.testing.assert_allclose(inside.times, times)
    p = run.point
    power = inside.dx * (run.steady_load[0] - inside.weight_on_bit)
    power = power - 2.0 * p.xi * p.eta * inside.dx**2 - 3.0 * inside.dhook**2
    ends = run.at([0.0, run.times[-1]], names)
    energy = 0.5 * (ends.dx**2 + 0.7 * ends.dhook**2 + 0.2 * ends.hook**2)
    energy += 0.5 * (p.eta * (ends.x - ends.hook)) ** 2

    def integral(values):
        return float((values.reshape(-1, 9) @ BOOLE * lengths).sum())

    size = integral(abs(power))
    assert integral(power) == pytest.approx(energy[1] - energy[0], abs=1e-8 * size)


def test_small_motion_is_the_linear_one():
    times, apart, case = np.linspace(0.5, 10.0, 100), [], fed(hoist_damping=2.0)
    for size in (1e-2, 1e-3):
        a, b = (
            simulate(
                case, duration=10.0, initial={"dx": size, "hook": size}, model=model,
                rtol=1e-12, atol=1e-15,
            ).at(times)
            for model in ("linear", "nonlinear")
        )  # fmt: skip
        apart.append(abs(a.x - b.x).max())
    assert apart[0] / apart[1] == pytest.approx(100.0, rel=0.1)


def test_a_hook_that_does_not_give_way_is_an_imposed_feed():
    times, kick = np.linspace(0.0, 10.0, 100), {"dx": 0.2, "dtheta": -0.5}
    imposed = simulate(POINT, duration=10.0, initial=kick, rtol=1e-9).at(times)
    apart = []
    for damping in (50.0, 500.0):
        case = fed(hoist_mass=0.1, hoist_damping=damping)
        run = simulate(case, duration=10.0, initial=kick, rtol=1e-9)
        apart.append(abs(run.at(times).x - imposed.x).max())
    assert apart[1] < 1e-2
    assert apart[0] / apart[1] == pytest.approx(10.0, rel=0.2)


def test_harder_rock_is_drilled_slower_not_pressed_ever_harder():
    """Weight and feed of steady drilling in it lie on the hook's line: W − W0 = c (V0 − V)."""
    point, damping = CALM, 2.0
    scenario = Scenario(changes=(Change(5.0, psi=21.0),))
    run = simulate(fed(point, hoist_damping=damping), duration=400.0, scenario=scenario)
    end = run.at([400.0], ("dx", "weight_on_bit"))
    more, slower = end.weight_on_bit[0] - run.steady_load[0], -end.dx[0]
    assert slower > 0.5
    # The bit's own damping is that of its motion beside V0 t.
    assert more == pytest.approx((damping + 2.0 * point.xi * point.eta) * slower, rel=1e-3)
    feed = point.penetration_rate - slower
    assert more + run.steady_load[0] == pytest.approx(
        21.0 * 2.0 * np.pi * feed / point.omega0 + point.lam, rel=1e-3
    )
    assert figures(run).outcome == "settles"


def test_a_bit_that_cannot_follow_is_loaded_by_no_more_than_the_gain_says():
    endless = simulate(HARD, duration=150.0, initial={"dtheta": -0.1}, rtol=1e-6)
    assert loads(endless).weight_ratio > 5.0
    damping = 20.0
    held = simulate(
        fed(HARD, hoist_mass=0.5, hoist_damping=damping), duration=150.0,
        initial={"dtheta": -0.1}, rtol=1e-6,
    )  # fmt: skip
    most = 1.0 + damping * HARD.penetration_rate / held.steady_load[0]
    assert loads(held).weight_ratio < most
    assert figures(held).outcome != "does-not-keep-up"


def test_the_feed_of_a_string_that_hangs_on_a_hook_may_change():
    """Where it is imposed on the string itself a step of it is refused."""
    half = 0.5 * CALM.penetration_rate
    changes = Scenario(changes=(Change(1.0, penetration_rate=half),))
    run = simulate(fed(CALM, hoist_damping=20.0), duration=200.0, scenario=changes)
    rock = CALM.psi * 2.0 * np.pi / CALM.omega0
    share = 20.0 / (20.0 + rock + 2.0 * CALM.xi * CALM.eta)
    assert -run.at([200.0]).dx[0] == pytest.approx(half * share, rel=1e-3)


RIG = """
[[sections]]
name = "pipe"
type = "pipe"
length = "900 m"
outer_diameter = "127 mm"
inner_diameter = "108 mm"
[bit]
diameter = "216 mm"
blades = 4
wearflat_length = "1.2 mm"
cutter_inclination = 0.6
friction_coefficient = 0.6
geometry = 1.0
[rock]
strength = "60 MPa"
contact_strength = "60 MPa"
[hoisting]
block_mass = "25 t"
feed_gain = "0.2 m/h/kN"
"""


def test_a_rig_file_says_so_and_what_it_cannot_be_is_named(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(RIG)
    rig = load_rig(path)
    assert rig.weight_control.feed_gain == pytest.approx(0.2 / 3600.0 / 1e3)
    assert "fed by weight, 0.2 m/h per kN" in rig_summary(check_rig(rig))
    where = RigPoint(rig, 12.0, 15.0 / 3600.0)
    case = as_case(where)
    (hoist,) = case.plant.blocks
    # In SI: the force that a rate of 1 m/s is worth at the hook.
    force = hoist.values["hoist_damping"] * rig.mass / rig.time_scale
    assert 1.0 / force == pytest.approx(rig.weight_control.feed_gain)
    run = simulate(where, duration=3.0, initial={"dhook": 0.01}, rtol=1e-6)
    assert run.status == "done"
    for old, new, word in (
        ('block_mass = "25 t"', "", "block_mass"),
        ('"25 t"', '"-25 t"', "hoisting.block_mass"),
        ('feed_gain = "0.2 m/h/kN"', 'feed_gain = "0.2 m/h"', "feed_gain"),
        ("[hoisting]", '[hoisting]\nstiffness = "20 MN/m"', "hoisting.stiffness"),
    ):
        path.write_text(RIG.replace(old, new))
        with pytest.raises(InputError, match=word):
            load_rig(path)
    with pytest.raises(InputError, match="hoist_mass"):
        Hoist(hoist_mass=0.0)
