"""Modes as peaks of a spectrum: frequency and damping by maximum likelihood (Whittle)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray

_TAPERS = 3
_PIECE = 600.0
_LOWEST, _HIGHEST = 0.05, 5.0
# A peak rises so many times above what is beside it.
_RISE = 3.0
_MOST = 4
# By so much a resonance must be likelier than a plain slope (logarithm).
_CLEAR = 5.0


class Peak(NamedTuple):
    """A mode that a spectrum shows.

    Attributes
    ----------
    frequency, error : float
        Hz, and half the width of its 95 % interval.
    damping_ratio, damping_error : float
        Share of critical, and half the width of its 95 % interval.
    """

    frequency: float
    error: float
    damping_ratio: float
    damping_error: float


def spectral_density(pieces: list[FloatArray], step: float) -> tuple[FloatArray, FloatArray, float]:
    """Return frequencies, a density, and of how many independent ones it is the mean.

    Sine tapers (Riedel and Sidorenko, 1995), and the mean over pieces cut to one length.
    """
    import scipy.signal

    shortest = min(piece.size for piece in pieces)
    size = shortest // max(1, round(shortest * step / _PIECE))
    number = np.arange(1, size + 1)
    total: FloatArray | None = None
    count = 0
    for piece in pieces:
        for begin in range(0, piece.size - size + 1, size):
            flat = scipy.signal.detrend(piece[begin : begin + size])
            for k in range(1, _TAPERS + 1):
                taper = np.sqrt(2.0 / (size + 1)) * np.sin(np.pi * k * number / (size + 1))
                density = np.abs(np.fft.rfft(taper * flat)) ** 2 * (2.0 * step)
                total = density if total is None else total + density
                count += 1
    assert total is not None
    # Tapers share what neighbouring frequencies tell: they smooth, and add nothing to it.
    frequency = np.asarray(np.fft.rfftfreq(size, step), dtype=float)
    return frequency, total / count, float(count) / _TAPERS


def spectral_modes(pieces: list[FloatArray], step: float) -> list[Peak]:
    """Return the modes that rise above what is beside them, by frequency.

    Parameters
    ----------
    pieces : list of array
        Torque without gaps, in a motion that a noise of the bit keeps up.
    step : float
        s.
    """
    frequency, density, count = spectral_density(pieces, step)
    if not density.max() > 0.0:
        return []
    density = np.maximum(density, 1e-20 * density.max())
    found = [
        peak
        for near in _candidates(frequency, density)
        if (peak := _likeliest(frequency, density, count, near)) is not None
    ]
    found.sort()
    distinct: list[Peak] = []
    for peak in found:
        if not distinct or peak.frequency > 1.15 * distinct[-1].frequency:
            distinct.append(peak)
    return distinct[:_MOST]


def _candidates(frequency: FloatArray, density: FloatArray) -> list[float]:
    import scipy.signal

    highest = min(_HIGHEST, 0.8 * frequency[-1])
    places = np.geomspace(max(_LOWEST, 5.0 * frequency[1]), highest, 400)
    edges = np.sqrt(places[1:] * places[:-1])
    # Means over 2.5 % of the frequency: narrower than a damped mode, wide enough to be smooth.
    whole = np.concatenate([[0.0], np.cumsum(density)])
    step = frequency[1]

    def mean(low: FloatArray, high: FloatArray) -> FloatArray:
        a = np.clip((low / step).astype(int), 0, density.size - 1)
        b = np.clip(np.maximum((high / step).astype(int), a + 3), 1, density.size)
        return np.asarray((whole[b] - whole[a]) / (b - a))

    smooth = np.log(mean(edges * 0.97, edges * 1.03))
    peaks, about = scipy.signal.find_peaks(smooth, prominence=np.log(_RISE))
    best = np.argsort(-about["prominences"])[: 2 * _MOST]
    return [float(edges[place]) for place in peaks[best]]


def _likeliest(
    frequency: FloatArray, density: FloatArray, count: float, near: float
) -> Peak | None:
    """Return the resonance that makes a density likeliest; None where there is none."""
    import scipy.optimize

    band = (frequency > 0.72 * near) & (frequency < 1.38 * near)
    at, seen = frequency[band], density[band]
    if at.size < 12:
        return None

    def model(p: FloatArray) -> FloatArray:
        centre, ratio, size, floor = np.exp(p)
        over = (centre**2 - at**2) ** 2 + (2.0 * ratio * centre * at) ** 2
        return np.asarray(size * (2.0 * ratio * centre**2) ** 2 / over + floor)

    def cost(p: FloatArray) -> float:
        told = model(p)
        return float(count * (np.log(told) + seen / told).sum())

    top = float(seen.max())
    middle = float(np.median(seen))
    starts = [np.log([near, r, 0.5 * top, middle]) for r in (0.02, 0.08)]
    bounds = [
        (np.log(0.8 * near), np.log(1.25 * near)), (np.log(1e-4), np.log(0.5)),
        (np.log(1e-9 * top), np.log(1e3 * top)), (np.log(1e-9 * top), np.log(10.0 * top)),
    ]  # fmt: skip
    best = min(
        (
            scipy.optimize.minimize(cost, start, method="L-BFGS-B", bounds=bounds)
            for start in starts
        ),
        key=lambda found: float(found.fun),
    )
    # Beside it: no resonance, a spectrum that falls or rises with frequency.
    slope, level = np.polyfit(np.log(at), np.log(np.maximum(seen, 1e-3 * np.median(seen))), 1)

    def plain(p: FloatArray) -> float:
        told = p[0] + p[1] * np.log(at)
        return float(count * (told + seen * np.exp(-told)).sum())

    flat = scipy.optimize.minimize(plain, [level + 0.5, slope], method="L-BFGS-B")
    if float(flat.fun) - float(best.fun) < _CLEAR:
        return None
    p = np.asarray(best.x)
    small = 1e-4
    slopes = np.stack(
        [(np.log(model(p + d)) - np.log(model(p - d))) / (2.0 * small) for d in small * np.eye(4)]
    )
    spread = np.linalg.pinv(count * slopes @ slopes.T)
    centre, ratio, size, floor = np.exp(p)
    about = 1.96 * np.sqrt(np.maximum(np.diag(spread), 0.0))
    told = Peak(float(centre), float(centre * about[0]), float(ratio), float(ratio * about[1]))
    # A line narrower than can be told is no mode.
    if size < _RISE * floor or ratio > 0.4 or about[0] > 0.2 or about[1] > 1.0:
        return None
    return told
