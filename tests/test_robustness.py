import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drillctrl import (
    DelaySystem,
    InputError,
    close_loop,
    dominant_roots,
    plant_system,
    preset_structure,
    spectral_abscissa,
)
from drillctrl.robustness import (
    delay_margin,
    parameter_margin,
    pseudospectral_abscissa,
    real_stability_radius,
    stability_radius,
    with_delay_factor,
)
from drillctrl.spectrum import characteristic


@pytest.fixture(scope="module")
def loop(plant_c):
    return close_loop(plant_c, preset_structure("case1"), [-5.17], [5.06])


def test_ordinary_system_has_its_textbook_radius():
    """A normal matrix: the distance of its spectrum from the axis."""
    system = DelaySystem(np.array([[-0.3, 2.0], [-2.0, -0.3]]), (), (), np.zeros((2, 1)), np.eye(2))
    radius = stability_radius(system, [1.0])
    assert radius.value == pytest.approx(0.3, abs=1e-9)
    assert radius.frequency == pytest.approx(2.0, abs=1e-4)
    assert radius.lower_bound <= radius.value <= 1.01 * radius.lower_bound


def test_the_worst_perturbation_puts_a_root_on_the_axis(loop):
    radius = stability_radius(loop, [1.0, 0.0])
    delta = characteristic.matrix(loop, 1j * radius.frequency)
    left, sizes, right = np.linalg.svd(delta)
    assert sizes[-1] == pytest.approx(radius.value, rel=1e-8)
    # The rank-one matrix of this norm makes Δ − δA0 singular; it is complex.
    worst = sizes[-1] * np.outer(left[:, -1], right[-1])
    assert abs(np.linalg.det(delta - worst)) < 1e-9 * abs(np.linalg.det(delta))


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_smaller_perturbations_never_destabilise(loop, seed):
    rng = np.random.default_rng(seed)
    radius = stability_radius(loop).lower_bound

    def perturbed(matrix):
        noise = rng.normal(size=matrix.shape)
        noise *= 0.999 * radius * np.linalg.norm(matrix, 2) / np.linalg.norm(noise, 2)
        return matrix + noise

    other = replace(loop, A0=perturbed(loop.A0), delayed=(perturbed(loop.delayed[0]),))
    assert spectral_abscissa(other) < 0


def test_real_radius_lies_above_the_complex_one_of_the_same_matrix(loop):
    norm = np.linalg.norm(loop.A0, 2)
    complex_radius = stability_radius(loop, [norm, 0.0]).value
    real = real_stability_radius(loop)
    assert real.value >= complex_radius * (1 - 1e-9)
    rng = np.random.default_rng(0)
    for _ in range(200):
        noise = rng.normal(size=(4, 4))
        noise *= 0.99 * real.value * norm / np.linalg.norm(noise, 2)
        assert spectral_abscissa(replace(loop, A0=loop.A0 + noise)) < 0


def test_unstable_loops_have_no_radius(plant_c):
    assert stability_radius(plant_c).value == 0.0
    with pytest.raises(InputError, match="unstable"):
        delay_margin(plant_c)


def test_pseudospectral_abscissa_crosses_zero_at_the_radius(loop):
    radius = stability_radius(loop).value
    assert pseudospectral_abscissa(loop, radius) == pytest.approx(0.0, abs=1e-6)
    assert pseudospectral_abscissa(loop, 0.0) == spectral_abscissa(loop)


def test_perturbed_roots_stay_left_of_the_pseudospectral_abscissa(loop):
    epsilon, rng = 2e-4, np.random.default_rng(0)
    limit = pseudospectral_abscissa(loop, epsilon)
    reached = []
    for _ in range(300):
        noise = rng.normal(size=(4, 4))
        noise *= epsilon * np.linalg.norm(loop.A0, 2) / np.linalg.norm(noise, 2)
        reached.append(spectral_abscissa(replace(loop, A0=loop.A0 + noise)))
    assert max(reached) <= limit
    # The bound is not idle: random real noise in A0 alone comes a good part of the way.
    alpha = spectral_abscissa(loop)
    assert max(reached) - alpha > 0.1 * (limit - alpha)


def test_delay_margin_of_a_scalar_equation():
    """x' = a x + b x(t − τ) with b < −|a| loses stability at arccos(−a/b)/sqrt(b² − a²)."""
    a, b = -0.4, -1.5
    critical = math.acos(-a / b) / math.sqrt(b * b - a * a)
    system = DelaySystem([[a]], ([[b]],), (0.5,), [[1.0]], [[1.0]])
    margin = delay_margin(system)
    assert margin.longer * 0.5 == pytest.approx(critical, rel=1e-12)
    assert margin.frequency_longer == pytest.approx(math.sqrt(b * b - a * a), rel=1e-12)
    assert margin.shorter == 0.0


def test_at_the_delay_margin_a_root_is_on_the_axis(loop):
    margin = delay_margin(loop)
    top = dominant_roots(with_delay_factor(loop, margin.longer))[0]
    assert top.real == pytest.approx(0.0, abs=1e-10)
    assert top.imag == pytest.approx(margin.frequency_longer, rel=1e-8)
    for factor in np.linspace(max(margin.shorter, 0.01) + 1e-3, margin.longer - 1e-3, 60):
        assert spectral_abscissa(with_delay_factor(loop, float(factor))) < 0
    assert spectral_abscissa(with_delay_factor(loop, margin.longer * 1.001)) > 0


@pytest.mark.parametrize("name", ["psi", "delta0", "omega0"])
def test_parameter_margins_end_where_stability_does(point_c, name):
    structure = preset_structure("case1")

    def at(error):
        point = point_c.with_changes(**{name: getattr(point_c, name) * (1 + error)})
        return close_loop(plant_system(point), structure, [-5.17], [5.06])

    margin = parameter_margin(at, limit=9.0, points=90)
    assert margin.lower < 0 < margin.upper
    for end, none in ((margin.lower, -1.0), (margin.upper, 9.0)):
        if end != none:
            assert spectral_abscissa(at(end)) == pytest.approx(0.0, abs=1e-9)
    inside = np.linspace(margin.lower + 1e-3, margin.upper - 1e-3, 37)
    assert all(spectral_abscissa(at(float(e))) < 0 for e in inside)


@pytest.mark.parametrize("weights", [[1.0], [-1.0, 1.0], [0.0, 0.0], [math.nan, 1.0]])
def test_bad_weights_are_refused(loop, weights):
    with pytest.raises(InputError, match="weights"):
        stability_radius(loop, weights)
