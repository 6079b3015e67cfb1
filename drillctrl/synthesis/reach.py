"""How far gains bring the roots left of a line, by search: any number of gains, no proof."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
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
    # Exact: near a multiple root the collocation promises more than there is.
    found = [Reach(family.exact(gains) - line, gains) for gains in [*ends, *known]]
    if not found or (everywhere and min(reach.margin for reach in found) >= 0.0):
        best = global_search(family, 0, _EFFORT, ends).best
        found.append(Reach(family.exact(best.gains) - line, best.gains))
    return min(found, key=lambda reach: reach.margin)
