"""The H∞ norm of a delay system, with a bound that it does not exceed.

Away from the centre of an interval of frequencies Δ = Δc(I + E), so that G = C Δ⁻¹ B differs
from what it is there by at most ‖C Δc⁻¹ δΔ‖ ‖Δc⁻¹ B‖/(1 − ‖E‖). Intervals that cannot hold the
peak by this bound are dropped and the rest halved: no peak is stepped over, however narrow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from drillctrl.base.arrays import FloatArray
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem
from drillctrl.robustness.axis import size_bound
from drillctrl.robustness.transfer import frequency_response
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.multiplicity import Root
from drillctrl.spectrum.roots import dominant_roots

_GAP = 1e-7
_COLUMNS = 128
_MOST_PIECES = 50_000
# Entries of matrices that are held at once.
_AT_ONCE = 200_000
_ROUNDS = 60


@dataclass(frozen=True)
class PeakGain:
    """Largest gain of a stable system over all frequencies.

    Attributes
    ----------
    value : float
        max ‖G(iω)‖, attained; infinite for a system that is not stable.
    upper_bound : float
        What the gain exceeds at no frequency.
    frequency : float
        ω of it.
    """

    value: float
    upper_bound: float
    frequency: float


@checks_kinds
def h_infinity_norm(system: DelaySystem) -> PeakGain:
    """Return the H∞ norm of G(s) = C Δ(s)⁻¹ B.

    Parameters
    ----------
    system : DelaySystem
        With inputs and outputs; late ones do not change the norm.

    Notes
    -----
    The peak is sharpened to rounding. The bound is 1e-7 above it, relative, or more where that
    many intervals would be needed that it is given up.
    """
    system = system.balanced
    if not system.B.any() or not system.C.any():
        return PeakGain(0.0, 0.0, 0.0)
    roots = dominant_roots(system)
    if roots[0].rightmost >= 0.0:
        return PeakGain(math.inf, math.inf, roots[0].imag)
    best = max((_sharpened(system, w) for w in _guesses(roots)), key=lambda peak: peak[0])
    norms = sum(float(np.linalg.norm(a, 2)) for a in (system.A0, *system.delayed))
    ends = float(np.linalg.norm(system.B, 2) * np.linalg.norm(system.C, 2))
    # Beyond, ‖G‖ ≤ ‖B‖ ‖C‖/(ω − Σ ‖Ai‖) is less than what was found.
    top = norms + ends / best[0]
    omega, half = (np.arange(_COLUMNS) + 0.5) * top / _COLUMNS, 0.5 * top / _COLUMNS
    for _ in range(_ROUNDS):
        values, bounds = _bounded(system, omega, half)
        highest = int(values.argmax())
        if values[highest] > best[0]:
            best = max(best, _sharpened(system, float(omega[highest])))
        alive = bounds > best[0] * (1.0 + _GAP)
        if not alive.any():
            return PeakGain(best[0], best[0] * (1.0 + _GAP), best[1])
        if alive.sum() > _MOST_PIECES:
            break
        half *= 0.5
        omega = np.concatenate([omega[alive] - half, omega[alive] + half])
    return PeakGain(best[0], max(best[0], float(bounds.max())), best[1])


def _guesses(roots: tuple[Root, ...]) -> list[float]:
    return [0.0, *(abs(root.imag) for root in roots[:8] if root.imag)]


def _gain(system: DelaySystem, omega: FloatArray) -> FloatArray:
    """Return ‖G(iω)‖ for every ω."""
    response = np.moveaxis(frequency_response(system, omega), -1, 0)
    return np.asarray(np.linalg.norm(response, 2, axis=(1, 2)))


def _sharpened(system: DelaySystem, omega: float) -> tuple[float, float]:
    """Return a local peak near a frequency: its height, and where it is."""
    here = float(_gain(system, np.array([omega]))[0])
    width = 1e-3 * (1.0 + omega)
    for _ in range(60):
        sides = _gain(system, np.abs(omega + width * np.array([-1.0, 1.0])))
        if sides.max() <= here:
            break
        omega, here = (
            abs(omega + width * (1.0 if sides[1] > sides[0] else -1.0)),
            float(sides.max()),
        )
        width *= 1.5
    found = scipy.optimize.minimize_scalar(
        lambda w: -float(_gain(system, np.array([abs(w)]))[0]),
        bounds=(omega - width, omega + width),
        method="bounded",
        options={"xatol": 1e-10 * (1.0 + omega)},
    )
    # Of peaks that differ by rounding, what was looked at first: zero, or a root's frequency.
    higher = -float(found.fun) > here * (1.0 + 1e-14)
    return (float(-found.fun), abs(float(found.x))) if higher else (here, omega)


def _bounded(system: DelaySystem, omega: FloatArray, half: float) -> tuple[FloatArray, FloatArray]:
    """Return ‖G‖ at the centres of intervals, and bounds of it within them."""
    parts = np.array_split(omega, 1 + omega.size * system.order**2 // _AT_ONCE)
    pairs = [_bounded_at_once(system, some, half) for some in parts]
    values, bounds = (np.concatenate(part) for part in zip(*pairs, strict=True))
    return values, bounds


def _bounded_at_once(
    system: DelaySystem, omega: FloatArray, half: float
) -> tuple[FloatArray, FloatArray]:
    delta = characteristic.matrix(system, 1j * omega)
    inverse = np.asarray(np.linalg.inv(delta), dtype=complex)
    moved = inverse
    curved = np.zeros(omega.shape)
    seen = np.asarray(system.C @ inverse)
    seen_moved, seen_curved = seen, np.zeros(omega.shape)
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        term = np.exp(-1j * delay * omega)[:, None, None] * delayed
        change, shown = inverse @ term, seen @ term
        moved, seen_moved = moved + delay * change, seen_moved + delay * shown
        # |exp(−iφ) − 1 + iφ| ≤ φ²/2.
        curved += 0.5 * (delay * half) ** 2 * size_bound(change)
        seen_curved += 0.5 * (delay * half) ** 2 * size_bound(shown)
    values = np.linalg.norm(seen @ system.B, 2, axis=(1, 2))
    off = half * size_bound(moved) + curved
    reach = (half * size_bound(seen_moved) + seen_curved) * size_bound(
        np.asarray(inverse @ system.B)
    )
    with np.errstate(divide="ignore"):
        bounds = np.where(off < 1.0, values + reach / np.maximum(1.0 - off, 1e-300), np.inf)
    return values, bounds
