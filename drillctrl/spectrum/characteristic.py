"""The characteristic matrix Δ(s) = sI − A0 − Σ Ai exp(−s τi), its inverse and derivative."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drillctrl.delay_system import DelaySystem

ComplexArray = npt.NDArray[np.complex128]
FloatArray = npt.NDArray[np.float64]

# Beyond this, exp(−s τ) would overflow when squared; such an s lies far left of any line
# that matters.
_EXPONENT_LIMIT = 300.0


def matrix(system: DelaySystem, s: npt.ArrayLike) -> ComplexArray:
    """Return Δ(s) for every s, shape (..., n, n)."""
    points = np.asarray(s, dtype=complex)[..., None, None]
    delta = points * np.eye(system.order) - system.A0
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        delta -= (
            np.exp(np.minimum(-points.real * delay, _EXPONENT_LIMIT))
            * np.exp(-1j * delay * points.imag)
            * delayed
        )
    return np.asarray(delta, dtype=complex)


def derivative(system: DelaySystem, s: npt.ArrayLike) -> ComplexArray:
    """Return dΔ/ds for every s, shape (..., n, n)."""
    points = np.asarray(s, dtype=complex)[..., None, None]
    slope = np.broadcast_to(np.eye(system.order), (*points.shape[:-2], *system.A0.shape)) + 0j
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        slope = slope + delay * np.exp(-points * delay) * delayed
    return np.asarray(slope, dtype=complex)


def log_derivative(system: DelaySystem, s: npt.ArrayLike) -> ComplexArray:
    """Return d ln det Δ/ds = tr(Δ⁻¹ Δ') for every s; infinite where Δ is singular."""
    points = np.asarray(s, dtype=complex)
    delta, slope = matrix(system, points), derivative(system, points)
    try:
        solved = np.linalg.solve(delta, slope)
    except np.linalg.LinAlgError:
        # An s that is a root to the last bit: leave it where it is.
        values = np.full(points.shape, np.inf + 0j)
        for index in np.ndindex(points.shape):
            try:
                values[index] = np.trace(np.linalg.solve(delta[index], slope[index]))
            except np.linalg.LinAlgError:
                continue
        return values
    return np.asarray(np.einsum("...ii->...", solved))


def magnitude_bound(system: DelaySystem, right_of: float) -> float:
    """Bound |s| for all characteristic roots with Re s ≥ ``right_of``.

    If Δ(s) v = 0 then |s| |v| ≤ (|A0| + Σ |Ai| exp(−right_of τi)) |v| entry by entry, so
    |s| is at most the Perron root of the matrix in brackets.
    """
    total = np.abs(system.A0)
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        total = total + np.abs(delayed) * np.exp(min(-right_of * delay, _EXPONENT_LIMIT))
    return perron_root(total)


def perron_root(matrix: FloatArray) -> float:
    """Return the spectral radius of a nonnegative matrix, rounded outward."""
    value = float(np.abs(np.linalg.eigvals(matrix)).max())
    return value * (1.0 + 1e-10) + 1e-300
