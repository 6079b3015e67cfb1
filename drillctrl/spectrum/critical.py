"""Frequencies at which a loop with one delay has a root on the axis, for any delay.

With one delayed signal, A1 = l rᵀ, a root lies at iω for some delay where |rᵀ(iω − A0)⁻¹ l| = 1:
at the eigenvalues iω of a Hamiltonian matrix of 2n rows (Boyd, Balakrishnan and Kabamba 1989).

With more of them: a root at iω with z = exp(−iωτ) makes A0 + zA1 singular against iω and its
conjugate against −iω, so that (A0 + zA1) X + X (A0 + A1/z)ᵀ = 0 has a solution X (Chen, Gu and
Nett 1995). With A1 = L R only RX and XRᵀ matter, and with z counted from a place z0 on the unit
circle they are eigenvectors of a matrix of 2nr rows whose eigenvalues are −1/(z − z0). All
critical z come out at once; nothing is sampled. Where 2nr is large the phase is swept (`circle`).
"""

from __future__ import annotations

import math

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.reduced import inverses
from drillctrl.spectrum.circle import critical_phases
from drillctrl.spectrum.critical_newton import IntArray, sharpened

# Places on the circle that no loop has a reason to be critical at; several in case one is.
_PLACES = np.exp(1j * np.array([2.347, 0.911, -1.653]))
_NEAR_CIRCLE = 1e-3
_NEAR_AXIS = 1e-3
# States times delayed signals up to which one eigenvalue problem costs less than a sweep.
_LARGEST = 80
# The same up to which one is solved where a sweep cannot tell crossings apart.
_AT_MOST = 400
# Numbers of all matrices that are taken at once.
_AT_ONCE = 2_000_000


def critical_points(
    A0: FloatArray, left: FloatArray, right: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray, IntArray]:
    """Return all (loop, ω, φ, direction) with a root at iω where ωτ = φ modulo 2π.

    Parameters
    ----------
    A0 : array, (N, n, n)
        Act on X(t).
    left, right : array, (N, n, r) and (N, r, n)
        Factors of A1, which acts on X(t − τ).

    Returns
    -------
    rows : int array, (k,)
        Which loop.
    omega, phase : array, (k,)
        ω > 0 and φ in [0, 2π).
    direction : int array, (k,)
        +1 where the root moves to the right as the delay grows, −1 to the left.

    Raises
    ------
    ArithmeticError
        If crossings of the axis cannot be told apart.
    """
    count, n, rank = left.shape
    if rank == 0 or count == 0:
        none = np.zeros(0)
        return none.astype(np.intp), none, none, none.astype(np.intp)
    if rank == 1:
        starts = _of_one_signal
    else:
        starts = _of_few_signals if n * rank <= _LARGEST else _swept
    late = left @ right
    slices = min(count, math.ceil(count * (2 * n * rank) ** 2 / _AT_ONCE))
    parts = []
    for some in np.array_split(np.arange(count), slices):
        rows, omega, phase = starts(A0[some], left[some], right[some])
        parts.append(sharpened(A0, late, some[rows], omega, phase))
    rows, omega, phase, direction = (np.concatenate(each) for each in zip(*parts, strict=True))
    return rows, omega, phase, direction


def _of_one_signal(
    A0: FloatArray, left: FloatArray, right: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return (loop, ω, φ) where to begin; the signal is scaled as its column is."""
    column, row = np.linalg.norm(left, axis=(1, 2)), np.linalg.norm(right, axis=(1, 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.sqrt(row / column)[:, None, None]
    scale[~np.isfinite(scale) | (scale == 0.0)] = 1.0
    n, turned = A0.shape[1], A0.transpose(0, 2, 1)
    matrix = np.zeros((len(A0), 2 * n, 2 * n))
    matrix[:, :n, :n], matrix[:, n:, n:] = A0, -turned
    matrix[:, :n, n:] = (left * scale) @ (left * scale).transpose(0, 2, 1)
    matrix[:, n:, :n] = -(right / scale).transpose(0, 2, 1) @ (right / scale)
    values = np.linalg.eigvals(matrix)
    near = (values.imag > 0) & (np.abs(values.real) < _NEAR_AXIS * np.abs(values))
    rows, columns = np.nonzero(near)
    omega = np.asarray(values[rows, columns].imag, dtype=float)
    inverse = inverses(1j * omega[:, None, None] * np.eye(n) - A0[rows])
    response = (right[rows] @ inverse @ left[rows])[:, 0, 0]
    fine = np.isfinite(response)
    return rows[fine], omega[fine], np.angle(response[fine])


def _swept(
    A0: FloatArray, left: FloatArray, right: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return (loop, ω, φ) of loops with many states and signals."""

    def of_loop(*loop: FloatArray) -> tuple[FloatArray, FloatArray]:
        try:
            return critical_phases(*loop)
        except ArithmeticError:
            # Slower by far, but nothing that runs along the axis misleads it.
            if loop[1].size > _AT_MOST:
                raise
            _, omega, phase = _of_few_signals(*(each[None] for each in loop))
            return omega, phase

    found = [of_loop(*loop) for loop in zip(A0, left, right, strict=True)]
    rows = np.repeat(np.arange(len(found)), [omega.size for omega, _ in found])
    omega, phase = (np.concatenate(each) for each in zip(*found, strict=True))
    return rows, omega, phase


def _of_few_signals(
    A0: FloatArray, left: FloatArray, right: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return (loop, ω, φ) where to begin, from all critical z at once."""
    z = _candidates(A0, left, right)
    rows, columns = np.nonzero(np.abs(np.abs(z) - 1.0) < _NEAR_CIRCLE)
    found = z[rows, columns]
    found = found / np.abs(found)
    roots = np.linalg.eigvals(A0[rows] + found[:, None, None] * (left @ right)[rows])
    size = np.abs(A0).max(axis=(1, 2), initial=0.0)[rows, None]
    away = np.abs(roots.real) / (np.abs(roots) + 1e-3 * size)
    away = np.where(roots.imag > 0, away, np.inf)
    # Of many roots beside the axis, as a lightly damped string has, one is on it.
    least = away.min(axis=1, keepdims=True, initial=np.inf)
    near = (away < _NEAR_AXIS) & (away < 10.0 * least + 1e-6)
    which, columns = np.nonzero(near)
    omega = np.asarray(roots[which, columns].imag, dtype=float)
    return rows[which], omega, -np.angle(found[which])


def _candidates(A0: FloatArray, left: FloatArray, right: FloatArray) -> ComplexArray:
    """Return every critical z of each loop, (N, 2nr), others among them."""
    late = left @ right
    z = np.full((len(A0), 2 * A0.shape[1] * left.shape[2]), np.inf + 0j)
    rest = np.arange(len(A0))
    for place in _PLACES:
        values, vectors = np.linalg.eig(A0[rest] + place * late[rest])
        gap = np.abs(values[:, :, None] + values[:, None, :].conj())
        size = np.abs(values).max(axis=1)
        # Neither a defective basis nor a root on the axis at the place itself.
        good = np.linalg.cond(vectors) < 1e8
        good &= gap.min(axis=(1, 2)) > 1e-10 * size
        if place == _PLACES[-1]:
            good |= np.isfinite(vectors).all(axis=(1, 2)) & (gap.min(axis=(1, 2)) > 0)
        chosen = rest[good]
        if chosen.size:
            basis = vectors[good]
            driven = np.linalg.solve(basis, left[chosen].astype(complex))
            z[chosen] = _eigenvalues(values[good], driven, right[chosen] @ basis, complex(place))
        rest = rest[~good]
        if not rest.size:
            break
    return z


def _eigenvalues(
    poles: ComplexArray, driven: ComplexArray, seen: ComplexArray, place: complex
) -> ComplexArray:
    """Return z = z0 − 1/κ for the eigenvalues κ of the matrix of each loop."""
    count, n, rank = driven.shape
    share = 1.0 / (poles[:, :, None] + poles[:, None, :].conj())
    turn = np.conj(place)
    size = n * rank
    matrix = np.zeros((count, 2, size, 2, size), dtype=complex)
    grid = (count, n, rank, n, rank)
    # Unknowns RX as (j, a) and XRᵀ/z as (i, a); the sums over the basis are poles of G.
    index = np.arange(n)
    block = np.zeros(grid, dtype=complex)
    block[:, index, :, index, :] = np.einsum("qai,qib,qij->jqab", seen, driven, share)
    matrix[:, 0, :, 0] = block.reshape(count, size, size)
    block = -turn * np.einsum("qai,qjb,qij->qjaib", seen, driven.conj(), share)
    matrix[:, 0, :, 1] = block.reshape(count, size, size)
    block = turn * np.einsum("qib,qaj,qij->qiajb", driven, seen.conj(), share)
    matrix[:, 1, :, 0] = block.reshape(count, size, size)
    block = np.zeros(grid, dtype=complex)
    block[:, index, :, index, :] = -turn * np.einsum(
        "qjb,qaj,qij->iqab", driven.conj(), seen.conj(), share
    )
    matrix[:, 1, :, 1] = turn * (block.reshape(count, size, size) + np.eye(size))
    values = np.linalg.eigvals(matrix.reshape(count, 2 * size, 2 * size))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(values == 0.0, np.inf, place - 1.0 / values))
