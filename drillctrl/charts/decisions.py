"""Whether some gains at a place are stabilising: by explicit curves, or by search and count."""

from __future__ import annotations

from dataclasses import dataclass

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.plane import Plane
from drillctrl.charts.stabilisable_scan import Decision
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.pseudospectral import degree_for
from drillctrl.synthesis.family import LoopFamily, loop_family
from drillctrl.synthesis.gain_margin import GainMargin, gain_margin
from drillctrl.synthesis.reach import searched_reach

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
    omega : float
        Imaginary part of the rightmost root.
    """

    x: float
    y: float
    gains: FloatArray
    margin: float
    stable: bool
    omega: float


class Searched:
    """A decision by search that begins at the gains of places nearby, and remembers all places.

    Along an edge the gains change little from place to place, so that where places are close
    the search continues from the stable side across the edge.
    """

    def __init__(self, plane: Plane, structure: FeedbackStructure, level: float) -> None:
        self.plane, self.structure, self.level = plane, structure, level
        self.places: list[Place] = []

    def __call__(self, x: float, y: float, everywhere: bool) -> Place:
        plant = self.plane.case_at(x, y).system(self.structure.inputs)
        # Ends are looked at again exactly: the fastest loops need no resolution here.
        family = loop_family(plant, self.structure, degree_for(plant) + 3)
        reach = searched_reach(family, self.level, self._known(x, y), everywhere=everywhere)
        loop = family.loop(reach.gains)
        stable = reach.margin < 0.0 and count_right_of(loop, self.level).count == 0
        # Roots and count that contradict each other decide nothing.
        margin = reach.margin if stable == (reach.margin < 0.0) else abs(reach.margin)
        omega = abs(family.eigenvalues(reach.gains)[0].imag)
        place = Place(x, y, reach.gains, margin, stable, omega)
        self.places.append(place)
        return place

    def nearby(self, x: float, y: float, everywhere: bool) -> Place:
        """Decide from the gains that are known, without looking all over the bounds."""
        return self(x, y, False)

    def _known(self, x: float, y: float) -> list[FloatArray]:
        """Return the gains of the nearest stable places, on the same line and on others."""
        stable = [place for place in self.places if place.stable]
        x_span, y_span = self.plane.x.span, self.plane.y.span
        stable.sort(key=lambda place: abs(place.x - x) / x_span + abs(place.y - y) / y_span)
        same = [place.gains for place in stable if place.x == x]
        other = [place.gains for place in stable if place.x != x]
        return [*same[:_NEIGHBOURS], *other[:_NEIGHBOURS]]


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
