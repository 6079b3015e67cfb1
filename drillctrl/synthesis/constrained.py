"""Minimise any measure of the loop within bounds, subject to requirements on other measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from drillctrl.base.arrays import FloatArray
from drillctrl.synthesis.certificate import OptimalityCertificate, shortest_combination
from drillctrl.synthesis.descent import Objective, bfgs
from drillctrl.synthesis.family import LoopFamily
from drillctrl.synthesis.spread import spread_points

_LOOKED = 64
_BEGUN = 6
_WEIGHTS = (1.0, 10.0, 100.0)
_SAMPLED_RADIUS = 1e-4
_CREEP = 2e-3


@dataclass(frozen=True, eq=False)
class ConstrainedSearch:
    """Result of `constrained_search`.

    Attributes
    ----------
    gains : array, (k,)
        The best that meet all requirements; without any, those that violate them least.
    value : float
        Of the objective there.
    ends : tuple of float
        Objective at the distinct ends that meet them, lowest first.
    hits : int
        Descents that ended at the lowest.
    evaluations : int
        Calls of the objective.
    """

    gains: FloatArray
    value: float
    ends: tuple[float, ...]
    hits: int
    evaluations: int


class _Watched:
    """An exact penalty function that remembers the best feasible point it has seen."""

    def __init__(self, objective: Objective, excesses: Sequence[Objective], scale: float) -> None:
        self.objective, self.excesses, self.scale = objective, excesses, scale
        self.weight = 1.0
        self.best = (np.inf, np.zeros(0))
        self.nearest = (np.inf, np.inf, np.zeros(0))
        self.calls = 0

    def __call__(self, gains: FloatArray) -> tuple[float, FloatArray]:
        self.calls += 1
        value, gradient = self.objective(gains)
        total, slope, violation = value, gradient, 0.0
        for excess in self.excesses:
            over, change = excess(gains)
            if over > 0.0:
                violation += over
                total = total + self.weight * self.scale * over
                slope = slope + self.weight * self.scale * change
        if violation == 0.0 and value < self.best[0]:
            self.best = (value, gains.copy())
        if (violation, value) < self.nearest[:2]:
            self.nearest = (violation, value, gains.copy())
        return total, slope


def constrained_search(
    family: LoopFamily,
    objective: Objective,
    excesses: Sequence[Objective],
    candidates: Sequence[FloatArray],
    seed: int = 0,
) -> ConstrainedSearch:
    """Minimise an objective over the box of the family's structure.

    Parameters
    ----------
    family : LoopFamily
        Whose structure gives the box.
    objective : callable
        Value and gradient of what is minimised.
    excesses : sequence of callable
        Each must not be positive; in units that make 1 a large excess.
    candidates : sequence of array
        Gains to begin at beside sampled ones.
    seed : int
        Of the sampled starts.

    Notes
    -----
    An exact penalty keeps the problem locally Lipschitz, which BFGS can descend; its weight
    grows while the end violates a requirement. The bounds themselves hold throughout.
    """
    lower, upper = family.feedback.lower, family.feedback.upper
    margin = 1e-3 * (upper - lower)
    cube = spread_points(_LOOKED, lower.size, seed)
    sampled = lower + (upper - lower) * cube
    starts = np.vstack([*candidates, sampled, 0.2 * sampled])
    starts = np.clip(starts, lower + margin, upper - margin)
    watched = _Watched(objective, excesses, 1.0)
    first = [watched(start)[0] for start in starts]
    watched.scale = 1.0 + abs(float(np.min(first)))
    order = np.argsort(first, kind="stable")
    chosen = [*range(min(2, len(candidates))), *order[: _BEGUN - 2]]
    ends = []
    for index in dict.fromkeys(int(i) for i in chosen):
        gains = starts[index]
        for weight in _WEIGHTS:
            watched.weight = weight
            gains = bfgs(watched, gains, lower, upper, most=50 + 25 * lower.size).gains
            if not any(excess(gains)[0] > 0.0 for excess in excesses):
                ends.append(float(objective(gains)[0]))
                break
            gains = np.clip(gains, lower + 1e-6 * margin, upper - 1e-6 * margin)
    if np.isfinite(watched.best[0]):
        _finish(watched, lower, upper)
    value, gains = watched.best if np.isfinite(watched.best[0]) else watched.nearest[1:]
    # A bound that is approached to rounding is meant.
    for bound in (lower, upper):
        gains = np.where(np.abs(gains - bound) < 1e-9 * (upper - lower), bound, gains)
    distinct: list[float] = []
    for end in sorted(ends):
        if not distinct or end > distinct[-1] + 1e-3 * (1.0 + abs(end)):
            distinct.append(end)
    hits = sum(end < value + 1e-4 * (1.0 + abs(value)) for end in ends)
    return ConstrainedSearch(gains, value, tuple(distinct), hits, watched.calls)


def _finish(watched: _Watched, lower: FloatArray, upper: FloatArray) -> None:
    """Creep on from the best gains without gradients, which mislead at a cusp of many roots."""
    best = watched.best[1]
    steps = np.vstack([np.zeros(best.size), np.diag(_CREEP * (upper - lower))])
    inward = np.where(best > 0.5 * (lower + upper), -1.0, 1.0)
    scipy.optimize.minimize(
        lambda gains: watched(np.clip(gains, lower, upper))[0],
        best,
        method="Nelder-Mead",
        options={
            "initial_simplex": best + inward * steps,
            "xatol": 1e-9,
            "fatol": 1e-12,
            "maxfev": 80 * best.size,
        },
    )


def certify_sampled(
    family: LoopFamily,
    objective: Objective,
    excesses: Sequence[Objective],
    search: ConstrainedSearch,
    seed: int = 0,
) -> OptimalityCertificate:
    """Return evidence of local optimality from gradients sampled around the end.

    Notes
    -----
    The shortest combination of gradients within a small ball approximates the smallest
    element of the Clarke subdifferential (Burke, Lewis and Overton 2005); multipliers of
    requirements that hold with equality nearby are free to be large.
    """
    lower, upper = family.feedback.lower, family.feedback.upper
    width = upper - lower
    count = 4 * (width.size + 1)
    cube = spread_points(count, width.size, seed)
    radius = _SAMPLED_RADIUS * width
    around = np.vstack([search.gains, search.gains + radius * (2.0 * cube - 1.0)])
    around = np.clip(around, lower, upper)
    gradients = [objective(gains)[1] for gains in around]
    low, high = search.gains <= lower + radius, search.gains >= upper - radius
    normals = [-np.eye(width.size)[j] for j in np.flatnonzero(low)]
    normals += [np.eye(width.size)[j] for j in np.flatnonzero(high)]
    for excess in excesses:
        pairs = [excess(gains) for gains in around]
        if max(over for over, _ in pairs) > 0.0:
            normals += [slope for _, slope in pairs]
    names = family.feedback.gain_names
    ends = search.ends
    return OptimalityCertificate(
        f"gradients sampled within {_SAMPLED_RADIUS:g} of the range",
        shortest_combination(np.array(gradients), normals),
        (),
        tuple(name for name, bound in zip(names, low | high, strict=True) if bound),
        len(ends),
        search.hits,
        ends[1] if len(ends) > 1 else None,
    )
