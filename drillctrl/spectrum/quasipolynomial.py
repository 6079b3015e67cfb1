"""The characteristic equation as a polynomial in s and E = exp(−sτ).

det(sI − A0 − E A1) has degree n in s and the rank of A1 in E. Its coefficients are read off
the matrices by sampling both variables on circles, so the physics stays where it is written.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray

# Radius of the circle for s: the roots that matter have modulus 0.5 to 10.
_RADIUS = 2.0


@dataclass(frozen=True, eq=False)
class Quasipolynomials:
    """f(s) = Σ c[j, k] s^j exp(−kτs) for many loops at once.

    Attributes
    ----------
    coefficients : array, (N, n + 1, r + 1)
        c[j, k] of every loop; c[n, 0] = 1.
    delays : array, (N,)
        τ of every loop.
    """

    coefficients: FloatArray
    delays: FloatArray

    @property
    def delayed_degree(self) -> int:
        """The largest power of E that occurs in any loop."""
        used = np.abs(self.coefficients).max(axis=(0, 1)) > 0.0
        return int(np.flatnonzero(used).max())

    def polynomials(self, at: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return P[k](s) = Σ c[j, k] s^j and their derivatives.

        Parameters
        ----------
        at : array_like, (N, ...)
            One row for each loop.

        Returns
        -------
        values, slopes : array, (r + 1, N, ...)
        """
        s = np.asarray(at, dtype=complex)
        shape = (-1, *[1] * (s.ndim - 1))
        order, degree = self.coefficients.shape[1] - 1, self.coefficients.shape[2]
        values = np.empty((degree, *s.shape), dtype=complex)
        slopes = np.empty_like(values)
        for k in range(degree):
            c = self.coefficients[:, :, k]
            value = np.broadcast_to(c[:, order].reshape(shape) + 0j, s.shape)
            slope = np.zeros(s.shape, dtype=complex)
            for j in range(order - 1, -1, -1):
                slope = slope * s + value
                value = value * s + c[:, j].reshape(shape)
            values[k], slopes[k] = value, slope
        return values, slopes

    def take(self, index: np.ndarray) -> Quasipolynomials:
        """Return the loops at the given places."""
        return Quasipolynomials(self.coefficients[index], self.delays[index])


def from_matrices(a0: FloatArray, a1: FloatArray, delays: FloatArray) -> Quasipolynomials:
    """Return the characteristic functions of X' = A0 X(t) + A1 X(t − τ).

    Parameters
    ----------
    a0, a1 : array, (N, n, n)
        The matrices of N loops.
    delays : array, (N,)
        Their delays.
    """
    order = a0.shape[-1]
    rows = np.flatnonzero(a1.any(axis=(0, 2))).size
    degree = min(rows, np.flatnonzero(a1.any(axis=(0, 1))).size)
    s = _RADIUS * np.exp(2j * np.pi * np.arange(order + 1) / (order + 1))
    z = np.exp(2j * np.pi * np.arange(degree + 1) / (degree + 1))
    pencil = (
        s[:, None, None, None] * np.eye(order)
        - a0[:, None, None]
        - z[None, :, None, None] * a1[:, None, None]
    )
    samples = np.linalg.det(pencil)
    scale = _RADIUS ** np.arange(order + 1)
    table = np.fft.fft2(samples, axes=(1, 2)).real / samples[0].size
    # What the transform leaves of a coefficient that is zero is noise.
    floor = 1e-12 * np.abs(samples).max(axis=(1, 2), keepdims=True)
    table[np.abs(table) <= floor] = 0.0
    return Quasipolynomials(table / scale[:, None], np.asarray(delays, dtype=float))


def perron_bounds(
    a0: FloatArray, a1: FloatArray, delays: FloatArray, right_of: float
) -> FloatArray:
    """Bound |s| of every root with Re s ≥ ``right_of`` for each of N loops, shape (N,).

    See `drillctrl.spectrum.characteristic.magnitude_bound`; ``a0`` and ``a1`` may be
    entrywise bounds of whole families.
    """
    growth = np.exp(np.minimum(-right_of * delays, 300.0))[:, None, None]
    total = np.abs(a0) + np.abs(a1) * growth
    return np.asarray(np.abs(np.linalg.eigvals(total)).max(axis=1) * (1.0 + 1e-9) + 1e-12)
