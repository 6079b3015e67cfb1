"""det Δ of a loop with one input: a quasi-polynomial, affine in the entries of the gains."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.system import DelaySystem

# Differences of coefficients below this, relative, are rounding.
_NOISE = 1e-13
# Radius of the circle for s: the roots that matter have modulus 0.5 to 10.
_RADIUS = 2.0
# From so many states on a determinant for each entry costs too much.
_MANY = 20


@dataclass(frozen=True, eq=False)
class Expansion:
    """det Δ = Σ_c h_c Σ C[c, k, j] s^j exp(−kτs) with h_0 = 1.

    Attributes
    ----------
    coefficients : array, (1 + c, r + 1, n + 1)
        C of the loop without feedback, then of each entry of the gain matrices.
    delay : float
        τ.
    """

    coefficients: FloatArray
    delay: float

    def taylor(self, s: ComplexArray, terms: int) -> ComplexArray:
        """Return the Taylor coefficients about many places, (q,) → (q, 1 + c, terms)."""
        entries, powers, degrees = self.coefficients.shape
        binomials, exponents = _binomials(terms, degrees)
        ladder = s[:, None] ** np.arange(degrees)
        shift = (binomials * ladder[:, exponents]).transpose(0, 2, 1)
        # Polynomials in h = s' − s, then times exp(−kτ(s + h)): a product of two series.
        shifted = self.coefficients.reshape(-1, degrees) @ shift
        decay = np.exp(-self.delay * s)[:, None] ** np.arange(powers)
        series = _exponential(terms, powers, self.delay) * decay[:, :, None, None]
        flat = powers * terms
        return np.asarray(shifted.reshape(-1, entries, flat) @ series.reshape(-1, flat, terms))


def expand(
    plain: DelaySystem, drive: FloatArray, seen: FloatArray, late: npt.NDArray[np.bool_]
) -> Expansion:
    """Expand det Δ of a loop with at most one delay around rank-one terms h_c b c(s)ᵀ.

    Parameters
    ----------
    plain : DelaySystem
        The loop without them.
    drive, seen : array, (n, c) and (c, n)
        Columns b, all of one direction, and rows c.
    late : bool array, (c,)
        Which rows are seen through exp(−sτ).
    """
    if len(plain.A0) >= _MANY:
        table = _of_one_solution(plain, drive, seen, late)
        if np.isfinite(table).all():
            return Expansion(np.ascontiguousarray(table.transpose(0, 2, 1)), plain.max_delay)
    terms = np.einsum("nc,cm->cnm", drive, seen)
    zero = np.zeros_like(plain.A0)
    now = [zero, *(zero if is_late else term for term, is_late in zip(terms, late, strict=True))]
    past = [zero, *(term if is_late else zero for term, is_late in zip(terms, late, strict=True))]
    delayed = plain.delayed[0] if plain.delays else zero
    table = _coefficients(plain.A0 + np.array(now), delayed + np.array(past))
    table[1:] -= table[0]
    _leave_out_noise(table)
    return Expansion(np.ascontiguousarray(table.transpose(0, 2, 1)), plain.max_delay)


def _leave_out_noise(table: FloatArray) -> None:
    table[1:][np.abs(table[1:]) < _NOISE * np.abs(table[0]).max()] = 0.0


def _of_one_solution(
    plain: DelaySystem, drive: FloatArray, seen: FloatArray, late: npt.NDArray[np.bool_]
) -> FloatArray:
    """Return the table of `expand` with one factorisation for all entries at each sample.

    An entry h changes det Δ by −h det Δ · c(s)ᵀ Δ⁻¹ b. NaN where Δ is singular at a sample.
    """
    zero = np.zeros_like(plain.A0)
    terms = np.abs(drive) @ np.abs(seen)
    delayed = plain.delayed[0] if plain.delays else zero
    past = np.abs(delayed) + (terms if late.any() else zero)
    s, z = _circles(len(zero), past[None])
    pencil = _pencil(plain.A0[None], delayed[None], s, z)
    value = np.linalg.det(pencil)
    try:
        response = np.linalg.solve(pencil[0], drive)
    except np.linalg.LinAlgError:
        return np.full((1, 1, 1), np.nan)
    share = np.einsum("szmc,cm->csz", response, seen) * np.where(late[:, None], z, 1.0)[:, None]
    table = _transformed(np.concatenate([value, -value * share]))
    _leave_out_noise(table)
    return table


def _coefficients(a0: FloatArray, a1: FloatArray) -> FloatArray:
    """Return c[j, k] of det(sI − A0 − E A1) = Σ c[j, k] s^j E^k for N loops, (N, n + 1, r + 1).

    The degree in E = exp(−sτ) is at most the rank of A1. The coefficients are read off the
    matrices by sampling both variables on circles, so the physics stays where it is written.
    """
    return _transformed(np.linalg.det(_pencil(a0, a1, *_circles(a0.shape[-1], a1))))


def _circles(order: int, a1: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return where s and E are sampled for matrices of so many states, (n + 1,) and (r + 1,)."""
    rows = np.flatnonzero(a1.any(axis=(0, 2))).size
    degree = min(rows, np.flatnonzero(a1.any(axis=(0, 1))).size)
    s = _RADIUS * np.exp(2j * np.pi * np.arange(order + 1) / (order + 1))
    return s, np.exp(2j * np.pi * np.arange(degree + 1) / (degree + 1))


def _pencil(a0: FloatArray, a1: FloatArray, s: ComplexArray, z: ComplexArray) -> ComplexArray:
    """Return sI − A0 − E A1 at all samples, (N, n + 1, r + 1, n, n)."""
    shifted = s[:, None, None, None] * np.eye(a0.shape[-1]) - a0[:, None, None]
    return np.asarray(shifted - z[None, :, None, None] * a1[:, None, None])


def _transformed(samples: ComplexArray) -> FloatArray:
    """Return the coefficients from values on both circles, (N, n + 1, r + 1)."""
    table = np.fft.fft2(samples, axes=(1, 2)).real / samples[0].size
    # What the transform leaves of a coefficient that is zero is noise.
    floor = 1e-12 * np.abs(samples).max(axis=(1, 2), keepdims=True)
    table[np.abs(table) <= floor] = 0.0
    powers = _RADIUS ** np.arange(samples.shape[1])
    return np.asarray(table / powers[:, None])


@functools.lru_cache(maxsize=32)
def _binomials(terms: int, degrees: int) -> tuple[FloatArray, npt.NDArray[np.intp]]:
    """Return binom(j, l), 0 where j < l, and the exponents j − l, each (terms, degrees)."""
    table = [[float(math.comb(j, i)) for j in range(degrees)] for i in range(terms)]
    exponents = np.arange(degrees) - np.arange(terms)[:, None]
    return np.array(table), np.maximum(exponents, 0)


@functools.lru_cache(maxsize=32)
def _exponential(terms: int, powers: int, delay: float) -> FloatArray:
    """Return (−kτ)^(m − l)/(m − l)!, 0 where m < l, shape (powers, terms, terms)."""
    table = np.zeros((powers, terms, terms))
    for k in range(powers):
        for i in range(terms):
            for m in range(i, terms):
                table[k, i, m] = (-k * delay) ** (m - i) / math.factorial(m - i)
    return table
