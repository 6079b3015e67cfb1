"""η = 0: the hook load is imposed, and the rate of penetration follows from the rock."""

from __future__ import annotations

import numpy as np
import pytest

from drillctrl.drilling.case import plant_system
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.spectrum.roots import spectral_abscissa

POINT = OperatingPoint(20.0, 1.0, 14.0, eta=0.0, kappa=0.2)
BOOLE = np.array([989, 5888, -928, 10496, -4540, 10496, -928, 5888, 989]) / 28350.0


def test_nothing_says_where_the_bit_is():
    """So a displacement neither grows nor dies, and no gain on the rotation changes that."""
    assert spectral_abscissa(plant_system(POINT)) == pytest.approx(0.0, abs=1e-9)


def test_softer_rock_is_drilled_faster_under_the_same_weight():
    """With ψ halved the cutters go twice as deep for ψ d + λ to stay what it is."""
    scenario = Scenario(changes=(Change(10.0, psi=7.0),))
    run = simulate(POINT, duration=250.0, scenario=scenario, rtol=1e-9)
    end = run.at([250.0])
    assert POINT.penetration_rate + end.dx[0] == pytest.approx(2.0 * POINT.penetration_rate, 1e-4)
    assert end.depth[0] == pytest.approx(2.0 * 2.0 * np.pi * POINT.delta0, rel=1e-4)
    assert end.weight_on_bit[0] == pytest.approx(14.0 * 2.0 * np.pi + POINT.lam, rel=1e-4)
    assert figures(run).feed == pytest.approx(2.0, rel=1e-3)


def test_momentum_is_what_the_weight_leaves():
    """x' changes by the weight that is missing, also where the bit is held and lifted."""
    point = OperatingPoint(5.0, 1.0, 14.0, eta=0.0)
    run = simulate(point, duration=60.0, initial={"dx": 3.0}, rtol=1e-9)
    assert run.status == "done"
    assert {"hold", "loss"} & {event.name for event in run.events}
    load = (run.steady_load[0] - run.on_steps(9).weight_on_bit).reshape(-1, 9)
    gained = float((load @ BOOLE * np.diff(run.times)).sum())
    size = float((abs(load) @ abs(BOOLE) * np.diff(run.times)).sum())
    ends = run.at([0.0, 60.0]).dx
    assert gained == pytest.approx(ends[1] - ends[0], abs=1e-7 * size)


def test_small_motion_is_the_linear_one():
    times, apart = np.linspace(0.5, 10.0, 100), []
    for size in (1e-2, 1e-3):
        a, b = (
            simulate(
                POINT, duration=10.0, initial={"dx": size, "dtheta": size}, model=model,
                rtol=1e-12, atol=1e-15,
            ).at(times)
            for model in ("linear", "nonlinear")
        )  # fmt: skip
        apart.append(max(abs(a.x - b.x).max(), abs(a.theta - b.theta).max()))
    assert apart[0] / apart[1] == pytest.approx(100.0, rel=0.1)
