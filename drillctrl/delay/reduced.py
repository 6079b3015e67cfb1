"""Loops through their delayed signals: det Δ from r × r matrices instead of n × n ones.

With Σ Ai exp(−sτi) = L E(s) R, where R X are the r signals that are delayed and E is diagonal,
and for any splitting factor z,

    det Δ(s) = det(sI − F) · det(I − (E(s) − z I) G(s)),   F = A0 + z L R,  G = R (sI − F)⁻¹ L.

In the eigenbasis of F each entry of G is a sum over its n poles, so that a point costs n r²
operations however many states there are. z is 0 unless F is then nearly defective.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.system import DelaySystem

# Numbers in one temporary array: 16 MB of complex ones.
_CHUNK = 1_000_000
_SPLITTINGS = (0.0, 0.37, -0.61)
_SAFE_CONDITION = 1e5
# Nearer to a pole than this, relative, G loses too many digits.
_NEAR_POLE = 1e-7
_EXPONENT_LIMIT = 300.0


@dataclass(frozen=True, eq=False)
class ReducedLoops:
    """Characteristic functions of N loops of one shape.

    Attributes
    ----------
    A0 : array, (N, n, n)
        Acts on X(t).
    left, right : array, (N, n, r) and (N, r, n)
        L and R.
    delays : array, (N, r)
        τ of each delayed signal.
    factor : array, (N,)
        z; NaN where no eigenbasis is safe and the n × n matrix is taken instead.
    poles : array, (N, n)
        Eigenvalues of F.
    residues : array, (N, n, r²)
        Of the entries of G at the poles.
    """

    A0: FloatArray
    left: FloatArray
    right: FloatArray
    delays: FloatArray
    factor: FloatArray
    poles: ComplexArray
    residues: ComplexArray

    @property
    def count(self) -> int:
        """N."""
        return len(self.A0)

    @property
    def order(self) -> int:
        """Number of states, n."""
        return int(self.A0.shape[-1])

    def take(self, index: npt.NDArray[np.intp] | slice) -> ReducedLoops:
        """Return the loops at the given places."""
        return ReducedLoops(
            self.A0[index],
            self.left[index],
            self.right[index],
            self.delays[index],
            self.factor[index],
            self.poles[index],
            self.residues[index],
        )

    @property
    def _is_plain(self) -> bool:
        return bool(self.residues.shape[2] == 0)

    def matrices(self, s: ComplexArray) -> ComplexArray:
        """Return Δ(s) of each loop at its own points, (N, G) → (N, G, n, n)."""
        return self._matrices(s, _late(self.delays, s))

    def _matrices(self, s: ComplexArray, late: ComplexArray) -> ComplexArray:
        delta = (self.left[:, None] * -late[:, :, None, :]) @ self.right[:, None]
        delta -= self.A0[:, None]
        delta.reshape(*s.shape, -1)[..., :: self.order + 1] += s[..., None]
        return np.asarray(delta)

    def determinant(self, s: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """Return det Δ of each loop at its own points as a unit number and a logarithm.

        Parameters
        ----------
        s : array, (N, G)
            Points.

        Returns
        -------
        sign, size : array, (N, G)
            det Δ = sign · exp(size).
        """
        sign, size, _ = self.evaluate(s, with_slope=False)
        return sign, size

    def evaluate(
        self, s: ComplexArray, *, with_slope: bool = True
    ) -> tuple[ComplexArray, FloatArray, ComplexArray]:
        """Return what `determinant` does, and (det Δ)'/det Δ, NaN where Δ is singular.

        Memory is bounded: points are taken in chunks.
        """
        width = max(self.order, self.residues.shape[2]) + 1
        if self._is_plain or np.isnan(self.factor).any():
            width = 4 * self.order**2
        if s.size * width <= _CHUNK:
            return self._evaluate(s, with_slope)
        sign = np.empty(s.shape, dtype=complex)
        size, slope = np.empty(s.shape), np.zeros(s.shape, dtype=complex)
        columns = max(1, _CHUNK // width)
        rows = max(1, columns // max(1, s.shape[1]))
        for first in range(0, s.shape[0], rows):
            row = slice(first, first + rows)
            some = self if rows >= self.count else self.take(np.arange(self.count)[row])
            for start in range(0, s.shape[1], columns):
                part = row, slice(start, start + columns)
                sign[part], size[part], slope[part] = some._evaluate(s[part], with_slope)
        return sign, size, slope

    def _evaluate(
        self, s: ComplexArray, with_slope: bool
    ) -> tuple[ComplexArray, FloatArray, ComplexArray]:
        if self._is_plain:
            return self._dense(s, with_slope)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            weights = 1.0 / (s[..., None] - self.poles[:, None])
            sizes = np.abs(weights)
            sign = (weights / sizes).prod(axis=-1).conj()
            size = -np.log(sizes).sum(axis=-1)
            rank = self.right.shape[1]
            grid = (*s.shape, rank, rank)
            gain = (weights @ self.residues).reshape(grid)
            late = _late(self.delays, s)
            turned = (late - self.factor[:, None, None])[..., None] * gain
            slope = np.zeros(s.shape, dtype=complex)
            change = None
            if with_slope:
                slope = weights.sum(axis=-1)
                steep = (weights**2 @ self.residues).reshape(grid)
                change = (late * self.delays[:, None])[..., None] * gain
                change += (late - self.factor[:, None, None])[..., None] * steep
            value, ratio = _small_determinant(turned, change)
            amount = np.abs(value)
            sign = sign * value / amount
            size = size + np.log(amount)
            slope = slope + ratio
        limit = _NEAR_POLE * (1.0 + np.abs(s))
        unsafe = ~np.isfinite(size) | ~np.isfinite(sign) | (sizes.max(axis=-1) * limit > 1.0)
        unsafe |= ~np.isfinite(slope)
        if unsafe.any():
            rows, columns = np.nonzero(unsafe)
            exact = self.take(rows)._dense(s[rows, columns][:, None], with_slope)
            sign[unsafe], size[unsafe], slope[unsafe] = (part[:, 0] for part in exact)
        return sign, size, slope

    def _dense(
        self, s: ComplexArray, with_slope: bool
    ) -> tuple[ComplexArray, FloatArray, ComplexArray]:
        """Do the same with Δ itself."""
        late = _late(self.delays, s)
        delta = self._matrices(s, late)
        # Where Δ is singular some versions of numpy warn.
        with np.errstate(divide="ignore", invalid="ignore"):
            sign, size = np.linalg.slogdet(delta)
        if not with_slope:
            return sign, size, np.zeros(s.shape, dtype=complex)
        late *= self.delays[:, None]
        change = (self.left[:, None] * late[:, :, None, :]) @ self.right[:, None]
        change.reshape(*s.shape, -1)[..., :: self.order + 1] += 1.0
        singular = ~np.isfinite(size)
        if singular.any():
            delta[singular] = np.eye(self.order)
        with np.errstate(over="ignore", invalid="ignore"):
            slope = np.einsum("ngij,ngji->ng", np.linalg.inv(delta), change)
        slope[singular] = np.nan
        return sign, size, slope


def _late(delays: FloatArray, s: ComplexArray) -> ComplexArray:
    """Return exp(−sτ), (N, r) and (N, G) → (N, G, r)."""
    exponent = -delays[:, None] * s[..., None]
    np.minimum(exponent.real, _EXPONENT_LIMIT, out=exponent.real)
    return np.asarray(np.exp(exponent))


def _small_determinant(
    turned: ComplexArray, change: ComplexArray | None
) -> tuple[ComplexArray, ComplexArray]:
    """Return det(I − T) and tr((I − T)⁻¹ C), with T and C of shape (..., r, r)."""
    rank = turned.shape[-1]
    shape = turned.shape[:-2]
    if rank == 0:
        return np.ones(shape, dtype=complex), np.zeros(shape, dtype=complex)
    if rank == 1:
        value = 1.0 - turned[..., 0, 0]
        return value, np.zeros(shape, complex) if change is None else change[..., 0, 0] / value
    if rank == 2:
        a, d = 1.0 - turned[..., 0, 0], 1.0 - turned[..., 1, 1]
        b, c = -turned[..., 0, 1], -turned[..., 1, 0]
        value = a * d - b * c
        if change is None:
            return value, np.zeros(shape, complex)
        trace = d * change[..., 0, 0] + a * change[..., 1, 1]
        trace = trace - b * change[..., 1, 0] - c * change[..., 0, 1]
        return value, trace / value
    matrix = np.eye(rank) - turned
    fine = np.isfinite(matrix).all(axis=(-2, -1))
    matrix[~fine] = np.eye(rank)
    value = np.linalg.det(matrix)
    value[~fine] = np.nan
    if change is None:
        return value, np.zeros(shape, complex)
    matrix[value == 0.0] = np.eye(rank)
    ratio = np.einsum("...ij,...ji->...", np.linalg.inv(matrix), change)
    ratio[(value == 0.0) | ~fine] = np.nan
    return value, ratio


def reduced(system: DelaySystem) -> ReducedLoops:
    """Return a single system as the one loop of a family; see `reduced_loops`.

    Its states are scaled first, so that the units in which they are given do not matter.
    """
    system = system.balanced
    n = system.order
    left = [np.zeros((n, 0))] + [one for one, _ in system.factors]
    right = [np.zeros((0, n))] + [other for _, other in system.factors]
    delays = [np.full(one.shape[1], tau) for tau, one in zip(system.delays, left[1:], strict=True)]
    return reduced_loops(
        system.A0[None],
        np.hstack(left)[None],
        np.vstack(right)[None],
        np.concatenate([np.zeros(0), *delays])[None],
    )


def reduced_matrices(
    A0: FloatArray, A1: FloatArray, delays: FloatArray, *, plain: bool = False
) -> ReducedLoops:
    """Return N loops X' = A0 X + A1 X(t − τ), (N, n, n), (N, n, n) and (N,)."""
    left, right = common_factors(A1)
    rank = right.shape[1]
    late = np.repeat(np.asarray(delays, dtype=float)[:, None], rank, axis=1)
    return reduced_loops(A0, left, right, late, plain=plain)


def common_factors(matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return L (N, n, r) and R (N, r, n) of N matrices, with r the largest rank among them."""
    left, sizes, right = np.linalg.svd(matrices)
    floor = matrices.shape[-1] * np.finfo(float).eps * sizes[:, :1]
    rank = int((sizes > floor).sum(axis=1).max(initial=0))
    return left[:, :, :rank] * sizes[:, None, :rank], right[:, :rank]


def reduced_loops(
    A0: FloatArray,
    left: FloatArray,
    right: FloatArray,
    delays: FloatArray,
    *,
    plain: bool = False,
) -> ReducedLoops:
    """Return N loops X' = A0 X + Σ l_j (r_j X)(t − τ_j).

    Parameters
    ----------
    A0 : array, (N, n, n)
        Act on X(t).
    left, right : array, (N, n, r) and (N, r, n)
        Columns l_j and rows r_j.
    delays : array, (N, r)
        τ_j.
    plain : bool
        Take the n × n matrices: better for few states at few points.
    """
    count, n, rank = left.shape
    factor = np.full(count, np.nan)
    poles = np.zeros((count, n), dtype=complex)
    # With many delayed signals Δ itself is the smaller matrix.
    plain = plain or rank >= max(3.0, 0.6 * n)
    residues = np.zeros((count, n, 0 if plain else rank * rank), dtype=complex)
    rest = np.arange(0 if plain else count)
    for z in _SPLITTINGS:
        if not rest.size:
            break
        some = A0[rest] if z == 0.0 else A0[rest] + z * left[rest] @ right[rest]
        values, vectors = np.linalg.eig(some)
        inverse = inverses(vectors)
        with np.errstate(over="ignore"):
            condition = np.linalg.norm(inverse, axis=(1, 2))
        safe = np.flatnonzero(condition < _SAFE_CONDITION)
        place = rest[safe]
        driven, seen = inverse[safe] @ left[place], right[place] @ vectors[safe]
        factor[place], poles[place] = z, values[safe]
        table = seen.transpose(0, 2, 1)[..., None] * driven[:, :, None, :]
        residues[place] = table.reshape(len(place), n, rank * rank)
        rest = np.delete(rest, safe)
    return ReducedLoops(A0, left, right, delays, factor, poles, residues)


def inverses(matrices: ComplexArray) -> ComplexArray:
    """Return the inverse of each matrix, NaN where it is singular to the last bit."""
    try:
        return np.asarray(np.linalg.inv(matrices))
    except np.linalg.LinAlgError:
        singular = (np.linalg.det(matrices) == 0.0)[:, None, None]
        some = np.where(singular, np.eye(matrices.shape[-1]), matrices)
        return np.asarray(np.where(singular, np.nan, np.linalg.inv(some)))
