"""The rightmost roots of loops of many states, followed from gains to gains.

A descent looks at gains that lie close together, and a plant of many states has few delayed
signals: Newton's iteration on the characteristic equation moves the roots that matter on, where
eigenvalues of the collocation would find them anew at ten times the cost.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dgeev

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.reduced import ReducedLoops, reduced_loops
from drillctrl.delay.system import DelaySystem
from drillctrl.synthesis.family import LoopFamily

# Loops of fewer states, or of more signals, are as fast by eigenvalues.
_MANY, _SIGNALS = 40, 4
# Roots this far left of the rightmost are followed, over 1/τ, and at so many gains in a row.
_DEPTH, _IN_A_ROW = 1.0, 12
# Steps of the iteration, how far a root may move, over the depth, and where it has arrived.
_STEPS, _FAR, _ARRIVED = 8, 0.4, 1e-9
_APART = 1e-6


def abscissa_along(family: LoopFamily) -> Callable[[FloatArray], tuple[float, FloatArray]]:
    """Return ``family.abscissa``, or what costs less along a descent on many states."""
    plain, n = family.plain, family.system.order
    keys = [(lag, b.tobytes()) for lag, b in zip(family.lags, family.drive.T, strict=True)]
    groups = sorted(set(keys))
    own = sum(len(right) for _, right in plain.factors)
    if n < _MANY or not groups or own + len(groups) > _SIGNALS:
        return family.abscissa
    scaled = DelaySystem(
        plain.A0, plain.delayed, plain.delays, B=family.drive, C=family.seen
    ).balanced
    delayed = zip(scaled.factors, scaled.delays, strict=True)
    late = [tau for (_, right), tau in delayed for _ in right]
    loops = reduced_loops(
        scaled.A0[None],
        np.hstack([*(left for left, _ in scaled.factors), scaled.B])[None],
        np.vstack([*(right for _, right in scaled.factors), scaled.C])[None],
        np.array([*late, *family.lags])[None],
    )
    if loops.factor[0] != 0.0:
        return family.abscissa
    return _Tracker(family, loops, own, np.array([groups.index(key) for key in keys])).abscissa


@dataclass(eq=False)
class _Tracker:
    """What is known of the roots at the last gains.

    Attributes
    ----------
    family : LoopFamily
        The loops.
    signals : ReducedLoops
        What the plant delays, then each entry of the gain matrices as a signal of gain 1.
    own : int
        How many the plant delays.
    group : int array, (c,)
        Entries of one group act on one input through one delay.
    roots : array, (q,)
        The roots near the rightmost, with imag ≥ 0.
    left : int
        At how many gains they are still followed.
    """

    family: LoopFamily
    signals: ReducedLoops
    own: int
    group: npt.NDArray[np.intp]
    roots: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    left: int = 0

    def abscissa(self, gains: FloatArray) -> tuple[float, FloatArray]:
        """Return what `LoopFamily.abscissa` does, of the exact loop where roots are followed."""
        sums = self._sums(self.family.spread @ gains)
        loops = self._loops(sums)
        depth = _DEPTH / float(self.signals.delays.max())
        moved = self._moved(loops, depth) if self.left else None
        if moved is None:
            real, imag, _, _, info = dgeev(self.family.matrix(gains), 0, 0)
            near = (imag >= 0.0) & (real > real.max() - depth)
            self.roots, self.left = real[near] + 1j * imag[near], _IN_A_ROW
            moved = None if info else self._moved(loops, depth)
        if moved is None:
            self.left = 0
            return self.family.abscissa(gains)
        self.roots, self.left = moved, self.left - 1
        top = complex(moved[np.argmax(moved.real)])
        return top.real, self._gradient(loops, sums, top)

    def _sums(self, entries: FloatArray) -> FloatArray:
        """Return how signals of the loop are summed up, (r + groups, r + c)."""
        count = int(self.group.max()) + 1
        fed = (self.group == np.arange(count)[:, None]) * entries
        top = np.eye(self.own, self.own + entries.size)
        return np.vstack([top, np.hstack([np.zeros((count, self.own)), fed])])

    @property
    def _columns(self) -> npt.NDArray[np.intp]:
        """One signal for each of the loop's: those of a group drive the same input."""
        first = np.unique(self.group, return_index=True)[1]
        return np.concatenate([np.arange(self.own), self.own + first])

    def _gains_of_modes(self) -> ComplexArray:
        rank = self.signals.delays.shape[1]
        modes = self.signals.residues[0].reshape(-1, rank, rank)
        return np.asarray(modes[:, :, self._columns])

    def _loops(self, sums: FloatArray) -> ReducedLoops:
        columns, every = self._columns, self.signals
        residues = sums @ self._gains_of_modes()
        return ReducedLoops(
            every.A0,
            every.left[:, :, columns],
            sums @ every.right,
            every.delays[:, columns],
            every.factor,
            every.poles,
            residues.reshape(1, len(residues), -1),
        )

    def _moved(self, loops: ReducedLoops, depth: float) -> ComplexArray | None:
        """Return where the roots have moved; None if one that matters is lost."""
        start = self.roots
        s, scale = start.copy(), 1.0 + np.abs(start)
        size = np.full(s.size, np.inf)
        for _ in range(_STEPS):
            everyone = np.concatenate([s, s[s.imag > 0.0].conj()])
            gap = s[:, None] - everyone
            gap[gap == 0.0] = np.inf
            with np.errstate(all="ignore"):
                newton = 1.0 / loops.evaluate(s[None])[2][0]
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

    def _gradient(self, loops: ReducedLoops, sums: FloatArray, s: complex) -> FloatArray:
        """Return the slope of the real part of a root by the gains.

        With M = E G, G the gains from signal to signal, (I − M) v = 0 and u (I − M) = 0 it is
        −u M_h v / (u M_s v).
        """
        weights = 1.0 / (s - loops.poles[0])
        modes = self._gains_of_modes()
        every = np.tensordot(weights, modes, 1)
        late = np.exp(-s * loops.delays[0])
        matrix = late[:, None] * (sums @ every)
        steep = late[:, None] * (sums @ np.tensordot(weights**2, modes, 1))
        change = -loops.delays[0][:, None] * matrix - steep
        left, _, right = np.linalg.svd(np.eye(len(matrix)) - matrix)
        u, v = left[:, -1].conj(), right[-1].conj()
        row = self.own + self.group
        slopes = -(u * late)[row] * (every[self.own :] @ v) / (u @ change @ v)
        slopes = np.real(slopes @ self.family.spread)
        return np.where(np.isfinite(slopes), slopes, 0.0)
