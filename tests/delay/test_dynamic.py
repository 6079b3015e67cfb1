"""Controllers with states, by the characteristic equations that they have by hand."""

import numpy as np
import pytest

from drillctrl import (
    DelaySystem,
    InputError,
    close_loop,
    design,
    dynamic_control,
    observer_control,
    pid_control,
    spectral_abscissa,
)
from drillctrl.spectrum import characteristic

S = np.array([0.3 + 0.7j, -0.4 + 2.0j, 1.1 - 3.0j])


@pytest.fixture(scope="module")
def lag():
    """y = exp(−0.8 s)/(s² + 0.4 s + 2) u, 0.5 of it at the input."""
    return DelaySystem(
        [[0, 1], [-2, -0.4]],
        B=[[0], [1]],
        C=[[1, 0]],
        input_names=("valve",),
        output_names=("level",),
        input_delays=(0.5,),
        output_delays=(0.3,),
    )


def determinant(loop):
    return np.linalg.det(characteristic.matrix(loop, S))


@pytest.mark.parametrize(
    ("limits", "gains"),
    [
        ({}, (-0.7, -0.3)),
        ({"integral": 0.0}, (-0.7,)),
        ({"derivative": 5.0, "filter_time": 0.2}, (-0.7, -0.3, 0.6)),
        ({"proportional": 0.0, "derivative": 5.0, "filter_time": 0.2}, (-0.3, 0.6)),
    ],
)
def test_pid_by_hand(lag, limits, gains):
    loop = close_loop(*pid_control(lag, "valve", "level", **limits), gains)
    kp, ki, kd = (-0.7 if len(gains) != 2 or not limits else 0.0), -0.3, 0.6
    constant = limits.get("filter_time", 0.0)
    has_integral, has_rate = limits.get("integral", 1.0) > 0, "derivative" in limits
    law = kp + (ki / S if has_integral else 0) + (kd * S / (constant * S + 1) if has_rate else 0)
    plain = (S**2 + 0.4 * S + 2) - law * np.exp(-0.8 * S)
    own = (S if has_integral else 1) * ((S + 1 / constant) if has_rate else 1)
    assert determinant(loop) == pytest.approx(plain * own, rel=1e-12)


def test_pi_against_a_lag_is_designed_for():
    """(s + 1) s = Kp s + Ki: with Kp ≥ −3 no pair is faster than −2, and Ki ≤ −4 gives that."""
    plant = DelaySystem([[-1.0]], B=[[1.0]], C=[[1.0]])
    grown, structure = pid_control(plant, "u1", "y1", proportional=3.0)
    found = design(grown, structure, trials=False)
    assert found.spectral_abscissa == pytest.approx(-2.0, abs=1e-7)
    assert found.K1[0, 0] == -3.0
    assert found.K1[0, 1] <= -4.0 + 1e-6


@pytest.mark.long
def test_a_controller_of_first_order_stabilises_a_double_integrator():
    """y'' = u: the roots of the loop sum to E ≥ −3, so that α ≥ −1."""
    plant = DelaySystem([[0, 1], [0, 0]], B=[[0], [1]], C=[[1, 0]])
    grown, structure = dynamic_control(plant, ["u1"], ["y1"], 1)
    structure = structure.with_bounds({"K1_2_2": (-3.0, 3.0)})
    assert structure.gain_names == ("K1_1_1", "K1_1_2", "K1_2_2")
    found = design(grown, structure, trials=False)
    assert found.spectral_abscissa == pytest.approx(-1.0, abs=1e-5)
    assert found.K1[0, 0] == pytest.approx(-3.0, abs=1e-3)


def test_a_chain_is_the_transfer_function_of_its_coefficients(lag):
    """z' = E z + F y, u = G z + H y with numerator G and denominator E."""
    grown, structure = dynamic_control(lag, ["valve"], ["level"], 2)
    vector = np.array([0.4, -0.8, 0.3, -2.0, -1.5])
    loop = close_loop(grown, structure, *structure.gains(vector))
    own = S**2 + 1.5 * S + 2.0
    law = 0.4 + (-0.8 + 0.3 * S) / own
    plain = (S**2 + 0.4 * S + 2) - law * np.exp(-0.8 * S)
    assert determinant(loop) == pytest.approx(plain * own, rel=1e-12)


def test_several_channels_are_all_free():
    rng = np.random.default_rng(1)
    plant = DelaySystem(rng.normal(size=(3, 3)), (np.eye(3),), (0.4,), np.eye(3)[:, :2], np.eye(3))
    grown, structure = dynamic_control(plant, ["u1", "u2"], ["y1", "y3"], 2)
    h, g, f, e = (rng.normal(size=(2, 2)) for _ in range(4))
    loop = close_loop(grown, structure, np.block([[h, g], [f, e]]))
    for s, value in zip(S, determinant(loop), strict=True):
        delta = s * np.eye(3) - plant.A0 - np.exp(-0.4 * s) * np.eye(3)
        law = h + g @ np.linalg.solve(s * np.eye(2) - e, f)
        closed = delta - plant.B @ law @ plant.C[[0, 2]]
        exact = np.linalg.det(closed) * np.linalg.det(s * np.eye(2) - e)
        assert value == pytest.approx(exact, rel=1e-10)


def test_observer_and_feedback_separate():
    """The loop has the roots of A + B K and of A − L C, delays and all."""
    rng = np.random.default_rng(2)
    a, late = rng.normal(size=(3, 3)), 0.3 * rng.normal(size=(3, 3))
    b, c = rng.normal(size=(3, 1)), rng.normal(size=(1, 3))
    plant = DelaySystem(a, (late,), (0.6,), b, c)
    gain, correction = rng.normal(size=(1, 3)), rng.normal(size=(3, 1))
    matrix = np.block([[gain, np.zeros((1, 1))], [np.zeros((3, 3)), correction]])
    loop = close_loop(*observer_control(plant, ["u1"], ["y1"]), matrix)
    parts = [a + b @ gain, a - correction @ c]
    alphas = [spectral_abscissa(DelaySystem(part, (late,), (0.6,))) for part in parts]
    assert spectral_abscissa(loop) == pytest.approx(max(alphas), abs=1e-9)
    late_channels = DelaySystem(a, (late,), (0.6,), b, c, input_delays=(0.2,), output_delays=(0.5,))
    loop = close_loop(*observer_control(late_channels, ["u1"], ["y1"]), matrix)
    for s, value in zip(S, determinant(loop), strict=True):
        delta = s * np.eye(3) - a - late * np.exp(-0.6 * s)
        first = delta - b @ gain * np.exp(-0.2 * s)
        second = delta + correction @ c * np.exp(-0.5 * s)
        assert value == pytest.approx(np.linalg.det(first) * np.linalg.det(second), rel=1e-9)


def test_bad_controllers_are_refused(lag):
    with pytest.raises(InputError, match="output = flow"):
        pid_control(lag, "valve", "flow")
    with pytest.raises(InputError, match="filter_time"):
        pid_control(lag, "valve", "level", derivative=1.0)
    with pytest.raises(InputError, match="not all 0"):
        pid_control(lag, "valve", "level", proportional=0.0, integral=0.0)
    with pytest.raises(InputError, match="order"):
        dynamic_control(lag, ["valve"], ["level"], 0)
    with pytest.raises(InputError, match="input = pump"):
        observer_control(lag, ["pump"], ["level"])
