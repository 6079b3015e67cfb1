"""Exact frequency responses of delay systems, and their way into python-control."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.delay.closing import gain_matrices, loop_channels
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic

if TYPE_CHECKING:
    pass

_COARSEST = 0.02
_MAX_POINTS = 20_000


def frequency_response(system: DelaySystem, omega: npt.ArrayLike) -> ComplexArray:
    """Return G(iω) = C Δ(iω)⁻¹ B without any approximation of the delays.

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
    delta = characteristic.matrix(system, 1j * points)
    inputs = np.broadcast_to(system.B.astype(complex), (points.size, *system.B.shape))
    response = system.C @ np.linalg.solve(delta, inputs)
    return np.asarray(np.moveaxis(response, 0, -1))


def loop_transfer(
    system: DelaySystem,
    structure: FeedbackStructure,
    K1: npt.ArrayLike,
    K2: npt.ArrayLike | None,
    omega: npt.ArrayLike,
) -> ComplexArray:
    """Return L(iω), the loop broken at the plant input, for negative feedback.

    The closed loop has the characteristic equation det(I + L) = 0, with
    L = −(K1 + K2 exp(−iωτ0)) C Δ⁻¹ B: the sign that margins are read with.

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
    now, past = gain_matrices(structure, K1, K2)
    drive, measure = loop_channels(system, structure)
    points = np.atleast_1d(np.asarray(omega, dtype=float))
    delta = characteristic.matrix(system, 1j * points)
    inputs = np.broadcast_to(drive.astype(complex), (points.size, *drive.shape))
    lag = np.exp(-1j * points * system.max_delay)[:, None, None]
    transfer = -(now + past * lag) @ measure @ np.linalg.solve(delta, inputs)
    return np.asarray(np.moveaxis(transfer, 0, -1))


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
    while omega.size < _MAX_POINTS:
        delta = characteristic.matrix(system, 1j * omega)
        sign, size = np.linalg.slogdet(delta)
        change = np.abs(np.diff(np.log(sign)).imag) % (2 * np.pi)
        change = np.minimum(change, 2 * np.pi - change) + np.abs(np.diff(size))
        smooth = np.abs(np.diff(np.log(omega))) * system.order
        coarse = np.flatnonzero(change > np.maximum(_COARSEST, 0.2 * smooth))
        coarse = coarse[np.diff(np.log(omega))[coarse] > 1e-5]
        if coarse.size == 0:
            break
        omega = np.insert(omega, coarse + 1, np.sqrt(omega[coarse] * omega[coarse + 1]))
    return omega
