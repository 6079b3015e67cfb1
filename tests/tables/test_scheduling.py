import numpy as np
import pytest

from drillctrl import (
    Change,
    OperatingPoint,
    Scenario,
    analyze,
    dimensionless_grid,
    linear_axis,
    simulate,
    table,
)
from drillctrl.tables.scheduling import course, scheduled

START = OperatingPoint(10.0, 1.5, 12.0)
HARDER = Scenario(initial={"dtheta": 1.0}, changes=(Change(30.0, duration=6.0, psi=24.0),))


@pytest.fixture(scope="module")
def rocks():
    """Gains over the rock's strength and the depth of cut."""
    return table(
        dimensionless_grid(10.0, linear_axis("delta0", 1, 3, 2), linear_axis("psi", 12, 24, 3)),
        "case1",
    )


def test_course_of_a_scenario():
    scenario = Scenario(changes=(Change(10.0, duration=4.0, omega0=20.0), Change(20.0, psi=7.0)))
    found = course(START, scenario, np.array([0.0, 12.0, 15.0, 21.0]))
    rate = START.penetration_rate
    assert found[:, 0] == pytest.approx([10.0, 15.0, 20.0, 20.0])
    assert found[:, 1] == pytest.approx(rate / found[:, 0])
    assert found[:, 2] == pytest.approx([12.0, 12.0, 12.0, 7.0])


def test_gains_follow_the_rock_and_the_motion_settles(rocks):
    controller = scheduled(rocks, START, HARDER, interval=1.0)
    times, K1, K2 = controller.gains()
    assert times.tolist() == [0.0, *np.linspace(31.0, 36.0, 6)]
    before, after = (rocks.gains_at(10.0, 1.5, psi) for psi in (12.0, 24.0))
    assert K1[0].sum() == pytest.approx(before[0].item())
    assert K1[-1].sum() == pytest.approx(after[0].item(), rel=1e-6)
    assert K2[-1].sum() == pytest.approx(after[1].item(), rel=1e-6)
    run = simulate(START, controller, scenario=HARDER, duration=120.0)
    assert run.status == "done"
    late = run.at(np.linspace(110.0, 120.0, 200))
    assert np.ptp(late.theta) < 1e-4 * np.ptp(run.on_steps(3).theta)
    # In the harder rock the gains that were looked up decay faster than those of the start.
    rock = OperatingPoint(10.0, 1.5, 24.0)
    alphas = [analyze(rock, "case1", *gains).spectral_abscissa for gains in (after, before)]
    assert alphas[0] < 0.0
    assert alphas[0] < alphas[1] - 0.05


def test_a_controller_that_learns_late_switches_late(rocks):
    late = scheduled(rocks, START, Scenario(changes=(Change(5.0, psi=24.0),)), late=2.0)
    assert late.gains()[0].tolist() == [0.0, 7.0]
