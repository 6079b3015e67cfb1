"""A motion that grows without end is named so at once, and a bounded one never."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import table1
from drillctrl.simulation import begin
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.strings.presets import string_preset


def at(rig, rpm, rop):
    return RigPoint(rig, rpm * 2.0 * math.pi / 60.0, rop / 3600.0)


def kicked(where, feed, speed, controller=None, **options):
    point = where.operating_point()
    kick = {"dx": feed * point.penetration_rate, "dtheta": speed * point.omega0}
    return simulate(where, controller, initial=kick, max_steps=200_000, **options)


def test_a_bit_that_is_driven_on_grows_as_its_own_equation_says():
    """Rock bears a bounded torque, so θ'' = (p2 − 2κ) θ' − θ for large θ'."""
    point, gain = OperatingPoint(10.0, 1.0, 14.0), 3.0
    run = simulate(point, Controller("pd", [0.0, gain]), duration=200.0, initial={"dtheta": 5.0})
    assert run.status == "diverges"
    assert figures(run).outcome == "diverges"
    assert run.steps < 1000
    damping = gain - 2.0 * point.kappa
    rate = 0.5 * damping + math.sqrt(0.25 * damping**2 - 1.0)
    end, last = float(run.times[-1]), float(run.motion.dtheta[-1])
    assert last > 50.0 * point.omega0
    before = run.at([end - math.log(2.0) / rate]).dtheta[0]
    assert last / before == pytest.approx(2.0, rel=0.02)


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("rpm", "rop", "structure", "K1", "K2", "rtol"),
    [
        (162.0, 55.7, "case2", [4.35, 0.898], [0.0230, -4.62], 1e-5),
        (138.0, 44.6, "case1", [0.899], [3.461], 1e-7),
        (141.0, 33.7, "case1", [-1.253], [5.291], 1e-9),
    ],
)
def test_what_is_named_goes_on_growing(monkeypatch, rpm, rop, structure, K1, K2, rtol):
    where, controller = at(table1(), rpm, rop), Controller(structure, K1, K2)
    named = kicked(where, 0.5, 0.5, controller, duration=100.0, rtol=rtol, cutting="single")
    assert named.status == "diverges"
    assert named.steps < 2000
    monkeypatch.setattr(begin, "rate_bounds", lambda *_: np.full(4, np.inf))
    end = float(named.times[-1])
    further = kicked(where, 0.5, 0.5, controller, duration=3.0 * end, rtol=rtol, cutting="single")
    speeds = further.motion.dtheta, named.motion.dtheta
    largest, before = (abs(values).max() for values in speeds)
    assert largest > 200.0 * before


@pytest.mark.long
def test_table_1_is_never_said_to_diverge_where_energy_only_goes():
    """Without control, or with damping by it, the drive alone gives energy."""
    random, seen = np.random.default_rng(7), set()
    for _ in range(80):
        gain = float(random.uniform(0.0, 2.0))
        controller = Controller("pd", [0.0, -gain]) if random.integers(2) else None
        where = at(table1(), random.uniform(50.0, 180.0), random.uniform(5.0, 60.0))
        kick = random.uniform(-0.5, 1.0, 2) if random.integers(2) else (5.0, 5.0)
        run = kicked(
            where, *kick, controller, duration=60.0, rtol=10.0 ** -random.uniform(5.0, 9.0),
            cutting=("multiple", "single")[random.integers(2)],
        )  # fmt: skip
        assert run.status in ("done", "reverse rotation"), where
        seen.add(str(figures(run).outcome))
    assert {"settles", "orbit", "bounces", "stick-slip"} <= seen


@pytest.mark.parametrize("preset", ["paper-string", "vertical-3000"])
def test_strings_neither(preset):
    for rpm, rop, feed, speed in ((60.0, 50.0, 0.5, -0.5), (110.0, 20.0, 5.0, 2.0)):
        run = kicked(at(string_preset(preset), rpm, rop), feed, speed, duration=12.0, rtol=1e-5)
        assert run.status in ("done", "reverse rotation")


def test_neither_is_a_bit_let_go_after_a_long_stall():
    """The drive winds the string up until the rock gives way."""
    hard = (Change(1.0, psi=14.0 * 30.0), Change(40.0, 0.5, psi=14.0))
    scenario = Scenario(changes=hard)
    run = simulate(OperatingPoint(1.0, 3.0, 14.0), duration=80.0, rtol=1e-6, scenario=scenario)
    assert any(b - a > 30.0 for a, b in run.phases("stuck"))
    assert run.status == "done"


def test_neither_is_a_bit_that_bounces_ever_higher_as_it_falls_behind():
    """The feed goes on, so its rates grow, but with the time: without end, yet not away."""
    kick = {"dx": 0.04772140069753391, "dtheta": 0.21092213760798373}
    where = at(table1(), 57.27510511751643, 26.191005761458573)
    run = simulate(where, duration=300.0, initial=kick, rtol=1e-6)
    assert run.status == "done"
    assert figures(run).outcome == "does-not-keep-up"
    sizes = [abs(run.motion.dx[run.motion.times < t]).max() for t in (75.0, 150.0, 300.0)]
    assert 1.2 < sizes[1] / sizes[0] < 2.0
    assert 1.2 < sizes[2] / sizes[1] < 2.0


@pytest.mark.long
def test_a_bit_off_the_rock_for_turns_on_end_finds_the_face_again():
    """However many passes ago it was left; `rock_face` looks at all of them."""
    controller = Controller("case2", [-3.4, -3.05], [1.37, -1.14], limit=4.1)
    run = kicked(at(table1(), 67.3, 42.8), 0.4, 0.4, controller, duration=60.0, rtol=1e-6)
    assert run.status == "done"
    random, passes = np.random.default_rng(1), []
    for time in random.uniform(20.0, 60.0, 100):
        face = run.rock_face(time, 2)
        depth = run.at([time]).depth[0]
        assert depth == pytest.approx(run.point.blades * face.height[0], rel=1e-6, abs=1e-6)
        passes.append(face.passes[0])
    assert max(passes) > 10


def test_a_bit_that_falls_behind_and_turns_back_has_turned_back():
    where = at(table1(), 60.959438957012026, 10.35077280309002)
    kick = {"dx": 0.018859656668560366, "dtheta": 0.2244900799947762}
    run = simulate(
        where, duration=170.0, initial=kick, rtol=1e-5, cutting="single", backwards="stop"
    )
    assert run.status == "reverse rotation"
    assert figures(run).outcome == "turns-back"
