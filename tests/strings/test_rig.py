"""Strings in the plant: lumped, reduced and exact."""

import dataclasses
import math

import numpy as np
import pytest

from drillctrl import (
    DriveMachine,
    InputError,
    OperatingPoint,
    RigPoint,
    characteristic_roots,
    close_loop,
    count_right_of,
    simulate,
    soft_torque,
    soft_torque_control,
    spectral_abscissas,
)
from drillctrl.drilling.case import as_case
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.rig import table1
from drillctrl.strings.catalogue import pipe, pipe_names
from drillctrl.strings.changed import changed_rig
from drillctrl.strings.exact import exact_loop
from drillctrl.strings.model import PipeString
from drillctrl.strings.presets import PRESETS, paper_string, string_preset
from drillctrl.strings.rig import lump
from drillctrl.strings.section import Section
from tests.strings.finite_drive import root_near

RPM, M_PER_H = np.pi / 30.0, 1.0 / 3600.0


def test_the_papers_string_lumps_to_table_1():
    rig = paper_string()
    assert rig.torsional_stiffness == pytest.approx(938.096, abs=5e-4)
    assert rig.axial_stiffness == pytest.approx(7.01361e5, abs=0.5)
    assert rig.inertia == pytest.approx(115.541, abs=5e-4)
    assert rig.mass == pytest.approx(34426.3, abs=0.05)
    known = table1()
    for name in ("mass", "inertia", "axial_stiffness", "torsional_stiffness"):
        assert getattr(rig, name) == pytest.approx(getattr(known, name), rel=0.02)
    for name in ("axial_damping", "torsional_damping"):
        assert getattr(rig, name) == pytest.approx(getattr(known, name), rel=0.02)
    assert type(lump(rig)) is type(known)


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize(("speed", "rate"), [(120, 20), (180, 5)])
def test_reduced_and_exact_loops_agree(name, speed, rate):
    rig = string_preset(name)
    point = RigPoint(rig, speed * RPM, rate * M_PER_H)
    case = as_case(point, paper_plant(string=PipeString(rig.string, 3.0, 6.0, 5e-2)))
    loop = exact_loop(case)
    roots = [root.value for root in characteristic_roots(case.system(), -0.3)]
    slow = [root for root in roots if abs(root.imag) < 3.0 * 2.0 * np.pi / loop.rate]
    assert len(slow) >= 2
    for root in slow:
        assert abs(loop.root(root) - root) < 5e-3 * max(abs(root), 1.0)


def test_counts_agree_on_the_papers_string():
    rig = paper_string()
    for speed, rate, count in ((120, 20, 4), (60, 30, 4), (180, 5, 0)):
        case = as_case(RigPoint(rig, speed * RPM, rate * M_PER_H))
        assert exact_loop(case).count_right_of(0.0) == count
        assert count_right_of(case.system(), 0.0).count == count


def test_an_exact_root_is_one_of_the_lumped_plant_where_the_string_is_stiff():
    # Slow drilling of soft rock: the bit moves with the string's first modes.
    rig = paper_string().with_rock_strength(1e4)
    point = RigPoint(rig, 200.0 * RPM, 1.0 * M_PER_H)
    loop = exact_loop(as_case(point))
    lumped = as_case(RigPoint(lump(rig), point.rotary_speed, point.penetration_rate))
    for root in characteristic_roots(lumped.system(), -0.5):
        assert abs(loop.root(root.value) - root.value) < 0.03


def test_groups_that_the_string_replaces_are_refused():
    case = as_case(RigPoint(paper_string(), 120.0 * RPM, 20.0 * M_PER_H))
    with pytest.raises(InputError, match="eta"):
        case.with_changes(eta=2.0)
    assert "xi" not in case.parameters
    assert as_case(OperatingPoint(10, 2, 14)).plant == paper_plant()


def test_numbers_that_contradict_the_string_are_refused():
    import dataclasses

    with pytest.raises(InputError, match="follows from the string"):
        dataclasses.replace(paper_string(), mass=4e4)


def test_pipe_by_name():
    assert set(pipe_names()) >= {'5" 19.5#', '5 1/2" 21.9#', '5" HWDP'}
    found = pipe("5 in 19.5 lb/ft")
    # API RP 7G: wall 9.19 mm; about 31 kg/m with its tool joints.
    assert found.outer_diameter - found.inner_diameter == pytest.approx(2 * 9.19e-3, abs=1e-4)
    section = Section(
        "pipe", found.kind, 9.6, found.outer_diameter, found.inner_diameter, found.tool_joint
    )
    assert section.mass_per_metre == pytest.approx(31.0, rel=0.05)
    with pytest.raises(InputError, match="19.5#"):
        pipe('5" 20.5#')


def test_a_bore_wider_than_the_pipe_is_refused():
    with pytest.raises(InputError, match="ID of pipe"):
        Section("pipe", "pipe", 1000.0, 0.108, 0.127)


def test_a_late_drive_has_the_roots_of_the_exact_string():
    """PI control through a lag and a delay, on the plant and by transfer matrices."""
    machine = DriveMachine(2900.0, 60e3, delay=0.05, lag=0.02)
    rig = dataclasses.replace(string_preset("vertical-3000"), drive=machine)
    case = as_case(RigPoint(rig, 4.0 * math.pi, 10 / 3600))
    law = soft_torque_control(machine, rig.string.torsion.wave_impedance, 0.2)
    kp, ki = law.speed.numerator
    gains = [-ki / rig.torsional_stiffness, -kp / (rig.torsional_stiffness * rig.time_scale)]
    system = case.system(("drive",))
    assert system.input_delays == (pytest.approx(0.05 / rig.time_scale),)
    loop = close_loop(system, soft_torque(), gains)
    exact = exact_loop(case, lambda s: s * law.impedance(s))
    roots = [-0.07 + 0.88j, -0.15 + 1.3j, -0.05 + 3.51j, -0.14 + 5.06j, -0.05 + 6.37j]
    for near in roots:
        root = exact.root(near)
        assert abs(root - near) < 0.02
        assert root_near(loop, near) == pytest.approx(root, rel=1e-4)
    for refused in (
        lambda: spectral_abscissas(case, {"psi": [14.0]}, soft_torque(), gains),
        lambda: simulate(case, duration=1.0),
    ):
        with pytest.raises(InputError, match="late"):
            refused()


def test_a_place_says_how_long_the_string_is():
    """Two depths of one rig are two places; a rig that is lumped has none."""
    rig = string_preset("vertical-3000")
    places = [
        as_case(RigPoint(each, 12.0, 0.002)).place
        for each in (rig, changed_rig(rig, depth=2500.0), table1())
    ]
    assert [place.count(" of string") for place in places] == [1, 1, 0]
    assert places[0].endswith("3000 m of string")
    assert places[1].endswith("2500 m of string")
