"""The H∞ norm by closed forms, by the Hamiltonian matrix, and as aim and limit of a design."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from drillctrl import (
    DelaySystem,
    FeedbackStructure,
    HInfinity,
    InputError,
    Requirements,
    close_loop,
    design,
    h_infinity_norm,
)
from drillctrl.robustness.transfer import frequency_response


@pytest.mark.parametrize("damping", [1e-6, 0.01, 0.6, 0.8])
def test_resonance(damping):
    """1/(s² + 2ζs + 1): 1/(2ζ √(1 − ζ²)) at √(1 − 2ζ²), or 1 at rest."""
    system = DelaySystem([[0, 1], [-1, -2 * damping]], B=[[0], [1]], C=[[1, 0]])
    found = h_infinity_norm(system)
    swings = damping < math.sqrt(0.5)
    exact = 1 / (2 * damping * math.sqrt(1 - damping**2)) if swings else 1.0
    assert found.value == pytest.approx(exact, rel=1e-9)
    assert exact <= found.upper_bound <= exact * (1 + 1e-6)
    peak = math.sqrt(1 - 2 * damping**2) if swings else 0.0
    assert found.frequency == pytest.approx(peak, abs=1e-6)


@pytest.mark.parametrize(("past", "delay"), [(0.7, 2.0), (0.99, 300.0), (-0.6, 0.1)])
def test_a_delayed_lag_at_rest(past, delay):
    """1/(s + 1 − b exp(−sτ)) is 1/(1 − b) at ω = 0, its peak for b > 0 and for short delays."""
    found = h_infinity_norm(DelaySystem([[-1.0]], ([[past]],), (delay,), [[1.0]], [[1.0]]))
    assert found.value == pytest.approx(1 / (1 - past), rel=1e-12)
    assert found.frequency == 0.0


def test_without_delay_the_hamiltonian_matrix_agrees():
    """It has eigenvalues on the axis below the norm and none above."""
    rng = np.random.default_rng(5)
    for n in (3, 6):
        a = rng.normal(size=(n, n)) - 3.0 * np.eye(n)
        b, c = rng.normal(size=(n, 2)), rng.normal(size=(3, n))
        value = h_infinity_norm(DelaySystem(a, B=b, C=c)).value

        def on_axis(level, a=a, b=b, c=c):
            hamiltonian = np.block([[a, b @ b.T / level], [-c.T @ c / level, -a.T]])
            eigenvalues = np.linalg.eigvals(hamiltonian)
            return (np.abs(eigenvalues.real) < 1e-9 * np.abs(eigenvalues)).any()

        assert on_axis(value * (1 - 1e-4))
        assert not on_axis(value * (1 + 1e-4))


@pytest.mark.long
def test_late_channels_and_scaled_states_change_nothing(plant_c):
    gains = [-5.03, -4.91], [-1.67, -0.31]
    loop = close_loop(plant_c, _case2(), *gains)
    value = h_infinity_norm(loop).value
    omega = np.linspace(0.0, 30.0, 60_001)
    sampled = np.linalg.norm(np.moveaxis(frequency_response(loop, omega), -1, 0), 2, axis=(1, 2))
    assert sampled.max() <= value < sampled.max() * (1 + 1e-6)
    scale = np.array([1.0, 1e6, 1e-4, 1.0])
    ratio = scale[:, None] / scale
    scaled = DelaySystem(
        loop.A0 * ratio,
        tuple(a * ratio for a in loop.delayed),
        loop.delays,
        loop.B * scale[:, None],
        loop.C / scale,
        input_delays=(3.0,),
        output_delays=(0.0, 1.0, 0.5, 0.2),
    )
    assert h_infinity_norm(scaled).value == pytest.approx(value, rel=1e-9)


def _case2():
    wide = np.full((1, 2), 10.0)
    return FeedbackStructure("case2", ("theta", "dtheta"), -wide, wide, -wide, wide)


def test_unstable_and_empty_systems():
    assert h_infinity_norm(DelaySystem([[0.1]], B=[[1.0]])).value == math.inf
    assert h_infinity_norm(DelaySystem([[-1.0]])).value == 0.0


ONE = np.ones((1, 1))


def norm_of(gain, delay):
    """max 1/|iω + k exp(−iωτ)|, by samples and a local search."""
    omega = np.linspace(0.0, 2.0 * abs(gain) + 1.0, 4001)
    size = 1 / np.abs(1j * omega - gain * np.exp(-1j * omega * delay))
    i = int(size.argmax())
    local = minimize_scalar(
        lambda w: -1 / abs(1j * w - gain * np.exp(-1j * w * delay)),
        bounds=(omega[max(i - 1, 0)], omega[min(i + 1, omega.size - 1)]),
        method="bounded",
        options={"xatol": 1e-12},
    )
    return max(size[i], -local.fun)


def test_the_best_gain_of_an_integrator_with_dead_time():
    """x' = u(t − 0.5) + w: one search over the gain by the closed form of the response."""
    plant = DelaySystem(
        [[0.0]], B=[[1.0, 1.0]], C=ONE, input_names=("u", "w"), input_delays=(0.5, 0.0)
    )
    structure = FeedbackStructure("late", ("y1",), -6 * ONE, 0 * ONE, 0 * ONE, 0 * ONE, ("u",))
    best = minimize_scalar(
        lambda k: norm_of(k, 0.5), bounds=(-3.0, -0.3), method="bounded", options={"xatol": 1e-10}
    )
    found = design(plant, structure, objective=HInfinity(("w",), ("y1",)), trials=False)
    assert found.objective_value == pytest.approx(best.fun, rel=1e-6)
    assert found.objective_value == pytest.approx(norm_of(found.K1.item(), 0.5), rel=1e-9)
    assert "H∞ norm from w to y1" in found.summary()


@pytest.mark.long
def test_a_limit_of_the_norm_is_met(point_c):
    between = HInfinity(outputs=("theta",))
    free = design(point_c, "case1", trials=False)
    gains = design(
        point_c, "case1", requirements=Requirements(h_infinity=0.5, between=between), trials=False
    )
    assert gains.requirements_met
    omega = np.linspace(0.0, 30.0, 60_001)
    peaks = [np.abs(frequency_response(d.system(), omega)[2, 0]).max() for d in (free, gains)]
    assert peaks[0] > 0.5 >= peaks[1] > 0.49
    assert free.spectral_abscissa < gains.spectral_abscissa < 0.0
    with pytest.raises(InputError, match="output = phi"):
        design(point_c, "case1", objective=HInfinity(outputs=("phi",)), trials=False)
