"""Designs for several plants at once: worst cases, and robust neighbours of an optimum."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.synthesis.descent import bfgs
from drillctrl.synthesis.family import LoopFamily
from drillctrl.synthesis.measures import worst_case

_PENALTY = 20.0


def robust_alternative(
    family: LoopFamily,
    perturbed: Sequence[LoopFamily],
    optimum: FloatArray,
    abscissa: float,
    give_up: float,
) -> FloatArray:
    """Minimise the worst abscissa of perturbed loops among gains that decay almost as fast.

    Parameters
    ----------
    family : LoopFamily
        Nominal loops.
    perturbed : sequence of LoopFamily
        The loops when the plant is not as assumed.
    optimum : array, (k,)
        Gains of the fastest nominal design.
    abscissa : float
        Its spectral abscissa, negative.
    give_up : float
        Share of the nominal decay rate that may be lost.

    Returns
    -------
    array, (k,)
        Gains with nominal α ≤ (1 − give_up) · abscissa and the lowest worst case found; the
        optimum itself if nothing is better.
    """
    limit = (1.0 - give_up) * abscissa
    worst = worst_case([family, *perturbed])
    lower, upper = family.feedback.lower, family.feedback.upper
    best = [(worst(optimum)[0], optimum)]

    def objective(gains: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = worst(gains)
        nominal = family.value(gains)
        if nominal <= limit:
            if value < best[0][0]:
                best[0] = (value, gains)
            return value, gradient
        _, slope = family.abscissa(gains)
        return value + _PENALTY * (nominal - limit), gradient + _PENALTY * slope

    margin = 1e-3 * (upper - lower)
    for pull in (0.0, 0.02, 0.1, 0.3):
        # The optimum is a cusp; beginning beside it lets the descent turn.
        start = np.clip((1.0 - pull) * best[0][1], lower + margin, upper - margin)
        bfgs(objective, start, lower, upper, most=40 * lower.size)
    return best[0][1]
