"""Critical phases by a sweep: beside those of the eigenvalue problem, and beside the count."""

import numpy as np
import pytest

from drillctrl import DelaySystem, count_right_of, delay_margin
from drillctrl.robustness.margins import with_delay_factor
from drillctrl.spectrum.circle import critical_phases
from drillctrl.spectrum.critical import _of_few_signals, critical_points
from drillctrl.spectrum.critical_newton import sharpened


def matrices(seed):
    """Systems of 1 to 9 states, most of them without full rank, that are critical a few times."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 10))
    rank = n if rng.random() < 0.5 else int(rng.integers(1, n + 1))
    now = rng.normal(size=(n, n)) - rng.uniform(0.0, 2.5) * np.eye(n)
    late = rng.normal(size=(n, rank)) @ rng.normal(size=(rank, n)) / np.sqrt(rank)
    return now, late * 10.0 ** rng.uniform(-1.0, 0.7)


@pytest.mark.parametrize("first", [0, 20])
def test_sweep_and_eigenvalue_problem_agree(first):
    seen = 0
    for seed in range(first, first + 20):
        now, late = matrices(seed)
        (left, right), *_ = DelaySystem(now, (late,), (1.0,)).factors
        _, omega, phase, _ = critical_points(now[None], left[None], right[None])
        swept = critical_phases(now, left, right)
        assert np.sort_complex(swept[0] + 1j * swept[1]) == pytest.approx(
            np.sort_complex(omega + 1j * phase), abs=1e-9
        )
        seen += omega.size
    assert seen > 20


def lightly_damped(seed):
    """Oscillators with damping from 1e-7 on that one to four delayed signals couple."""
    rng = np.random.default_rng(seed)
    many, rank = int(rng.integers(2, 7)), int(rng.integers(1, 5))
    now = np.zeros((2 * many, 2 * many))
    now[:many, many:] = np.eye(many)
    now[many:, :many] = -np.diag(rng.uniform(0.5, 5.0, many) ** 2)
    now[many:, many:] = -np.diag(10.0 ** rng.uniform(-7.0, -1.0, many))
    left = rng.normal(size=(2 * many, rank)) * 10.0 ** rng.uniform(-3.0, 0.7)
    return now, left, rng.normal(size=(rank, 2 * many))


def test_response_over_frequency_and_eigenvalue_problem_agree():
    # Signals that are one or few are read off their response, here beside 2nr linear unknowns.
    seen = 0
    for seed in range(30):
        now, left, right = lightly_damped(seed)
        start = _of_few_signals(now[None], left[None], right[None])
        _, omega, phase, _ = sharpened(now[None], (left @ right)[None], *start)
        read = critical_phases(now, left, right)
        assert np.sort_complex(read[0] + 1j * read[1]) == pytest.approx(
            np.sort_complex(omega + 1j * phase), abs=1e-7
        )
        if left.shape[1] == 1:
            assert critical_points(now[None], left[None], right[None])[1] == pytest.approx(omega)
        seen += omega.size
    assert seen > 60


def test_where_a_sweep_is_lost_the_eigenvalue_problem_answers(monkeypatch):
    rng = np.random.default_rng(0)
    now = rng.normal(size=(20, 20)) - 5.0 * np.eye(20)
    left, right = rng.normal(size=(20, 5)), rng.normal(size=(5, 20))
    swept = critical_points(now[None], left[None], right[None])

    def lost(*_):
        raise ArithmeticError

    monkeypatch.setattr("drillctrl.spectrum.critical.critical_phases", lost)
    solved = critical_points(now[None], left[None], right[None])
    assert swept[1].size
    for one, other in zip(swept, solved, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_a_branch_that_touches_the_axis_and_turns_back_is_not_stepped_over():
    # x' = −a x − b x(t − τ) with b a little above a: critical in a short range of phases only.
    now, late = np.diag([-1.0, -2.0, -3.0]), np.diag([-1.000001, -1.9, -2.9])
    omega, phase = critical_phases(now, late, np.eye(3))
    assert omega == pytest.approx([np.sqrt(1.000001**2 - 1.0)], rel=1e-9)
    assert np.cos(phase) == pytest.approx([-1.0 / 1.000001], abs=1e-12)


@pytest.mark.parametrize(("n", "seed"), [(24, 2), (40, 7)])
def test_margin_of_a_full_delayed_matrix_is_that_of_the_count(n, seed):
    rng = np.random.default_rng(seed)
    now = rng.normal(size=(n, n)) - 1.05 * np.sqrt(n) * np.eye(n)
    loop = DelaySystem(now, (0.3 * rng.normal(size=(n, n)),), (0.3,))
    margin = delay_margin(loop)
    assert margin.shorter == 0.0
    at = [1.0, 0.5 * (1.0 + margin.longer), margin.longer * (1.0 - 1e-6)]
    assert [count_right_of(with_delay_factor(loop, f), 0.0).count for f in at] == [0, 0, 0]
    assert count_right_of(with_delay_factor(loop, margin.longer * (1.0 + 1e-6)), 0.0).count == 2
