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
from drillctrl.robustness.axis import crossings
from drillctrl.robustness.margins import delay_margin, parameter_margin, with_delay_factor
from drillctrl.robustness.radius import (
    pseudospectral_abscissa,
    real_stability_radius,
    stability_radius,
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
    assert real_stability_radius(loop, [norm, 0.0]).value >= complex_radius * (1 - 1e-9)


def test_real_errors_below_the_real_radius_never_destabilise(loop):
    sizes = np.array([np.linalg.norm(loop.A0, 2), np.linalg.norm(loop.delayed[0], 2)])
    real = real_stability_radius(loop).value
    rng = np.random.default_rng(0)
    for _ in range(200):
        noise = rng.normal(size=(4, 8))
        noise *= 0.99 * real / np.linalg.norm(noise, 2)
        a0 = loop.A0 + sizes[0] * noise[:, :4]
        a1 = loop.delayed[0] + sizes[1] * noise[:, 4:]
        assert spectral_abscissa(replace(loop, A0=a0, delayed=(a1,))) < 0


@pytest.mark.long(but=1)
@pytest.mark.parametrize(("a", "b", "tau"), [(-0.4, -1.5, 0.5), (-1.0, 0.7, 2.0), (0.3, -0.8, 0.9)])
def test_real_radius_of_a_scalar_equation_is_the_distance_to_its_boundary(a, b, tau):
    """x' = a x + b x(t − τ): the boundary in the plane of a and b is known in closed form."""
    w = np.array([0.8, 1.7])
    omega = np.linspace(1e-9, 40.0, 4_000_001)
    sine = np.sin(omega * tau)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = np.array([omega * np.cos(omega * tau) / sine, -omega / sine])
    distance = np.sqrt((((crossing - [[a], [b]]) / w[:, None]) ** 2).sum(axis=0))
    nearest = min(np.nanmin(distance), abs(a + b) / np.hypot(*w))
    system = DelaySystem([[a]], ([[b]],), (tau,), [[1.0]], [[1.0]])
    assert real_stability_radius(system, list(w)).value == pytest.approx(nearest, rel=1e-6)


@pytest.mark.parametrize("weight", [0.3, 300.0])
def test_errors_of_matrices_and_delay_meet_at_the_radius(loop, weight):
    alone = stability_radius(loop)
    both = stability_radius(loop, delay_weight=weight)
    assert both.value <= alone.value
    assert both.lower_bound <= both.value <= 1.011 * both.lower_bound
    total = sum(np.linalg.norm(m, 2) for m in (loop.A0, loop.delayed[0]))
    worst = with_delay_factor(loop, both.delay_factor)
    delta = characteristic.matrix(worst, 1j * both.frequency)
    assert abs(both.delay_factor - 1.0) <= weight * both.value * (1 + 1e-9)
    assert np.linalg.svd(delta)[1][-1] / total <= both.value * (1 + 1e-9)
    # The delay's error is used up, and so is a good part of the radius for a heavy weight.
    assert abs(both.delay_factor - 1.0) > 0.9 * weight * both.value
    if weight == 300.0:
        assert both.value < 0.9 * alone.value


def test_radius_of_the_delay_alone_is_the_delay_margin():
    system = DelaySystem([[-0.4]], ([[-1.5]],), (1.0,), [[1.0]], [[1.0]])
    margin = delay_margin(system)
    assert 1.0 < margin.longer < 1.5
    # A little error of the matrices must be allowed, or no sample would lie on the axis.
    radius = stability_radius(system, [1e-3, 0.0], delay_weight=1.0)
    assert radius.value == pytest.approx(margin.longer - 1.0, rel=2e-3)
    assert radius.delay_factor == pytest.approx(margin.longer, rel=1e-3)


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


def test_a_far_delay_margin_is_found():
    """x' = a x + b x(t − τ) with |b| barely above |a|: critical far beyond the delay."""
    a, b = -1.0, -1.0001
    omega = math.sqrt(b * b - a * a)
    system = DelaySystem([[a]], ([[b]],), (0.01,), [[1.0]], [[1.0]])
    margin = delay_margin(system)
    assert margin.longer * 0.01 == pytest.approx(math.acos(-a / b) / omega, rel=1e-9)
    assert margin.longer > 1e4
    assert math.isinf(margin.limit)


@pytest.mark.long
@settings(max_examples=20)
@given(st.integers(0, 10**6))
def test_pencil_and_boxes_find_the_same_critical_delays(seed):
    rng = np.random.default_rng(seed)
    a0 = rng.normal(size=(2, 2))
    a0 -= (np.linalg.eigvals(a0).real.max() + 0.8) * np.eye(2)
    system = DelaySystem(a0, (0.9 * rng.normal(size=(2, 2)),), (0.4,), np.eye(2), np.eye(2))
    if spectral_abscissa(system) > -1e-3:
        return
    margin = delay_margin(system)
    factors = [f for f, _ in crossings(system, 0.0, 10.0)]
    above = min((f for f in factors if f > 1.0), default=math.inf)
    if margin.longer < 9.99 or above < 9.99:
        assert above == pytest.approx(margin.longer, rel=1e-8)
    assert max((f for f in factors if f < 1.0), default=0.0) == pytest.approx(
        margin.shorter, rel=1e-8
    )


def test_several_delays_have_a_common_margin(plant_c):
    """The controller's delay is 3 % off the plant's, then both grow together."""
    loop = close_loop(plant_c, preset_structure("case1"), [-5.17], [5.06])
    own = plant_c.delayed[0]
    tau = plant_c.delays[0]
    two = replace(loop, delayed=(own, loop.delayed[0] - own), delays=(tau, 1.03 * tau))
    assert spectral_abscissa(two) < 0
    margin = delay_margin(two)
    assert margin.limit == 10.0
    for factor, omega in (
        (margin.longer, margin.frequency_longer),
        (margin.shorter, margin.frequency_shorter),
    ):
        if 0.0 < factor < math.inf:
            top = dominant_roots(with_delay_factor(two, factor))[0]
            assert top.real == pytest.approx(0.0, abs=1e-9)
            assert top.imag == pytest.approx(omega, rel=1e-7)
    assert margin.longer < 10.0
    for factor in np.linspace(max(margin.shorter, 0.01) + 1e-3, margin.longer - 1e-3, 60):
        assert spectral_abscissa(with_delay_factor(two, float(factor))) < 0


def test_a_narrow_unstable_window_between_the_steps_is_seen():
    def at(error):
        # α = 1e-6 − (error − 0.3021)²: unstable over a fifth of a step only.
        return DelaySystem([[1e-6 - (error - 0.3021) ** 2]], (), (), [[1.0]], [[1.0]])

    margin = parameter_margin(at, limit=1.0, points=100)
    assert margin.upper == pytest.approx(0.3011, abs=1e-9)


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
