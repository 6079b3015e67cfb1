"""Scan lines: the stability of a family along one parameter, with the other held.

Along a line the number of unstable roots changes only where a root lies on the imaginary
axis (or on another vertical line), and by a known amount.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray

IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ScanLine:
    """Crossings along one line, in increasing order.

    Attributes
    ----------
    position : float
        Value of the parameter that is held.
    at : array, (k,)
        Values of the other parameter at which roots lie on the line Re s = σ.
    omega : array, (k,)
        |Im s| of those roots; 0 for a real root.
    jump : array, (k,)
        Change of the number of roots right of the line as the parameter grows.
    counts : array, (k + 1,)
        Number of roots right of the line on each segment.
    low, high : float
        Ends of the line.
    decided_from : float
        Below this value nothing is proved (``low`` normally).
    listed_from : float
        Below this value crossings are not listed and counts are meaningless, other than that
        the segment is unstable where it is decided (``low`` normally).
    """

    position: float
    at: FloatArray
    omega: FloatArray
    jump: IntArray
    counts: IntArray
    low: float
    high: float
    decided_from: float
    listed_from: float

    @functools.cached_property
    def stable_intervals(self) -> list[tuple[float, float, float, float]]:
        """(start, end, ω at start, ω at end) of each stable stretch.

        ω is NaN at an end of the line.
        """
        edges = np.concatenate([[self.low], self.at, [self.high]])
        omega = np.concatenate([[np.nan], self.omega, [np.nan]])
        found: list[tuple[float, float, float, float]] = []
        for i in np.flatnonzero(self.counts == 0):
            start, end = float(edges[i]), float(edges[i + 1])
            if end <= start:
                continue
            if found and found[-1][1] == start:
                # Two crossings that touch without a change in between.
                found[-1] = (found[-1][0], end, found[-1][2], float(omega[i + 1]))
            else:
                found.append((start, end, float(omega[i]), float(omega[i + 1])))
        return found


Scanner = Callable[[FloatArray], list[ScanLine]]
