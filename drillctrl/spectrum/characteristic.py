"""The characteristic matrix Δ(s) = sI − A0 − Σ Ai exp(−s τi), its inverse and derivative."""

from __future__ import annotations

import cmath
import functools

import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dgeev, zgetrf, zgetrs

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.reduced import ReducedLoops, reduced
from drillctrl.delay.system import DelaySystem

# Beyond this, exp(−s τ) would overflow when squared; such an s lies far left of any line
# that matters.
_EXPONENT_LIMIT = 300.0
# Below so many states a tighter bound, or another way to det Δ, saves nothing.
_FEW_STATES, _SAFE_CONDITION = 20, 1e6
# Of a power iteration: most steps, how near its bounds come to each other, and what stays positive.
_POWERS, _CLOSE, _LEAST = 100, 1e-6, 1e-200
# With fewer delayed signals to a state det Δ costs less through them.
_THIN = 0.25
_INVERSE_ITERATIONS = 3
# Numbers in one temporary array: 8 MB of complex ones.
_CHUNK = 500_000


def matrix(system: DelaySystem, s: npt.ArrayLike) -> ComplexArray:
    """Return Δ(s) for every s, shape (..., n, n)."""
    return matrix_and_derivative(system, np.asarray(s, dtype=complex), with_derivative=False)[0]


def derivative(system: DelaySystem, s: npt.ArrayLike) -> ComplexArray:
    """Return dΔ/ds for every s, shape (..., n, n)."""
    return matrix_and_derivative(system, np.asarray(s, dtype=complex))[1]


def matrix_and_derivative(
    system: DelaySystem, points: ComplexArray, with_derivative: bool = True
) -> tuple[ComplexArray, ComplexArray]:
    """Return Δ(s) and, unless it is not wanted, dΔ/ds for every s."""
    points = points[..., None, None]
    identity = np.eye(system.order)
    delta = points * identity - system.A0
    slope = np.zeros_like(delta) + identity if with_derivative else delta
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        exponent = -delay * points
        np.minimum(exponent.real, _EXPONENT_LIMIT, out=exponent.real)
        term = np.exp(exponent) * delayed
        delta -= term
        if with_derivative:
            slope += delay * term
    return delta, slope


@functools.lru_cache(maxsize=8)
def _thin(system: DelaySystem) -> ReducedLoops | None:
    """Return a system of many states through its few delayed signals; None for others."""
    signals = sum(right.shape[0] for _, right in system.factors)
    few = system.order < _FEW_STATES or signals > _THIN * system.order
    return None if few else reduced(system)


def is_thin(system: DelaySystem) -> bool:
    """Whether a system of many states is evaluated through its few delayed signals."""
    return _thin(system) is not None


def log_derivative_at(system: DelaySystem, s: complex) -> complex:
    """Return `log_derivative` at a single point, with less overhead."""
    if system.order >= _FEW_STATES:
        return complex(log_derivative(system, np.array([s]))[0])
    slope: ComplexArray = np.eye(system.order, dtype=complex)
    delta = s * slope - system.A0
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        term = cmath.exp(complex(min(-s.real * delay, _EXPONENT_LIMIT), -s.imag * delay)) * delayed
        delta = delta - term
        slope = slope + delay * term
    try:
        return complex((np.linalg.inv(delta) * slope.T).sum())
    except np.linalg.LinAlgError:
        return complex(np.inf)


def log_derivative(system: DelaySystem, s: npt.ArrayLike) -> ComplexArray:
    """Return d ln det Δ/ds = tr(Δ⁻¹ Δ') for every s; infinite where Δ is singular."""
    points = np.asarray(s, dtype=complex)
    loops = _thin(system) if system.order >= _FEW_STATES else None
    if loops is not None:
        slope = loops.evaluate(points.reshape(1, -1))[2].reshape(points.shape)
        return np.where(np.isnan(slope), np.inf, slope)
    if points.ndim != 1 or points.size * system.order**2 <= _CHUNK:
        return trace_ratio(*matrix_and_derivative(system, points))
    parts = np.array_split(points, points.size * system.order**2 // _CHUNK + 1)
    return np.concatenate([trace_ratio(*matrix_and_derivative(system, part)) for part in parts])


def trace_ratio(delta: ComplexArray, slope: ComplexArray) -> ComplexArray:
    """Return tr(Δ⁻¹ Δ'); infinite where Δ is singular."""
    try:
        inverse = np.linalg.inv(delta)
    except np.linalg.LinAlgError:
        # An s that is a root to the last bit: leave it where it is.
        values = np.full(delta.shape[:-2], np.inf + 0j)
        for index in np.ndindex(values.shape):
            try:
                values[index] = np.trace(np.linalg.solve(delta[index], slope[index]))
            except np.linalg.LinAlgError:
                continue
        return values
    return np.asarray(np.einsum("...ij,...ji->...", inverse, slope))


def magnitude_bound(system: DelaySystem, right_of: float) -> float:
    """Bound |s| for all characteristic roots with Re s ≥ ``right_of``.

    If Δ(s) v = 0 then |s| |v| ≤ (|A0| + Σ |Ai| exp(−right_of τi)) |v| entry by entry, so
    |s| is at most the Perron root of the matrix in brackets.
    """
    total = np.abs(system.A0)
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        total = total + np.abs(delayed) * np.exp(min(-right_of * delay, _EXPONENT_LIMIT))
    return perron_root(total)


def tight_bound(system: DelaySystem, right_of: float) -> float:
    """Return `magnitude_bound`, or that of the same loop in the eigenbasis of A0 if it is less.

    What many coupled modes add up to is far above the fastest of them; in their own
    coordinates hardly anything couples them.
    """
    plain = magnitude_bound(system, right_of)
    if system.order < _FEW_STATES:
        return plain
    balanced = system.balanced
    _, vectors = np.linalg.eig(balanced.A0)
    try:
        inverse = np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        return plain
    if not np.linalg.norm(inverse) < _SAFE_CONDITION:
        return plain
    total = np.abs(inverse @ balanced.A0 @ vectors)
    for delay, delayed in zip(balanced.delays, balanced.delayed, strict=True):
        growth = np.exp(min(-right_of * delay, _EXPONENT_LIMIT))
        total = total + np.abs(inverse @ delayed @ vectors) * growth
    return min(plain, perron_root(total) * (1.0 + 1e-6))


def perron_root(matrix: FloatArray) -> float:
    """Return the spectral radius of a nonnegative matrix, rounded outward.

    Of many states it is bounded by the largest (M x)ᵢ/xᵢ (Collatz 1942), which is no less for any
    x > 0; where the power iteration for x does not close in on it, eigenvalues are computed.
    """
    # LAPACK scales what is beyond 1e138 or below 1e-138, and some builds do not scale back.
    size = float(matrix.max()) or 1.0
    if len(matrix) >= _FEW_STATES:
        x = np.ones(len(matrix))
        for _ in range(_POWERS):
            y = matrix @ x / size
            ratios = y / x
            if ratios.max() <= (1.0 + _CLOSE) * ratios.min():
                return size * float(ratios.max()) * (1.0 + 1e-10) + 1e-300
            x = y / (y.max() or 1.0) + _LEAST
    real, imag, _, _, info = dgeev(matrix / size, 0, 0)
    value = np.hypot(real, imag).max() if info == 0 else np.linalg.norm(matrix / size)
    value = size * float(value)
    return value * (1.0 + 1e-10) + 1e-300


def perron_bounds(
    A0: FloatArray, A1: FloatArray, delays: FloatArray, right_of: float
) -> FloatArray:
    """Return `magnitude_bound` of N loops with one delay each, shape (N,).

    ``A0`` and ``A1``, both (N, n, n), may be entrywise bounds of whole families.
    """
    growth = np.exp(np.minimum(-right_of * delays, _EXPONENT_LIMIT))[:, None, None]
    total = np.abs(A0) + np.abs(A1) * growth
    return np.asarray(np.abs(np.linalg.eigvals(total)).max(axis=1) * (1.0 + 1e-9) + 1e-12)


def weight(system: DelaySystem, s: ComplexArray) -> FloatArray:
    """S(s) = ‖A0‖ + Σ ‖Ai‖ |exp(−sτi)|, what relative changes are measured against."""
    total = np.full(s.shape, system.norms[0])
    for delay, norm in zip(system.delays, system.norms[1:], strict=True):
        total += norm * np.exp(np.minimum(-s.real * delay, _EXPONENT_LIMIT))
    return np.asarray(np.maximum(total, 1e-300))


def smallest_singular(system: DelaySystem, s: ComplexArray) -> FloatArray:
    """Smallest singular value of Δ for every s, 0 at a root; of many states an estimate.

    It is never less than the value, and is it where Δ is nearly singular.
    """
    delta = matrix(system, s)
    if system.order < _FEW_STATES:
        return np.asarray(np.linalg.svd(delta, compute_uv=False)[..., -1])
    each = [nearly_null(one)[0] for one in delta.reshape(-1, *delta.shape[-2:])]
    return np.asarray(each).reshape(delta.shape[:-2])


def nearly_null(delta: ComplexArray) -> tuple[float, ComplexArray, ComplexArray]:
    """Return the smallest singular value of a matrix and its left and right vectors, (n,).

    Of a large one by inverse iteration, which is exact where it is nearly singular.
    """
    if len(delta) >= _FEW_STATES:
        factors, pivots, info = zgetrf(delta)
        if info == 0:
            left = np.ones(len(delta), dtype=complex)
            for _ in range(_INVERSE_ITERATIONS):
                right = zgetrs(factors, pivots, left)[0]
                right /= np.linalg.norm(right)
                left = zgetrs(factors, pivots, right, trans=2)[0]
                size = 1.0 / float(np.linalg.norm(left))
                left *= size
            if np.isfinite(size):
                return size, left, right
    left, sizes, right = np.linalg.svd(delta)
    return float(sizes[-1]), left[:, -1], right[-1].conj()
