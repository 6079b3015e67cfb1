import math

import control
import numpy as np
import pytest

from drillctrl import (
    Controller,
    DelaySystem,
    FeedbackStructure,
    InputError,
    OperatingPoint,
    close_loop,
    controller_system,
    design,
    from_control,
    lifted_system,
    pade_approximation,
    preset_structure,
    scheduled_controller,
    semidiscretize,
    simulate,
    spectral_abscissa,
)

GAINS = [-5.03, -4.91], [-1.67, -0.31]


@pytest.fixture(scope="module")
def loop(plant_c):
    return close_loop(plant_c, preset_structure("case2"), *GAINS)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_poles_of_the_lifted_loop_are_the_spectrum_of_d(loop, order):
    lifted = lifted_system(loop, 24, order)
    scheme = semidiscretize(loop, 24, order)
    poles = np.sort_complex(lifted.poles())
    expected = np.sort_complex(np.linalg.eigvals(scheme.matrix()))
    # Those at zero are defective and known to no more than a root of the rounding.
    large = np.abs(expected) > 1e-2
    for pole in expected[large]:
        assert np.abs(poles - pole).min() < 1e-10
    assert lifted.dt == scheme.step
    assert lifted.state_labels[:4] == ["x", "dx", "theta", "dtheta"]
    assert lifted.input_labels == ["torque"]


def test_lifted_response_tends_to_the_exact_one(loop):
    """At low frequency the step-held input and the interpolated past cost little."""
    from drillctrl import frequency_response

    omega = np.array([0.2, 0.9, 2.0])
    exact = frequency_response(loop, omega)[2, 0]
    errors = []
    for m in (20, 40, 80):
        lifted = lifted_system(loop, m, 1)
        z = np.exp(1j * omega * lifted.dt)
        # The hold is late by half a step.
        held = (1 - 1 / z) / (1j * omega * lifted.dt)
        errors.append(np.abs(lifted(z, squeeze=False)[2, 0] / held - exact).max())
    assert errors[2] < 1e-3 * np.abs(exact).max()
    assert errors[0] > 2.5 * errors[1] > 6 * errors[2]


def test_padé_states_its_error_and_converges(loop):
    errors = [pade_approximation(loop, degree).error for degree in (2, 4, 6)]
    assert errors[0] > errors[1] > errors[2]
    near = pade_approximation(loop, 8, highest_frequency=10.0)
    assert near.error < 1e-8
    assert near.system.poles().real.max() == pytest.approx(spectral_abscissa(loop), abs=1e-8)
    with pytest.raises(InputError, match="degree = 0"):
        pade_approximation(loop, 0)


def test_a_plant_of_python_control_is_designed_for():
    """x'' = u with u = k x(t − τ) + d x'(t − τ): the double integrator with a late input."""
    plant = control.ss([[0, 1], [0, 0]], [[0], [1]], np.eye(2), 0, inputs=["force"])
    system = from_control(plant, feedback_delay=0.2)
    late = FeedbackStructure(
        "late",
        tuple(system.output_names),
        np.zeros((1, 2)),
        np.zeros((1, 2)),
        np.full((1, 2), -30.0),
        np.full((1, 2), 30.0),
        inputs=("force",),
    )
    result = design(system, late)
    assert result.stable
    # The best two gains put a triple root at (√2 − 2)/τ.
    assert result.spectral_abscissa == pytest.approx((math.sqrt(2) - 2) / 0.2, abs=1e-6)
    with pytest.raises(InputError, match="continuous"):
        from_control(control.ss([[0.5]], [[1]], [[1]], 0, 0.1), 0.2)
    with pytest.raises(InputError, match="feedthrough"):
        from_control(control.ss([[0.5]], [[1]], [[1]], 1), 0.2)


def test_sampled_controller_closes_the_lifted_plant(plant_c):
    """With the plant's own step the loop of two systems is the loop of one map."""
    structure = preset_structure("case1")
    plant = lifted_system(plant_c, 40, 1)
    assert (plant.output_labels[2], plant.input_labels[0]) == ("theta", "torque")
    ours = controller_system(structure, [-5.17], [5.06], plant_c.delays[0], plant.dt)
    closed = control.feedback(ours * plant[2, 0], sign=1)
    growth = np.log(np.abs(closed.poles()).max()) / plant.dt
    exact = spectral_abscissa(close_loop(plant_c, structure, [-5.17], [5.06]))
    finer = lifted_system(plant_c, 160, 1)
    ours = controller_system(structure, [-5.17], [5.06], plant_c.delays[0], finer.dt)
    closed = control.feedback(ours * finer[2, 0], sign=1)
    better = np.log(np.abs(closed.poles()).max()) / finer.dt
    # The hold is late by half a step: an error of first order.
    assert abs(better - exact) < 0.3 * abs(growth - exact) < 0.05
    assert better < 0


def test_interconnect_by_name(plant_c):
    structure = preset_structure("case1")
    plant = lifted_system(plant_c, 40, 1)
    plant.name = "string"
    ours = controller_system(structure, [-5.17], [5.06], plant_c.delays[0], plant.dt)
    ours.name = "controller"
    closed = control.interconnect(
        [plant, ours],
        inplist=["controller.theta"],
        outlist=["string.x"],
        ignore_outputs=["dx", "dtheta"],
    )
    assert np.abs(closed.poles()).max() < 1.0


def test_scheduled_controller_with_constant_gains_is_the_linear_one(plant_c):
    structure = preset_structure("case2")
    period, tau = 0.01, plant_c.delays[0]
    linear = controller_system(structure, *GAINS, tau, period)
    scheduled = scheduled_controller(structure, lambda *_: GAINS, 4, 5.0, period)
    rng = np.random.default_rng(0)
    times = np.arange(200) * period
    signals = rng.normal(size=(2, 200))
    point = np.tile([[10.0], [1.75], [14.0]], 200)
    one = control.forced_response(linear, times, signals).outputs
    two = control.input_output_response(scheduled, times, np.vstack([signals, point])).outputs
    assert two.ravel() == pytest.approx(one.ravel(), abs=1e-12)
    limited = scheduled_controller(structure, lambda *_: GAINS, 4, 5.0, period, limit=0.5)
    three = control.input_output_response(limited, times, np.vstack([signals, point])).outputs
    assert three.ravel() == pytest.approx(np.clip(one, -0.5, 0.5).ravel(), abs=1e-12)


def test_sampled_controllers_agree_with_the_simulator():
    """The command that the simulator's controller gave, from the outputs that it measured."""
    point, period = OperatingPoint(10.0, 2.5, 14.0), 0.01
    ours = Controller("case1", [-3.82], [3.61], period=period)
    run = simulate(point, ours, duration=20.0, initial={"dtheta": 1.0}, rtol=1e-10)
    # Just after each instant the command of that instant is held.
    times = np.arange(1999) * period
    theta, torque = run.at(times).theta, run.at(times + 0.5 * period).torque
    system = controller_system(ours.feedback, [-3.82], [3.61], point.delay, period)
    command = control.forced_response(system, times, theta).outputs
    inside = times > point.delay + period
    assert np.abs(command - torque)[inside].max() < 1e-3 * np.abs(torque).max()


def test_responses_plot_in_python_control():
    run = simulate(OperatingPoint(10.0, 1.0, 14.0), duration=5.0, initial={"dx": 1.0})
    response = run.to_control()
    assert list(response.output_labels)[:4] == ["x", "dx", "theta", "dtheta"]
    assert response.outputs[0, -1] == pytest.approx(float(run.at([5.0]).x[0]), abs=1e-12)
    assert response.plot() is not None


def test_a_delay_system_keeps_its_names():
    system = DelaySystem([[-1.0]], ([[-0.5]],), (0.3,), [[1.0]], [[1.0]])
    assert lifted_system(system, 3).nstates == 1 + 3 + 1


def test_systems_of_other_packages_are_told_what_to_become():
    import scipy.signal

    with pytest.raises(InputError, match=r"control\.ss\(plant\)"):
        from_control(3.0, 1.0)
    for plant in (
        scipy.signal.StateSpace([[-1.0]], [[1.0]], [[1.0]], [[0.0]]),
        scipy.signal.TransferFunction([1.0], [1.0, 1.0]),
    ):
        with pytest.raises(
            InputError, match=r"s = plant\.to_ss\(\); control\.ss\(s\.A, s\.B, s\.C, s\.D\)"
        ):
            from_control(plant, 1.0)
        # What is told does it.
        s = plant.to_ss()
        assert from_control(control.ss(s.A, s.B, s.C, s.D), 1.0).A0.tolist() == [[-1.0]]
