"""Frequencies at which a loop with one delay has a root on the axis, for any delay.

A root at iω with z = exp(−iωτ) makes A0 + zA1 singular against iω and its conjugate against
−iω, so that (A0 + zA1) X + X (A0 + A1/z)ᵀ = 0 has a solution X (Chen, Gu and Nett 1995). With
A1 = L R only RX and XRᵀ matter, and with z counted from a place z0 on the unit circle they are
eigenvectors of a matrix of 2nr rows whose eigenvalues are −1/(z − z0). All critical z come
out at once; nothing is sampled.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.reduced import inverses

IntArray = npt.NDArray[np.intp]

# Places on the circle that no loop has a reason to be critical at; several in case one is.
_PLACES = np.exp(1j * np.array([2.347, 0.911, -1.653]))
_NEAR_CIRCLE = 1e-3
_NEAR_AXIS = 1e-3


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
    """
    count, _, rank = left.shape
    if rank == 0 or count == 0:
        none = np.zeros(0)
        return none.astype(np.intp), none, none, none.astype(np.intp)
    z = _candidates(A0, left, right)
    rows, columns = np.nonzero(np.abs(np.abs(z) - 1.0) < _NEAR_CIRCLE)
    found = z[rows, columns]
    found = found / np.abs(found)
    late = left @ right
    roots = np.linalg.eigvals(A0[rows] + found[:, None, None] * late[rows])
    size = np.abs(A0).max(axis=(1, 2), initial=0.0)[rows, None]
    away = np.abs(roots.real) / (np.abs(roots) + 1e-3 * size)
    away = np.where(roots.imag > 0, away, np.inf)
    # Of many roots beside the axis, as a lightly damped string has, one is on it.
    least = away.min(axis=1, keepdims=True, initial=np.inf)
    near = (away < _NEAR_AXIS) & (away < 10.0 * least + 1e-6)
    which, columns = np.nonzero(near)
    omega = np.asarray(roots[which, columns].imag, dtype=float)
    phase = -np.angle(found[which])
    return sharpened(A0, late, rows[which], omega, phase)


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


def sharpened(
    A0: FloatArray, late: FloatArray, rows: IntArray, omega: FloatArray, phase: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray, IntArray]:
    """Newton's method on det Δ(iω, φ) = 0; keep what converges nearby, once each."""
    start, omega, phase = omega, omega.copy(), phase.copy()
    eye = np.eye(A0.shape[1])
    good = np.ones(rows.shape, dtype=bool)
    step, turn = np.zeros(rows.shape), np.zeros(rows.shape)
    by_omega, by_phase = np.ones((2, *rows.shape), dtype=complex)
    # Those that still move.
    on = np.arange(rows.size)
    for _ in range(12):
        term = np.exp(-1j * phase[on])[:, None, None] * late[rows[on]]
        inverse = inverses(1j * omega[on, None, None] * eye - A0[rows[on]] - term)
        # Derivatives of ln det Δ: a step solves by_omega δω + by_phase δφ = −1.
        new_omega = 1j * np.trace(inverse, axis1=1, axis2=2)
        new_phase = 1j * np.einsum("qij,qji->q", inverse, term)
        fine = np.isfinite(new_omega) & np.isfinite(new_phase)
        by_omega[on[fine]], by_phase[on[fine]] = new_omega[fine], new_phase[fine]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            across = (by_omega[on] * by_phase[on].conj()).imag
            along, around = by_phase[on].imag / across, -by_omega[on].imag / across
        # Where Δ is singular to the last bit nothing is left to do.
        good[on] = np.isfinite(along) & np.isfinite(around) | ~fine
        step[on] = np.where(good[on] & fine, along, 0.0)
        turn[on] = np.where(good[on] & fine, around, 0.0)
        scale = 0.05 * (1e-3 + np.abs(omega[on]))
        omega[on] += np.clip(step[on], -scale, scale)
        phase[on] += np.clip(turn[on], -0.2, 0.2)
        on = on[(np.abs(step[on]) > 1e-11 * omega[on]) | (np.abs(turn[on]) > 1e-11)]
        if not on.size:
            break
    keep = good & (np.abs(step) < 1e-8 * omega) & (np.abs(turn) < 1e-8) & (omega > 1e-9)
    keep &= np.abs(omega - start) < 0.05 * (1e-3 + start)
    rows, omega, phase = rows[keep], omega[keep], phase[keep] % (2.0 * np.pi)
    direction = -np.sign((by_omega[keep] / by_phase[keep]).imag).astype(np.intp)
    order = np.lexsort((phase, omega, rows))
    rows, omega, phase, direction = rows[order], omega[order], phase[order], direction[order]
    if not rows.size:
        return rows, omega, phase, direction
    apart = np.abs(np.diff(phase))
    same = (
        (np.diff(rows) == 0)
        & (np.diff(omega) < 1e-8 * omega[1:])
        & (np.minimum(apart, 2 * np.pi - apart) < 1e-7)
    )
    once = np.concatenate([[True], ~same])
    return rows[once], omega[once], phase[once], direction[once]
