"""Roots of a turned string by mode: of the plant in modes and of the exact string."""

import dataclasses
import json
import math

import casadi as ca
import numpy as np
import pytest

from drillctrl import (
    BitRock,
    DriveMachine,
    FreeBit,
    InputError,
    Load,
    PaperLaw,
    RigPoint,
    Stribeck,
    Transfer,
    as_case,
    characteristic_roots,
    cli,
    close_loop,
    drive_control,
    preset_structure,
    string_preset,
)
from drillctrl.base.language import SI
from drillctrl.cli.drive_law import driven_case
from drillctrl.spectrum import characteristic
from drillctrl.strings.drive_law import companion, driven_plant, without_integral
from drillctrl.strings.drive_roots import drive_roots
from drillctrl.strings.exact import exact_loop
from drillctrl.strings.named_roots import named_roots
from tests.strings.finite_drive import root_near

LATE = DriveMachine(2900.0, 60e3, delay=0.02, lag=0.005, encoder=0.002)
RPM, M_PER_H = math.pi / 30.0, 1.0 / 3600.0


def turned(name, machine):
    rig = dataclasses.replace(string_preset("vertical-3000"), drive=machine)
    control = drive_control(name, rig)
    case = as_case(RigPoint(rig, 120 * RPM, 10 * M_PER_H), driven_plant(rig, control))
    return rig, control, case


@pytest.mark.long(but=1)
@pytest.mark.parametrize("machine", [DriveMachine(2900.0), LATE])
@pytest.mark.parametrize("name", ["stiff", "soft-torque", "z-torque", "dynamic-1"])
def test_a_law_in_the_plant_has_the_roots_of_the_exact_string(name, machine):
    _, control, case = turned(name, machine)
    loop = case.system(())
    exact = exact_loop(case, lambda s: s * control.impedance(s))
    named = named_roots(case)
    assert named.control == control
    kinds = [root.mode.kind for root in named.roots]
    assert kinds == sorted(kinds, reverse=True)
    for root in named.roots[:3]:
        near = root.value / exact.rate
        assert exact.root(near) == pytest.approx(near, rel=1e-8)
        assert root_near(loop, near) == pytest.approx(near, rel=1e-4)


def test_names_of_the_papers_string():
    rig = string_preset("paper-string")
    case = as_case(RigPoint(rig, 180 * RPM, 5 * M_PER_H))
    named = {root.mode.name: root for root in named_roots(case).roots}
    # Of the plant in modes, by collocation and Newton's method.
    roots = [root.value / rig.time_scale for root in characteristic_roots(case.system(), -0.08)]
    known_names = {"1st torsional": 0.447, "2nd torsional": 1.690, "3rd torsional": 3.138}
    known_names |= {"4th axial": 7.578, "5th axial": 9.882}
    for name, hertz in known_names.items():
        known = min(roots, key=lambda s: abs(s.imag / (2 * math.pi) - hertz))
        assert named[name].value == pytest.approx(known, rel=1e-3)
        assert named[name].damping_ratio == pytest.approx(-known.real / abs(known), abs=2e-4)
        assert named[name].frequency == pytest.approx(hertz, abs=2e-3)


def test_names_with_feedback_at_the_bit():
    rig = string_preset("paper-string")
    case = as_case(RigPoint(rig, 180 * RPM, 5 * M_PER_H))
    structure, gains = preset_structure("case2"), ([[-0.5, -0.8]], [[0.3, 0.2]])
    told = named_roots(case, structure, *map(np.array, gains))
    assert told.control is None
    system = close_loop(case.system(("torque",)), structure, *gains)
    for root in told.roots[:3]:
        s = root.value * rig.time_scale
        step = 1.0 / characteristic.log_derivative_at(system, s * (1 + 1e-9))
        assert abs(step) < 1e-3 * abs(s)
        assert root.critical_slope is None


def test_a_law_loses_nothing_in_its_states():
    law = Transfer((3.0, 2.0, 5.0, 7.0), (1.0, 4.0, 6.0, 0.0))
    k, rest = without_integral(law)
    s = np.array([0.3 + 0.7j, -0.4 + 2.0j])
    assert k / s + rest(s) == pytest.approx(law(s), rel=1e-12)
    a, b, c, d = companion(rest)
    for at in s:
        value = c @ np.linalg.solve(at * np.eye(2) - a, b) + d
        assert value == pytest.approx(complex(rest(at)), rel=1e-12)


RIG = ("--rig", "vertical-3000", "--speed", "120 rpm", "--rop", "10 m/h")


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main(["analyze", *arguments])
    said = capsys.readouterr()
    return stop.value.code, said.out, said.err


@pytest.mark.long
def test_analyze_tells_modes_and_reflection(capsys):
    code, said, _ = run(capsys, *RIG, "--structure", "soft-torque", "--json")
    assert code == 0
    fields = json.loads(said)
    assert fields["structure"] == "soft-torque"
    first = fields["modes"][0]
    assert (first["kind"], first["number"], first["name"]) == ("torsional", 1, "1st torsional")
    assert {mode["kind"] for mode in fields["modes"]} == {"torsional", "axial"}
    assert all(mode["damping_ratio"] > 0.0 for mode in fields["modes"][:4])
    # By its rule: Kp = 4 ζ, Ki = ω1² J with the first mode under a held top.
    kp, ki = fields["drive"]["law"]["speed"]["numerator"]
    assert math.sqrt(ki / 2900.0) / (2 * math.pi) == pytest.approx(0.166, abs=1e-3)
    reflection = fields["reflection"]
    least = int(np.argmin(reflection["magnitudes"]))
    assert reflection["magnitudes"][least] == pytest.approx(0.6, abs=5e-3)
    assert reflection["frequencies"][least] == pytest.approx(0.166, abs=5e-3)
    rig = string_preset("vertical-3000")
    where = RigPoint(rig, 120 * RPM, 10 * M_PER_H)
    given = f"{-ki} N*m/rad, {-kp} N*m*s/rad"
    case = driven_case(where, "soft-torque", (given, None), False, PaperLaw())
    named = named_roots(case)
    lines = named.lines
    assert [label for label, _ in lines[:2]] == ["Drive", "Modes"]
    told = lines[2][1]
    assert told.startswith(f"1st torsional: {first['frequency']:.4g} Hz")
    assert told.endswith(f"critical slope {first['critical_slope']:.4g} N·m·s")
    # Told at once are the first three of each kind and what grows.
    shown = [root.text(SI) for root in named.roots if root.mode.number <= 3 or grows(root)]
    assert [text for _, text in lines[2 : 2 + len(shown)]] == shown
    others = [text for _, text in named.others]
    assert sorted(shown + others) == sorted(root.text(SI) for root in named.roots)
    assert len(others) > 10
    assert lines[2 + len(shown)][1].startswith(f"{len(others)} more modes die away")


def grows(root):
    return root.damping_ratio is not None and root.damping_ratio < 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*RIG, "--structure", "stiff", "--K1", "7 kN*m/rad, -1 kN*m*s/rad"), "--K1"),
        ((*RIG, "--structure", "z-torque", "--K1", "-7 kN*m/rad, -1 kN*m*s/rad"), "--K1"),
        ((*RIG, "--structure", "stiff", "--K1", "-7, -1"), "--K1"),
        ((*RIG, "--structure", "stiff", "--K2", "-7"), "--K2"),
        ((*RIG, "--structure", "stiff", "--trials", "all"), "--trials"),
        ((*RIG, "--structure", "dynamic-x"), "structure = dynamic-x"),
        (("--structure", "stiff"), "--structure"),
        (("--rig", "paper-string", *RIG[2:], "--structure", "stiff"), "[top_drive]"),
        (("--rig", "table1", *RIG[2:], "--structure", "stiff"), "[top_drive]"),
    ],
)
def test_what_does_not_fit_a_drive_is_refused(capsys, arguments, message):
    code, said, error = run(capsys, *arguments)
    assert (code, said) == (2, "")
    assert message in error.splitlines()[-1]


@pytest.mark.long
def test_a_free_bit_and_one_whose_torque_falls():
    """Free: the roots of string and drive alone; falling: over its critical slope a mode grows."""
    rig, control, _ = turned("soft-torque", LATE)
    point = RigPoint(rig, 120 * RPM, 10 * M_PER_H)
    free = named_roots(as_case(point, driven_plant(rig, control, FreeBit())))
    known = {round(r.frequency, 6): r for r in drive_roots(rig.string.torsion, control, 5.0)}
    for root in free.roots[1:4]:
        assert known[round(root.frequency, 6)].damping_ratio == pytest.approx(root.damping_ratio)
    second = free.roots[1]
    # No weight, no wear: what is left of the law is the fall.
    for share, grows in ((0.9, False), (1.1, True)):
        decay = 2.0
        drop = share * second.critical_slope * decay * math.exp(4.0 * math.pi / decay)
        scaled = {"drop": drop / rig.torsional_stiffness, "decay": decay * rig.time_scale}
        law = FallOnly(**scaled)
        found = named_roots(as_case(point, driven_plant(rig, control, law)))
        assert (found.roots[1].damping_ratio < 0.0) == grows


class FallOnly(BitRock):
    parameters = Stribeck.parameters
    quantities = Stribeck.quantities

    def load(self, c, contact, rates, q):
        return Load(ca.SX(0), q.drop * ca.exp(-rates.rotary / q.decay))


def test_the_law_of_the_bit_on_the_command_line(capsys):
    point = ("--rig", "paper-string", *RIG[2:])
    code, said, _ = run(capsys, *point, "--bit-law", "none", "--json")
    assert code == 0
    fields = json.loads(said)
    assert fields["modes"][0]["frequency"] == pytest.approx(0.448, abs=2e-3)
    falling = ("--bit-law", "stribeck", "--drop", "20 kN*m", "--decay", "10 rad/s")
    code, said, _ = run(capsys, *point, *falling, "--json")
    assert code == 0
    # 2000 exp(−4 π/10) N m s exceeds what the first mode stands.
    assert json.loads(said)["modes"][0]["damping_ratio"] < 0.0
    for wrong, message in (
        (("--bit-law", "stone"), "--bit-law"),
        (("--drop", "2 kN*m"), "--drop"),
        (("--bit-law", "stribeck", "--drop", "2"), "--drop"),
        (("--bit-law", "stribeck", "--decay", "0 rpm"), "--decay"),
    ):
        code, said, error = run(capsys, *point, *wrong)
        assert (code, said) == (2, "")
        assert message in error


def test_a_case_of_something_else_has_no_names():
    assert named_roots(as_case(RigPoint(string_preset("vertical-3000"), 12.0, 3e-3))) is None
    with pytest.raises(InputError, match="structure = softer"):
        drive_control("softer", string_preset("vertical-3000"))
