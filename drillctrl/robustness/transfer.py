"""Exact frequency responses of delay systems, and their way into python-control."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.closing import feedback_lags, gain_matrices, loop_channels
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic

# Change of phase and size of det Δ, and relative change of what is drawn, between neighbours.
_COARSEST, _TURN = 0.02, 0.05
# How far the ends are moved.
_DECADES = 12
_MAX_POINTS = 20_000
# Entries of matrices that are held at once.
_AT_ONCE = 100_000


@checks_kinds
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
        Outputs by inputs by frequencies; infinite at a pole.
    """
    points = frequencies(omega)
    lags = np.add.outer(system.output_delays, system.input_delays)
    turned = np.exp(-1j * np.multiply.outer(points, lags))
    return _by_frequency(turned * (system.C @ _responses(system, system.B, points)))


@checks_kinds
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
    points = frequencies(omega)
    turned = np.exp(-1j * np.multiply.outer(points, feedback_lags(system, structure)))
    transfer = -(gains * turned).sum(axis=1) @ measure @ _responses(system, drive, points)
    return _by_frequency(transfer)


def frequencies(omega: npt.ArrayLike) -> FloatArray:
    """Return angular frequencies as a row, or raise if they are none or not finite."""
    points = np.atleast_1d(np.asarray(omega, dtype=float))
    if points.ndim != 1 or points.size == 0:
        raise InputError("omega", f"array of shape {points.shape}", "a row of frequencies")
    if not np.isfinite(points).all():
        raise InputError("omega", "an array with NaN or infinity", "finite")
    return points


def _responses(system: DelaySystem, drive: FloatArray, omega: FloatArray) -> ComplexArray:
    """Return Δ(iω)⁻¹ B for every ω, (q, n, m), without holding all Δ at once."""
    found = []
    for some in _portions(system, omega):
        delta = characteristic.matrix(system, 1j * some)
        right = np.broadcast_to(drive.astype(complex), (some.size, *drive.shape))
        try:
            found.append(np.linalg.solve(delta, right))
        except np.linalg.LinAlgError:
            poles = np.linalg.svd(delta, compute_uv=False)[:, -1] == 0.0
            poles |= np.linalg.det(delta) == 0.0
            delta[poles] = np.eye(system.order)
            found.append(np.where(poles[:, None, None], np.nan, np.linalg.solve(delta, right)))
    return np.concatenate(found)


def _by_frequency(transfer: ComplexArray) -> ComplexArray:
    """Move frequencies last; what has a pole there is infinite, as in python-control."""
    transfer[np.isnan(transfer).any(axis=(1, 2))] = np.inf
    return np.asarray(np.moveaxis(transfer, 0, -1))


def _portions(system: DelaySystem, omega: FloatArray) -> list[FloatArray]:
    return np.array_split(omega, 1 + omega.size * system.order**2 // _AT_ONCE)


def frequency_grid(
    system: DelaySystem,
    low: float | None = None,
    high: float | None = None,
    *,
    response: Callable[[FloatArray], ComplexArray] | None = None,
    small: float | None = None,
) -> FloatArray:
    """Return frequencies dense enough that a response changes little from one to the next.

    Parameters
    ----------
    system : DelaySystem
        Whose peaks are to be resolved.
    low, high : float, optional
        Ends; by default from where the response only follows a power of ω to where it is small,
        and where the phase of each late channel has turned once.
    response : callable, optional
        (q,) → (..., q), what is drawn; G of the system by default, L for margins.
    small : float, optional
        What may be left out at high frequencies; by default 1e-3 of the largest.
    """
    drawn = response
    if drawn is None:
        drawn = functools.partial(frequency_response, system)
    scale = characteristic.magnitude_bound(system, 0.0)
    low = _power_law_below(drawn, 1e-3 * min(scale or 1.0, 1.0)) if low is None else low
    high = (
        _small_beyond(system, drawn, max(10.0 * scale, 10.0 * low), small) if high is None else high
    )
    if not 0.0 < low < high or not np.isfinite(high):
        raise InputError("low, high", (low, high), "positive, finite and increasing")

    def looked(omega: FloatArray) -> tuple[ComplexArray, ComplexArray, FloatArray]:
        values = np.asarray(drawn(omega)).reshape(-1, omega.size)
        return values, *_log_determinant(system, omega)

    omega = np.geomspace(low, high, 400)
    values, sign, size = looked(omega)
    while omega.size < _MAX_POINTS:
        change = np.abs(np.diff(np.log(sign)).imag) % (2 * np.pi)
        change = np.minimum(change, 2 * np.pi - change) + np.abs(np.diff(size))
        smooth = np.abs(np.diff(np.log(omega)))
        change = change / np.maximum(_COARSEST, 0.2 * smooth * system.order)
        modulus = np.abs(values)
        larger = np.maximum(modulus[:, 1:], modulus[:, :-1])
        with np.errstate(divide="ignore", invalid="ignore"):
            turned = np.abs(np.diff(values)) / larger
        # Little is seen of what is far smaller than the rest.
        whole = modulus.max(initial=0.0) if small is None else 1e3 * small
        turned *= np.minimum(larger / (whole or 1.0), 1.0) ** 0.35 * (larger > 1e-6 * whole) / _TURN
        change = np.maximum(change, np.nan_to_num(turned).max(axis=0, initial=0.0))
        change[smooth <= 1e-5] = 0.0
        coarse = np.flatnonzero(change > 1.0)
        if coarse.size == 0:
            break
        # Where there are too many, those that are largest.
        first = np.argsort(-larger[:, coarse].max(axis=0, initial=0.0), kind="stable")
        coarse = np.sort(coarse[first[: _MAX_POINTS - omega.size]])
        middle = np.sqrt(omega[coarse] * omega[coarse + 1])
        new = looked(middle)
        omega = np.insert(omega, coarse + 1, middle)
        values, sign, size = (
            np.insert(old, coarse + 1, more, axis=-1)
            for old, more in zip((values, sign, size), new, strict=True)
        )
    return omega


def _power_law_below(response: Callable[[FloatArray], ComplexArray], low: float) -> float:
    """Return a frequency below which a response is a power of ω, as far as decades show."""
    for _ in range(_DECADES):
        values = np.asarray(response(low * np.array([1.0, 0.1, 0.01]))).reshape(-1, 3)
        if not np.isfinite(values).all():
            break
        bent = np.abs(values[:, 0] * values[:, 2] - values[:, 1] ** 2)
        if (bent <= 1e-2 * np.abs(values[:, 1]) ** 2).all():
            break
        low *= 0.1
    return low


def _small_beyond(
    system: DelaySystem,
    response: Callable[[FloatArray], ComplexArray],
    high: float,
    small: float | None,
) -> float:
    """Return a frequency beyond which a response is small and all late channels have turned."""
    lags = [lag for lag in (*system.input_delays, *system.output_delays) if lag]
    lags += [system.feedback_delay] if system.feedback_delay else []
    if lags:
        high = max(high, 2.0 * np.pi / min(lags))
    seen = np.abs(np.asarray(response(np.geomspace(1e-6 * high, high, 200)))).reshape(-1, 200)
    limit = 1e-3 * float(seen.max(initial=0.0)) if small is None else small
    for _ in range(4 * _DECADES):
        ahead = np.abs(np.asarray(response(high * np.array([0.8, 0.9, 1.0])))).max(initial=0.0)
        if ahead <= limit:
            break
        high *= 2.0
    return high


def _log_determinant(system: DelaySystem, omega: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return det Δ(iω) by its phase factor and the logarithm of its size."""
    parts = [
        np.linalg.slogdet(characteristic.matrix(system, 1j * some))
        for some in _portions(system, omega)
    ]
    sign, size = (np.concatenate(part) for part in zip(*parts, strict=True))
    return np.asarray(sign, dtype=complex), np.asarray(size)
