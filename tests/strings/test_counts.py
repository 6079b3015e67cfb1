"""Roots of the reduced plant against those of the exact string, at random."""

import math

import numpy as np
import pytest

from drillctrl import (
    Damping,
    DrillString,
    DriveMachine,
    RigPoint,
    Section,
    as_case,
    characteristic_roots,
    count_right_of,
    driven_plant,
    exact_loop,
    pipe,
    rule_control,
    string_rig,
)
from drillctrl.strings.named_roots import turned_by

LAWS = ("imposed", "stiff", "soft-torque", "z-torque")


def random_case(rng, law):
    joints = int(rng.integers(50, 350))
    bought = pipe('5" 19.5#')
    pipes = Section(
        "pipe",
        bought.kind,
        joints * bought.joint_length,
        bought.outer_diameter,
        bought.inner_diameter,
        bought.tool_joint,
        joints,
    )
    collars = Section("collars", "collar", rng.uniform(60.0, 250.0), 0.1714, 0.0714)
    damping = Damping(*rng.uniform(0.05, 0.4, 2).tolist(), rng.uniform(2e-4, 6e-4))
    string = DrillString((pipes, collars), damping, mud_density=1200.0)
    machine = DriveMachine(
        rng.uniform(1000.0, 4000.0), delay=rng.choice([0.0, 0.02]), lag=rng.choice([0.0, 0.005])
    )
    rig = string_rig(
        string,
        drive=None if law == "imposed" else machine,
        bit_radius=rng.uniform(0.08, 0.16),
        blades=int(rng.integers(3, 8)),
        rock_strength=rng.uniform(10e6, 100e6),
        contact_strength=60e6,
        wearflat_length=1.2e-3,
        cutter_inclination=0.6,
        friction_coefficient=0.6,
        bit_geometry=1.0,
    )
    point = RigPoint(rig, rng.uniform(60.0, 200.0) * math.pi / 30, rng.uniform(3.0, 40.0) / 3600)
    if law == "imposed":
        return as_case(point)
    return as_case(point, driven_plant(rig, rule_control(law, machine, string)))


@pytest.mark.long
def test_reduced_and_exact_strings_have_as_many_growing_roots():
    rng = np.random.default_rng(11)
    for law in 3 * LAWS:
        case = random_case(rng, law)
        known = count_right_of(case.system(), 0.0).count
        assert exact_loop(case).count_right_of(0.0) == known


@pytest.mark.long
def test_roots_of_reduced_strings_are_those_of_exact_ones():
    """Those that grow or hardly decay, up to 10 Hz, of every law of the drive."""
    rng = np.random.default_rng(5)
    seen = set()
    for law in LAWS[::-1] + LAWS[:2]:
        case = random_case(rng, law)
        loop = exact_loop(case)
        roots = [root.value for root in characteristic_roots(case.system(), -0.3)]
        slow = [root for root in roots if abs(root) * loop.rate < 20.0 * math.pi]
        for root in slow:
            assert abs(loop.root(root) - root) < 1e-4 * max(abs(root), 1.0)
        assert getattr(turned_by(case), "name", "imposed") == law
        seen |= {law} if slow else set()
    assert seen == set(LAWS)
