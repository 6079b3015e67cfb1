"""Decide by the explicit boundary whether any gains within bounds put all roots left of a line."""

from __future__ import annotations

from dataclasses import dataclass

from drillctrl.synthesis.family import LoopFamily
from drillctrl.synthesis.gain_margin import gain_margin


@dataclass(frozen=True)
class BoundaryDecision:
    """Whether some gains within the bounds put all roots left of a line.

    Attributes
    ----------
    line : float
        σ.
    possible : bool
        The answer.
    next_root : float
        Real part of the rightmost root that is not held at the line, at the best place that
        was looked at on the boundary within the bounds; infinite where none enters them.
    points : int
        Places on the boundary that were looked at.
    """

    line: float
    possible: bool
    next_root: float
    points: int


def decide(family: LoopFamily, line: float = 0.0) -> BoundaryDecision | None:
    """Decide whether gains within the bounds put all roots left of Re s = ``line``.

    Parameters
    ----------
    family : LoopFamily
        Loops with one or two gains that drive one input.
    line : float
        σ.

    Returns
    -------
    BoundaryDecision or None
        None where there are more gains, or several inputs.
    """
    if family.feedback.lower.size not in (1, 2) or not family.is_affine:
        return None
    found = gain_margin(family, line)
    return BoundaryDecision(line, found.margin < 0.0, line + found.margin, found.places)
