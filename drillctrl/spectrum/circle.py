"""Critical phases of one loop of many delayed signals, by a sweep of the phase.

A root at iω with φ = ωτ is an eigenvalue iω of A(φ) = A0 + exp(−iφ) A1. The n eigenvalues are
followed over φ in [0, π] (they are conjugate at −φ) with their first and second derivatives, so
that a point costs n³ operations where the linear problem of `drillctrl.spectrum.critical` has
2n² unknowns. Steps are halved until those that may reach the axis move straight; there Newton's
method is begun. The crossings must be those by which the number of eigenvalues right of the axis
changes from point to point. With few delayed signals they are read off the response over frequency
(`resonances`), which must agree with the number of eigenvalues at a few phases.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.spectrum.critical_newton import IntArray, sharpened
from drillctrl.spectrum.resonances import critical_frequencies, modal_response

BoolArray = npt.NDArray[np.bool_]

_LOST = "crossings of the axis could not be told apart"
_FIRST = 48
# Delayed signals up to which the response over frequency is looked at; phases that check it.
_FEW, _CHECKS = 4, 9
_MOST_POINTS = 4000
_ROUNDS = 20
# Shortest step; what changes within it is a crossing at it.
_SHORTEST = 1e-9
# By how much the second derivative may bend a branch near the axis over a step, as a share of
# what the first moves it, and how much further than predicted a branch is feared to come.
_BENT, _SAFETY = 0.5, 2.0


@dataclass(frozen=True, eq=False)
class _Point:
    """Eigenvalues at a phase, with derivatives by it."""

    phase: float
    values: ComplexArray
    slopes: ComplexArray
    bends: ComplexArray

    @property
    def right(self) -> int:
        return int((self.values.real > 0.0).sum())


def critical_phases(
    A0: FloatArray, left: FloatArray, right: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return all (ω, φ) with a root at iω where ωτ = φ modulo 2π.

    Parameters
    ----------
    A0 : array, (n, n)
        Acts on X(t).
    left, right : array, (n, r) and (r, n)
        Factors of A1, which acts on X(t − τ).

    Returns
    -------
    omega, phase : array, (k,)
        ω > 0 and φ in [0, 2π).

    Raises
    ------
    ArithmeticError
        If a branch runs along the axis, so that crossings cannot be told apart.
    """
    A1 = left @ right
    if left.shape[1] <= _FEW:
        seen = _by_frequency(A0, left, right)
        if seen is not None:
            return seen
    points, starts = _followed(A0, A1)
    for _ in range(_ROUNDS):
        begun = np.array(starts).reshape(-1, 2).T
        omega, phase = np.abs(begun[0]), np.where(begun[0] < 0.0, -begun[1], begun[1])
        rows = np.zeros(omega.shape, dtype=np.intp)
        _, omega, phase, direction = sharpened(A0[None], A1[None], rows, omega, phase)
        folded, turn = _folded(phase, direction)
        lost = [
            (one, other)
            for one, other in itertools.pairwise(points)
            if other.right - one.right != turn[(folded > one.phase) & (folded <= other.phase)].sum()
        ]
        if not lost:
            return omega, phase
        for one, other in lost:
            middle = _at(A0, A1, 0.5 * (one.phase + other.phase))
            points.append(middle)
            width = other.phase - one.phase
            starts += [start for point in (one, middle, other) for start in _starts(point, width)]
        points.sort(key=lambda point: point.phase)
    raise ArithmeticError(_LOST)


def _folded(phase: FloatArray, direction: IntArray) -> tuple[FloatArray, IntArray]:
    """Return phases in [0, π] and which way a root moves as they grow; at −ω the phase is −φ."""
    upper = phase <= math.pi
    return np.where(upper, phase, 2.0 * math.pi - phase), np.where(upper, direction, -direction)


def _by_frequency(
    A0: FloatArray, left: FloatArray, right: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return what the response over frequency tells, where counts at some phases bear it out."""
    response = modal_response(A0, left, right)
    if response is None:
        return None
    omega, phase = critical_frequencies(*response)
    A1 = left @ right
    rows = np.zeros(omega.shape, dtype=np.intp)
    _, omega, phase, direction = sharpened(A0[None], A1[None], rows, omega, phase)
    folded, turn = _folded(phase, direction)
    checks = np.linspace(0.0, math.pi, _CHECKS)
    values = np.linalg.eigvals(A0 + np.exp(-1j * checks)[:, None, None] * A1)
    counts = (values.real > 0.0).sum(axis=1)
    for one, other, change in zip(checks, checks[1:], np.diff(counts), strict=False):
        if turn[(folded > one) & (folded <= other)].sum() != change:
            return None
    return omega, phase


def _followed(A0: FloatArray, A1: FloatArray) -> tuple[list[_Point], list[tuple[float, float]]]:
    """Return the points of the sweep in order, and signed ω and φ to begin at."""
    points = [_at(A0, A1, phase) for phase in np.linspace(0.0, math.pi, _FIRST + 1).tolist()]
    waiting = list(itertools.pairwise(points))
    starts: list[tuple[float, float]] = []
    while waiting:
        one, other = waiting.pop()
        width = other.phase - one.phase
        near = [(point, _in_reach(point, width)) for point in (one, other)]
        reached = any(where.any() for _, where in near)
        straight = all(_is_straight(point, where, width) for point, where in near)
        if (reached and not straight and width > _SHORTEST) or (
            not reached and one.right != other.right
        ):
            if len(points) > _MOST_POINTS or width < _SHORTEST:
                raise ArithmeticError(_LOST)
            points.append(_at(A0, A1, 0.5 * (one.phase + other.phase)))
            waiting += [(one, points[-1]), (points[-1], other)]
            continue
        starts += [start for point in (one, other) for start in _starts(point, width)]
    return sorted(points, key=lambda point: point.phase), starts


def _at(A0: FloatArray, A1: FloatArray, phase: float) -> _Point:
    term = np.exp(-1j * phase) * A1
    values, vectors = np.linalg.eig(A0 + term)
    with np.errstate(all="ignore"):
        moved = np.linalg.solve(vectors, -1j * term @ vectors)
        slopes = moved.diagonal()
        gap = values[:, None] - values[None, :]
        np.fill_diagonal(gap, np.inf)
        bends = 2.0 * (moved * moved.T / gap).sum(axis=1) - 1j * slopes
    return _Point(phase, values, slopes, bends)


def _in_reach(point: _Point, width: float) -> BoolArray:
    """Which eigenvalues may come to the axis within a step."""
    first = np.abs(point.slopes.real) * width
    second = 0.5 * np.abs(point.bends) * width**2
    return np.asarray(~(np.abs(point.values.real) > _SAFETY * (first + second)))


def _starts(point: _Point, width: float) -> list[tuple[float, float]]:
    """Return signed ω and φ where those that may come to the axis are expected to cross it."""
    near = _in_reach(point, width)
    values, slopes = point.values[near], point.slopes[near]
    with np.errstate(divide="ignore", invalid="ignore"):
        ahead = np.nan_to_num(np.clip(-values.real / slopes.real, -width, width))
    omega = values.imag + slopes.imag * ahead
    return list(zip(omega.tolist(), (point.phase + ahead).tolist(), strict=True))


def _is_straight(point: _Point, where: BoolArray, width: float) -> bool:
    """Whether those move nearly on straight lines over a step."""
    bent = 0.5 * np.abs(point.bends[where]) * width
    return bool((bent <= _BENT * np.abs(point.slopes.real[where])).all())
