"""Prove a root count: the argument principle in ball arithmetic, without a gap.

The matrices and delays are taken as the doubles that they are. det Δ is enclosed over whole
segments of the line, so nothing can happen between two evaluations; the part of the line
beyond the last segment is settled by a bound on |s| that is itself evaluated in balls.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import checked_number
from drillctrl.base.extras import required
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem

PRECISION = 106
_TERMS = 6
_MAX_SEGMENTS = 200_000


@dataclass(frozen=True)
class Proof:
    """A proved number of characteristic roots right of a line.

    Attributes
    ----------
    line : float
        Re s of the line.
    count : int or None
        Roots with Re s > line, with multiplicity; None if undecided.
    height : float
        Segments cover the line up to this |Im s|; a norm bound covers the rest.
    segments : int
        Segments on which det Δ was enclosed away from zero.
    precision : int
        Bits of the ball arithmetic.
    elapsed_seconds : float
        Wall time.
    """

    line: float
    count: int | None
    height: float
    segments: int
    precision: int
    elapsed_seconds: float


@checks_kinds
def prove_count(system: DelaySystem, line: float, most: int = _MAX_SEGMENTS) -> Proof:
    """Prove how many characteristic roots have Re s > ``line``.

    Parameters
    ----------
    system : DelaySystem
        Any.
    line : float
        Must not pass through a root; close to one the proof takes longer, and on one it
        ends undecided.
    most : int
        Segments after which the proof gives up, undecided.

    Raises
    ------
    InputError
        If python-flint is not installed or ``line`` is not finite.

    Notes
    -----
    On a segment with midpoint m the enclosure of det Δ(s)/det Δ(m), a Taylor polynomial with
    its remainder, must have a positive real part; then both halves turn by less than a
    quarter, and their principal arguments add up to the true change.
    """
    line = checked_number("line", line)
    flint = required("flint", "proof")
    began = time.perf_counter()
    old, flint.ctx.prec = flint.ctx.prec, PRECISION
    try:
        count, height, segments = _follow(flint, system, line, most)
    finally:
        flint.ctx.prec = old
    return Proof(line, count, height, segments, PRECISION, time.perf_counter() - began)


def _follow(
    flint: Any, system: DelaySystem, line: float, most: int
) -> tuple[int | None, float, int]:
    n = system.order
    bound = _magnitude_bound(flint, system, line)
    quarter = flint.arb.pi() / (2 * n)
    height = math.nextafter(float((bound / quarter.sin()).upper()) * 1.001 + 1e-6, math.inf)
    expand = _determinant_series(flint, system)
    total = flint.arb(0)
    stack = [(height * i / 16, height * (i + 1) / 16) for i in reversed(range(16))]
    segments = 0
    ends: dict[float, Any] = {}
    while stack:
        low, high = stack.pop()
        middle = 0.5 * (low + high)
        if segments + len(stack) > most or not low < middle < high:
            return None, height, segments
        centre = flint.acb(line, middle)
        omega = flint.arb(low).union(flint.arb(high))
        near = expand(centre)
        rest = expand(flint.acb(flint.arb(line), omega))
        if near is None or rest is None or near[0].abs_lower() == 0:
            stack += [(middle, high), (low, middle)]
            continue
        # Taylor's theorem along the segment: the last coefficient is enclosed on all of it.
        coefficients = [*near[:-1], rest[-1]]

        def value(omega: Any, coefficients: Any = coefficients, middle: float = middle) -> Any:
            h = flint.acb(0, omega - middle)
            total = flint.acb(0)
            for coefficient in reversed(coefficients):
                total = total * h + coefficient
            return total / coefficients[0]

        if not value(omega).real > 0:
            stack += [(middle, high), (low, middle)]
            continue
        segments += 1
        # The ends themselves are evaluated as points: enclosures would add up.
        for end in (low, high):
            if end not in ends:
                at_end = expand(flint.acb(line, end))
                if at_end is None:
                    return None, height, segments
                ends[end] = at_end[0]
        total += (ends[high] / near[0]).arg() - (ends[low] / near[0]).arg()
        del ends[low]
    top = flint.acb(line, height)
    asymptotic = ends[height] / top**n
    if not asymptotic.real > 0:
        return None, height, segments
    pi = flint.arb.pi()
    beyond = n * (pi / 2 - top.arg()) - asymptotic.arg()
    count = flint.arb(n) / 2 - (total + beyond) / pi
    whole = count.unique_fmpz()
    return (None if whole is None else int(whole)), height, segments


def _determinant_series(flint: Any, system: DelaySystem) -> Any:
    """Return a function that encloses the Taylor coefficients of det Δ at a ball."""
    n = system.order
    delays = [flint.arb(tau) for tau in system.delays]
    entries = [
        [(i, j, flint.arb(float(a[i, j]))) for i, j in zip(*np.nonzero(a), strict=True)]
        for a in system.delayed
    ]

    def expand(s: Any) -> list[Any] | None:
        x = flint.acb_series([0, 1], _TERMS)
        rows = [
            [
                flint.acb_series([-flint.arb(float(system.A0[i, j]))], _TERMS)
                + ((s + x) if i == j else 0)
                for j in range(n)
            ]
            for i in range(n)
        ]
        for tau, terms in zip(delays, entries, strict=True):
            factor = (-(s + x) * tau).exp()
            for i, j, value in terms:
                rows[i][j] = rows[i][j] - factor * value
        determinant = flint.acb_series([1], _TERMS)
        for k in range(n):
            pivot = max(range(k, n), key=lambda i: float(rows[i][k][0].abs_lower()))
            if k < n - 1 and rows[pivot][k][0].abs_lower() == 0:
                return None
            if pivot != k:
                rows[k], rows[pivot] = rows[pivot], rows[k]
                determinant = -determinant
            determinant = determinant * rows[k][k]
            for i in range(k + 1, n):
                ratio = rows[i][k] / rows[k][k]
                rows[i] = [
                    rows[i][j] - ratio * rows[k][j] if j > k else rows[i][j] for j in range(n)
                ]
        return [determinant[i] for i in range(_TERMS)]

    return expand


def _magnitude_bound(flint: Any, system: DelaySystem, line: float) -> Any:
    """Return a ball whose upper end bounds |s| for every root right of the line.

    For every positive x the Perron root of M is at most max (Mx)_i/x_i (Collatz, Wielandt).
    """
    total: FloatArray = np.abs(system.A0)
    for tau, delayed in zip(system.delays, system.delayed, strict=True):
        total = total + np.abs(delayed) * math.exp(min(-line * tau, 700.0))
    x = np.ones(system.order)
    shifted = total + np.eye(system.order) * (1e-3 + float(np.trace(total)) + total.max() ** 0.5)
    for _ in range(200):
        x = shifted @ x
        x = np.maximum(x / x.max(), 1e-12)
    bound = flint.arb(0)
    for i in range(system.order):
        row = flint.arb(0)
        for j in range(system.order):
            entry = flint.arb(abs(float(system.A0[i, j])))
            for tau, delayed in zip(system.delays, system.delayed, strict=True):
                entry += flint.arb(abs(float(delayed[i, j]))) * (flint.arb(-line) * tau).exp()
            row += entry * float(x[j])
        bound = bound.max(row / float(x[i]))
    return bound
