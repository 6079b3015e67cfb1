"""How far gains bring the roots left of a line, by search: any number of gains, no proof."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.synthesis.boxes import nested_boxes
from drillctrl.synthesis.descent import bfgs
from drillctrl.synthesis.family import LoopFamily, loop_family
from drillctrl.synthesis.search import Effort, starting_points

_EFFORT = Effort(64, 4, 40, 0, 0)
# Share of the bounds by which descents begin inside of them.
_INSIDE = 1e-3
MOST_STEPS = 80
# By how much the collocated roots are to lie left of the line, relative, where that is enough.
_CLEAR = 1e-3


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
    family: LoopFamily,
    line: float,
    known: Sequence[FloatArray],
    *,
    everywhere: bool = True,
    enough: bool = False,
    steps: int = MOST_STEPS,
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
        Whether descents begin all over the box where those gains do not suffice; they do
        without any known.
    enough : bool
        Take the first gains that do it, not the best.
    steps : int
        Evaluations of each descent.
    """
    lower, upper = family.feedback.lower, family.feedback.upper
    inset = _INSIDE * (upper - lower)
    below = line - _CLEAR * (1.0 + abs(line)) if enough else -np.inf
    found: list[Reach] = []

    def does(gains: FloatArray) -> bool:
        # The collocation promises too much near multiple roots.
        found.append(Reach(family.exact(gains) - line, gains))
        return found[-1].margin < 0.0

    def descends(start: FloatArray) -> bool:
        start = np.clip(start, lower + inset, upper - inset)
        return does(bfgs(family.abscissa, start, lower, upper, most=steps, below=below).gains)

    for gains in known:
        if (does(gains) or descends(gains)) and enough:
            return found[-1]
    if not found or (everywhere and min(reach.margin for reach in found) >= 0.0):
        for start in _everywhere(family):
            if descends(start) and enough:
                return found[-1]
    return min(found, key=lambda reach: reach.margin)


def _everywhere(family: LoopFamily) -> Iterator[FloatArray]:
    """Yield starts all over the box, over smaller ones where it is wide, and in narrow basins."""
    inner = nested_boxes(family.system, family.feedback)[:-1]
    families = [*(loop_family(family.system, feedback) for feedback in inner), family]
    for placed in (False, True):
        for one in families:
            yield from starting_points(one, 0, _EFFORT, placed=placed)
