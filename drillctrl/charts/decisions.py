"""Whether some gains at a place are stabilising: by explicit curves, or by search and count."""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.charts.plane import Plane
from drillctrl.charts.stabilisable_scan import Decision
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.pseudospectral import degree_for
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.synthesis.family import LoopFamily, loop_family
from drillctrl.synthesis.gain_margin import GainMargin, gain_margin
from drillctrl.synthesis.reach import MOST_STEPS, searched_reach

# Places nearby whose gains are tried, on the same line and on others.
_NEIGHBOURS = 2


@dataclass(frozen=True, eq=False)
class Place:
    """What was found at one place of a chart by search.

    Attributes
    ----------
    x, y : float
        Where.
    gains : array, (k,)
        The best that were found.
    margin : float
        Real part of the rightmost root with them, less σ; infinite where it could not be told.
    stable : bool
        Whether a count by the argument principle finds no root right of σ: that is proved.
        Otherwise gains were searched for and not found, which proves nothing.
    """

    x: float
    y: float
    gains: FloatArray
    margin: float
    stable: bool


class Searched:
    """Decisions by search that begin at the gains of places nearby, and all places with them."""

    def __init__(self, plane: Plane, structure: FeedbackStructure, level: float) -> None:
        self.plane, self.structure, self.level = plane, structure, level
        self.places: list[Place] = []
        self._deep: dict[Place, Place] = {}

    def delay(self, x: float, y: float) -> float:
        """Return the largest delay of the plant at a place."""
        return self._plant(x, y).max_delay

    def known(self, x: float, y: float, *, search: bool) -> Place | None:
        """Try the gains of the nearest stable places, and none.

        Parameters
        ----------
        x, y : float
            The place.
        search : bool
            Look all over the bounds where they do not suffice.

        Returns
        -------
        Place or None
            None where they do not, and nothing was searched.
        """
        plant = self._plant(x, y)
        none = np.clip(0.0, self.structure.lower, self.structure.upper)
        for gains in (*self._nearest(x, y), none):
            loop = close_loop(plant, self.structure, *self.structure.gains(gains))
            if count_right_of(loop, self.level).count == 0:
                return self._place(x, y, loop, gains)
        if not search:
            return None
        family = self._family(plant)
        found = searched_reach(family, self.level, (), enough=True)
        return self._place(x, y, family.loop(found.gains), found.gains)

    def descend(self, x: float, y: float, gains: FloatArray, steps: int = MOST_STEPS) -> Place:
        """Descend from gains to the best nearby."""
        family = self._family(self._plant(x, y))
        found = searched_reach(family, self.level, [gains], everywhere=False, steps=steps)
        return self._place(x, y, family.loop(found.gains), found.gains)

    def deepened(self, place: Place) -> Place:
        """Return a stable place with the best gains near its own."""
        if place not in self._deep:
            self._deep[place] = self.descend(place.x, place.y, place.gains)
            self._deep[self._deep[place]] = self._deep[place]
        return self._deep[place]

    def _plant(self, x: float, y: float) -> DelaySystem:
        return self.plane.case_at(x, y).system(self.structure.inputs)

    def _family(self, plant: DelaySystem) -> LoopFamily:
        # Ends are looked at again exactly: the fastest loops need no resolution here.
        return loop_family(plant, self.structure, degree_for(plant))

    def _place(self, x: float, y: float, loop: DelaySystem, gains: FloatArray) -> Place:
        """Remember a place, with the count of its roots where they seem to be on the left."""
        try:
            margin = spectral_abscissa(loop) - self.level
        except InputError:
            margin = np.inf
        stable = margin < 0.0 and count_right_of(loop, self.level).count == 0
        # Roots and count that contradict each other decide nothing.
        margin = margin if stable == (margin < 0.0) else abs(margin)
        place = Place(x, y, gains, margin, stable)
        self.places.append(place)
        return place

    def _nearest(self, x: float, y: float) -> list[FloatArray]:
        """Return the gains of the nearest stable places, on the same line and on others."""
        x_span, y_span = self.plane.x.span, self.plane.y.span

        def distance(place: Place) -> float:
            return abs(place.x - x) / x_span + abs(place.y - y) / y_span

        stable = [place for place in self.places if place.stable]
        same = heapq.nsmallest(_NEIGHBOURS, (p for p in stable if p.x == x), key=distance)
        other = heapq.nsmallest(_NEIGHBOURS, (p for p in stable if p.x != x), key=distance)
        return [place.gains for place in (*same, *other)]


def by_curves(plane: Plane, structure: FeedbackStructure, level: float) -> Decision:
    """Return the decision by the curves of one or two gains that hold a root at the line."""

    def decide(x: float, y: float, everywhere: bool) -> GainMargin:
        plant = plane.case_at(x, y).system(structure.inputs)
        return gain_margin(loop_family(plant, structure), level)

    return decide


def has_curves(system: DelaySystem, structure: FeedbackStructure) -> bool:
    """Whether `by_curves` can decide: one or two gains that drive one input."""
    family: LoopFamily = loop_family(system, structure)
    return structure.lower.size in (1, 2) and family.is_affine
