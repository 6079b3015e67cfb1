import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import lambertw

from drillctrl import (
    DelaySystem,
    InputError,
    OperatingPoint,
    analyze_loop,
    characteristic_roots,
    close_loop,
    dominant_roots,
    plant_system,
    preset_structure,
    spectral_abscissa,
)
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.pseudospectral import approximate_roots, degree_for

from ..strategies import loops


def scalar(a, b, tau):
    return DelaySystem([[a]], ([[b]],), (tau,), [[1.0]], [[1.0]])


def determinant(system, s):
    return np.linalg.det(characteristic.matrix(system, s))


def characteristic_function(point, gains, s):
    """The characteristic equation with control, typed from the model, not from the plant."""
    p1, p2, q1, q2 = gains
    n, psi, d = point.blades, point.psi, point.delta0
    e = np.exp(-s * point.delay)
    da = s**2 + 2 * point.xi * point.eta * s + point.eta**2
    dt = s**2 + 2 * point.kappa * s + 1
    c = p1 + p2 * s + (q1 + q2 * s) * e
    return (da + n * psi * (1 - e)) * (dt - c) - da * n * d * (1 - e)


def test_open_loop_root_at_point_c(plant_c):
    root = dominant_roots(plant_c)[0]
    assert root.real == pytest.approx(0.009760358069533952, abs=1e-13)
    assert root.imag == pytest.approx(0.8930716683243664, abs=1e-13)
    assert root.multiplicity == 1
    assert root.converged
    assert spectral_abscissa(plant_c) == pytest.approx(0.009760358069533952, abs=1e-13)


@pytest.mark.parametrize(
    ("omega0", "delta0", "alpha", "places"),
    [
        (10.0, 1.33, -1.2e-4, 5),
        (10.0, 1.0, -0.0065, 4),
        (10.0, 1.75, 0.00976, 5),
        (5.1, 1.75, -0.0028, 4),
        (5.1, 0.25, 0.1735, 4),
    ],
)
def test_the_five_points_of_figure_8(omega0, delta0, alpha, places):
    found = spectral_abscissa(plant_system(OperatingPoint(omega0, delta0, 14.0)))
    assert found == pytest.approx(alpha, abs=0.51 * 10**-places)


def test_triple_root_is_one_root_of_multiplicity_three(plant_c):
    loop = close_loop(plant_c, preset_structure("case1"), [-9.525113872283], [9.220013710400])
    root = dominant_roots(loop)[0]
    assert root.multiplicity == 3
    assert root.real == pytest.approx(-0.811927438342, abs=1e-9)
    assert root.imag == 0.0
    assert 0.0 < root.spread < 1e-3
    analysis = analyze_loop(loop)
    assert analysis.certificate.agrees
    assert analysis.certificate.counted >= 3


def test_quadruple_root_is_one_root_of_multiplicity_four(plant_c):
    gains = [-9.861254902, 3.695722915], [10.0, -2.673320042]
    loop = close_loop(plant_c, preset_structure("case2"), *gains)
    root = dominant_roots(loop)[0]
    assert root.multiplicity == 4
    assert root.real == pytest.approx(-1.392998065, abs=1e-8)
    # Ten digits of the gains leave the fourth root of 1e-10 of freedom.
    assert root.real < root.rightmost < root.real + 0.02
    assert count_right_of(loop, root.rightmost + 1e-3).count == 0
    assert count_right_of(loop, root.rightmost - 1e-3).count >= 1


@pytest.mark.parametrize("delta0", [5.71875, 5.72, 0.25 + 14.0 / 1.6**2])
def test_singular_a0_is_no_special_point(delta0):
    """At nδ0 = 1 + nψ/η² the matrix A0 has no inverse."""
    point = OperatingPoint(10.0, delta0, 14.0)
    root = dominant_roots(plant_system(point))[0]
    assert abs(characteristic_function(point, (0, 0, 0, 0), root.value)) < 1e-11


@given(st.floats(-3, 3), st.floats(-3, 3).filter(lambda b: abs(b) > 1e-3), st.floats(0.05, 5))
def test_scalar_roots_are_lambert_functions(a, b, tau):
    """x' = a x + b x(t − τ) has the roots a + W_k(bτ exp(−aτ))/τ."""
    argument = b * tau * math.exp(-a * tau)
    # Next to the branch point two roots nearly coincide and the real part is ill conditioned.
    if abs(argument + math.exp(-1)) < 1e-3:
        return
    exact = max((a + lambertw(argument, k) / tau).real for k in range(-3, 4))
    assert spectral_abscissa(scalar(a, b, tau)) == pytest.approx(exact, abs=1e-11)


def test_double_root_of_a_scalar_equation_is_found_exactly():
    """bτ exp(1 − aτ) = −1 makes a double root at a − 1/τ."""
    a, tau = 0.3, 0.8
    root = dominant_roots(scalar(a, -math.exp(a * tau - 1) / tau, tau))[0]
    assert root.multiplicity == 2
    assert root.real == pytest.approx(a - 1 / tau, abs=1e-12)


def test_semisimple_root_counts_twice():
    """Two equal subsystems side by side: a double root with two eigenvectors."""
    twice = DelaySystem(0.2 * np.eye(2), (-0.7 * np.eye(2),), (1.0,), np.zeros((2, 1)), np.eye(2))
    single = dominant_roots(scalar(0.2, -0.7, 1.0))[0]
    root = dominant_roots(twice)[0]
    assert root.multiplicity == 2 * single.multiplicity
    assert root.value == pytest.approx(single.value, abs=1e-9)


def test_ordinary_system_has_its_eigenvalues():
    a = np.array([[0.0, 1.0], [-2.0, -0.3]])
    system = DelaySystem(a, (), (), np.zeros((2, 1)), np.eye(2))
    assert spectral_abscissa(system) == pytest.approx(-0.15)


@given(loops())
def test_roots_solve_the_equation_and_the_count_agrees(loop):
    analysis = analyze_loop(loop)
    assert analysis.certificate.agrees
    for root in analysis.dominant_roots:
        assert root.converged
        if root.multiplicity == 1:
            assert root.residual < 1e-13


@given(loops())
def test_abscissa_is_that_of_a_much_finer_collocation(loop):
    root = dominant_roots(loop)[0]
    if root.multiplicity > 1:
        return
    fine = approximate_roots(loop, 3 * degree_for(loop))[0].real
    assert root.rightmost == pytest.approx(fine, abs=1e-8 + 1e-9 * root.condition)


def test_roots_right_of_a_line_are_all_there(plant_c):
    line = -40.0
    roots = characteristic_roots(plant_c, line)
    total = sum(root.multiplicity * (2 if root.imag > 0 else 1) for root in roots)
    assert total == count_right_of(plant_c, line).count
    assert total > 8
    assert all(root.converged and root.rightmost >= line for root in roots)


def test_several_delays():
    rng = np.random.default_rng(0)
    for _ in range(10):
        system = DelaySystem(
            rng.normal(size=(3, 3)),
            (np.outer(rng.normal(size=3), rng.normal(size=3)), rng.normal(size=(3, 3))),
            (0.3, 1.1),
            np.zeros((3, 1)),
            np.eye(3),
        )
        analysis = analyze_loop(system)
        assert analysis.certificate.agrees
        assert abs(determinant(system, analysis.dominant_roots[0].value)) < 1e-9


@pytest.mark.parametrize("omega0", [0.05, 0.1, 0.3])
def test_long_delays_are_counted_right(omega0):
    for delta0 in (0.2, 3.0, 12.0):
        analysis = analyze_loop(plant_system(OperatingPoint(omega0, delta0, 14.0)))
        assert analysis.certificate.agrees
        assert not analysis.stable


def test_too_far_left_is_refused(plant_c):
    with pytest.raises(InputError, match="right_of = -200"):
        characteristic_roots(plant_c, -200.0)
    with pytest.raises(InputError, match="right_of = nan"):
        characteristic_roots(plant_c, math.nan)


def test_roots_far_left_of_the_first_line_are_found():
    """x' = -x(t - 1/2): the line at which the bound is first drawn encloses no root."""
    system = DelaySystem([[0.0]], ([[-1.0]],), (0.5,), [[1.0]], [[1.0]])
    exact = lambertw(-0.5) / 0.5
    assert spectral_abscissa(system) == pytest.approx(exact.real, abs=1e-12)


def test_four_roots_near_each_other_are_not_taken_for_one():
    """Close to a quadruple root at -1.816 the members lie up to 0.04 apart."""
    point = OperatingPoint(13.411764705882353, 5.8076923076923075, 14.0)
    structure = preset_structure("case2")
    loop = close_loop(
        plant_system(point), structure, [-9.93640766, -2.08057287], [7.72228519, 1.49886138]
    )
    alpha = spectral_abscissa(loop)
    # Counting knows nothing of how roots are found: none right of α, some just left of it.
    assert count_right_of(loop, alpha + 2e-4).count == 0
    assert count_right_of(loop, alpha - 2e-4).count >= 1


def test_a_split_fourfold_root_is_found_whatever_rounding_makes_of_it():
    # Four real roots within 0.07 of each other, which an iteration cannot tell apart.
    point = OperatingPoint(13.411764705882353, 5.8076923076923075, 14)
    gains = [-9.93640766, -2.08057287], [7.72228519, 1.49886138]
    loop = close_loop(plant_system(point), preset_structure("case2"), *gains)
    counts = [count_right_of(loop, -1.7728024850 + off).count for off in (1e-5, -1e-5)]
    assert counts == [0, 1]
    rng = np.random.default_rng(0)
    for _ in range(40):
        noise = 1.0 + 1e-15 * rng.standard_normal(loop.A0.shape)
        other = replace(loop, A0=loop.A0 * noise)
        assert spectral_abscissa(other) == pytest.approx(-1.7728024850, abs=1e-6)
        assert dominant_roots(other)[0].rightmost == pytest.approx(-1.7728024850, abs=1e-6)


def test_a_critically_damped_pair_without_delay_is_told():
    """Iterations on its characteristic function come to rest at rounding beside it."""
    a0 = np.array([[0.0, 0.25], [-0.9907158450717944, -0.9953470977863926]])
    system = DelaySystem(a0, (), (), np.zeros((2, 0)), np.zeros((0, 2)))
    (root,) = characteristic_roots(system, -2.0)
    assert root.multiplicity == 2
    assert root.value == pytest.approx(np.trace(a0) / 2.0, rel=1e-7)
    assert spectral_abscissa(system) == pytest.approx(np.trace(a0) / 2.0, rel=1e-7)


def test_roots_of_many_states_are_those_of_the_matrix_itself(monkeypatch):
    """A chain of masses with a delayed push at its end, by both ways of telling its roots."""
    n = 20
    chain = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    A0 = np.block([[np.zeros((n, n)), np.eye(n)], [-chain, -0.02 * chain]])
    A1 = np.zeros((2 * n, 2 * n))
    A1[-1, n - 1] = 0.3
    system = DelaySystem(A0, (A1,), (1.3,), np.eye(2 * n)[:, :1], np.eye(2 * n)[:1])
    quick = dominant_roots(system)
    monkeypatch.setattr("drillctrl.spectrum.characteristic._FEW_STATES", 1000)
    whole = dominant_roots(system)
    assert len(quick) == len(whole) > 3
    for one, other in zip(quick, whole, strict=True):
        assert one.value == pytest.approx(other.value, abs=1e-12)
        assert one.condition == pytest.approx(other.condition, rel=1e-6)
        assert one.residual < 1e-14
