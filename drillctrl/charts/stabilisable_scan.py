"""Scan lines of what feedback can reach: where some gains within bounds are stabilising.

Along a line the margin of the best gains is sampled; its sign changes are found by a
bracketing root finder, and a low dip between samples is followed to its floor, since a
narrow island may lie there.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import scipy.optimize

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.plane import Plane
from drillctrl.charts.scan import ScanLine
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.synthesis.family import loop_family
from drillctrl.synthesis.gain_margin import GainMargin, gain_margin

_DIP = 0.3
_CEILING = 10.0
# Wanted accuracy of a crossing, as a share of the line.
CROSSING_TOLERANCE = 2e-5


def scan_stabilisable(
    plane: Plane,
    structure: FeedbackStructure,
    positions: FloatArray,
    *,
    level: float = 0.0,
    samples: int = 16,
    low: float | None = None,
    progress: Callable[[], None] | None = None,
) -> list[ScanLine]:
    """Scan lines of constant x along y.

    Parameters
    ----------
    plane : Plane
        Supplies the operating point of every place.
    structure : FeedbackStructure
        One or two gains, with their bounds.
    positions : array, (N,)
        Values of x.
    level : float
        σ.
    samples : int
        Evenly spaced places to begin with.
    low : float, optional
        Where lines begin; by default the lower limit of y.
    progress : callable, optional
        Called after each line.

    Returns
    -------
    list of ScanLine
        ``counts`` is 0 where gains exist and 1 where not; ``omega`` is the frequency of the
        root that the best gains hold at the line.
    """
    start = plane.y.low if low is None else low
    lines = []
    for position in positions.tolist():

        def margin(y: float, x: float = position) -> GainMargin:
            plant = plane.case_at(x, y).system(structure.inputs)
            return gain_margin(loop_family(plant, structure), level)

        lines.append(_scan(margin, position, start, plane.y.high, samples))
        if progress is not None:
            progress()
    return lines


def _scan(
    margin: Callable[[float], GainMargin], position: float, low: float, high: float, samples: int
) -> ScanLine:
    def value(y: float) -> float:
        # Brackets need finite ends, and the margin is infinite where no curve is in reach.
        return float(np.clip(margin(y).margin, -_CEILING, _CEILING))

    at = np.linspace(low, high, samples)
    found = np.array([value(y) for y in at.tolist()])
    for i in range(1, samples - 1):
        dip = found[i] <= found[i - 1] and found[i] <= found[i + 1]
        if dip and 0.0 < found[i] < _DIP:
            floor = _floor(value, float(at[i - 1]), float(at[i + 1]))
            if floor is not None:
                at, found = np.append(at, floor[0]), np.append(found, floor[1])
    order = np.argsort(at)
    at, found = at[order], found[order]
    tolerance = CROSSING_TOLERANCE * (high - low)
    crossings, omega = [], []
    for i in np.flatnonzero((found[1:] < 0.0) != (found[:-1] < 0.0)).tolist():
        a, b = float(at[i]), float(at[i + 1])
        if found[i] * found[i + 1] == 0.0:
            place = a if found[i] == 0.0 else b
        else:
            place = float(scipy.optimize.brentq(value, a, b, xtol=tolerance, rtol=1e-10))
        inner = tolerance if found[i + 1] < 0.0 else -tolerance
        crossings.append(place)
        omega.append(margin(float(np.clip(place + inner, low, high))).omega)
    stable = found[0] < 0.0
    counts = [0 if stable ^ (k % 2 == 1) else 1 for k in range(len(crossings) + 1)]
    jump = np.array([b - a for a, b in itertools.pairwise(counts)], dtype=np.int64)
    speeds = np.nan_to_num(np.array(omega, dtype=float))
    return ScanLine(
        position,
        np.array(crossings, dtype=float),
        speeds,
        jump,
        np.array(counts, dtype=np.int64),
        low,
        high,
        low,
        low,
    )


def _floor(value: Callable[[float], float], a: float, b: float) -> tuple[float, float] | None:
    """Return the first negative place that a golden-section descent meets, if any."""
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    fc, fd = value(c), value(d)
    for _ in range(8):
        if min(fc, fd) < 0.0:
            return (c, fc) if fc < fd else (d, fd)
        if fc < fd:
            b, d, fd = d, c, fc
            c = b - ratio * (b - a)
            fc = value(c)
        else:
            a, c, fc = c, d, fd
            d = a + ratio * (b - a)
            fd = value(d)
    return None
