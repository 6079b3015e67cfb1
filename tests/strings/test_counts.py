"""Roots of the reduced plant against those of the exact string, at random."""

import math

import numpy as np

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

COUNT = 24
LAWS = ("imposed", "stiff", "soft-torque", "z-torque")


def random_case(rng):
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
    law = str(rng.choice(LAWS))
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


def test_reduced_and_exact_strings_have_as_many_growing_roots():
    """They may differ by a root on the axis, nearer than the reduction is exact."""
    rng = np.random.default_rng(11)
    agree = 0
    for _ in range(COUNT):
        case = random_case(rng)
        system = case.system()
        reduced, exact = count_right_of(system, 0.0).count, exact_loop(case).count_right_of(0.0)
        assert (reduced == 0) == (exact == 0)
        agree += reduced == exact
        if reduced != exact:
            near = [r.value for r in characteristic_roots(system, -0.2) if abs(r.value.real) < 0.2]
            assert 2 * len(near) >= abs(reduced - exact)
    assert agree >= 0.9 * COUNT
