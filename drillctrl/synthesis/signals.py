"""A family of loops of many states through its few signals: what the past and the gains act on.

With G(s) what a signal is by what acts, E(s) the delays, and S(h) which signals are summed up to
what acts, det Δ(s) = Π (s − p) · det(I − S(h) E(s) G(s)), p the poles of the plant without its
past. A point costs a sum over the poles, and no determinant of as many rows overflows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.reduced import reduced_loops
from drillctrl.delay.system import DelaySystem

# Loops of fewer states, or of more signals, are as fast by their matrices.
_MANY, _SIGNALS = 40, 4
# Taylor series are taken on circles of this share of the way to the third pole.
_NEAR, _THIRD = 0.25, 2


@dataclass(frozen=True, eq=False)
class Signals:
    """The signals of a family: what the plant delays, then what each entry of the gains sees.

    Attributes
    ----------
    poles : array, (n,)
        Of the plant without what is delayed.
    residues : array, (n, (r + c) (r + g))
        Of the signals by what acts: r delayed by the plant, c entries in g groups.
    delays : array, (r + c,)
        Of the signals.
    group : int array, (c,)
        Entries of one group act on one input through one delay.
    """

    poles: ComplexArray
    residues: ComplexArray
    delays: FloatArray
    group: npt.NDArray[np.intp]

    @property
    def own(self) -> int:
        """How many signals the plant delays, r."""
        return self.delays.size - self.group.size

    def sums(self, entries: FloatArray) -> FloatArray:
        """Return S at the entries of the gain matrices, (r + g, r + c)."""
        own, count = self.own, int(self.group.max()) + 1
        fed = (self.group == np.arange(count)[:, None]) * entries
        top = np.eye(own, own + entries.size)
        return np.vstack([top, np.hstack([np.zeros((count, own)), fed])])

    def gains(self, weights: ComplexArray) -> ComplexArray:
        """Return E⁻¹ of what the signals are, for sums over the poles (..., n), (..., r + c, g)."""
        made = weights @ self.residues
        return np.asarray(made.reshape(*weights.shape[:-1], self.delays.size, -1))

    def late(self, s: ComplexArray) -> ComplexArray:
        """Return the delays E at places, (..., r + c)."""
        return np.asarray(np.exp(-np.multiply.outer(s, self.delays)))

    def newton(self, s: ComplexArray, sums: FloatArray) -> ComplexArray:
        """Return det Δ over its derivative at many places, 0 at roots; not finite at poles."""
        weights = 1.0 / (s[:, None] - self.poles)
        late, gain = self.late(s)[..., None], self.gains(weights)
        matrix = np.eye(len(sums)) - sums @ (late * gain)
        slope = sums @ (late * (self.delays[:, None] * gain + self.gains(weights**2)))
        met = np.linalg.det(matrix) == 0.0
        matrix[met] = np.eye(len(sums))
        ratio = np.trace(np.linalg.solve(matrix, slope), axis1=1, axis2=2)
        return np.where(met, 0.0, 1.0 / (weights.sum(axis=1) + ratio))

    def near(self, s: ComplexArray) -> FloatArray:
        """Return radii of circles around places on which det Δ is smooth, (q,)."""
        away = np.sort(np.abs(s[:, None] - self.poles), axis=1)
        return np.asarray(_NEAR * away[:, _THIRD])

    def determinant(
        self, s: ComplexArray, centre: ComplexArray, entries: FloatArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return det Δ around places, over its size there without feedback, and its slopes.

        Parameters
        ----------
        s : array, (q, p)
            Points that are neither roots nor poles.
        centre : array, (q,)
            The places.
        entries : array, (c,)
            Of the gain matrices.

        Returns
        -------
        array, (q, p), and array, (q, p, c)
            Over Π |centre − p|.
        """
        away = s[..., None] - self.poles
        size = np.maximum(np.abs(centre[:, None] - self.poles), np.finfo(float).tiny)
        sums, seen = self.sums(entries), self.late(s)[..., None] * self.gains(1.0 / away)
        matrix = np.eye(len(sums)) - sums @ seen
        value = (away / size[:, None]).prod(axis=-1) * np.linalg.det(matrix)
        answer = seen[..., self.own :, :] @ np.linalg.inv(matrix)
        each = answer[..., np.arange(self.group.size), self.own + self.group]
        return value, -value[..., None] * each


def signals_of(
    plain: DelaySystem, drive: FloatArray, seen: FloatArray, lags: FloatArray
) -> Signals | None:
    """Return the signals of a `LoopFamily`; None where its matrices are as fast, or safer."""
    keys = [(lag, b.tobytes()) for lag, b in zip(lags, drive.T, strict=True)]
    groups = sorted(set(keys))
    own = sum(len(right) for _, right in plain.factors)
    if plain.order < _MANY or not groups or own + len(groups) > _SIGNALS:
        return None
    scaled = DelaySystem(plain.A0, plain.delayed, plain.delays, B=drive, C=seen).balanced
    delayed = zip(scaled.factors, scaled.delays, strict=True)
    late = [tau for (_, right), tau in delayed for _ in right]
    loops = reduced_loops(
        scaled.A0[None],
        np.hstack([*(left for left, _ in scaled.factors), scaled.B])[None],
        np.vstack([*(right for _, right in scaled.factors), scaled.C])[None],
        np.array([*late, *lags])[None],
    )
    if loops.factor[0] != 0.0:
        return None
    rank = own + len(keys)
    # One of each group: all of them act alike.
    acting = [*range(own), *(own + keys.index(key) for key in groups)]
    residues = loops.residues[0].reshape(-1, rank, rank)[:, :, acting]
    return Signals(
        loops.poles[0],
        np.ascontiguousarray(residues.reshape(len(residues), -1)),
        loops.delays[0],
        np.array([groups.index(key) for key in keys]),
    )
