"""Roots of many states followed along gains, beside eigenvalues and counts that know no past."""

import numpy as np
import pytest

from drillctrl import DelaySystem, FeedbackStructure, count_right_of, spectral_abscissa
from drillctrl.synthesis.descent import bfgs
from drillctrl.synthesis.family import loop_family
from drillctrl.synthesis.tracking import abscissa_along

MASSES = 24


@pytest.fixture(scope="module")
def family():
    """A chain of masses on springs, cut at its end and driven at its end, late and at once."""
    springs = 40.0 * (2.0 * np.eye(MASSES) - np.eye(MASSES, k=1) - np.eye(MASSES, k=-1))
    springs[-1, -1] = 40.0
    damping = 0.02 * springs + 0.1 * np.eye(MASSES)
    zero, eye = np.zeros((MASSES, MASSES)), np.eye(MASSES)
    cut = np.zeros((MASSES, MASSES))
    cut[-1, -1] = 1.5
    a0 = np.block([[zero, eye], [-springs - cut, -damping]])
    late = np.block([[zero, zero], [cut, zero]])
    b = np.zeros((2 * MASSES, 1))
    b[-1] = 1.0
    c = np.zeros((2, 2 * MASSES))
    c[0, MASSES - 1] = c[1, -1] = 1.0
    system = DelaySystem(
        a0, (late,), (0.7,), b, c, input_names=("force",), output_names=("x", "dx")
    )
    bounds = [[-3.0, -1.0]], [[3.0, 1.0]]
    structure = FeedbackStructure("both", ("x", "dx"), *bounds, *bounds, inputs=("force",))
    return loop_family(system, structure)


def test_followed_abscissa_and_its_slope(family):
    """Along a walk of gains: exact, and the slope that finite differences show."""
    along = abscissa_along(family)
    assert along != family.abscissa
    rng = np.random.default_rng(3)
    gains = np.array([0.5, -0.2, 0.4, 0.3])
    for _ in range(16):
        value, slope = along(gains)
        assert value == pytest.approx(family.exact(gains), abs=1e-9)
        direction = rng.normal(size=4)
        step = 1e-6 * direction
        rise = (family.exact(gains + step) - family.exact(gains - step)) / 2e-6
        assert slope @ direction == pytest.approx(rise, abs=1e-4 * (1.0 + abs(rise)))
        gains = gains + 0.03 * direction
    # Not found anew each time.
    assert 0 < along.__self__.left < 12


def test_descent_ends_as_with_eigenvalues(family):
    lower, upper = family.feedback.lower, family.feedback.upper
    start = np.array([0.2, 0.1, -0.1, 0.05])
    ends = [
        bfgs(f, start, lower, upper, most=40) for f in (abscissa_along(family), family.abscissa)
    ]
    followed, found = (family.exact(end.gains) for end in ends)
    assert followed == pytest.approx(found, abs=1e-4)
    loop = family.loop(ends[0].gains)
    assert spectral_abscissa(loop) == pytest.approx(ends[0].value, abs=1e-9)
    assert count_right_of(loop, ends[0].value + 1e-6).count == 0


def test_few_states_are_left_to_eigenvalues():
    plant = DelaySystem(
        [[-1.0]], ([[0.5]],), (1.0,), [[1.0]], input_names=("u",), output_names=("x",)
    )
    structure = FeedbackStructure("p", ("x",), [[-1.0]], [[1.0]], [[0.0]], [[0.0]], inputs=("u",))
    few = loop_family(plant, structure)
    assert abscissa_along(few) == few.abscissa


def test_taylor_of_many_states_beside_their_matrices(family):
    """Coefficients give det Δ nearby, over its size without feedback, and its slopes by gains."""
    gains = np.array([0.5, -0.2, 0.4, 0.3])
    places = np.array([-0.2 + 3.1j, 0.1 + 0.4j, -0.5 + 0.0j])
    taylor, slopes = family.taylor(places, gains, 6)
    step = 0.02 * family.reach(places)
    poles = np.linalg.eigvals(family.plain.A0)

    def determinant(s, at):
        sign, size = np.linalg.slogdet(family.characteristic_matrix(s, at))
        free = np.log(np.abs(places[:, None] - poles)).sum(axis=1)
        return sign * np.exp(size - free)

    near = (taylor * step[:, None] ** np.arange(6)).sum(axis=1)
    assert near == pytest.approx(determinant(places + step, gains), rel=1e-8)
    # It is affine in the gains.
    change = np.array([0.1, -0.3, 0.2, 0.5])
    moved = determinant(places, gains + change)
    expected = taylor[:, 0] + slopes[:, 0] @ change
    assert expected == pytest.approx(moved, rel=1e-9)
