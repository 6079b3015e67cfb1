"""Scan along the delay: every crossing in ω0 for fixed other parameters, in closed form.

The frequencies at which a root lies on the imaginary axis are finitely many and the same for
every delay (`drillctrl.spectrum.critical`); each gives a family of delays τ = (φ + 2πk)/ω,
one for each lobe, all crossed in the same direction (Walton and Marshall 1987). Nothing is
sampled, so nothing is missed, however small ω0 is.
"""

from __future__ import annotations

import math

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.scan import ScanLine
from drillctrl.delay.reduced import common_factors
from drillctrl.spectrum.critical import critical_points

# Lobes that are listed one by one; below the ω0 of the last one a bound decides.
_FEWEST_TURNS, _MOST_TURNS = 6.0, 400.0


def _far_enough(
    omega: FloatArray, phase: FloatArray, direction: np.ndarray, base: int, limit: float
) -> tuple[float, bool]:
    """Return a delay up to which lobes are listed, and whether all beyond is unstable.

    The count N(τ) grows at the mean rate Σ ± ω/π, and its ripple is at most one pair for
    each critical frequency.
    """
    if not omega.size:
        return limit, True
    rate = float((direction * omega).sum()) / np.pi
    turns = _FEWEST_TURNS
    while True:
        longest = min(limit, turns * 2.0 * math.pi / float(omega.max()))
        floor = base + rate * longest - float((direction * phase).sum()) / np.pi
        proved = rate > 0.0 and floor - 2.0 * direction.size > 0.0
        if proved or longest >= limit or turns >= _MOST_TURNS:
            return longest, proved
        turns *= 2.0


def scan_rotary_speed(
    A0: FloatArray, A1: FloatArray, positions: FloatArray, low: float, high: float, turn: float
) -> list[ScanLine]:
    """Scan loops whose matrices do not depend on ω0 along ω0.

    Parameters
    ----------
    A0, A1 : array, (N, n, n)
        Of the loop of each line.
    positions : array, (N,)
        The parameter that is held, for the record.
    low, high : float
        Limits of ω0; ``low`` may be 0.
    turn : float
        τ ω0 = 2π/n.
    """
    rows, omega, phase, direction = critical_points(A0, *common_factors(A1))
    # The limit τ → 0.
    base = (np.linalg.eigvals(A0 + A1).real > 0).sum(axis=1)
    lines = []
    bounds = np.searchsorted(rows, np.arange(positions.size + 1))
    for i, position in enumerate(positions):
        part = slice(bounds[i], bounds[i + 1])
        w, phi, sign = omega[part], phase[part], direction[part]
        limit = turn / low if low > 0.0 else math.inf
        longest, proved = _far_enough(w, phi, sign, int(base[i]), limit)
        listed = turn / longest if longest < limit else low
        lobes = (
            [
                np.arange(max(0, math.floor((a * longest - f) / (2 * np.pi)) + 1))
                for a, f in zip(w, phi, strict=True)
            ]
            if w.size
            else []
        )
        if lobes:
            which = np.repeat(np.arange(w.size), [lobe.size for lobe in lobes])
            delays = (phi[which] + 2 * np.pi * np.concatenate(lobes)) / w[which]
            keep = delays > 0.0
            which, delays = which[keep], delays[keep]
            order = np.argsort(-delays, kind="stable")
            which, at = which[order], turn / delays[order]
            frequency, jump = w[which], -2 * sign[which]
        else:
            at = frequency = np.zeros(0)
            jump = np.zeros(0, dtype=np.int64)
        # From ω0 = ∞ downwards, where the count is that of the loop without delay.
        counts = np.concatenate([base[i] - np.cumsum(jump[::-1])[::-1], base[i : i + 1]])
        inside = (at > low) & (at < high)
        first = int(np.searchsorted(at, low, side="right"))
        last = int(np.searchsorted(at, high, side="left"))
        lines.append(
            ScanLine(
                float(position),
                at[inside],
                frequency[inside],
                jump[inside],
                counts[first : last + 1],
                low,
                high,
                low if proved else listed,
                listed,
            )
        )
    return lines
