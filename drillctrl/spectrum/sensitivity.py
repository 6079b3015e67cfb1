"""Derivatives of simple characteristic roots: ds = −(yᴴ dΔ x)/(yᴴ Δ'(s) x)."""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import ComplexArray
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic


def matrix_sensitivity(
    system: DelaySystem, s: complex
) -> tuple[ComplexArray, tuple[ComplexArray, ...], tuple[complex, ...]]:
    """Return the derivatives of a simple root with respect to every matrix entry and delay.

    Parameters
    ----------
    system : DelaySystem
        Any.
    s : complex
        A simple characteristic root.

    Returns
    -------
    dA0 : array, (n, n)
        ds/dA0, entry by entry.
    dA : tuple of array, (n, n)
        ds/dAi.
    dtau : tuple of complex
        ds/dτi.
    """
    left, _, right = np.linalg.svd(characteristic.matrix(system, s))
    y, x = left[:, -1].conj(), right[-1].conj()
    outer = np.outer(y, x) / (y @ characteristic.derivative(system, s) @ x)
    factors = [np.exp(-s * tau) for tau in system.delays]
    slopes = tuple(outer * factor for factor in factors)
    delays = tuple(
        complex(-s * factor * (outer * matrix).sum())
        for factor, matrix in zip(factors, system.delayed, strict=True)
    )
    return outer, slopes, delays
