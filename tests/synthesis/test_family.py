import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drillctrl import dominant_roots, plant_system, preset_structure
from drillctrl.synthesis.descent import bfgs, from_box, to_box
from drillctrl.synthesis.family import loop_family

from ..strategies import points

names = st.sampled_from(["p", "case1", "pd", "case2"])


@given(points, names, st.integers(0, 10**6))
def test_family_has_the_abscissa_of_the_loop(point, name, seed):
    structure = preset_structure(name)
    family = loop_family(plant_system(point), structure)
    gains = np.random.default_rng(seed).uniform(structure.lower, structure.upper)
    root = dominant_roots(family.loop(gains))[0]
    if root.multiplicity > 1:
        return
    value, _ = family.abscissa(gains)
    assert value == pytest.approx(root.rightmost, abs=2e-5 + 1e-10 * root.condition)


@given(points, names, st.integers(0, 10**6))
def test_gradient_matches_differences(point, name, seed):
    structure = preset_structure(name)
    family = loop_family(plant_system(point), structure)
    gains = np.random.default_rng(seed).uniform(structure.lower, structure.upper)
    top = dominant_roots(family.loop(gains))
    gap = min([abs(root.value - top[0].value) for root in top[1:]] or [1.0])
    if top[0].multiplicity > 1 or gap < 0.05 or 0 < top[0].imag < 0.05:
        return
    _, gradient = family.abscissa(gains)
    for j, slope in enumerate(gradient):
        h = 1e-6 * np.eye(gains.size)[j]
        difference = (family.abscissa(gains + h)[0] - family.abscissa(gains - h)[0]) / 2e-6
        assert slope == pytest.approx(difference, abs=1e-4 * (1 + np.abs(gradient).max()))


@given(st.lists(st.floats(-100, 100), min_size=2, max_size=2))
def test_the_box_is_never_left(y):
    lower, upper = np.array([-10.0, 0.1]), np.array([10.0, 0.3])
    x, _ = to_box(np.array(y), lower, upper)
    assert (lower <= x).all()
    assert (x <= upper).all()
    again, _ = to_box(from_box(x, lower, upper), lower, upper)
    assert again == pytest.approx(x, abs=1e-7)


def test_descent_follows_a_curved_ridge():
    """The nonsmooth Rosenbrock function, 8|x² − y| + (1 − x)²."""

    def objective(z):
        side = np.sign(z[0] ** 2 - z[1])
        value = 8 * abs(z[0] ** 2 - z[1]) + (1 - z[0]) ** 2
        return value, np.array([16 * side * z[0] - 2 * (1 - z[0]), -8 * side])

    lower, upper = np.array([-3.0, -3.0]), np.array([3.0, 3.0])
    end = bfgs(objective, np.array([-1.0, 0.7]), lower, upper, most=2000)
    assert end.gains == pytest.approx([1.0, 1.0], abs=1e-3)


def test_descent_finds_a_minimum_on_a_face():
    def objective(z):
        return float(np.abs(z - [5.0, 0.2]).sum()), np.sign(z - [5.0, 0.2])

    end = bfgs(objective, np.zeros(2), -np.ones(2), np.ones(2), most=500)
    assert end.gains == pytest.approx([1.0, 0.2], abs=1e-4)
