"""How far gains bring the roots left of a line, by search: any number of gains, no proof."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.synthesis.descent import bfgs
from drillctrl.synthesis.family import LoopFamily
from drillctrl.synthesis.search import Effort, global_search

_EFFORT = Effort(64, 4, 40, 1, 1)
# Share of the bounds by which descents begin inside of them.
_INSIDE = 1e-3
_STEPS = 40


@dataclass(frozen=True, eq=False)
class Reach:
    """The best gains that were found.

    Attributes
    ----------
    margin : float
        Real part of the rightmost root there, less σ: negative where the gains do it.
    gains : array, (k,)
        Within the bounds.
    """

    margin: float
    gains: FloatArray


def searched_reach(
    family: LoopFamily, line: float, known: Sequence[FloatArray], *, everywhere: bool = True
) -> Reach:
    """Look for gains within the bounds that put all roots left of Re s = ``line``.

    Parameters
    ----------
    family : LoopFamily
        Loops with any number of gains and inputs.
    line : float
        σ.
    known : sequence of array, (k,)
        Gains that do it nearby: descents begin there.
    everywhere : bool
        Whether they begin all over the box too where those do not suffice; they do without
        any known.
    """
    lower, upper = family.feedback.lower, family.feedback.upper
    inset = _INSIDE * (upper - lower)
    starts = [np.clip(gains, lower + inset, upper - inset) for gains in known]
    ends = [bfgs(family.abscissa, start, lower, upper, most=_STEPS).gains for start in starts]
    found = [Reach(_exact(family, gains) - line, gains) for gains in [*ends, *known]]
    if not found or (everywhere and min(reach.margin for reach in found) >= 0.0):
        try:
            best = global_search(family, 0, _EFFORT, ends).best.gains
        except InputError:
            # Some loop on the way has roots that cannot be told apart; the middle is as good.
            best = 0.5 * (lower + upper)
        found.append(Reach(_exact(family, best) - line, best))
    return min(found, key=lambda reach: reach.margin)


def _exact(family: LoopFamily, gains: FloatArray) -> float:
    """Return α, which the collocation promises too low near multiple roots.

    It is infinite where roots cannot be told apart: such gains are not found to do anything.
    """
    try:
        return family.exact(gains)
    except InputError:
        return np.inf
