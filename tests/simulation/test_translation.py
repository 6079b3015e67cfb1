"""The generated kernel computes what CasADi computes."""

from __future__ import annotations

import math

import casadi as ca
import numba
import numpy as np
import pytest

from drillctrl.drilling.case import as_case
from drillctrl.drilling.linear import rhs_function
from drillctrl.drilling.motion import kinematic_functions, load_function
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.compile import kernel, law_address
from drillctrl.simulation.kernel import data
from drillctrl.simulation.layout import settings_for
from drillctrl.simulation.structure import structure_of
from drillctrl.simulation.translate import translate

RNG = np.random.default_rng(7)
POINT = OperatingPoint(10.0, 2.5, 14.0)
CASE = as_case(POINT)


def as_python(function: ca.Function):
    """Compile a translation as plain Python."""
    space = {"math": math}
    exec(translate(function), space)
    return space[function.name()]


def arguments(function: ca.Function) -> list:
    sizes = [function.nnz_in(i) for i in range(function.n_in())]
    return [RNG.normal(size=size) * 3.0 for size in sizes]


def plain(values: list) -> list:
    return [float(v[0]) if v.size == 1 else tuple(v.tolist()) for v in values]


def compiled_load(case):
    """The law of a case as the kernel calls it."""
    load, address = kernel("law").load, law_address(structure_of(case).law)
    called = numba.njit(lambda contact, rates, law: load(contact, rates, law))
    return lambda contact, rates, q: called(contact, rates, (address, np.array(q)))


@pytest.mark.parametrize("index", range(4))
def test_compiled_physics_equals_casadi(index):
    function = (load_function(CASE.plant.bit), *kinematic_functions())[index]
    name = function.name()
    compiled = compiled_load(CASE) if name == "load" else getattr(kernel("physics"), name)
    for _ in range(50):
        values = arguments(function)
        expected = function(*values).full().ravel()
        result = np.atleast_1d(compiled(*plain(values)))
        np.testing.assert_allclose(result, expected, rtol=1e-13, atol=1e-13)


def test_translation_of_switches_equals_casadi():
    function = rhs_function(CASE.plant)
    translated = as_python(function)
    seen = set()
    for _ in range(1000):
        values = arguments(function)
        values[-1] = CASE.parameter_vector * RNG.uniform(0.5, 2.0, 9)
        # Both sides of every switch, and the switches themselves.
        values[0][1] = RNG.choice([-1.0, 0.0, 1.0]) * 25.0 - values[-1][0] * values[-1][1]
        values[0][3] = RNG.choice([-2.0, 0.0, 2.0]) - values[-1][0]
        expected = function(*values).full().ravel()
        np.testing.assert_allclose(translated(*plain(values)), expected, rtol=1e-12, atol=1e-12)
        seen.add(tuple(np.sign(np.round(expected, 6))))
    assert len(seen) > 4


def test_every_elementary_operation():
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    expressions = [
        ca.sin(x) + ca.cos(y) * ca.tan(x / 4),
        ca.exp(x) - ca.sqrt(ca.fabs(y)) + ca.log(1 + x**2),
        ca.fmin(x, y) - ca.fmax(x, 2 * y) + ca.tanh(y),
        ca.if_else(ca.logic_and(x < y, y > 0), x * x, -1 / (3 + y)),
        ca.if_else(ca.logic_or(x <= y, ca.logic_not(y > 0)), ca.sign(x), x**3),
        (2 + ca.sin(x)) ** y,
    ]
    function = ca.Function("f", [x, y], [ca.vertcat(*expressions)])
    translated = as_python(function)
    for a, b in RNG.normal(size=(100, 2)):
        np.testing.assert_allclose(
            translated(a, b), function(a, b).full().ravel(), rtol=1e-13, atol=1e-13
        )


def test_unknown_operation_is_refused():
    x = ca.SX.sym("x")
    with pytest.raises(NotImplementedError, match="operation"):
        translate(ca.Function("f", [x], [ca.erf(x)]))


@pytest.mark.parametrize("torsion", ["FORWARD", "REVERSE"])
@pytest.mark.parametrize("axial", ["DOWN", "UP"])
@pytest.mark.parametrize("contact", [0, 1])
def test_branches_are_the_plant_away_from_its_switches(torsion, axial, contact):
    string = structure_of(CASE)
    contacts = kernel("contact")
    p = CASE.parameter_vector
    tau = 0.2
    z_rate = 3.0 if axial == "DOWN" else -3.0
    turn = 4.0 if torsion == "FORWARD" else -4.0
    state = np.array([1.5, z_rate - 25.0, 0.3, turn - 10.0])
    depth = 9.0 if contact else -9.0
    then = np.zeros(4)
    then[0] = state[0] + 25.0 * tau - depth / 4.0
    expected = rhs_function(CASE.plant)(state, then, tau, [0.1, 0.2], p).full().ravel()
    settings = settings_for(
        string, None, np.zeros((1, 9)), duration=1.0, linear=False, multiple=True, backwards=False,
        rtol=1e-8, atol=1e-10,
    )  # fmt: skip
    arrays = string.arrays
    alone = arrays.A @ state + arrays.B @ [0.1, 0.2]
    load = contacts.bit_load(
        alone[1], alone[3], depth, (z_rate, turn), contact, getattr(data, torsion),
        getattr(data, axial), 0, (0.0, 0.0, 0.0), settings.real, settings.law,
        np.zeros(data.P_ROOM),
    )  # fmt: skip
    found = alone + arrays.E @ (np.array(load) - arrays.steady)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
