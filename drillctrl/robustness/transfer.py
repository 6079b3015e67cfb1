"""Exact frequency responses of delay systems, and their way into python-control."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.delay.closing import feedback_lags, gain_matrices, loop_channels
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic

_COARSEST = 0.02
_MAX_POINTS = 20_000
# Entries of matrices that are held at once.
_AT_ONCE = 100_000


def frequency_response(system: DelaySystem, omega: npt.ArrayLike) -> ComplexArray:
    """Return G(iω) = C Δ(iω)⁻¹ B, late inputs and outputs included, with no approximation.

    Parameters
    ----------
    system : DelaySystem
        Any; it need not be stable.
    omega : array_like, (q,)
        Angular frequencies.

    Returns
    -------
    array, (p, m, q)
        Outputs by inputs by frequencies.
    """
    points = np.atleast_1d(np.asarray(omega, dtype=float))
    if not np.isfinite(points).all():
        raise InputError("omega", "an array with NaN or infinity", "finite")
    response = np.moveaxis(system.C @ _responses(system, system.B, points), 0, -1)
    lags = np.add.outer(system.output_delays, system.input_delays)
    return np.asarray(response * np.exp(-1j * np.multiply.outer(lags, points)))


def loop_transfer(
    system: DelaySystem,
    structure: FeedbackStructure,
    K1: npt.ArrayLike,
    K2: npt.ArrayLike | None,
    omega: npt.ArrayLike,
) -> ComplexArray:
    """Return L(iω), the loop broken at the plant input, for negative feedback.

    The closed loop has the characteristic equation det(I + L) = 0, with
    L = −(K1 + K2 exp(−iωτ)) C Δ⁻¹ B, late inputs and outputs included: the sign that margins
    are read with.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    structure, K1, K2 : FeedbackStructure and gains
        As in `close_loop`.
    omega : array_like, (q,)
        Angular frequencies.

    Returns
    -------
    array, (m, m, q)
    """
    gains = np.stack(gain_matrices(structure, K1, K2))
    drive, measure = loop_channels(system, structure)
    points = np.atleast_1d(np.asarray(omega, dtype=float))
    turned = np.exp(-1j * np.multiply.outer(points, feedback_lags(system, structure)))
    transfer = -(gains * turned).sum(axis=1) @ measure @ _responses(system, drive, points)
    return np.asarray(np.moveaxis(transfer, 0, -1))


def _responses(system: DelaySystem, drive: FloatArray, omega: FloatArray) -> ComplexArray:
    """Return Δ(iω)⁻¹ B for every ω, (q, n, m), without holding all Δ at once."""
    found = [
        np.linalg.solve(
            characteristic.matrix(system, 1j * some),
            np.broadcast_to(drive.astype(complex), (some.size, *drive.shape)),
        )
        for some in _portions(system, omega)
    ]
    return np.concatenate(found)


def _portions(system: DelaySystem, omega: FloatArray) -> list[FloatArray]:
    return np.array_split(omega, 1 + omega.size * system.order**2 // _AT_ONCE)


def frequency_grid(
    system: DelaySystem, low: float | None = None, high: float | None = None
) -> FloatArray:
    """Return frequencies dense enough that G turns little from one to the next.

    Parameters
    ----------
    system : DelaySystem
        Whose peaks are to be resolved.
    low, high : float, optional
        Ends; by default far below and above all that the system does.
    """
    scale = characteristic.magnitude_bound(system, 0.0)
    low = 1e-3 * min(scale, 1.0) if low is None else low
    high = 10.0 * scale if high is None else high
    if not 0.0 < low < high or not np.isfinite(high):
        raise InputError("low, high", (low, high), "positive, finite and increasing")
    omega = np.geomspace(low, high, 400)
    sign, size = _log_determinant(system, omega)
    while omega.size < _MAX_POINTS:
        change = np.abs(np.diff(np.log(sign)).imag) % (2 * np.pi)
        change = np.minimum(change, 2 * np.pi - change) + np.abs(np.diff(size))
        smooth = np.abs(np.diff(np.log(omega))) * system.order
        coarse = np.flatnonzero(change > np.maximum(_COARSEST, 0.2 * smooth))
        coarse = coarse[np.diff(np.log(omega))[coarse] > 1e-5]
        if coarse.size == 0:
            break
        middle = np.sqrt(omega[coarse] * omega[coarse + 1])
        signs, sizes = _log_determinant(system, middle)
        omega = np.insert(omega, coarse + 1, middle)
        sign, size = np.insert(sign, coarse + 1, signs), np.insert(size, coarse + 1, sizes)
    return omega


def _log_determinant(system: DelaySystem, omega: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return det Δ(iω) by its phase factor and the logarithm of its size."""
    parts = [
        np.linalg.slogdet(characteristic.matrix(system, 1j * some))
        for some in _portions(system, omega)
    ]
    sign, size = (np.concatenate(part) for part in zip(*parts, strict=True))
    return np.asarray(sign, dtype=complex), np.asarray(size)
