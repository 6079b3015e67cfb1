"""Scan along the delay: every crossing in ω0 for fixed other parameters, in closed form.

On the imaginary axis f = P0 + P1 E + P2 E² with |E| = 1. Eliminating E leaves a polynomial
in ω² alone, so the critical frequencies are its positive roots, finitely many and the same
for every delay; each gives a family of delays τ = (φ + 2πk)/ω, one for each lobe, all
crossed in the same direction (Walton and Marshall 1987). Nothing is sampled, so nothing is
missed, however small ω0 is.
"""

from __future__ import annotations

import math

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.charts.scan import ScanLine
from drillctrl.spectrum.quasipolynomial import Quasipolynomials

# Lobes that are listed one by one; below the ω0 of the last one a bound decides.
_FEWEST_TURNS, _MOST_TURNS = 6.0, 400.0


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Multiply polynomials given by rows of ascending coefficients."""
    result = np.zeros((a.shape[0], a.shape[1] + b.shape[1] - 1))
    for i in range(a.shape[1]):
        result[:, i : i + b.shape[1]] += a[:, i : i + 1] * b
    return result


def _sum(*terms: FloatArray) -> FloatArray:
    size = max(term.shape[1] for term in terms)
    return np.asarray(sum(np.pad(term, ((0, 0), (0, size - term.shape[1]))) for term in terms))


def _shift(a: FloatArray) -> FloatArray:
    """Multiply by w = ω²."""
    return np.pad(a, ((0, 0), (1, 0)))


def _parts(c: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Split P(iω) = e(w) + iω o(w) with w = ω², ascending coefficients."""
    even = c[:, 0::2] * (-1.0) ** np.arange(c[:, 0::2].shape[1])
    odd = c[:, 1::2] * (-1.0) ** np.arange(c[:, 1::2].shape[1])
    return even, odd


def critical_polynomial(loops: Quasipolynomials) -> FloatArray:
    """Return the polynomial in w = ω² that vanishes at critical frequencies.

    (|P0|² − |P2|²)² = |P2 P1* − P1 P0*|² is the resultant of f and its mirror image on the
    circle |E| = 1; without E² it reduces to |P0|² = |P1|².

    Returns
    -------
    array, (N, d + 1)
        Ascending coefficients.
    """
    p = [_parts(loops.coefficients[:, :, k]) for k in range(loops.coefficients.shape[2])]

    def size(k: int) -> FloatArray:
        even, odd = p[k]
        return _sum(_product(even, even), _shift(_product(odd, odd)))

    def cross(j: int, k: int) -> tuple[FloatArray, FloatArray]:
        (e1, o1), (e2, o2) = p[j], p[k]
        real = _sum(_product(e1, e2), _shift(_product(o1, o2)))
        return real, _sum(_product(o1, e2), -_product(e1, o2))

    degree = loops.delayed_degree
    if degree == 0:
        return size(0)
    if degree == 1:
        return _sum(size(0), -size(1))
    (real1, imag1), (real2, imag2) = cross(2, 1), cross(1, 0)
    real, imag = _sum(real1, -real2), _sum(imag1, -imag2)
    gap = _sum(size(0), -size(2))
    return _sum(_product(gap, gap), -_product(real, real), -_shift(_product(imag, imag)))


def _real_roots(polynomial: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """Return (row, w) of the positive, nearly real roots of each row."""
    degree = polynomial.shape[1] - 1
    lead = polynomial[:, -1]
    scale = np.maximum(np.abs(polynomial[:, 0] / lead), 1e-12) ** (1.0 / degree)
    monic = polynomial[:, :-1] / lead[:, None]
    monic = monic * scale[:, None] ** (np.arange(degree) - degree)
    companion = np.zeros((polynomial.shape[0], degree, degree))
    companion[:, np.arange(1, degree), np.arange(degree - 1)] = 1.0
    companion[:, :, -1] = -monic
    roots = np.linalg.eigvals(companion) * scale[:, None]
    # Generous: what is no crossing is thrown out by the characteristic equation itself.
    near = (roots.real > 0) & (np.abs(roots.imag) < 1e-3 * np.abs(roots))
    rows, columns = np.nonzero(near)
    return rows, roots[rows, columns].real


def critical_frequencies(
    loops: Quasipolynomials,
) -> tuple[np.ndarray, FloatArray, FloatArray, np.ndarray]:
    """Return all (loop, ω, φ, direction) with f(iω) = 0 at ωτ = φ modulo 2π.

    Returns
    -------
    rows : int array, (k,)
        Which loop.
    omega, phase : array, (k,)
        ω > 0 and φ in [0, 2π).
    direction : int array, (k,)
        +1 where the root moves to the right as the delay grows, −1 to the left.
    """
    rows, w = _real_roots(critical_polynomial(loops))
    omega = np.sqrt(w)
    chosen = loops.take(rows)
    p = chosen.polynomials(1j * omega)[0]
    candidates: list[ComplexArray] = []
    if p.shape[0] == 1:
        return rows[:0], omega[:0], omega[:0], rows[:0]
    with np.errstate(divide="ignore", invalid="ignore"):
        if p.shape[0] == 2 or not p[2].any():
            candidates.append(-p[0] / p[1])
        else:
            root = np.sqrt(p[1] ** 2 - 4.0 * p[2] * p[0])
            # The stable pair of formulas for the two roots of a quadratic.
            root = np.where((p[1].conj() * root).real < 0, -root, root)
            half = -0.5 * (p[1] + root)
            candidates += [half / p[2], p[0] / half]
    e = np.concatenate(candidates)
    rows, omega = np.tile(rows, len(candidates)), np.tile(omega, len(candidates))
    near = np.isfinite(e) & (np.abs(np.abs(e) - 1.0) < 0.05)
    return _sharpen(loops, rows[near], omega[near], -np.angle(e[near]))


def _sharpen(
    loops: Quasipolynomials, rows: np.ndarray, omega: FloatArray, phase: FloatArray
) -> tuple[np.ndarray, FloatArray, FloatArray, np.ndarray]:
    """Newton's method on f(iω, φ) = 0; keep what converges nearby, once each."""
    chosen = loops.take(rows)
    start = omega.copy()
    powers = np.arange(loops.coefficients.shape[2])[:, None]
    good = np.ones(rows.shape, dtype=bool)
    for _ in range(8):
        p, slope = chosen.polynomials(1j * omega)
        turn = np.exp(-1j * powers * phase)
        f = (p * turn).sum(axis=0)
        by_omega = 1j * (slope * turn).sum(axis=0)
        by_phase = -1j * (powers * p * turn).sum(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = (f * by_phase.conj()).imag / (by_omega * by_phase.conj()).imag
            turn_step = (f * by_omega.conj()).imag / (by_phase * by_omega.conj()).imag
        good = np.isfinite(step) & np.isfinite(turn_step)
        omega = omega - np.where(good, np.clip(step, -0.05, 0.05), 0.0)
        phase = phase - np.where(good, np.clip(turn_step, -0.2, 0.2), 0.0)
    size = np.abs(step) + np.abs(turn_step)
    keep = good & (size < 1e-9 * (1.0 + omega)) & (omega > 1e-9)
    keep &= np.abs(omega - start) < 0.05 * (1.0 + start)
    rows, omega, phase = rows[keep], omega[keep], phase[keep] % (2.0 * np.pi)
    direction = np.sign((by_omega / by_phase).imag[keep]).astype(np.int64)
    # by_omega/by_phase = i Q/(−i G) = −Q/G, and the direction is the sign of Im(Q/G).
    direction = -direction
    order = np.lexsort((phase, omega, rows))
    rows, omega, phase, direction = rows[order], omega[order], phase[order], direction[order]
    same = (
        (np.diff(rows) == 0)
        & (np.diff(omega) < 1e-8 * (1.0 + omega[1:]))
        & (np.abs(np.diff(phase)) < 1e-7)
    )
    once = np.concatenate([[True], ~same]) if rows.size else np.zeros(0, dtype=bool)
    return rows[once], omega[once], phase[once], direction[once]


def unstable_without_delay(loops: Quasipolynomials) -> np.ndarray:
    """Count the right half-plane roots of Σ P[k](s), the limit τ → 0, shape (N,)."""
    c = loops.coefficients.sum(axis=2)
    n = c.shape[1] - 1
    companion = np.zeros((c.shape[0], n, n))
    companion[:, np.arange(1, n), np.arange(n - 1)] = 1.0
    companion[:, :, -1] = -c[:, :-1] / c[:, -1:]
    return np.asarray((np.linalg.eigvals(companion).real > 0).sum(axis=1))


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
    loops: Quasipolynomials, positions: FloatArray, low: float, high: float, turn: float
) -> list[ScanLine]:
    """Scan loops whose coefficients do not depend on ω0 along ω0.

    Parameters
    ----------
    loops : Quasipolynomials
        One for each line; their delays are ignored.
    positions : array, (N,)
        The parameter that is held, for the record.
    low, high : float
        Limits of ω0; ``low`` may be 0.
    turn : float
        τ ω0 = 2π/n.
    """
    rows, omega, phase, direction = critical_frequencies(loops)
    base = unstable_without_delay(loops)
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
