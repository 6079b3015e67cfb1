"""Where a mode neither grows nor decays, between places at which its sign is sure."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple, Protocol


class Change(NamedTuple):
    """A change of sign of a growth rate.

    Attributes
    ----------
    place : float
        Interpolated.
    low, high : float
        Places between which it lies, at both of which the sign is sure.
    grows_below : bool
        Whether the mode grows at the lower one, and decays at the other.
    """

    place: float
    low: float
    high: float
    grows_below: bool


class _Signed(Protocol):
    @property
    def root(self) -> complex: ...

    @property
    def sign(self) -> int: ...


def sign_changes(places: Sequence[float], at: Sequence[_Signed]) -> tuple[Change, ...]:
    """Return the changes of sign over rising places, those of no sure sign left out."""
    sure = [(float(place), each) for place, each in zip(places, at, strict=True) if each.sign]
    found = []
    for (low, before), (high, after) in itertools.pairwise(sure):
        if before.sign != after.sign:
            a, b = before.root.real, after.root.real
            found.append(Change(low + (high - low) * a / (a - b), low, high, before.sign > 0))
    return tuple(found)
