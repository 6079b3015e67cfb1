"""Late inputs, late outputs, and feedback whose delay is not the plant's largest."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize
from scipy.special import lambertw

from drillctrl import (
    DelaySystem,
    FeedbackStructure,
    Filtered,
    InputError,
    as_case,
    chart,
    close_loop,
    count_right_of,
    design,
    lifted_system,
    loop_transfer,
    paper_plant,
    pid_control,
    spectral_abscissa,
    with_filter,
    with_late_output,
)
from drillctrl.designs.loops import spectral_abscissas
from drillctrl.robustness.margins import with_delay_factor
from drillctrl.robustness.transfer import frequency_response
from drillctrl.spectrum import characteristic
from drillctrl.synthesis.active import ActiveDesign
from drillctrl.synthesis.family import ActiveRoot, loop_family
from drillctrl.synthesis.search import _holds

S = np.array([0.3 + 0.7j, -0.4 + 2.0j, 1.1 - 3.0j])


def feedback(rows, columns, *, now=5.0, late=5.0):
    """Every output to every input, within ± the bounds."""
    shape = (rows, columns)
    bounds = [factor * np.ones(shape) for factor in (-now, now, -late, late)]
    inputs = tuple(f"u{i + 1}" for i in range(rows))
    return FeedbackStructure("all", tuple(f"y{i + 1}" for i in range(columns)), *bounds, inputs)


@pytest.fixture(scope="module")
def lag():
    """x' = −x + u(t − 0.7), y = x(t − 0.5)."""
    one = [[1.0]]
    return DelaySystem([[-1.0]], B=one, C=one, input_delays=(0.7,), output_delays=(0.5,))


@pytest.fixture(scope="module")
def many():
    rng = np.random.default_rng(3)
    return DelaySystem(
        rng.normal(size=(3, 3)) - 3.0 * np.eye(3),
        (rng.normal(size=(3, 3)),),
        (0.9,),
        rng.normal(size=(3, 2)),
        rng.normal(size=(2, 3)),
        input_delays=(0.0, 1.3),
        output_delays=(0.4, 0.0),
        feedback_delay=0.25,
    )


def test_dead_time_by_the_lambert_function(lag):
    """s + 1 = K exp(−1.2 s)."""
    for gain in (-2.0, -0.5, 0.8):
        loop = close_loop(lag, feedback(1, 1, late=0.0), [gain])
        exact = lambertw(1.2 * gain * math.exp(1.2), [0, -1, 1]) / 1.2 - 1.0
        assert spectral_abscissa(loop) == pytest.approx(exact.real.max(), abs=1e-12)


def test_the_best_gain_against_dead_time_is_the_closed_form(lag):
    """A double root: s = −1 − 1/h and K = −exp(sh)/h."""
    result = design(lag, feedback(1, 1, late=0.0), trials=False)
    best = -1.0 - 1.0 / 1.2
    assert result.spectral_abscissa == pytest.approx(best, abs=1e-8)
    assert result.K1[0, 0] == pytest.approx(-math.exp(1.2 * best) / 1.2, abs=1e-8)


def test_a_loop_of_many_channels_is_that_of_its_transfer_function(many):
    """det Δ of the loop over that of the plant is det(I − K(s) G(s))."""
    K1, K2 = np.array([[0.3, -0.7], [1.1, 0.2]]), np.array([[0.0, 0.4], [-0.6, 0.9]])
    loop = close_loop(many, feedback(2, 2), K1, K2)
    lag_in, lag_out = np.array(many.input_delays), np.array(many.output_delays)
    for s in S:
        delta = s * np.eye(3) - many.A0 - many.delayed[0] * np.exp(-0.9 * s)
        plain = many.C @ np.linalg.solve(delta, many.B)
        transfer = np.exp(-s * lag_out)[:, None] * plain * np.exp(-s * lag_in)
        ratio = np.linalg.det(np.eye(2) - (K1 + K2 * np.exp(-0.25 * s)) @ transfer)
        closed = np.linalg.det(characteristic.matrix(loop, np.array([s]))[0])
        assert closed == pytest.approx(ratio * np.linalg.det(delta), rel=1e-12)
    omega = np.array([0.4, 2.0])
    for i, w in enumerate(omega):
        delta = 1j * w * np.eye(3) - many.A0 - many.delayed[0] * np.exp(-0.9j * w)
        plain = many.C @ np.linalg.solve(delta, many.B)
        exact = np.exp(-1j * w * lag_out)[:, None] * plain * np.exp(-1j * w * lag_in)
        assert frequency_response(many, omega)[:, :, i] == pytest.approx(exact, rel=1e-12)
        broken = loop_transfer(many, feedback(2, 2), K1, K2, omega)[:, :, i]
        law = K1 + K2 * np.exp(-0.25j * w)
        expected = np.linalg.det(np.eye(2) - law @ exact)
        assert np.linalg.det(np.eye(2) + broken) == pytest.approx(expected, rel=1e-12)


def test_families_and_batches_have_the_abscissa_of_the_loop(many):
    structure = feedback(2, 2, now=0.6, late=0.6)
    family = loop_family(many, structure)
    vectors = np.random.default_rng(0).uniform(-0.6, 0.6, (8, 8))
    exact = [spectral_abscissa(close_loop(many, structure, *structure.gains(v))) for v in vectors]
    assert family.abscissas(vectors) == pytest.approx(exact, abs=1e-6)
    assert spectral_abscissas(many, structure=structure, gains=vectors) == pytest.approx(
        exact, abs=1e-9
    )
    delta = family.characteristic_matrix(S, vectors[0])
    assert delta == pytest.approx(characteristic.matrix(family.loop(vectors[0]), S), rel=1e-12)


def test_many_outputs_through_one_late_input_are_one_signal():
    rng = np.random.default_rng(4)
    plant = DelaySystem(
        rng.normal(size=(4, 4)) - 3.0 * np.eye(4),
        (0.5 * rng.normal(size=(4, 4)),),
        (0.6,),
        rng.normal(size=(4, 1)),
        input_delays=(1.1,),
        output_names=("y1", "y2", "y3", "y4"),
    )
    structure = feedback(1, 4, now=0.8, late=0.0)
    family = loop_family(plant, structure)
    assert len(family.base) == 4 + (4 + 1) * family.degree
    for vector in rng.uniform(-0.8, 0.8, (5, 4)):
        value, gradient = family.abscissa(vector)
        assert value == pytest.approx(spectral_abscissa(family.loop(vector)), abs=1e-6)
        steps = 1e-6 * np.eye(4)
        slopes = [(family.value(vector + h) - family.value(vector - h)) / 2e-6 for h in steps]
        assert gradient == pytest.approx(slopes, abs=1e-5)


@pytest.mark.long
def test_feedback_may_be_earlier_than_a_state_arrives():
    """A double integrator with feedback 0.2 late, beside a state that hears itself after 1."""
    a0, late = np.diag([1.0, 0.0], 1), np.zeros((3, 3))
    a0[2, 2], late[2, 2] = -5.0, 1e-3
    plant = DelaySystem(
        a0, (late,), (1.0,), [[0.0], [1.0], [0.0]], np.eye(3)[:2], feedback_delay=0.2
    )
    result = design(plant, feedback(1, 2, now=0.0, late=30.0), trials=False)
    # The best two gains put a triple root at (√2 − 2)/τ.
    assert result.spectral_abscissa == pytest.approx((math.sqrt(2) - 2) / 0.2, abs=1e-6)
    later = replace(plant, feedback_delay=0.5)
    result = design(later, feedback(1, 2, now=0.0, late=30.0), trials=False)
    assert result.spectral_abscissa == pytest.approx((math.sqrt(2) - 2) / 0.5, abs=1e-6)


def test_a_late_sensor_leaves_the_feedback_at_the_regenerative_delay(point_c):
    plant = as_case(point_c, paper_plant(blocks=(Filtered("theta", 0.1, 1.0),))).system()
    tau = 2.0 * math.pi / (4 * 10)
    assert plant.max_delay == 1.0
    assert plant.feedback_delay == pytest.approx(tau, rel=1e-15)
    name = next(name for name in plant.output_names if name.startswith("theta_"))
    zero, one = np.zeros((1, 1)), np.ones((1, 1))
    loop = close_loop(plant, FeedbackStructure("late", (name,), zero, zero, -one, one), [0], [0.5])
    added = loop.delayed_matrix(plant.feedback_delay) - plant.delayed_matrix(plant.feedback_delay)
    row = plant.C[plant.output_names.index(name)]
    column = plant.B[:, plant.input_names.index("torque")]
    assert added == pytest.approx(0.5 * np.outer(column, row))
    assert (loop.delayed_matrix(1.0) == plant.delayed_matrix(1.0)).all()


def test_one_signal_with_several_delays():
    """x' = u with u = a x + b x(t − 0.3) + c x(t − 0.8)."""
    one = [[1.0]]
    plant = DelaySystem([[0.0]], B=one, C=one)
    plant = with_late_output(with_late_output(plant, "y1", 0.3, "y2"), "y1", 0.8, "y3")
    loop = close_loop(plant, feedback(1, 3, late=0.0), [-0.2, -0.9, 0.4])
    assert loop.delays == (0.3, 0.8)
    assert [matrix.item() for matrix in loop.delayed] == [-0.9, 0.4]
    assert loop.A0.item() == -0.2


def test_late_measurements_enter_filters_late(lag):
    measured = with_filter(lag, ["y1"], 0.1, delay=0.2)
    assert measured.delays == (0.7,)
    assert measured.output_delays == (0.5, 0.0)
    assert measured.feedback_delay == lag.feedback_delay


def test_longer_delays_are_those_of_channels_and_feedback_too(many):
    longer = with_delay_factor(many, 2.0)
    assert longer.input_delays == (0.0, 2.6)
    assert longer.output_delays == (0.8, 0.0)
    assert longer.feedback_delay == 0.5
    # The same in time that runs half as fast.
    same = many.scaled_time(0.5)
    loop = close_loop(longer, feedback(2, 2), np.eye(2), -np.eye(2))
    slow = close_loop(same, feedback(2, 2), np.eye(2), -np.eye(2))
    assert slow.delays == pytest.approx([2.0 * tau for tau in close_loop(
        many, feedback(2, 2), np.eye(2), -np.eye(2)).delays])  # fmt: skip
    assert loop.delays == pytest.approx(slow.delays)


def test_what_cannot_have_late_channels_says_so(many):
    with pytest.raises(InputError, match="late inputs or outputs"):
        lifted_system(many)
    with pytest.raises(InputError, match="delays of the feedback"):
        chart(many, ("K1_1_1", -1.0, 1.0), ("K2_1_1", -1.0, 1.0), feedback(2, 2),
              np.zeros((2, 2)), np.zeros((2, 2)))  # fmt: skip
    with pytest.raises(InputError, match="input_delays"):
        DelaySystem([[0.0]], B=[[1.0]], input_delays=(-1.0,))
    with pytest.raises(InputError, match="output_delays"):
        DelaySystem([[0.0]], output_delays=(1.0, 2.0))
    with pytest.raises(InputError, match="feedback_delay"):
        DelaySystem([[0.0]], feedback_delay=-1.0)
    with pytest.raises(InputError, match="no delay is known"):
        design(DelaySystem([[0.0]], B=[[1.0]]), feedback(1, 1))


@pytest.fixture(scope="module")
def exchanger():
    """A heater, a mixer, a cooler and long pipes, with the sum of the error.

    The heat transfer set-up of Vyhlídal, Zítek and Paulů, with the constants that tdcpy states
    for it (examples/example_closed_loop_static.py, "Heat Exchanger problem").
    """
    terms = {tau: np.zeros((5, 5)) for tau in (0.0, 2.8, 6.5, 9.2, 13.0, 18.0, 40.0)}
    terms[0.0][1:3, :3] = [[1.0 / 3.0, -2.0 / 3.0, 0.0], [0.0, 0.0, -1.0 / 3.0]]
    terms[0.0][4, 3] = -1.0
    terms[2.8][3, 2] = 0.81 / 25.0
    terms[6.5][0, 0] = -1.0 / 14.0
    terms[9.2][3, 3] = -1.0 / 25.0
    terms[13.0][1, 3] = 1.0 / 3.0
    terms[18.0][2, 1] = 0.94 / 3.0
    terms[40.0][0, 1] = 0.24 / 14.0
    late = {tau: matrix for tau, matrix in terms.items() if tau}
    drive = np.array([[0.39 / 14.0], [0.0], [0.0], [0.0], [0.0]])
    plant = DelaySystem(
        terms[0.0], tuple(late.values()), tuple(late), drive, np.eye(5), input_delays=(13.2,)
    )
    return plant, terms, drive


def test_a_late_input_before_six_other_delays(exchanger):
    plant, terms, drive = exchanger
    structure = feedback(1, 5, late=0.0)
    gains = np.array([[-0.49141, -2.13058, -4.15442, -5.0, 0.20639]])
    closed = close_loop(plant, structure, gains)
    alpha = spectral_abscissa(closed)
    assert alpha == pytest.approx(-0.0544, abs=1e-3)
    assert count_right_of(closed, alpha + 1e-6).count == 0
    assert count_right_of(closed, alpha - 1e-4).count > 0
    s = 0.05j
    delta = s * np.eye(5) - sum(matrix * np.exp(-s * tau) for tau, matrix in terms.items())
    expected = np.linalg.solve(delta, drive) * np.exp(-13.2 * s)
    response = frequency_response(plant, [0.05])
    assert response[..., 0] == pytest.approx(expected, rel=1e-12)
    loop = loop_transfer(plant, structure, gains, None, np.array([0.05]))
    assert loop[0, 0, 0] == pytest.approx(-(gains @ expected)[0, 0], rel=1e-12)


def test_roots_that_coincide_are_no_optimum_where_others_lie_right_of_them(exchanger):
    """Six roots meet at −0.0737, which shows them to 0.005, and a pair lies at −0.048 ± 0.23i."""
    plant, *_ = exchanger
    family = loop_family(plant, feedback(1, 5, late=0.0))
    gains = np.array([-0.19392818, 1.03765537, -3.4039846, -2.90944452, 0.09222856])
    meant = ActiveDesign(gains, -0.0736985, (ActiveRoot(0.0, 6),), 0.0, 0)
    value = family.exact(gains)
    assert value == pytest.approx(-0.048016, abs=1e-6)
    assert not _holds(family, meant, value)


@pytest.mark.long
def test_a_pi_controller_behind_a_late_input_before_six_other_delays(exchanger):
    """The temperature behind the cooler, held without the sum of the error among the states."""
    _, terms, drive = exchanger
    alone = DelaySystem(
        terms[0.0][:4, :4],
        tuple(matrix[:4, :4] for tau, matrix in terms.items() if tau),
        tuple(tau for tau in terms if tau),
        drive[:4],
        np.eye(4)[3:],
        input_delays=(13.2,),
    )
    controlled, structure = pid_control(alone, "u1", "y1", proportional=5.0, integral=0.1)
    found = design(controlled, structure, trials=False)
    kp, ki = found.K1[0]

    def parts(s):
        """Return det Δ(s) and det Δ(s) G(s) of the plant."""
        delta = s * np.eye(4) - sum(matrix[:4, :4] * np.exp(-s * t) for t, matrix in terms.items())
        size = np.linalg.det(delta)
        return size, size * np.linalg.solve(delta, drive[:4])[3, 0] * np.exp(-13.2 * s)

    def by_hand(s):
        size, response = parts(s)
        return s * size - (kp * s + ki) * response

    # No roots lie right of those that are given: from 0 to far up the phase of a polynomial of
    # degree 5 turns by 5 quarters.
    line = found.spectral_abscissa + 1e-5
    omega = np.concatenate([[0.0], np.geomspace(1e-7, 0.01, 500), np.linspace(0.01, 60.0, 3000)])
    turned = np.unwrap(np.angle([by_hand(line + 1j * w) for w in omega]))
    assert (turned[-1] - turned[0]) / (0.5 * np.pi) == pytest.approx(5.0, abs=0.05)

    # Three roots meet where s/G(s) = kp s + ki has no curvature.
    def expanded(s):
        ring = 2e-3 * np.exp(2j * np.pi * np.arange(32) / 32)
        values = [(s + z) * np.divide(*parts(s + z)) for z in ring]
        return [float(np.mean(values * ring**-k).real) for k in range(3)]

    best = scipy.optimize.brentq(lambda s: expanded(s)[2], -0.03, -0.02)
    value, slope, _ = expanded(best)
    assert found.spectral_abscissa == pytest.approx(best, abs=1e-8)
    assert found.K1[0] == pytest.approx([slope, value - slope * best], abs=1e-8)


@pytest.mark.long
def test_a_gain_behind_a_late_input_is_designed_for(exchanger):
    """One gain: the best of 401 over its range is no better."""
    plant, *_ = exchanger
    low, none = np.array([[0.0, 0.0, 0.0, 0.0, 0.0]]), np.zeros((1, 5))
    high = np.array([[0.0, 0.0, 0.0, 0.0, 1.0]])
    structure = FeedbackStructure("sum", plant.output_names, low, high, none, none, ("u1",))
    found = design(plant, structure, trials=False)
    family = loop_family(plant, structure)
    assert found.spectral_abscissa < 0.0
    sampled = family.abscissas(np.linspace(0.0, 1.0, 401)[:, None]).min()
    assert found.spectral_abscissa < sampled + 1e-9
