"""Choose, among the floating-point gains next to an optimum, those that hold it best.

At a k-fold root the abscissa answers an error ε of the gains with about (κ ε)^(1/k). For
k = 4 the half unit in the last place of a gain already moves it by several 1e-4. Units in
the last place of several gains together make a fine lattice: some point of it meets the
condition det Δ(t) = 0 much more closely than the nearest one does.
"""

from __future__ import annotations

import itertools
from decimal import Context, Decimal, localcontext

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.system import DelaySystem
from drillctrl.synthesis.family import LoopFamily
from drillctrl.synthesis.search import Basin

IntArray = npt.NDArray[np.intp]
_DIGITS = 50
_STEP = Decimal("1e-9")
_REACH = 9


def exact_determinant(system: DelaySystem, t: Decimal) -> Decimal:
    """Return det Δ(t) at a real t for the matrices as they are, to about 50 digits."""
    n = system.order
    rows = [
        [(t if i == j else Decimal(0)) - Decimal(float(system.A0[i, j])) for j in range(n)]
        for i in range(n)
    ]
    for delay, matrix in zip(system.delays, system.delayed, strict=True):
        factor = (-t * Decimal(delay)).exp()
        for i, j in zip(*np.nonzero(matrix), strict=True):
            rows[i][j] -= factor * Decimal(float(matrix[i, j]))
    value = Decimal(1)
    for column in range(n):
        pivot = max(range(column, n), key=lambda i: abs(rows[i][column]))
        if rows[pivot][column] == 0:
            return Decimal(0)
        if pivot != column:
            rows[column], rows[pivot] = rows[pivot], rows[column]
            value = -value
        value *= rows[column][column]
        for i in range(column + 1, n):
            ratio = rows[i][column] / rows[column][column]
            for j in range(column, n):
                rows[i][j] -= ratio * rows[column][j]
    return value


def _taylor(system: DelaySystem, t: Decimal, terms: int) -> list[Decimal]:
    """Return the Taylor coefficients of det Δ at t from differences in many digits."""
    values = [exact_determinant(system, t + (i - terms // 2) * _STEP) for i in range(terms)]
    # Newton's divided differences, then expansion about t.
    points = [(i - terms // 2) * _STEP for i in range(terms)]
    table = list(values)
    for level in range(1, terms):
        for i in range(terms - 1, level - 1, -1):
            table[i] = (table[i] - table[i - 1]) / (points[i] - points[i - level])
    polynomial = [Decimal(0)] * terms
    for i in range(terms - 1, -1, -1):
        shifted = [Decimal(0), *polynomial[:-1]]
        polynomial = [a - points[i] * b for a, b in zip(shifted, polynomial, strict=True)]
        polynomial[0] += table[i]
    return polynomial


def hold_multiple_root(family: LoopFamily, basin: Basin) -> FloatArray:
    """Move gains by units in the last place so that a real multiple root splits least.

    Parameters
    ----------
    family : LoopFamily
        Loops to choose from.
    basin : Basin
        Sharpened on a single real root of multiplicity k ≥ 3, with k − 1 gains inside their
        bounds; the gains of any other basin are returned as they are.

    Returns
    -------
    array, (k,)
        Gains within the bounds.
    """
    if (
        family.signals is not None
        or len(basin.roots) != 1
        or basin.roots[0].omega
        or basin.roots[0].multiplicity < 3
    ):
        return basin.gains
    k = basin.roots[0].multiplicity
    lower, upper = family.feedback.lower, family.feedback.upper
    free = np.flatnonzero((basin.gains > lower) & (basin.gains < upper))
    if free.size != k - 1:
        return basin.gains
    with localcontext(Context(prec=_DIGITS)):
        gains, t = basin.gains.copy(), Decimal(basin.value)
        for _ in range(3):
            residual = _taylor(family.loop(gains), t, k + 1)
            _, slopes = family.taylor(np.array([complex(float(t))]), gains, k)
            by_gain = slopes[0, :, free].real.T
            jacobian = np.zeros((k, k))
            jacobian[:, : k - 1] = by_gain
            jacobian[:, -1] = [float((i + 1) * residual[i + 1]) for i in range(k)]
            step = np.linalg.solve(jacobian, [-float(value) for value in residual[:k]])
            gains[free] += step[:-1]
            t += Decimal(float(step[-1]))
        gains = np.clip(gains, lower, upper)
        return _nearest_on_lattice(family, gains, t, free, by_gain[0])


def _nearest_on_lattice(
    family: LoopFamily, gains: FloatArray, t: Decimal, free: IntArray, slope: FloatArray
) -> FloatArray:
    """Return gains a few units in the last place away that make |det Δ(t)| smallest."""
    defect = float(exact_determinant(family.loop(gains), t))
    unit = np.spacing(np.abs(gains[free])) * slope
    steps = np.array(list(itertools.product(range(-_REACH, _REACH + 1), repeat=min(3, free.size))))
    best = steps[int(np.argmin(np.abs(defect + steps @ unit[: steps.shape[1]])))]
    moved = gains.copy()
    chosen = free[: steps.shape[1]]
    moved[chosen] += best * np.spacing(np.abs(gains[chosen]))
    lower, upper = family.feedback.lower, family.feedback.upper
    inside = ((moved >= lower) & (moved <= upper)).all()
    return moved if inside else gains
