"""Semi-discretised loops as a family over their gains, to be sharpened on their active roots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.spectrum.semidiscretization import SemiDiscretization, semidiscretize
from drillctrl.synthesis.family import LoopFamily

_CIRCLE = np.exp(2j * np.pi * np.arange(16) / 16)
# Of the central differences by the gains, relative.
_STEP = 1e-5


@dataclass(frozen=True, eq=False)
class DiscretisedFamily:
    """ln z/Δt for the eigenvalues z of D, as functions of the gains.

    Attributes
    ----------
    family : LoopFamily
        The loops.
    m, order : int
        As in `semidiscretize`.
    """

    family: LoopFamily
    m: int
    order: int

    @property
    def feedback(self) -> FeedbackStructure:
        """Structure of the loops."""
        return self.family.feedback

    def scheme(self, gains: FloatArray) -> SemiDiscretization:
        """Return the semi-discretised loop at a gain vector."""
        return semidiscretize(self.family.loop(gains), self.m, self.order)

    def exact(self, gains: FloatArray) -> float:
        """Return ln ρ(D)/Δt."""
        return self.scheme(gains).growth_rate

    def eigenvalues(self, gains: FloatArray) -> ComplexArray:
        """Return ln z/Δt of all z that are not zero, rightmost first."""
        scheme = self.scheme(gains)
        z = scheme.multipliers()
        return np.asarray(np.log(z[np.abs(z) > 1e-12 * np.abs(z[0])]) / scheme.step)

    def taylor(
        self, s: ComplexArray, gains: FloatArray, terms: int
    ) -> tuple[ComplexArray, ComplexArray]:
        """Expand det(zI − P − Σ Rk S z⁻ᵏ) with z = exp(s Δt) about many places.

        Returns
        -------
        array, (q, terms), and array, (q, terms, k)
            Taylor coefficients, and their derivatives by the gains from differences.
        """
        radius = 0.1 * (1.0 + np.abs(s))
        ring = s[:, None] + radius[:, None] * _CIRCLE
        wave = _CIRCLE[:, None] ** -np.arange(terms) / _CIRCLE.size
        scale = radius[:, None] ** -np.arange(terms)

        def expanded(at: FloatArray) -> ComplexArray:
            scheme = self.scheme(at)
            z = np.exp(ring * scheme.step)[..., None, None]
            matrix = z * np.eye(len(scheme.P)) - scheme.P
            for k, factor in scheme.terms:
                matrix = matrix - factor @ scheme.signals * z**-k
            return np.asarray(np.linalg.det(matrix / scheme.step) @ wave * scale)

        slopes = []
        for unit in np.eye(gains.size):
            h = _STEP * (1.0 + np.abs(gains)) * unit
            slopes.append((expanded(gains + h) - expanded(gains - h)) / (2.0 * h.sum()))
        return expanded(gains), np.stack(slopes, axis=-1)
