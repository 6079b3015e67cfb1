"""Gains that put roots at chosen places, by linear equations.

With one input the characteristic equation is affine in all gains, so prescribing as many
real conditions as there are gains gives them by a linear solve. Scanning over the places
finds the narrow basins of multiple roots, which no sampling of the box would hit.
"""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.synthesis.family import LoopFamily

_ABSCISSAS = 40
_FREQUENCIES = 12
# Of a plant of many states so many are looked at.
_MOST = 48


def explicit_candidates(
    family: LoopFamily, deepest: float, highest: float, keep: int
) -> FloatArray:
    """Return gain vectors within the bounds that make roots coincide on the right.

    Parameters
    ----------
    family : LoopFamily
        Loops to choose from.
    deepest : float
        Leftmost real part to try; the scan ends at 0.5 above the axis.
    highest : float
        Largest imaginary part to try.
    keep : int
        How many of each kind of configuration to keep, lowest abscissa first.

    Returns
    -------
    array, (q, k)
        Empty where the equations are not affine.
    """
    k = family.spread.shape[1]
    if not family.is_affine:
        return np.zeros((0, k))
    depth = deepest * (np.arange(_ABSCISSAS) + 0.5) / _ABSCISSAS + 0.25
    omega = highest * ((np.arange(_FREQUENCIES) + 0.5) / _FREQUENCIES) ** 2
    # Shapes (frequencies, abscissas): gains move along the last axis.
    real = np.broadcast_to(depth + 0j, (1, depth.size))
    pairs = depth[::2] + 1j * omega[:, None]
    kept = []
    for multiplicity in range(k % 2, k + 1, 2):
        # multiplicity real conditions on the real axis, the rest on a pair.
        order = (k - multiplicity) // 2
        if order == 0:
            gains = _solve(family, [(real, multiplicity, False)])
        elif multiplicity == 0:
            gains = _solve(family, [(pairs, order, True)])
        else:
            on_axis = pairs.real + 0j
            gains = _solve(family, [(on_axis, multiplicity, False), (pairs, order, True)])
        kept.append(_lowest(family, _inside(family, gains), keep))
    return np.vstack(kept)


def _solve(family: LoopFamily, conditions: list[tuple[ComplexArray, int, bool]]) -> FloatArray:
    """Return the gains for every place, shape (..., k); NaN where they are not determined."""
    rows, right = [], []
    k = family.spread.shape[1]
    for places, multiplicity, paired in conditions:
        values, slopes = family.taylor(places.ravel(), np.zeros(k), multiplicity)
        constant = values.reshape(*places.shape, multiplicity)
        linear = slopes.reshape(*places.shape, multiplicity, k)
        size = np.abs(constant).max(axis=-1) + 1e-300
        constant, linear = constant / size[..., None], linear / size[..., None, None]
        for part in (np.real, np.imag) if paired else (np.real,):
            right.append(-part(constant))
            rows.append(part(linear))
    matrix, vector = np.concatenate(rows, axis=-2), np.concatenate(right, axis=-1)
    gains = np.full(vector.shape, np.nan)
    regular = np.abs(np.linalg.det(matrix)) > 1e-200
    gains[regular] = np.linalg.solve(matrix[regular], vector[regular][..., None])[..., 0]
    return gains


def _inside(family: LoopFamily, gains: FloatArray) -> FloatArray:
    """Return where the polygon through the gains crosses the box, three points a crossing.

    Gains may run through the box within a small part of a step of the scan.
    """
    lower, upper = family.feedback.lower, family.feedback.upper
    start, step = gains[:, :-1], np.diff(gains, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.sort(np.stack([(lower - start) / step, (upper - start) / step]), axis=0)
    enter = np.maximum(ends[0].max(axis=-1), 0.0)
    leave = np.minimum(ends[1].min(axis=-1), 1.0)
    hit = enter <= leave
    fractions = (enter[hit], 0.5 * (enter[hit] + leave[hit]), leave[hit])
    points = [start[hit] + f[:, None] * step[hit] for f in fractions]
    return np.asarray(np.clip(np.vstack(points), lower, upper))


def _lowest(family: LoopFamily, gains: FloatArray, keep: int) -> FloatArray:
    if family.signals is not None:
        # An eigenvalue problem of many states for each: a part of the scan, evenly taken.
        gains = gains[:: -(-len(gains) // _MOST) or 1]
    return gains[np.argsort(family.abscissas(gains), kind="stable")[:keep]]
