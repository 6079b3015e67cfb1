import numpy as np
import pytest

from drillctrl import (
    DelaySystem,
    FeedbackStructure,
    InputError,
    close_loop,
    design,
    frequency_response,
    preset_structure,
    spectral_abscissa,
    with_actuator_lag,
    with_filter,
)

OMEGA = np.array([0.1, 0.9, 3.0, 20.0])


def test_a_filtered_output_is_late_and_slow(plant_c):
    measured = with_filter(plant_c, ["theta"], 0.3, delay=0.05)
    assert measured.output_names[-1] == "theta_filtered"
    response = frequency_response(measured, OMEGA)
    expected = response[2] * np.exp(-0.05j * OMEGA) / (1 + 0.3j * OMEGA)
    assert response[-1] == pytest.approx(expected, rel=1e-12)
    assert response[:4] == pytest.approx(frequency_response(plant_c, OMEGA), rel=1e-12)


def test_a_lag_divides_the_response(plant_c):
    slow = with_actuator_lag(plant_c, "torque", 0.2)
    expected = frequency_response(plant_c, OMEGA) / (1 + 0.2j * OMEGA)
    assert frequency_response(slow, OMEGA) == pytest.approx(expected, rel=1e-12)


def test_a_fast_filter_and_a_fast_actuator_change_little(plant_c):
    gains = [-5.17], [5.06]
    exact = spectral_abscissa(close_loop(plant_c, preset_structure("case1"), *gains))
    apart = []
    for constant in (4e-3, 2e-3, 1e-3):
        loop = close_loop(
            with_actuator_lag(plant_c, "torque", constant), preset_structure("case1"), *gains
        )
        apart.append(abs(spectral_abscissa(loop) - exact))
    assert apart[0] / apart[1] == pytest.approx(2.0, rel=0.1)
    assert apart[1] / apart[2] == pytest.approx(2.0, rel=0.1)


def test_gains_are_designed_for_what_is_measured(plant_c):
    """Gains for the ideal loop lose their optimum behind a filter; gains for it do not."""
    measured = with_filter(plant_c, ["theta"], 0.1)
    bounds = np.array([[-10.0]]), np.array([[10.0]])
    filtered = FeedbackStructure("filtered", ("theta_filtered",), *bounds, *bounds)
    ideal = design(plant_c, "case1", trials=False)
    naive = spectral_abscissa(close_loop(measured, filtered, ideal.K1, ideal.K2))
    aware = design(measured, filtered, trials=False)
    assert aware.stable
    assert aware.spectral_abscissa < naive - 0.1


def test_two_delays_in_one_loop():
    system = DelaySystem([[-1.0]], ([[-0.5]],), (0.3,), [[1.0]], [[1.0]])
    measured = with_filter(system, ["y1"], 0.1, delay=0.7)
    assert measured.delays == (0.3, 0.7)
    same = with_filter(system, ["y1"], 0.1, delay=0.3)
    assert same.delays == (0.3,)


def test_unknown_names_are_refused(plant_c):
    with pytest.raises(InputError, match="output = phi"):
        with_filter(plant_c, ["phi"], 0.1)
    with pytest.raises(InputError, match="input = drive"):
        with_actuator_lag(plant_c, "drive", 0.1)
    with pytest.raises(InputError, match="time_constant = 0"):
        with_filter(plant_c, ["theta"], 0.0)
