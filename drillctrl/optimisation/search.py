"""Deterministic multi-start: many descents from points spread over the box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from drillctrl.optimisation.descent import Descent, bfgs
from drillctrl.optimisation.family import LoopFamily
from drillctrl.spectrum.characteristic import FloatArray

# Points that are looked at, descents begun, and descents finished, per number of gains.
_STARTS = {0: (1, 1, 1), 1: (16, 4, 2), 2: (64, 8, 4), 3: (128, 16, 6), 4: (512, 32, 8)}


@dataclass(frozen=True, eq=False)
class Search:
    """Result of a multi-start search.

    Attributes
    ----------
    gains : array, (k,)
        Best gain vector.
    value : float
        Collocated spectral abscissa there.
    ends : tuple of float
        Values of the finished descents, best first.
    evaluations : int
        Eigenvalue problems solved.
    """

    gains: FloatArray
    value: float
    ends: tuple[float, ...]
    evaluations: int


def multi_start(family: LoopFamily, seed: int = 0) -> Search:
    """Minimise the collocated abscissa over the box of the family's structure.

    Parameters
    ----------
    family : LoopFamily
        Loops to choose from.
    seed : int
        Scrambles the Sobol points; the same seed gives the same result.
    """
    lower, upper = family.feedback.lower, family.feedback.upper
    count = lower.size
    looked, begun, finished = _STARTS[min(count, 4)]
    if count == 0:
        value, _ = family.abscissa(lower)
        return Search(lower, value, (value,), 1)
    cube = qmc.Sobol(count, scramble=True, rng=seed).random(looked)
    points = lower + (upper - lower) * (0.01 + 0.98 * cube)
    # The box is wide; many useful gains are small against it.
    points = np.vstack([points, 0.2 * points + 0.8 * np.clip(0.0, lower, upper)])
    values = np.array([family.abscissa(point)[0] for point in points])
    evaluations = len(points)
    best = points[np.argsort(values, kind="stable")[:begun]]
    descents: list[Descent] = []
    for point in best:
        descents.append(bfgs(family.abscissa, point, lower, upper, most=40 + 15 * count))
    descents.sort(key=lambda end: end.value)
    evaluations += sum(end.evaluations for end in descents)
    ends = []
    for rough in descents[:finished]:
        inside = lower + np.clip((rough.gains - lower) / (upper - lower), 1e-6, 1 - 1e-6) * (
            upper - lower
        )
        fine = bfgs(family.abscissa, inside, lower, upper, most=150 * count)
        evaluations += fine.evaluations
        ends.append(min(rough, fine, key=lambda end: end.value))
    ends.sort(key=lambda end: end.value)
    return Search(ends[0].gains, ends[0].value, tuple(end.value for end in ends), evaluations)
