"""How far a semi-discretisation can be trusted: its spectrum beside the exact roots."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum.roots import dominant_roots
from drillctrl.spectrum.semidiscretization import (
    MAX_INTERVALS,
    SemiDiscretization,
    semidiscretize,
)

_DENSE_LIMIT = 300


@dataclass(frozen=True, eq=False)
class SpectrumComparison:
    """Exact roots and what the semi-discretisation makes of them.

    Attributes
    ----------
    scheme : SemiDiscretization
        The map.
    exact : array, (q,)
        Exact dominant roots, imag ≥ 0, multiple ones repeated.
    approximate : array, (q,)
        ln μ/Δt of the multipliers μ that belong to them, each used once.
    """

    scheme: SemiDiscretization
    exact: ComplexArray
    approximate: ComplexArray

    @property
    def errors(self) -> FloatArray:
        """|approximate − exact| for each root."""
        return np.abs(self.approximate - self.exact)

    @property
    def abscissa_error(self) -> float:
        """ln ρ/Δt over the roots compared, less the exact spectral abscissa."""
        return float(self.approximate.real.max() - self.exact.real.max())


@checks_kinds
def compare_spectra(
    system: DelaySystem, m: int | None = None, order: int = 0, depth: float | None = None
) -> SpectrumComparison:
    """Set the multipliers of the semi-discretisation beside the exact dominant roots.

    Parameters
    ----------
    system : DelaySystem
        With at least one delay.
    m, order : int, optional
        See `semidiscretize`. For large m the multipliers are sought near the exact ones in
        sparse arithmetic.
    depth : float, optional
        Roots this far left of the spectral abscissa are compared, at most and by default
        1/(4τ): further left no m that is usual resolves them.
    """
    scheme = semidiscretize(system, m, order)
    roots = dominant_roots(system)
    deepest = 0.25 / system.max_delay
    depth = deepest if depth is None else checked_number("depth", depth, 0.0, deepest)
    roots = tuple(root for root in roots if root.rightmost >= roots[0].rightmost - depth)
    exact = np.array([root.value for root in roots for _ in range(root.multiplicity)])
    if scheme.m <= _DENSE_LIMIT:
        available = list(scheme.multipliers()[: 4 * exact.size + 8])
    else:
        available = []
        for root in roots:
            # A shift off the root keeps the shifted matrix regular.
            target = cmath.exp((root.value + 1e-4 * (1.0 + 1.0j)) * scheme.step)
            found = scheme.multipliers_near(target, 2 * root.multiplicity)
            available += [z for z in found if all(abs(z - have) > 1e-14 for have in available)]
    matched = []
    for s in exact:
        expected = cmath.exp(s * scheme.step)
        nearest = min(range(len(available)), key=lambda i: abs(available[i] - expected))
        matched.append(cmath.log(available.pop(nearest)) / scheme.step)
    return SpectrumComparison(scheme, exact, np.array(matched))


@checks_kinds
def intervals_for(system: DelaySystem, tolerance: float, order: int = 0) -> int:
    """Choose m so that the dominant roots are right to a tolerance.

    Parameters
    ----------
    system : DelaySystem
        With at least one delay.
    tolerance : float
        Permitted error of every dominant root, per unit of time.
    order : int
        Of the scheme.

    Returns
    -------
    int
        m, found by extrapolating the measured error and then confirmed by measurement.

    Raises
    ------
    InputError
        If no permitted m reaches the tolerance.
    """
    wanted = checked_number("tolerance", tolerance, 0.0, open_low=True)
    rate = 4 if order == 2 else 2
    m = 1
    while m <= MAX_INTERVALS:
        error = float(compare_spectra(system, m, order).errors.max())
        if error <= wanted:
            return m
        growth = min(max((error / wanted) ** (1.0 / rate), 1.1), 4.0)
        m = math.ceil(m * growth)
    raise InputError("tolerance", wanted, f"one that m ≤ {MAX_INTERVALS} reaches")
