"""Designs whose best gains are known by hand: where roots coincide, in a box and in wider ones."""

import math

import numpy as np
import pytest

from drillctrl import DelaySystem, FeedbackStructure, design, pid_control, spectral_abscissa


def within(outputs, K1, K2, inputs=("u",)):
    """A structure whose gains lie within these bounds, either way."""
    K1, K2 = np.array(K1, dtype=float), np.array(K2, dtype=float)
    return FeedbackStructure("mine", outputs, -K1, K1, -K2, K2, inputs)


def lag(a, tau):
    """x' = a x + k x(t − τ): a double root at a − 1/τ, at k = −exp(aτ − 1)/τ."""
    plant = DelaySystem(
        [[a]], B=[[1.0]], state_names=("x",), input_names=("u",), feedback_delay=tau
    )
    size = math.exp(a * tau - 1.0) / tau
    return plant, lambda wide: within(("x",), [[0.0]], [[wide * size]]), a - 1.0 / tau


def integrator_pi(a, tau):
    """x' = a x + u(t − τ), u = kp x + ki ∫x: a triple root of (s² − a s) e^(sτ) = kp s + ki."""
    plant = DelaySystem(
        [[a, 0.0], [1.0, 0.0]],
        B=[[1.0], [0.0]],
        state_names=("x", "sum"),
        input_names=("u",),
        feedback_delay=tau,
    )
    best = (a * tau - 4.0 + math.sqrt((a * tau) ** 2 + 8.0)) / (2.0 * tau)

    def structure(wide):
        return within(("x", "sum"), [[0.0, 0.0]], [[wide / tau, wide / tau**2]])

    return plant, structure, best


def position_twice(damping, stiffness, tau):
    """x'' + d x' + c x = k1 x + k2 x(t − τ): a triple root at −1/τ − d/2."""
    plant = DelaySystem(
        [[0.0, 1.0], [-stiffness, -damping]],
        B=[[0.0], [1.0]],
        state_names=("x", "v"),
        input_names=("u",),
        feedback_delay=tau,
    )
    best = -1.0 / tau - damping / 2.0
    return plant, lambda wide: within(("x",), [[wide / tau**2]], [[wide / tau**2]]), best


def late_pd(damping, stiffness, tau):
    """x'' + d x' + c x = kp x(t − τ) + kd x'(t − τ): (P e^(sτ))'' vanishes at a triple root."""
    plant, _, _ = position_twice(damping, stiffness, tau)
    roots = np.roots(
        [tau**2, damping * tau**2 + 4.0 * tau, stiffness * tau**2 + 2.0 * damping * tau + 2.0]
    )

    def structure(wide):
        return within(("x", "v"), [[0.0, 0.0]], [[wide / tau**2, wide / tau**2]])

    return plant, structure, float(roots.real.max())


def two_delays(a, first, second):
    """x' = a x + k1 x(t − τ1) + k2 x(t − τ2): a triple root at a − 1/τ1 − 1/τ2."""
    plant = DelaySystem(
        [[a]],
        B=[[1.0, 1.0]],
        state_names=("x",),
        input_names=("u", "w"),
        input_delays=(first, second),
    )

    def structure(wide):
        bounds = [[wide / first], [wide / first]]
        return within(("x",), bounds, [[0.0], [0.0]], ("u", "w"))

    return plant, structure, a - 1.0 / first - 1.0 / second


def beside_a_bound(a, largest, tau):
    """x' = a x + k1 x + k2 x(t − τ): k1 on its bound, and there a double root."""
    plant, _, _ = lag(a, tau)
    return (
        plant,
        lambda wide: within(("x",), [[largest]], [[wide * math.exp((a - largest) * tau)]]),
        a - largest - 1.0 / tau,
    )


CASES = {
    "lag": lag(0.9, 1.0),
    # Far left of the axis, over 1/τ.
    "stable": lag(-1.0, 2.0),
    "fast": lag(-20.0, 0.5),
    # So far that the best gain is 7e-23.
    "faster": lag(-50.0, 1.0),
    "pi": integrator_pi(0.3, 1.0),
    "twice": position_twice(0.0, 4.0, 0.5),
    "damped": position_twice(0.2, 1.0, 1.0),
    "pd": late_pd(0.1, 1.0, 0.5),
    "pendulum": late_pd(0.0, -1.0, 0.5),
    "two": two_delays(0.5, 1.0, 2.0),
    "bound": beside_a_bound(1.0, 20.0, 1.0),
}


def reached(name, wide):
    plant, structure, best = CASES[name]
    found = design(plant, structure(wide), trials=False)
    assert found.spectral_abscissa == pytest.approx(best, abs=1e-8)


@pytest.mark.parametrize("name", CASES)
def test_the_best_gains_by_hand_are_reached(name):
    reached(name, 2.0)


@pytest.mark.parametrize("name", ["stable", "fast", "damped"])
def test_in_wider_bounds_too(name):
    reached(name, 100.0)


@pytest.mark.long
@pytest.mark.parametrize("wide", [100.0, 1e5])
@pytest.mark.parametrize("name", CASES)
def test_in_bounds_of_any_width(name, wide):
    reached(name, wide)


def test_where_the_best_zero_cancels_the_pole_the_answer_says_how_sure_it_is():
    """(s + 1)(s e^s − k): the pole of 1/(s + 1) and a double root at −1, at k = −1/e.

    Of three roots in one place rounding of the gains moves each by its cube root.
    """
    plant = DelaySystem([[-1.0]], B=[[1.0]], C=[[1.0]], input_delays=(1.0,))
    controlled, structure = pid_control(plant, "u1", "y1", proportional=2.0, integral=2.0)
    found = design(controlled, structure, trials=False)
    assert found.K1[0] == pytest.approx(-math.exp(-1.0), abs=1e-8)
    assert found.loop.abscissa_error < 1e-4
    assert found.spectral_abscissa == pytest.approx(-1.0, abs=found.loop.abscissa_error)
    assert found.loop.dominant_roots[0].multiplicity == 3
    assert found.loop.dominant_roots[0].real == pytest.approx(-1.0, abs=1e-8)


@pytest.mark.parametrize("change", [0.0, 1e-12, 1e-9, -1e-7, 3e-6, 1e-5, -1e-4])
def test_of_a_root_that_nearly_coincides_with_others_the_rightmost_is_given(change):
    """(s² + 4) e^(s/2) = k2 has a triple root at −2; a collocation's starts are 0.1 away."""
    k2 = 8.0 / math.e * (1.0 + change)
    system = DelaySystem([[0.0, 1.0], [-4.0, 0.0]], ([[0.0, 0.0], [k2, 0.0]],), (0.5,))
    # With z = s + 2: (8 − 4 z + z²) e^(z/2) = 8 (1 + change), so z³/6 = 8 · change nearly.
    away = np.cbrt(48.0 * change)
    right = away if change > 0.0 else -0.5 * away
    assert spectral_abscissa(system) == pytest.approx(right - 2.0, rel=1e-3, abs=2e-4)
