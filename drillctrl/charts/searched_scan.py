"""Scan lines of what is reached by search: gains are handed on from place to place.

Where gains have been found they are tried next door, and descents go on from them until a
whole neighbourhood is out of reach; only there, at places far apart, is the whole box searched.
So the edge of the region is followed from the side where gains are known.
"""

from __future__ import annotations

import bisect
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.optimize

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.decisions import Place, Searched
from drillctrl.charts.scan import ScanLine
from drillctrl.charts.stabilisable_scan import bounded_margin, reached_line

# On every so many of the first lines the whole box is searched at every so many samples.
_SPARSE_LINES, _SPARSE = 2, 4
# Lines of less relative distance have much the same gains in reach.
_APART = 0.06
# Evaluations of a descent from gains very near.
_FEW_STEPS = 40
# Wanted accuracy of a crossing, as a share of the line.
SEARCHED_TOLERANCE = 1e-3


@dataclass(eq=False)
class SearchedScan:
    """A scanner that remembers the samples of all lines; see `drillctrl.charts.scan`.

    Attributes
    ----------
    searched : Searched
        The decisions.
    low, high : float
        Ends of the lines.
    samples : int
        Evenly spaced places of each.
    progress : callable
        Called after each line.
    """

    searched: Searched
    low: float
    high: float
    samples: int
    progress: Callable[[], None]
    _lines: dict[float, list[Place | None]] = field(default_factory=dict)

    def __call__(self, positions: FloatArray) -> list[ScanLine]:
        """Scan lines of constant x."""
        at = np.linspace(self.low, self.high, self.samples).tolist()
        first = not self._lines
        # The longer a delay the dearer a search: begin where it is short.
        cheap = sorted(positions.tolist(), key=lambda x: self.searched.delay(x, self.high))
        looked: list[float] = []
        for i, x in enumerate(cheap):
            apart = all(abs(x - other) > _APART * abs(x) for other in looked)
            sparse = first and i % _SPARSE_LINES == 0 and apart
            looked += [x] * sparse
            beside = self._beside(x)
            line: list[Place | None] = []
            for k, y in enumerate(at):
                near = [
                    other[j]
                    for other in beside
                    for j in range(max(0, k - 1), min(k + 2, self.samples))
                ]
                if first or any(_stable(place) for place in near):
                    line.append(self.searched.known(x, y, search=sparse and k % _SPARSE == 0))
                else:
                    line.append(None)
            self._lines[x] = line
        self._spread(set(cheap), at)
        scanned = []
        for x in positions.tolist():
            scanned.append(self._line(x, at))
            self.progress()
        return scanned

    def _beside(self, x: float) -> list[list[Place | None]]:
        """Return the samples of the lines next to a place on the axis, without its own."""
        order = sorted(self._lines)
        i = bisect.bisect_left(order, x)
        j = i + 1 if i < len(order) and order[i] == x else i
        return [self._lines[t] for t in (*order[max(0, i - 1) : i], *order[j : j + 1])]

    def _spread(self, new: set[float], at: list[float]) -> None:
        """Go on from stable samples to those beside them until nothing more is reached."""
        tried: set[tuple[float, int, Place]] = set()
        changed = True
        while changed:
            changed = False
            for x, k in itertools.product(sorted(new), range(self.samples)):
                line = self._lines[x]
                if _stable(line[k]):
                    continue
                own = [line[j] for j in (k - 1, k + 1) if 0 <= j < self.samples]
                for place in [*own, *(other[k] for other in self._beside(x))]:
                    if place is None or not place.stable or (x, k, place) in tried:
                        continue
                    tried.add((x, k, place))
                    # Gains that barely do it lead nowhere.
                    deep = self.searched.deepened(place)
                    line[k] = self.searched.descend(x, at[k], deep.gains)
                    if _stable(line[k]):
                        changed = True
                        break

    def _line(self, x: float, at: list[float]) -> ScanLine:
        """Find the crossings between the samples of a line."""
        line = self._lines[x]
        tolerance = SEARCHED_TOLERANCE * (self.high - self.low)
        crossings: list[float] = []
        for k in range(self.samples - 1):
            one, other = line[k], line[k + 1]
            if _stable(one) == _stable(other):
                continue
            inside = one if _stable(one) else other
            assert inside is not None
            best = self.searched.deepened(inside)

            def margin(y: float, x: float = x) -> float:
                nonlocal best
                place = self.searched.descend(x, y, best.gains, _FEW_STEPS)
                best = place if place.stable else best
                return bounded_margin(place.margin)

            ends = at[k], at[k + 1]
            outer = ends[1] if inside is one else ends[0]
            # The far side, from gains of this line: it may be in reach after all.
            values = {inside.y: bounded_margin(best.margin), outer: margin(outer)}
            crossing = outer
            if values[outer] > 0.0:
                crossing = float(
                    scipy.optimize.brentq(
                        lambda y, known=values, f=margin: known[y] if y in known else f(y),
                        *ends,
                        xtol=tolerance,
                        rtol=1e-10,
                    )
                )
            crossings.append(crossing)
        # At the best gains several roots are held, whose frequencies change along the edge.
        omega = [0.0] * len(crossings)
        return reached_line(x, self.low, self.high, _stable(line[0]), crossings, omega)


def _stable(place: Place | None) -> bool:
    return place is not None and place.stable
