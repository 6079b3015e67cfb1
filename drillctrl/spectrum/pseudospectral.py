"""Chebyshev collocation of the infinitesimal generator, on the delayed signals only.

For Ai = Li Ri the past enters through the signals w = Ri X alone, so each delay carries
rank(Ai) functions on [−τi, 0] instead of n (Breda, Maset and Vermiglio 2005; the reduction
is exact, because the unused components never return to the motion).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg.lapack import dgeev

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum.characteristic import magnitude_bound

MAX_DEGREE = 400
# Points of a short delay beyond its share of those of the largest.
_MORE = 5


@functools.lru_cache(maxsize=256)
def _blocks(degree: int, rank: int) -> tuple[FloatArray, FloatArray]:
    """Differentiation of ``rank`` signals: columns of the past nodes, and of node 0."""
    base = _chebyshev(degree)
    past = np.asarray(np.kron(base[1:, 1:], np.eye(rank)), dtype=float)
    present = np.asarray(np.kron(base[1:, :1], np.eye(rank)), dtype=float)
    past.setflags(write=False)
    present.setflags(write=False)
    return past, present


@functools.lru_cache(maxsize=64)
def _chebyshev(degree: int) -> FloatArray:
    """Differentiation matrix on the nodes (cos(jπ/N) − 1)/2 of [−1, 0], node 0 first."""
    nodes = (np.cos(np.pi * np.arange(degree + 1) / degree) - 1.0) / 2.0
    weight = np.ones(degree + 1)
    weight[0] = weight[-1] = 2.0
    weight *= (-1.0) ** np.arange(degree + 1)
    gap = nodes[:, None] - nodes[None, :]
    matrix = np.outer(weight, 1.0 / weight) / (gap + np.eye(degree + 1))
    matrix -= np.diag(matrix.sum(axis=1))
    matrix.setflags(write=False)
    return matrix


@functools.lru_cache(maxsize=64)
def own_abscissa(degree: int) -> float:
    """Return the abscissa, times τ, of the collocation of a delay that nothing enters.

    It is near −2 for few nodes and −5 for many: what lies further left does not show.
    """
    return float(np.linalg.eigvals(_blocks(degree, 1)[0]).real.max())


def degree_for(system: DelaySystem, right_of: float = 0.0) -> int:
    """Choose the degree that resolves all roots right of a line.

    The collocation replaces exp(−sτ) by a rational function that is accurate while
    |s| τ < 2N; every root right of the line has |s| below the Perron bound.
    """
    return degree_for_reach(magnitude_bound(system, right_of) * system.max_delay)


def degree_for_reach(reach: float) -> int:
    """Choose the degree that resolves exp(−sτ) up to |s| τ = ``reach``.

    The error is then below 1e-4 at the edge, which starts the iteration on the
    characteristic equation, and far smaller where dominant roots mostly are.
    """
    return min(MAX_DEGREE, 3 + math.ceil(0.55 * reach)) if reach > 0.0 else 1


def degrees_for(delays: Sequence[float], degree: int) -> list[int]:
    """Return the degree for each delay that resolves as much as ``degree`` does for the largest.

    Over a shorter delay exp(−sτ) turns less; a few more see to it that what is resolved to
    rounding with the largest is so with all.
    """
    longest = max(delays, default=1.0)
    return [min(degree, _MORE + math.ceil(degree * delay / longest)) for delay in delays]


def generator_size(system: DelaySystem, degree: int) -> int:
    """Return the number of rows of `generator_matrix`."""
    each = zip(degrees_for(system.delays, degree), system.factors, strict=True)
    return system.order + sum(points * len(right) for points, (_, right) in each)


def generator_matrix(
    system: DelaySystem,
    degree: int,
    factors: Sequence[tuple[FloatArray, FloatArray]] | None = None,
) -> FloatArray:
    """Return the collocated generator, shape (n + Σ Ni ri, n + Σ Ni ri).

    The unknowns are X, then for each delay the signals at the nodes, the oldest last.

    Parameters
    ----------
    system : DelaySystem
        Any number of delays.
    degree : int
        N ≥ 1, degree of the polynomial on the longest [−τi, 0]; for the others see `degrees_for`.
    factors : sequence of (array, array), optional
        Li (n, ri) and Ri (ri, n) of each delay; by default ``system.factors``.
    """
    factors = system.factors if factors is None else factors
    n = system.order
    degrees = degrees_for(system.delays, degree)
    size = n + sum(p * len(right) for p, (_, right) in zip(degrees, factors, strict=True))
    matrix = np.zeros((size, size))
    matrix[:n, :n] = system.A0
    start = n
    for delay, points, (left, right) in zip(system.delays, degrees, factors, strict=True):
        rank = right.shape[0]
        past, present = _blocks(points, rank)
        stop = start + points * rank
        matrix[start:stop, start:stop] = past / delay
        matrix[start:stop, :n] = present @ (right / delay)
        matrix[:n, stop - rank : stop] = left
        start = stop
    return matrix


def generator_eigenvalues(system: DelaySystem, degree: int) -> ComplexArray:
    """Return the eigenvalues of the collocated generator in no order.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the QR iteration does not converge.
    """
    real, imag, _, _, info = dgeev(generator_matrix(system, degree), 0, 0, overwrite_a=1)
    if info:
        raise np.linalg.LinAlgError("eigenvalues did not converge")
    return np.asarray(real + 1j * imag)


def approximate_roots(system: DelaySystem, degree: int | None = None) -> ComplexArray:
    """Return the eigenvalues of the collocated generator, rightmost first.

    Parameters
    ----------
    system : DelaySystem
        Any number of delays.
    degree : int, optional
        By default `degree_for` the imaginary axis.
    """
    degree = degree_for(system) if degree is None else degree
    values = generator_eigenvalues(system, degree)
    return values[np.argsort(-values.real, kind="stable")]
