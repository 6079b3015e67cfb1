"""Spectral abscissas of very many systems of one shape in a few compiled calls."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum.polishing import EPSILON
from drillctrl.spectrum.pseudospectral import _blocks, degree_for_reach
from drillctrl.spectrum.roots import spectral_abscissa

_CHUNK = 512


def batch_abscissas(
    A0: FloatArray,
    left: FloatArray,
    right: FloatArray,
    delay: FloatArray,
    workers: int | None = None,
) -> FloatArray:
    """Return the spectral abscissas of q systems X' = A0 X + L R X(t − τ).

    Each of the r delayed signals R X may have a delay of its own.

    Parameters
    ----------
    A0 : array, (q, n, n)
        Undelayed matrices.
    left, right : array, (q, n, r) and (q, r, n)
        Factors of the delayed matrices.
    delay : array, (q,) or (q, r)
        τ > 0, of all signals or of each.
    workers : int, optional
        Threads; by default one for each core. The result does not depend on it.

    Returns
    -------
    array, (q,)
        α of each, by the same collocation and iteration as `spectral_abscissa`; those few
        that do not converge here, close to multiple roots, are handed to it.
    """
    count = A0.shape[0]
    n = A0.shape[1]
    for name, array, shape in (
        ("left", left, (count, n, right.shape[1])),
        ("right", right, (count, left.shape[2], n)),
        ("delay", delay, (count,) if delay.ndim == 1 else (count, left.shape[2])),
    ):
        if array.shape != shape:
            raise InputError(name, f"array of shape {array.shape}", f"of shape {shape}")
    finite = all(np.isfinite(array).all() for array in (A0, left, right, delay))
    if not finite or not (delay > 0).all():
        raise InputError("A0, left, right, delay", "arrays", "finite, with delay > 0")
    delay = np.broadcast_to(delay.reshape(count, -1), (count, left.shape[2]))
    degrees = _degrees(A0, left, right, delay)
    alpha = np.empty(count)
    jobs = []
    for degree in np.unique(degrees):
        members = np.flatnonzero(degrees == degree)
        jobs += [(int(degree), members[i : i + _CHUNK]) for i in range(0, members.size, _CHUNK)]

    def solve(job: tuple[int, npt.NDArray[np.intp]]) -> None:
        degree, rows = job
        alpha[rows] = _solve(A0[rows], left[rows], right[rows], delay[rows], degree)

    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        list(pool.map(solve, jobs))
    for row in np.flatnonzero(np.isnan(alpha)):
        taus = np.unique(delay[row])
        parts = [left[row][:, delay[row] == t] @ right[row][delay[row] == t] for t in taus]
        none = np.zeros((n, 0)), np.zeros((0, n))
        system = DelaySystem(A0[row], tuple(parts), tuple(taus.tolist()), *none)
        alpha[row] = spectral_abscissa(system)
    return alpha


def _degrees(
    A0: FloatArray, left: FloatArray, right: FloatArray, delay: FloatArray
) -> npt.NDArray[np.intp]:
    """Choose a degree for each system, from few values so that groups are large."""
    total = np.abs(A0) + np.exp(0.5) * np.abs(left @ right)
    bound = np.abs(np.linalg.eigvals(total)).max(axis=1)
    exact = np.array([degree_for_reach(reach) for reach in bound * delay.max(axis=1)])
    ladder = np.unique(np.round(4 * 1.15 ** np.arange(40)).astype(int))
    return np.asarray(ladder[np.minimum(np.searchsorted(ladder, exact), ladder.size - 1)])


def _solve(
    A0: FloatArray, left: FloatArray, right: FloatArray, delay: FloatArray, degree: int
) -> FloatArray:
    """Return α of each system, NaN where the iteration is not sure of it."""
    count, n, rank = left.shape
    past, present = _blocks(degree, rank)
    size = n + degree * rank
    matrix = np.zeros((count, size, size))
    matrix[:, :n, :n] = A0
    matrix[:, n:, n:] = past / np.tile(delay, degree)[:, :, None]
    matrix[:, n:, :n] = present @ (right / delay[:, :, None])
    matrix[:, :n, size - rank :] += left
    values = np.linalg.eigvals(matrix).astype(complex)
    values = np.where(values.imag >= 0, values, -np.inf)
    order = np.argsort(-values.real, axis=1, kind="stable")[:, :3]
    start = np.take_along_axis(values, order, axis=1)
    s = start[:, :2]
    gap = np.abs(s[:, 0] - s[:, 1])
    sure = np.zeros(s.shape, dtype=bool)
    # Two candidates: the collocation may have exchanged the first two.
    for _ in range(4):
        newton = 1.0 / _log_derivative(A0, left, right, delay, s)
        with np.errstate(divide="ignore", invalid="ignore"):
            pull = np.where(s.imag > 0, 1.0 / (2j * s.imag), 0.0)
            step = newton / (1.0 - newton * pull)
        step = np.where(sure, 0.0, step)
        s = s - step
        near = np.minimum(gap[:, None], np.where(s.imag > 0, 2 * np.abs(s.imag), np.inf))
        scale = 1.0 + np.abs(s)
        sure |= np.abs(step) ** 2 <= EPSILON * scale * np.minimum(near, scale)
        if sure.all():
            break
    alpha = s.real.max(axis=1)
    strayed = np.abs(s - start[:, :2]) > 1e-2 * (1.0 + np.abs(s))
    tight = (gap < 0.05 * (1.0 + np.abs(s[:, 0]))) | ((s.imag > 0) & (s.imag < 0.05)).any(axis=1)
    third = start[:, 2].real > alpha - 1e-3 * (1.0 + np.abs(alpha))
    doubtful = ~sure.all(axis=1) | strayed.any(axis=1) | tight | third
    # A second candidate far to the left may wander; only the first one counts then.
    far = start[:, 1].real < start[:, 0].real - 0.1 * (1.0 + np.abs(start[:, 0]))
    single = far & sure[:, 0] & ~strayed[:, 0] & (s[:, 0].imag == 0)
    single |= far & sure[:, 0] & ~strayed[:, 0] & (s[:, 0].imag > 0.05)
    alpha = np.where(single, s[:, 0].real, alpha)
    return np.where(doubtful & ~single | ~np.isfinite(alpha), np.nan, alpha)


def _log_derivative(
    A0: FloatArray, left: FloatArray, right: FloatArray, delay: FloatArray, s: ComplexArray
) -> ComplexArray:
    """Return tr(Δ⁻¹ Δ') of each system at its own points, shape (q, k)."""
    late = delay[:, None, :]
    factor = np.exp(-np.maximum(s.real[..., None], -1e3 / late) * late)
    factor = factor * np.exp(-1j * s.imag[..., None] * late)
    identity = np.eye(A0.shape[1])
    arriving = left[:, None] * factor[:, :, None, :]
    delta = s[..., None, None] * identity - A0[:, None] - arriving @ right[:, None]
    slope = identity + (arriving * late[:, :, None, :]) @ right[:, None]
    try:
        inverse = np.linalg.inv(delta)
    except np.linalg.LinAlgError:
        # Some s is a root to the last bit; the step from beside it leads back.
        beside = s + 1e-15 * (1.0 + np.abs(s))
        return _log_derivative(A0, left, right, delay, beside)
    return np.asarray(np.einsum("qkij,qkji->qk", inverse, slope))
