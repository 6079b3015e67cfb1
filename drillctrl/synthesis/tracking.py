"""The rightmost roots of loops of many states, followed from gains to gains.

A descent looks at gains that lie close together, and a plant of many states has few delayed
signals: Newton's iteration on the characteristic equation moves the roots that matter on, where
eigenvalues of the collocation would find them anew at ten times the cost.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg.lapack import dgeev

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.spectrum.pseudospectral import degree_for_reach
from drillctrl.synthesis.family import LoopFamily, loop_family
from drillctrl.synthesis.signals import Signals

# Roots this far left of the rightmost are followed, over 1/τ, so many of them at most, and at so
# many gains in a row.
_DEPTH, _MOST, _IN_A_ROW = 1.0, 24, 24
# Steps of the iteration, how far a root may move, over the depth, and where it has arrived.
_STEPS, _FAR, _ARRIVED = 8, 0.4, 1e-9
_APART = 1e-6
# First places come from a collocation of at least this degree, that resolves poles which decay
# more slowly than that, over 1/τ.
_COARSE, _SLOW = 16, 1.0


@functools.lru_cache(maxsize=8)
def coarse_family(family: LoopFamily) -> LoopFamily:
    """Return the loops with a collocation that places the roots of many states well enough."""
    if family.signals is None:
        return family
    poles, longest = family.signals.poles, float(family.signals.delays.max())
    reach = longest * float(np.abs(poles[poles.real > -_SLOW / longest]).max(initial=0.0))
    degree = max(_COARSE, degree_for_reach(reach))
    if degree >= family.degree:
        return family
    return loop_family(family.system, family.feedback, degree, family.line)


def abscissa_along(family: LoopFamily) -> Callable[[FloatArray], tuple[float, FloatArray]]:
    """Return ``family.abscissa``, or what costs less along a descent on many states."""
    if family.signals is None:
        return family.abscissa
    return _Tracker(family, coarse_family(family), family.signals).abscissa


def exact_abscissa(family: LoopFamily) -> Callable[[FloatArray], float]:
    """Return ``family.exact``, or what costs less on many states."""
    if family.signals is None:
        return family.exact
    return _Tracker(family, coarse_family(family), family.signals).anew


@dataclass(eq=False)
class _Tracker:
    """What is known of the roots at the last gains.

    Attributes
    ----------
    family, coarse : LoopFamily
        The loops, and where first places are taken from.
    signals : Signals
        Of the loops.
    roots : array, (q,)
        The roots near the rightmost, with imag ≥ 0.
    edge : float
        Others were left of this when they were found.
    left : int
        At how many gains they are still followed.
    """

    family: LoopFamily
    coarse: LoopFamily
    signals: Signals
    roots: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    edge: float = math.inf
    left: int = 0

    def abscissa(self, gains: FloatArray) -> tuple[float, FloatArray]:
        """Return what `LoopFamily.abscissa` does, of the exact loop where roots are followed."""
        sums = self.signals.sums(self.family.spread @ gains)
        depth = _DEPTH / float(self.signals.delays.max())
        moved = self._moved(sums, depth) if self.left else None
        if moved is None or moved.real.max() < self.edge:
            moved = self._found(gains, sums, depth)
        if moved is None:
            self.left = 0
            return self.family.abscissa(gains)
        self.roots, self.left = moved, self.left - 1
        top = complex(moved[np.argmax(moved.real)])
        return top.real, self._gradient(sums, top)

    def anew(self, gains: FloatArray) -> float:
        """Return the abscissa of the exact loop, whatever was known before."""
        depth = _DEPTH / float(self.signals.delays.max())
        moved = self._found(gains, self.signals.sums(self.family.spread @ gains), depth)
        return self.family.exact(gains) if moved is None else float(moved.real.max())

    def _found(self, gains: FloatArray, sums: FloatArray, depth: float) -> ComplexArray | None:
        """Return the roots near the rightmost, anew."""
        real, imag, _, _, info = dgeev(self.coarse.matrix(gains), 0, 0)
        if info:
            return None
        upper = np.flatnonzero((imag >= 0.0) & (real > real.max() - depth))
        order = upper[np.argsort(-real[upper], kind="stable")]
        self.edge = float(real[order[_MOST]]) if order.size > _MOST else real.max() - depth
        self.roots = real[order[:_MOST]] + 1j * imag[order[:_MOST]]
        self.left = _IN_A_ROW
        return self._moved(sums, depth)

    def _moved(self, sums: FloatArray, depth: float) -> ComplexArray | None:
        """Return where the roots have moved; None if one that matters is lost."""
        start = self.roots
        s, scale = start.copy(), 1.0 + np.abs(start)
        size = np.full(s.size, np.inf)
        for _ in range(_STEPS):
            everyone = np.concatenate([s, s[s.imag > 0.0].conj()])
            gap = s[:, None] - everyone
            gap[gap == 0.0] = np.inf
            with np.errstate(all="ignore"):
                newton = self.signals.newton(s, sums)
                step = newton / (1.0 - newton * (1.0 / gap).sum(axis=1))
            step[~np.isfinite(step)] = 0.0
            step.imag[s.imag == 0.0] = 0.0
            s = s - step
            s.imag = np.abs(s.imag)
            size = np.abs(step)
            if (size <= _ARRIVED * scale).all():
                break
        close = np.abs(gap).min(axis=1) < _APART * scale
        lost = (size > _ARRIVED * scale) | (np.abs(s - start) > _FAR * depth) | close
        top = float(s[~lost].real.max(initial=-np.inf))
        if (lost & (start.real > top - 0.5 * depth)).any() or not np.isfinite(top):
            return None
        return np.asarray(s[~lost])

    def _gradient(self, sums: FloatArray, s: complex) -> FloatArray:
        """Return the slope of the real part of a root by the gains.

        With M = S E G, (I − M) v = 0 and u (I − M) = 0 it is −u M_h v / (u M_s v).
        """
        signals = self.signals
        weights = 1.0 / (s - signals.poles)
        late = signals.late(np.asarray(s))[:, None]
        seen = late * signals.gains(weights)
        change = -signals.delays[:, None] * seen - late * signals.gains(weights**2)
        left, _, right = np.linalg.svd(np.eye(len(sums)) - sums @ seen)
        u, v = left[:, -1].conj(), right[-1].conj()
        row, own = signals.own + signals.group, signals.own
        slopes = -u[row] * (seen[own:] @ v) / (u @ (sums @ change) @ v)
        slopes = np.real(slopes @ self.family.spread)
        return np.where(np.isfinite(slopes), slopes, 0.0)
