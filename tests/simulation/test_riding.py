"""A bit that rides on a rock face which falls away: the limit of ever smaller bounces."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from drillctrl.drilling.bit_rock import BitRock, Load
from drillctrl.drilling.case import as_case
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.point import OperatingPoint
from drillctrl.drilling.string import spring_string
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Scenario
from drillctrl.simulation.structure import structure_of

POINT = OperatingPoint(8.0, 1.5, 1.0, lam=20.0, beta=0.3)
SHARE, STIFFNESS = 0.01, 51.2
# Closed Newton-Cotes weights on nine points.
BOOLE = np.array([989, 5888, -928, 10496, -4540, 10496, -928, 5888, 989]) / 28350.0
TIMES = np.linspace(0.0, 0.5, 501)


def ramped(thin):
    """A law whose wear flat presses in proportion to depth as far as ``thin``, fully beyond."""

    class Ramped(BitRock):
        name = f"ramped over {thin:g}"
        form = name

        def load(self, c, contact, rates, q):
            pressed = contact.pressed * ca.fmin(1.0, contact.cut / thin)
            return Load(
                c.cutting_force * contact.cut + c.wear_force * pressed,
                c.cutting_torque * contact.cut + c.wear_torque * contact.direction * pressed,
            )

    return Ramped()


def light_bit(law=None):
    """A bit of little mass hangs on a stiff and strongly damped spring below all other mass."""

    def string(c):
        coordinates = {"x": "length", "theta": "angle", "collar": "length"}
        return spring_string(
            {**coordinates, "x_top": "length", "theta_top": "angle"},
            masses={"x": SHARE * c.mass, "theta": 1.0, "collar": (1.0 - SHARE) * c.mass},
            springs={
                ("x", "collar"): STIFFNESS,
                ("collar", "x_top"): c.axial_stiffness,
                ("theta", "theta_top"): 1.0,
            },
            dampers={
                "collar": c.axial_damping,
                "theta": c.torsional_damping,
                ("x", "collar"): 5.0 * c.mass,
            },
            inputs={"axial": "x", "torque": "theta"},
        )

    return as_case(POINT, paper_plant(law, string=string))


def lifted(law=None, share=0.01, **options):
    """A run from a bit that is lifted off the face, on which less than the wear flat bears."""
    case = light_bit(law)
    structure = structure_of(case)
    way = structure.steady_depth / structure.bit[2] * (1.0 + share)
    slack = (structure.arrays.steady[0] - 0.75 * POINT.lam) / STIFFNESS
    scenario = Scenario("steady", {"x": -way, "collar": -way - slack}, alone=True)
    return simulate(case, duration=float(TIMES[-1]), scenario=scenario, **options)


@pytest.fixture(scope="module")
def run():
    return lifted(rtol=1e-8)


def test_bounces_end_in_riding(run):
    names = [event.name for event in run.events]
    assert names.count("ride") == 1
    assert names.count("loss") > 10
    (began, left), *others = run.phases("riding")
    assert not others
    assert left - began > 0.05
    # Once it rides it bounces no more, and cuts again where it is pressed fully.
    after = [event.name for event in run.events if event.time > began]
    assert after == ["advance"]


def test_the_bit_falls_as_the_face_does(run):
    ((began, left),) = run.phases("riding")
    motion = run.at(np.linspace(began, left, 30)[1:-1])
    # The face is that of steady drilling.
    structure = structure_of(light_bit())
    slope = structure.penetration_rate / structure.omega0
    falls = slope * (structure.omega0 + motion.dtheta)
    assert structure.penetration_rate + motion.dx == pytest.approx(falls, abs=1e-9)
    assert motion.ddx == pytest.approx(slope * motion.ddtheta, abs=1e-8)
    assert (motion.depth == 0.0).all()
    assert ((motion.pressed > 0.0) & (motion.pressed < 1.0)).all()
    assert motion.weight_on_bit == pytest.approx(POINT.lam * motion.pressed)
    assert motion.contact.all()


def test_it_is_the_limit_of_a_wear_flat_that_takes_hold_by_depth():
    limit = lifted(rtol=1e-9).at(TIMES)
    apart = []
    for thin in (1e-2, 1e-3):
        near = lifted(ramped(thin), rtol=1e-9)
        assert not near.phases("riding")
        found = near.at(TIMES)
        apart.append(
            [abs(getattr(found, k) - getattr(limit, k)).max() for k in ("x", "collar", "theta")]
        )
    few, fewer = np.array(apart)
    assert few / fewer == pytest.approx(10.0, rel=0.02)
    assert (fewer < [1e-3, 1e-3, 1e-4]).all()


def test_energy_balance(run):
    motion, c = run.on_steps(9), structure_of(light_bit())._c
    weight, torque = run.steady_load
    power = motion.dx * (weight - motion.weight_on_bit)
    power += motion.dtheta * (torque - motion.torque_on_bit)
    power -= 5.0 * (motion.dx - motion.dcollar) ** 2 + c.axial_damping * motion.dcollar**2
    power -= c.torsional_damping * motion.dtheta**2
    # The last bounce before that it rides is cut short, and its momentum with it.
    since = run.times[:-1] >= run.phases("riding")[0][0]
    ends = run.at([run.times[:-1][since][0], run.times[-1]])
    energy = SHARE * ends.dx**2 + (1.0 - SHARE) * ends.dcollar**2 + ends.dtheta**2
    energy += STIFFNESS * (ends.x - ends.collar) ** 2 + c.axial_stiffness * ends.collar**2
    energy = 0.5 * (energy + ends.theta**2)

    def integral(values):
        return float((values.reshape(-1, 9) @ BOOLE * np.diff(run.times))[since].sum())

    size = integral(abs(power))
    assert integral(power) == pytest.approx(energy[1] - energy[0], abs=1e-8 * size)


def test_tolerance_says_how_small_a_bounce_is_none(run):
    ((began, left),) = run.phases("riding")
    ((rough, end),) = lifted(rtol=1e-5).phases("riding")
    assert rough < began < left
    assert end == pytest.approx(left, abs=1e-4)


def test_a_bit_that_is_set_on_the_face_rides_at_once():
    run = lifted(share=0.0)
    assert run.phases("riding")[0][0] == 0.0
    assert "loss" not in [event.name for event in run.events]
