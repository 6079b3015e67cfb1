"""Strings of more inertias than the bit's: sizes are data, and the motion obeys the mechanics."""

from __future__ import annotations

import pickle
import subprocess
import sys
from typing import ClassVar

import casadi as ca
import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.bit_rock import BitRock, Load, PaperLaw
from drillctrl.drilling.case import as_case
from drillctrl.drilling.friction import Stribeck
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.point import OperatingPoint
from drillctrl.drilling.string import String, spring_string
from drillctrl.simulation.compile import kernel
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.floquet import multipliers_at
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.spectrum.roots import dominant_roots

POINT = OperatingPoint(10.0, 2.5, 14.0)
KICK = {"dx": 1.0, "dtheta": 1.0}
BOOLE = np.array([989, 5888, -928, 10496, -4540, 10496, -928, 5888, 989]) / 28350.0
NONE = np.zeros((1, 2))
UPPER = FeedbackStructure(
    "upper", ("phi", "surface_torque"), NONE - 9.0, NONE + 9.0, NONE - 9.0, NONE + 9.0, ("drive",)
)


def with_collar(point, share=0.3, stiffness=4.0, damping=0.1, relative=False):
    """A part of the inertia hangs between the bit and a torsional spring of 1 to the top end.

    Its coordinate is its angle, or how far it is twisted against the bit.
    """

    def string(c):
        name = "twist" if relative else "phi"
        coordinates = {"x": "length", "theta": "angle", name: "angle"}
        coordinates |= {"x_top": "length", "theta_top": "angle"}
        plain = spring_string(
            coordinates,
            masses={"x": c.mass, "theta": 1.0 - share, name: share},
            springs={
                ("x", "x_top"): c.axial_stiffness,
                ("theta", name): stiffness,
                (name, "theta_top"): 1.0,
            },
            dampers={
                "x": c.axial_damping, name: c.torsional_damping, ("theta", name): damping,
            },
        )  # fmt: skip
        S = ca.DM.eye(5)
        S[2, 1] = float(relative)
        phi = {"theta": 1.0, "twist": 1.0} if relative else {"phi": 1.0}
        outputs = {"surface_torque": ("angle", phi)}
        if relative:
            outputs["phi"] = ("angle", phi)
        return String(
            coordinates,
            *(S.T @ matrix @ S for matrix in (plain.mass, plain.damping, plain.stiffness)),
            inputs={"axial": "x", "torque": "theta", "drive": name},
            outputs=outputs,
            reference={"twist": None},
        )

    return as_case(point, paper_plant(string=string))


@pytest.fixture(scope="module")
def stick_slip():
    return simulate(with_collar(POINT), duration=60.0, initial={"dtheta": -6.0}, rtol=1e-9)


def test_energy_balance(stick_slip):
    run, point = stick_slip, POINT
    assert {"stick", "release", "hold", "advance"} <= {event.name for event in run.events}
    motion = run.on_steps(9)
    weight, torque = run.steady_load
    power = motion.dx * (weight - motion.weight_on_bit)
    power += motion.dtheta * (torque - motion.torque_on_bit)
    power -= 2.0 * point.xi * point.eta * motion.dx**2 + 2.0 * point.kappa * motion.dphi**2
    power -= 0.1 * (motion.dtheta - motion.dphi) ** 2
    end = run.at([0.0, run.times[-1]])
    energy = 0.5 * (end.dx**2 + 0.7 * end.dtheta**2 + 0.3 * end.dphi**2)
    energy += 0.5 * ((point.eta * end.x) ** 2 + 4.0 * (end.theta - end.phi) ** 2 + end.phi**2)

    def integral(values):
        return float((values.reshape(-1, 9) @ BOOLE * np.diff(run.times)).sum())

    size = integral(abs(power))
    assert integral(power) == pytest.approx(energy[1] - energy[0], abs=1e-9 * size)


def test_a_very_stiff_spring_is_none():
    times = np.linspace(0.0, 20.0, 400)
    two = simulate(POINT, duration=20.0, initial={"dtheta": -6.0}, rtol=1e-9).at(times)
    apart = []
    for stiffness in (1e3, 1e4):
        string = with_collar(POINT, 0.3, stiffness, 0.3 * stiffness**0.5)
        # Both inertias are kicked, lest the spring rings.
        kick = {"dtheta": -6.0, "dphi": -6.0}
        three = simulate(string, duration=20.0, initial=kick, rtol=1e-9).at(times)
        apart.append(max(abs(three.theta - two.theta).max(), abs(three.x - two.x).max()))
    assert apart[1] < 2e-3 * abs(two.x).max()
    assert apart[0] / apart[1] == pytest.approx(10.0, rel=0.1)


@pytest.mark.parametrize("feedback", [None, ([-0.4, 0.2], [0.3, 0.1])])
def test_difference_from_the_linear_model_shrinks_with_the_square(feedback):
    control = feedback and Controller(UPPER, *feedback)
    times, apart = np.linspace(1.0, 20.0, 300), []
    for size in (1e-1, 1e-2, 1e-3):
        a, b = (
            simulate(
                with_collar(POINT), control, duration=20.0,
                initial={"dx": size, "dphi": size}, model=model, rtol=1e-12, atol=1e-15,
            ).at(times)
            for model in ("linear", "nonlinear")
        )  # fmt: skip
        apart.append(max(abs(getattr(a, n) - getattr(b, n)).max() for n in ("x", "theta", "phi")))
    np.testing.assert_allclose(np.array(apart[:-1]) / apart[1:], 100.0, rtol=0.1)


def test_coordinates_do_not_matter(stick_slip):
    """With the twist between both inertias as a state the load acts on all rates."""
    other = with_collar(POINT, relative=True)
    assert (other.motion().E[:, 1] != 0.0).sum() == 2
    kick = Scenario(initial={"dtheta": -6.0, "dtwist": 6.0}, alone=True)
    run = simulate(other, duration=60.0, scenario=kick, rtol=1e-9)
    assert [e.name for e in run.events] == [e.name for e in stick_slip.events]
    times = np.linspace(0.0, 60.0, 600)
    one, two = run.at(times, ("theta", "twist", "phi")), stick_slip.at(times)
    np.testing.assert_allclose(one.theta, two.theta, atol=2e-6)
    np.testing.assert_allclose(one.twist, two.phi - two.theta, atol=2e-6)
    np.testing.assert_allclose(one.phi, two.phi, atol=2e-6)  # an output here


def test_order_stays_five_where_another_inertia_is_fed_back_late():
    control = Controller(UPPER, [-0.8, 0.1], [0.6, 0.1], measurement_delay=0.2)
    string, times = with_collar(POINT), np.linspace(0.0, 10.0, 500)

    def phi(**options):
        run = simulate(string, control, duration=10.0, initial=KICK, **options)
        return run.at(times).phi

    exact = phi(rtol=1e-13, atol=1e-15)
    errors = [abs(phi(rtol=0.1, atol=1.0, max_step=h) - exact).max() for h in (0.02, 0.01, 0.005)]
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 4.4


@pytest.mark.parametrize("extra", [{}, {"actuator_lag": 0.1, "limit": 0.2}], ids=str)
def test_the_controller_feeds_back_what_it_is_told(extra):
    string = with_collar(POINT)
    control = Controller(UPPER, [-0.4, 0.2], [0.3, 0.1], measurement_delay=0.3, **extra)
    run = simulate(string, control, duration=12.0, initial=KICK, rtol=1e-10)
    times = np.linspace(1.0, 12.0, 201)
    now, then = run.at(times - 0.3), run.at(times - 0.3 - POINT.delay)
    law = -0.2 * now.phi + 0.4 * then.phi
    here = run.at(times)
    assert not here.torque.any()
    if not extra:
        np.testing.assert_allclose(here.drive, law, atol=1e-9)
    else:
        assert run.phases("saturated")
        slope = (run.at(times[:-1] + 1e-4).drive - run.at(times[:-1] - 1e-4).drive) / 2e-4
        wanted = np.clip(law, -0.2, 0.2)[:-1]
        np.testing.assert_allclose(slope, (wanted - here.drive[:-1]) / 0.1, atol=1e-4)


def test_outputs_are_measured_against_the_moving_top_end():
    string = with_collar(POINT)
    scenario = Scenario(changes=(Change(2.0, 1.0, omega0=11.0),))
    run = simulate(string, duration=4.0, scenario=scenario)
    motion = run.at([1.0, 2.5, 4.0], ("phi", "surface_torque", "y_dphi", "dphi", "ddphi"))
    top = np.array([0.0, 0.125, 0.5 + 1.0])
    np.testing.assert_allclose(motion.surface_torque, motion.phi - top, atol=1e-12)
    np.testing.assert_allclose(motion.dphi - motion.y_dphi, [0.0, 0.5, 1.0], atol=1e-12)
    assert motion.ddphi[0] == pytest.approx(0.0, abs=1e-12)


def test_the_rest_of_a_motion_is_the_same(stick_slip):
    rest = simulate(
        with_collar(POINT), duration=30.0,
        scenario=Scenario(start=stick_slip.past(30.0)), rtol=1e-9,
    )  # fmt: skip
    with pytest.raises(InputError, match="plant"):
        simulate(POINT, duration=1.0, scenario=Scenario(start=stick_slip.past(30.0)))
    times = np.linspace(0.0, 30.0, 300)
    a, b = stick_slip.at(30.0 + times), rest.at(times)
    for name in ("x", "dtheta", "phi", "dphi", "delay"):
        np.testing.assert_allclose(getattr(b, name), getattr(a, name), atol=2e-6)


def test_at_rest_the_multipliers_are_exponentials_of_the_roots():
    control = Controller(UPPER, [-0.8, 0.2], [0.4, 0.1])
    case = with_collar(POINT)
    run = simulate(case, control, duration=20.0, rtol=1e-11)
    found, residuals = multipliers_at(run, 10.0, 1.3, size=1e-4, directions=10)
    loop = close_loop(case.system(("drive",)), UPPER, control.K1, control.K2, delay=POINT.delay)
    roots = dominant_roots(loop)
    for root in roots[:3]:
        assert abs(found - np.exp(1.3 * root.value)).min() < 1e-6
    assert residuals[0] < 1e-6


def test_another_string_or_law_does_not_recompile(stick_slip):
    march = kernel("march").march
    simulate(POINT, duration=1.0)
    simulate(as_case(POINT, paper_plant(bit=Stribeck(drop=4.0))), duration=1.0)
    assert len(march.signatures) == 1


@pytest.mark.long
def test_a_run_is_looked_at_in_another_process():
    # Machine code of the law stands at another place there.
    run = simulate(POINT, duration=2.0)
    script = (
        "import pickle, sys; run = pickle.load(sys.stdin.buffer); "
        "print(repr(float(run.at([1.5]).torque_on_bit[0])))"
    )
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, input=pickle.dumps(run), capture_output=True, check=True)
    assert float(done.stdout) == run.at([1.5]).torque_on_bit[0]


def test_names_that_the_string_lacks_are_refused():
    with pytest.raises(InputError, match="inputs"):
        simulate(POINT, Controller(UPPER, [1.0, 0.0]), duration=1.0)
    string = with_collar(POINT)
    with pytest.raises(InputError, match="initial"):
        simulate(string, duration=1.0, initial={"psi": 1.0})
    run = simulate(string, duration=1.0)
    with pytest.raises(InputError, match="names"):
        run.at([0.5], ("psi",))


class Weakening(BitRock):
    """Wear torque that falls with the speed of the bit."""

    parameters: ClassVar = {"drop": 20.0, "decay": 3.0}

    def load(self, c, contact, rates, q):
        weight, torque = PaperLaw().load(c, contact, rates, q)
        falling = q.drop * ca.exp(-ca.fabs(rates.rotary) / q.decay)
        return Load(weight, torque + falling * contact.pressed * contact.direction)


def test_a_law_is_told_the_rates():
    case = as_case(POINT, paper_plant(bit=Weakening()))
    times, apart = np.linspace(1.0, 10.0, 100), []
    for size in (1e-2, 1e-3):
        a, b = (
            simulate(case, duration=10.0, initial={"dtheta": size}, model=model, rtol=1e-12)
            .at(times).theta
            for model in ("linear", "nonlinear")
        )  # fmt: skip
        apart.append(abs(a - b).max())
    assert apart[0] / apart[1] == pytest.approx(100.0, rel=0.1)
    run = simulate(case, duration=60.0, initial={"dtheta": -6.0}, rtol=1e-9, backwards="stop")
    motion = run.on_steps(5)
    assert motion.stuck.any()
    slips = motion.contact & ~motion.stuck & ~motion.held & (motion.pressed == 1.0)
    speed = POINT.omega0 + motion.dtheta
    law = motion.depth + POINT.beta + 20.0 * np.exp(-speed / 3.0)
    np.testing.assert_allclose(motion.torque_on_bit[slips], law[slips], rtol=1e-10)
    # It lets go when the torque offered is what rock and standing friction bear.
    let_go = run.at(np.array([e.time for e in run.events if e.name == "release"]))
    limit = let_go.depth + (POINT.beta + 20.0) * let_go.pressed
    np.testing.assert_allclose(let_go.torque_on_bit, limit, rtol=1e-6)
