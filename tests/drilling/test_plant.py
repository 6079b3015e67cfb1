import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drillctrl import OperatingPoint, RigPoint, as_case, plant_system, table1
from drillctrl.drilling.coefficients import RIG_PARAMETER_NAMES
from drillctrl.drilling.linear import linear_arrays, linearisation_sensitivity, rhs_function
from drillctrl.drilling.plant import paper_plant, rig_plant
from drillctrl.drilling.steady import rig_parameter_values

from ..strategies import points

small = st.floats(-2.0, 2.0)


def published_matrices(p):
    """Eqs. 25 and 26, typed from the paper."""
    n, psi, d = p.blades, p.psi, p.delta0
    a1 = [
        [0, 1, 0, 0],
        [-(p.eta**2) - n * psi, -2 * p.xi * p.eta, n * psi * d, 0],
        [0, 0, 0, 1],
        [-n, 0, -1 + n * d, -2 * p.kappa],
    ]
    a2 = [[0, 0, 0, 0], [n * psi, 0, -n * psi * d, 0], [0, 0, 0, 0], [n, 0, -n * d, 0]]
    return np.array(a1, dtype=float), np.array(a2, dtype=float)


@given(points)
def test_linearisation_is_the_published_one(point):
    system = plant_system(point)
    a1, a2 = published_matrices(point)
    scale = 1 + np.abs(a1)
    assert np.abs((system.A0 - a1) / scale).max() < 4e-16
    assert np.abs((system.delayed[0] - a2) / scale).max() < 4e-16
    assert system.B.tolist() == [[0.0], [0.0], [0.0], [1.0]]
    assert system.delays == (pytest.approx(2 * np.pi / (point.blades * point.omega0)),)


def test_linearisation_is_the_published_one_to_the_last_bit_at_whole_numbers():
    """Where no product rounds, nothing may be left of the difference."""
    for seed in range(20):
        w, d, psi, eta, n = (int(v) for v in np.random.default_rng(seed).integers(1, 9, 5))
        point = OperatingPoint(2.0**w, d, psi, eta, xi=0.5, kappa=0.25, blades=n)
        a1, a2 = published_matrices(point)
        system = plant_system(point)
        assert system.A0.tolist() == a1.tolist()
        assert system.delayed[0].tolist() == a2.tolist()


def test_dropping_the_motion_dependence_of_the_delay_would_change_the_operator(point_c):
    """The terms in θ exist only because τ depends on the motion."""
    system = plant_system(point_c)
    assert system.delayed[0][1, 2] == -point_c.blades * point_c.psi * point_c.delta0
    assert system.A0[1, 2] == +point_c.blades * point_c.psi * point_c.delta0


@given(st.lists(small, min_size=8, max_size=8), st.floats(0.05, 2.0), small, small)
def test_si_and_dimensionless_motion_are_the_same(states, tau, axial, torque):
    rig_point = RigPoint(table1(), 12.0, 4e-3)
    rig, point = rig_point.rig, rig_point.operating_point()
    time, length = rig.time_scale, rig.axial_scale
    unit = np.array([length, length / time, 1.0, 1.0 / time])
    now, then = np.array(states[:4]), np.array(states[4:])
    plain = rhs_function(paper_plant())(
        now, then, tau, [axial, torque], as_case(point).parameter_vector
    )
    values = rig_parameter_values(rig_point)
    si = rhs_function(rig_plant())(
        now * unit,
        then * unit,
        tau * time,
        [axial * rig.axial_force_scale, torque * rig.torsional_stiffness],
        [values[name] for name in RIG_PARAMETER_NAMES],
    )
    back = np.array(si).ravel() * time / unit
    want = np.array(plain).ravel()
    assert np.abs(back - want).max() <= 1e-12 * (1 + np.abs(want).max())


@given(points)
def test_steady_drilling_is_an_equilibrium(point):
    zero = np.zeros(4)
    rate = rhs_function(paper_plant())(
        zero, zero, point.delay, [0, 0], as_case(point).parameter_vector
    )
    scale = 1 + point.psi * 2 * np.pi * point.delta0 + point.lam
    assert np.abs(np.array(rate)).max() < 1e-14 * scale


@given(points)
def test_linear_model_is_the_limit_of_the_nonlinear_one(point):
    """Central difference of the motion with τ solved from its own condition."""
    if point.delta0 < 0.1:
        point = point.with_changes(delta0=0.1)
    system, f = plant_system(point), rhs_function(paper_plant())
    p, h = as_case(point).parameter_vector, 1e-6
    for j in range(8):
        sides = []
        for sign in (1.0, -1.0):
            both = np.zeros(8)
            both[j] = sign * h
            now, then = both[:4], both[4:]
            tau = point.delay - (now[2] - then[2]) / point.omega0
            sides.append(np.array(f(now, then, tau, [0, 0], p)).ravel())
        want = system.A0[:, j] if j < 4 else system.delayed[0][:, j - 4]
        got = (sides[0] - sides[1]) / (2 * h)
        assert np.abs(got - want).max() < 1e-6 * (1 + np.abs(system.A0).max())


@given(points)
def test_parameter_sensitivity_matches_differences(point):
    plant = paper_plant()
    jacobian = np.array(linearisation_sensitivity(plant)(as_case(point).parameter_vector))
    p = as_case(point).parameter_vector

    def stacked(vector):
        a0, left, right, b, _, tau, *_ = linear_arrays(plant, vector[None, :])
        matrices = (a0[0], left[0] @ right[0], b[0])
        return np.concatenate([*(m.ravel(order="F") for m in matrices), tau])

    for j in range(p.size):
        h = 1e-6 * (1 + abs(p[j]))
        up, down = p.copy(), p.copy()
        up[j] += h
        down[j] -= h
        if down[1] < 0:
            continue
        difference = (stacked(up) - stacked(down)) / (2 * h)
        assert np.abs(difference - jacobian[:, j]).max() < 1e-5 * (1 + np.abs(jacobian).max())


def test_axial_actuator_is_available_and_unknown_ones_are_refused():
    point = OperatingPoint(5.1, 0.25, 14.0)
    assert plant_system(point, ("axial",)).B.tolist() == [[0.0], [1.0], [0.0], [0.0]]
    with pytest.raises(ValueError, match="inputs = feed"):
        plant_system(point, ("feed",))
