import control
import numpy as np
import pytest
from scipy.optimize import brentq

from drillctrl import (
    DelaySystem,
    FeedbackStructure,
    InputError,
    close_loop,
    from_control,
    preset_structure,
    spectral_abscissa,
)
from drillctrl.delay.closing import gain_matrices
from drillctrl.interop.responses import loop_frd, to_frd
from drillctrl.robustness.loop_margins import loop_margins
from drillctrl.robustness.transfer import frequency_grid, frequency_response, loop_transfer
from drillctrl.spectrum import characteristic

GAINS = [-5.17], [5.06]


def test_pure_delay_feedback_by_hand():
    """x' = −x(t − τ) + u has G = 1/(iω + exp(−iωτ))."""
    system = DelaySystem([[0.0]], ([[-1.0]],), (0.7,), [[1.0]], [[1.0]])
    omega = np.array([0.1, 1.0, 5.0])
    by_hand = 1 / (1j * omega + np.exp(-0.7j * omega))
    assert frequency_response(system, omega)[0, 0] == pytest.approx(by_hand, rel=1e-14)


def test_loop_transfer_has_the_characteristic_equation(plant_c):
    """det Δ of the closed loop is that of the plant times 1 + L."""
    structure = preset_structure("case2")
    gains = [-5.03, -4.91], [-1.67, -0.31]
    omega = np.array([0.3, 0.9, 4.0])
    transfer = loop_transfer(plant_c, structure, *gains, omega)[0, 0]
    closed = close_loop(plant_c, structure, *gains)
    ratio = np.linalg.det(characteristic.matrix(closed, 1j * omega)) / np.linalg.det(
        characteristic.matrix(plant_c, 1j * omega)
    )
    assert 1 + transfer == pytest.approx(ratio, rel=1e-10)


def test_margins_of_python_control_are_those_of_the_spectrum(plant_c):
    structure = preset_structure("case1")
    loop = loop_frd(plant_c, structure, *GAINS)
    gain_margin, phase_margin, _, phase_frequency, gain_frequency, _ = control.stability_margins(
        loop
    )
    assert phase_frequency > 0

    def alpha(factor):
        return spectral_abscissa(
            close_loop(plant_c, structure, [factor * GAINS[0][0]], [factor * GAINS[1][0]])
        )

    # Bisection on the gain, downwards and upwards.
    ends = []
    for stable, unstable in ((1.0, 1e-3), (1.0, 100.0)):
        assert alpha(stable) < 0 < alpha(unstable)
        for _ in range(60):
            middle = 0.5 * (stable + unstable)
            stable, unstable = (middle, unstable) if alpha(middle) < 0 else (stable, middle)
        ends.append(stable)
    assert min(abs(gain_margin - end) / end for end in ends) < 1e-6

    def turned(angle):
        lag = angle / gain_frequency
        loop_delay = close_loop(plant_c, structure, *GAINS)
        past = plant_c.delayed[0]
        gain1 = loop_delay.A0 - plant_c.A0
        gain2 = loop_delay.delayed[0] - past
        tau = plant_c.delays[0]
        terms = sorted(
            zip((lag, tau, tau + lag), (gain1, past, gain2), strict=True), key=lambda term: term[0]
        )
        delays, matrices = zip(*terms, strict=True)
        return spectral_abscissa(DelaySystem(plant_c.A0, matrices, delays, plant_c.B, plant_c.C))

    # The phase margin, as an extra delay at its frequency, puts a root on the axis.
    assert phase_margin > 0
    assert turned(np.deg2rad(phase_margin)) == pytest.approx(0.0, abs=1e-6)


def test_closed_loop_response_from_python_control_feedback(plant_c):
    """feedback() on exact data gives the response of the closed delay system."""
    structure = preset_structure("case1")
    omega = np.geomspace(0.1, 20, 50)
    theta = DelaySystem(plant_c.A0, plant_c.delayed, plant_c.delays, plant_c.B, plant_c.C[2:3])
    plant = to_frd(theta, omega)
    law = -(GAINS[0][0] + GAINS[1][0] * np.exp(-1j * omega * plant_c.delays[0]))
    closed = control.feedback(plant, control.frd(law, omega, smooth=True))
    loop = close_loop(plant_c, structure, *GAINS)
    exact = frequency_response(
        DelaySystem(loop.A0, loop.delayed, loop.delays, loop.B, loop.C[2:3]), omega
    )
    assert np.asarray(closed(1j * omega)) == pytest.approx(exact[0, 0], rel=1e-8)


def test_the_grid_resolves_peaks(plant_c):
    omega = frequency_grid(plant_c)
    response = np.abs(frequency_response(plant_c, omega)[2, 0])
    fine = np.linspace(0.5, 2.0, 20001)
    exact = np.abs(frequency_response(plant_c, fine)[2, 0]).max()
    near = response[(omega > 0.5) & (omega < 2.0)].max()
    assert near == pytest.approx(exact, rel=1e-2)
    assert (np.diff(omega) > 0).all()


def test_bad_frequencies_are_refused(plant_c):
    with pytest.raises(InputError, match="omega"):
        frequency_response(plant_c, [1.0, np.nan])
    with pytest.raises(InputError, match="low, high"):
        frequency_grid(plant_c, 2.0, 1.0)


ONE = np.ones((1, 1))


@pytest.mark.parametrize("late", ["input", "feedback"])
def test_margins_of_a_lag_with_dead_time_are_the_closed_forms(late):
    """100 exp(−0.001 s)/(s + 0.1) with unit feedback."""
    lag = control.ss([[-0.1]], [[100.0]], [[1.0]], 0, inputs=["valve"], outputs=["level"])
    bounds = -ONE, ONE, -ONE, ONE
    structure = FeedbackStructure("unit", ("level",), *bounds, inputs=("valve",))
    plant = from_control(lag, **{f"{late}_delay": 0.001})
    gains = ([-1.0], None) if late == "input" else ([0.0], [-1.0])
    # arg L = −arctan(10 ω) − 0.001 ω, |L| = 100/√(ω² + 0.01).
    turn = brentq(lambda w: np.arctan(10 * w) + 0.001 * w - np.pi, 100.0, 3000.0)
    gain = np.hypot(turn, 0.1) / 100.0
    unit = np.sqrt(1e4 - 0.01)
    phase = 180.0 - np.degrees(np.arctan(10 * unit) + 0.001 * unit)
    assert (gain, phase) == (pytest.approx(15.7086, abs=1e-4), pytest.approx(84.3277, abs=1e-4))
    loop = loop_frd(plant, structure, *gains)
    found = control.stability_margins(loop)
    assert found[0] == pytest.approx(gain, rel=1e-6)
    assert found[1] == pytest.approx(phase, rel=1e-6)
    assert (loop.input_labels, loop.output_labels) == (["valve"], ["valve_demanded"])
    K1, K2 = gain_matrices(structure, *gains)
    margins = loop_margins(plant, structure, K1, K2)
    assert margins.gain_up == pytest.approx(gain, rel=1e-9)
    assert margins.phase == pytest.approx(phase, rel=1e-9)


def test_what_is_drawn_is_resolved_and_keeps_its_names():
    plant = control.ss([[-1.0]], [[1.0]], [[1.0]], 0, inputs=["valve"], outputs=["level"])
    drawn = to_frd(from_control(plant, 2.0))
    assert (drawn.input_labels, drawn.output_labels) == (["valve"], ["level"])
    exact = np.exp(-2j * drawn.omega) / (1j * drawn.omega + 1.0)
    assert drawn(1j * drawn.omega) == pytest.approx(exact, rel=1e-12)
    assert drawn.omega[0] < 1e-2
    assert np.abs(exact[-1]) < 1e-3
    steps = np.abs(np.diff(exact)) / np.abs(exact[1:])
    large = np.abs(exact[1:]) > 0.5
    assert steps[large].max() < 0.06 < steps.max() < 0.6


def test_a_slow_pole_is_seen():
    slow = from_control(control.ss([[-1e-5]], [[1.0]], [[1.0]], 0), 0.1)
    omega = frequency_grid(slow)
    assert np.abs(frequency_response(slow, omega[:1])) == pytest.approx(1e5, rel=1e-2)


def test_a_pole_on_the_axis_is_infinite():
    double = from_control(control.ss([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], np.eye(2), 0), 0.3)
    response = frequency_response(double, [0.0, 2.0])
    assert np.isinf(response[:, :, 0]).all()
    assert response[0, 0, 1] == pytest.approx(-np.exp(-0.6j) / 4.0, rel=1e-14)
