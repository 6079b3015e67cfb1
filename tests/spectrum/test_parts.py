"""Systems of parts that do not feel one another: their roots are those of the parts."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from scipy.special import lambertw

from drillctrl import (
    DelaySystem,
    characteristic_roots,
    count_right_of,
    dominant_roots,
    spectral_abscissa,
)
from drillctrl.spectrum.characteristic import perron_root
from drillctrl.spectrum.parts import parts
from drillctrl.spectrum.polishing import polish

_PATH = Path(__file__).parents[2] / "benchmarks" / "agreement.py"
_SPEC = importlib.util.spec_from_file_location("agreement", _PATH)
agreement = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(agreement)

# x' = −x + 0.5 x(t − 1).
ALONE = float(lambertw(0.5 * np.e).real) - 1.0


def test_one_part_drives_another():
    """A chain of equal parts, each driven late by the one before: one root, k times."""
    count = 4
    a0, late = -np.eye(count), 0.5 * np.eye(count) + 100.0 * np.eye(count, k=-1)
    system = DelaySystem(a0, (late,), (1.0,))
    assert spectral_abscissa(system) == pytest.approx(ALONE, abs=1e-12)
    assert [part.order for part in parts(system)] == [1] * count
    # By the parts also where the whole cannot be followed: next to a fourfold root.
    assert count_right_of(system, ALONE - 1e-3).count == count
    assert count_right_of(system, ALONE + 1e-3).count == 0


def test_states_that_no_delayed_signal_reaches():
    """Hidden by a rotation: 2 states with delay, 3 that the delayed signals do not reach."""
    rng = np.random.default_rng(5)
    free = np.array([[-0.2, 3.0, 0.0], [-3.0, -0.2, 0.0], [1.0, 0.0, -0.5]])
    a0 = np.block([[np.diag([-1.0, -4.0]), rng.normal(size=(2, 3))], [np.zeros((3, 2)), free]])
    late = np.zeros((5, 5))
    late[:2] = rng.normal(size=(2, 5))
    late[:2, :2] = [[0.5, 0.0], [0.3, 0.1]]
    turn = np.linalg.qr(rng.normal(size=(5, 5)))[0]
    for sign in (1, -1):
        # Transposed they are states that no delayed signal is made of.
        a, b = (m if sign == 1 else m.T for m in (turn @ a0 @ turn.T, turn @ late @ turn.T))
        found = parts(DelaySystem(a, (b,), (1.0,)))
        eigenvalues = np.concatenate([np.linalg.eigvals(p.A0) for p in found if not p.delays])
        assert np.sort_complex(eigenvalues) == pytest.approx(
            np.sort_complex(np.linalg.eigvals(free)), abs=1e-12
        )
        [late_part] = [p for p in found if p.delays]
        assert late_part.order == 2
        # Of the two states one is x' = −x + 0.5 x(t − 1), driven by the other or driving it.
        values = [root.real for root in characteristic_roots(late_part, -0.32)]
        assert values == pytest.approx([ALONE], abs=1e-12)


# Whole numbers make nilpotent delayed matrices and delays that act on nothing: det Δ is
# (s − a)^k by hand.
@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("seed", "multiplicity"),
    [
        (31000191, 3),
        (31001507, None),
        (32000070, 3),
        (33000230, 5),
        (40005305, 6),
        (40010470, 8),
        (41007292, 7),
        (41007599, 2),
    ],
)
def test_delays_that_do_not_show_in_the_characteristic_function(seed, multiplicity):
    system = agreement.random_system(seed)
    expected = float(system.A0.diagonal().max()) if seed != 31000191 else 0.0
    assert spectral_abscissa(system) == pytest.approx(expected, rel=1e-9, abs=1e-6)
    assert agreement.verdict(system, 1.0) == ("agrees", "")
    if multiplicity is not None:
        assert dominant_roots(system)[0].multiplicity == multiplicity


def test_a_multiple_root_of_a_single_part_is_found():
    """Members that still move about it when the iteration ends: 3 and 8 states by one delay."""
    for seed in (31000212, 31002062):
        system = agreement.random_system(seed)
        assert agreement.verdict(system, 1.0) == ("agrees", "")
        roots = characteristic_roots(system, spectral_abscissa(system) - 0.1 / system.max_delay)
        assert roots[0].residual < 1e-12


def test_two_starts_that_meet_are_no_root():
    """Seven states that drive one another in a row: eigenvalues of A0, none where starts met."""
    system = agreement.random_system(34000904)
    assert spectral_abscissa(system) == pytest.approx(-17.46160477 / 65536.0, rel=1e-8)
    assert agreement.verdict(system, 1.0) == ("agrees", "")


@pytest.mark.parametrize("size", [1e-200, 1.0, 1e137, 1e139, 1e150, 1e250])
def test_bound_of_numbers_far_apart(size):
    """Of a triangular matrix it is the largest diagonal entry, however large the others."""
    matrix = np.diag([3e5, 2e5, 1e5]) + size * np.eye(3, k=-1)
    assert perron_root(matrix) == pytest.approx(3e5, rel=1e-9)


def test_a_part_with_no_root_near_the_line():
    """It has places to start from further left only: nothing is polished, nothing found."""
    a0, late = np.diag([-1.0, -40.0]), np.diag([0.5, 0.1])
    for part, many in zip(parts(DelaySystem(a0, (late,), (1.0,))), (1, 0), strict=True):
        roots, done = polish(part, np.full(many, ALONE + 0j))
        assert roots.size == done.size == many
        assert [root.real for root in characteristic_roots(part, -1.0)] == (
            pytest.approx([ALONE] * many, abs=1e-12)
        )


def test_what_is_small_beside_other_parts_is_no_rounding():
    """λ⁷ (λ − 4) in whole numbers, by hand, with states scaled by up to 10⁸: nothing is delayed."""
    system = agreement.random_system(42008763)
    unit = float(system.A0[0, 0]) * -1.0
    for one in (system, system.balanced):
        found = np.concatenate([np.linalg.eigvals(part.A0) for part in parts(one)])
        assert np.sort(np.abs(found)) / unit == pytest.approx([0.0] * 7 + [4.0], abs=1e-3)
    assert spectral_abscissa(system) / unit == pytest.approx(4.0, rel=1e-9)
    assert agreement.verdict(system, 1.0) == ("agrees", "")


@pytest.mark.parametrize("cyclic", [False, True])
def test_many_states_are_bounded_as_their_eigenvalues_say(cyclic):
    rng = np.random.default_rng(5)
    matrix = rng.random((60, 60)) ** 8
    if cyclic:
        # No power iteration settles: eigenvalues decide.
        matrix = np.roll(np.diag(rng.random(60) + 0.5), 1, axis=1)
    exact = np.abs(np.linalg.eigvals(matrix)).max()
    assert exact <= perron_root(matrix) <= (1.0 + 2e-6) * exact
    assert perron_root(np.zeros((60, 60))) < 1e-200
