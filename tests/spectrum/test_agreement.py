"""Roots and count of random systems agree, or one of them is refused: a slice of the campaign."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from drillctrl import (
    DelaySystem,
    characteristic_roots,
    count_right_of,
    dominant_roots,
    spectral_abscissa,
)

_PATH = Path(__file__).parents[2] / "benchmarks" / "agreement.py"
_SPEC = importlib.util.spec_from_file_location("agreement", _PATH)
assert _SPEC is not None
assert _SPEC.loader is not None
agreement = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(agreement)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("first", [0, 40, 80])
def test_random_systems_are_right_or_refused(first):
    systems = [agreement.random_system(first + k) for k in range(40)]
    # The longest take long.
    kinds = [
        agreement.verdict(system, 1.0) for system in systems if agreement.turns(system) < 300.0
    ]
    assert [told for kind, told in kinds if kind == "silent"] == []
    # To refuse everything would be no answer.
    assert sum(kind == "agrees" for kind, _ in kinds) >= 35


def test_the_systems_are_of_every_kind():
    systems = [agreement.random_system(seed) for seed in range(600)]
    sizes = [agreement.turns(system) for system in systems]
    assert min(sizes) < 0.1
    assert max(sizes) > 1e4
    assert {system.order for system in systems} == set(range(1, 9))
    assert {1, 6} <= {len(system.delays) for system in systems}
    assert any(system.balanced is not system for system in systems)


def test_a_cluster_does_not_forget_those_that_were_resolved_before():
    # Eigenvalues of whole numbers: a fivefold root, and beside it a double one.
    system = agreement.random_system(150063)
    assert agreement.verdict(system, 1.0) == ("agrees", "")
    sizes = [root.multiplicity for root in dominant_roots(system)]
    assert sizes[0] == 5


def test_a_double_root_is_found_to_rounding_with_neighbours_beside():
    # The circle about it must not reach so far that those are felt.
    system = agreement.random_system(72004414)
    assert spectral_abscissa(system) == pytest.approx(-2408.205667269, rel=1e-8)


def test_a_cluster_keeps_its_members_where_a_circle_about_it_is_disturbed():
    # Three roots within rounding of one, and a fourth too near to be kept off the circle.
    system = agreement.random_system(72015634)
    assert spectral_abscissa(system) == pytest.approx(3.23722816108e-07, rel=1e-9)


def test_roots_that_all_run_away_are_sought_otherwise():
    # A nilpotent matrix, and delayed ones of zeros: a double root at 0.
    system = agreement.random_system(73001301)
    assert agreement.verdict(system, 1.0)[0] == "agrees"
    assert spectral_abscissa(system) == pytest.approx(0.0, abs=1e-9)
    assert dominant_roots(system)[0].multiplicity == 2


def test_no_roots_at_all_are_no_answer():
    # Threefold chains to rounding: where none can be told apart that is said.
    kind, told = agreement.verdict(agreement.random_system(75002480), 1.0)
    assert kind == "refused"
    assert "near the rightmost" in told


def test_a_wrong_root_would_be_told(monkeypatch):
    system = DelaySystem([[-1.0]], ([[0.5]],), (1.0,))
    assert agreement.verdict(system, 1.0) == ("agrees", "")
    for off in (1e-3, -1e-3):
        monkeypatch.setattr(
            agreement, "spectral_abscissa", lambda s, off=off: spectral_abscissa(s) + off
        )
        assert agreement.verdict(system, 1.0)[0] == "silent"


def test_a_double_root_beside_a_root_that_is_not_looked_at():
    """The mean over a circle about a double root is not pulled by a neighbour."""
    # Diagonal: the root of s = −3 + e^(−s), twice, and an eigenvalue left of it.
    top = spectral_abscissa(DelaySystem([[-3.0]], ([[1.0]],), (1.0,)))
    for gap in (0.2, 0.3, 0.34, 0.4):
        system = DelaySystem(np.diag([-3.0, -3.0, top - gap]), (np.diag([1.0, 1.0, 0.0]),), (1.0,))
        assert spectral_abscissa(system) == pytest.approx(top, abs=1e-9)
        assert dominant_roots(system)[0].multiplicity == 2


def test_eight_delays_of_vyhlidal_and_zitek():
    """Their retarded quasi-polynomial of degree 8, delays to 24.99: 26 roots right of −0.1.

    T. Vyhlídal and P. Zítek, "Mapping based algorithm for large-scale computation of
    quasi-polynomial zeros", IEEE Trans. Autom. Control 54 (2009) 171–177, example 2, as the
    same authors' QPmR carries it.
    """
    # Coefficients of s⁰ … s⁷; that of s⁸ is 0.2.
    parts = {
        24.99: [51.7],
        23.35: [1.5, -0.1, 0.04, 0.03],
        19.9: [0, 0, 0, 0.5],
        18.52: [0, 25.2, 0, -0.9, 0.2, 0.15],
        13.32: [7.2, -1.4, 0, 0, 0.1, 0, 0.8],
        10.33: [0, 19.3, 2.1, 0, -8.7],
        8.52: [0, 6.7, 0, 0, 0, -1.1, 0, 1.0],
        4.61: [29.1],
        0.0: [0, -1.8, 0.001, 0, 0, -12.8, 0, 1.7],
    }

    def companion(coefficients):
        matrix = np.zeros((8, 8))
        matrix[-1, : len(coefficients)] = -np.array(coefficients) / 0.2
        return matrix

    undelayed = companion(parts.pop(0.0)) + np.eye(8, k=1)
    system = DelaySystem(undelayed, tuple(map(companion, parts.values())), tuple(parts))
    assert count_right_of(system, -0.1).count == 26
    roots = characteristic_roots(system, -0.1)
    assert sum(root.multiplicity * (2 if root.imag > 0 else 1) for root in roots) == 26
    # Each of them solves the quasi-polynomial, typed above.
    for root in roots:
        s = root.value
        terms = [
            np.polyval(c[::-1], s) * np.exp(-tau * s)
            for tau, c in [*parts.items(), (0.0, [0, -1.8, 0.001, 0, 0, -12.8, 0, 1.7, 0, 0])]
        ]
        terms.append(0.2 * s**8)
        assert abs(sum(terms)) < 1e-9 * sum(map(abs, terms))


def test_a_circle_tells_apart_what_the_smallest_change_would_make_one():
    """A root beside a sevenfold zero: a change of 1e-15 would make it one eightfold root."""
    system = agreement.random_system(42008763)
    alpha = spectral_abscissa(system)
    assert alpha == pytest.approx(0.01476, rel=1e-4)
    assert count_right_of(system, alpha + 1e-4).count == 0
    assert count_right_of(system, alpha - 1e-4).count == 1
    assert agreement.verdict(system, 1.0) == ("agrees", "")
