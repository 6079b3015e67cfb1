"""Conditions for roots to lie where they are taken to lie, with two derivatives.

A configuration of roots with a common real part t holds if det Δ vanishes at each t + iω
together with its first k − 1 derivatives. The unknowns are u = (gains, t, frequencies).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.synthesis.family import ActiveRoot, LoopFamily

_TERMS = 6


@dataclass(frozen=True, eq=False)
class Conditions:
    """The conditions of one configuration, scaled to be of order one around a start.

    Attributes
    ----------
    family : LoopFamily
        Loops to choose from.
    roots : tuple of ActiveRoot
        The configuration.
    weights : tuple of array
        Factors of the Taylor coefficients of det Δ about each root.
    start : array
        u where the configuration was suggested.
    """

    family: LoopFamily
    roots: tuple[ActiveRoot, ...]
    weights: tuple[FloatArray, ...]
    start: FloatArray

    @property
    def gains(self) -> int:
        """Number of gains, k; u[k] is t."""
        return self.family.feedback.lower.size

    @functools.cached_property
    def units(self) -> FloatArray:
        """Units of u in which gains within narrow bounds are of order one."""
        width = self.family.feedback.upper - self.family.feedback.lower
        units = np.ones(self.start.size)
        units[: self.gains] = 2.0 ** np.floor(np.log2(np.minimum(width, 1.0)))
        return units

    def places(self, u: FloatArray) -> ComplexArray:
        """Return t + iω of every root."""
        omega = np.zeros(len(self.roots))
        omega[self._paired] = u[self.gains + 1 :]
        return np.asarray(u[self.gains] + 1j * omega)

    @functools.cached_property
    def _paired(self) -> list[int]:
        return [i for i, root in enumerate(self.roots) if root.omega != 0.0]

    def located(self, u: FloatArray) -> tuple[ActiveRoot, ...]:
        """Return the roots with the frequencies of u."""
        places = self.places(u)
        return tuple(
            ActiveRoot(float(s.imag), root.multiplicity)
            for s, root in zip(places, self.roots, strict=True)
        )

    def values(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the real conditions, (q,), and their Jacobian, (q, len(u))."""
        k = self.gains
        most = max(root.multiplicity for root in self.roots)
        taylor, slopes = self.family.taylor(self.places(u), u[:k], most + 1)
        values, rows = [], []
        column = k + 1
        for i, root in enumerate(self.roots):
            m = root.multiplicity
            weight = self.weights[i][:m]
            # d/ds of coefficient l is l + 1 times the next one.
            by_s = np.arange(1, m + 1) * taylor[i, 1 : m + 1] * weight
            block = np.zeros((m, u.size), dtype=complex)
            block[:, :k] = slopes[i, :m] * weight[:, None]
            block[:, k] = by_s
            value = taylor[i, :m] * weight
            values.append(value.real)
            if root.omega != 0.0:
                block[:, column] = 1j * by_s
                column += 1
                values.append(value.imag)
                rows += [block.real, block.imag]
            else:
                rows.append(block.real)
        return np.concatenate(values), np.vstack(rows)

    def curvature(self, u: FloatArray, multipliers: FloatArray) -> FloatArray:
        """Return Σ λj times the Hessian of condition j."""
        k = self.gains
        most = max(root.multiplicity for root in self.roots)
        taylor, slopes = self.family.taylor(self.places(u), u[:k], most + 2)
        hessian = np.zeros((u.size, u.size))
        column, row = k + 1, 0
        for i, root in enumerate(self.roots):
            m = root.multiplicity
            factor = (multipliers[row : row + m] * self.weights[i][:m]).astype(complex)
            row += m
            if root.omega != 0.0:
                factor = factor - 1j * multipliers[row : row + m] * self.weights[i][:m]
                row += m
            first = np.arange(1, m + 1)
            mixed = (factor * first) @ slopes[i, 1 : m + 1]
            second = complex((factor * first * (first + 1)) @ taylor[i, 2 : m + 2])
            hessian[:k, k] += mixed.real
            hessian[k, k] += second.real
            if root.omega != 0.0:
                hessian[:k, column] += (1j * mixed).real
                hessian[k, column] += (1j * second).real
                hessian[column, column] += -second.real
                column += 1
        upper = np.triu(hessian)
        return np.asarray(upper + np.triu(hessian, 1).T)


def conditions(
    family: LoopFamily, gains: FloatArray, abscissa: float, roots: tuple[ActiveRoot, ...]
) -> Conditions:
    """Pose the conditions of a configuration that was suggested at given gains."""
    omega = np.array([root.omega for root in roots])
    s = abscissa + 1j * omega
    ladder = family.reach(s)[:, None] ** np.arange(_TERMS)
    sizes = np.abs(family.taylor(s, gains, _TERMS)[0] * ladder).max(axis=1)
    start = np.concatenate([gains, [abscissa], omega[omega != 0.0]])
    return Conditions(family, roots, tuple(ladder / sizes[:, None]), start)
