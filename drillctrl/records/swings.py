"""Swings in time: their period and how it drifts, the stick-slip index, time spent sticking."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray

# The field's window of the stick-slip index, s.
WINDOW = 20.0
# Hz, between which stick-slip is looked for.
_SLOWEST, _FASTEST = 0.02, 2.0
# A bit below this share of its mean speed sticks.
STICKS_BELOW = 0.05
# Of a swing, left after so many periods where it keeps itself up, and the windows where it must.
_MEMORY, _KEPT, _SHARE = 4.0, 0.6, 0.5
_PERIODS, _OTHER = 8.0, 0.3


class Period(NamedTuple):
    """The period of a swing that keeps itself up.

    Attributes
    ----------
    value : float
        Median over the record, s.
    times, values : array
        Middles of the windows it was measured in, and the period there; NaN where none.
    drift : float
        Least-squares slope over the record, s per hour.
    """

    value: float
    times: FloatArray
    values: FloatArray
    drift: float


def period_of(data: FloatArray, step: float, segments: list[slice]) -> Period | None:
    """Return the period of a signal; None where no swing lasts for many periods.

    Parameters
    ----------
    data : array, (k,)
        Torque, or the bit's speed.
    step : float
        s.
    segments : list of slice
        Stretches without gaps.
    """
    longest = max(segments, key=lambda cut: cut.stop - cut.start, default=None)
    if longest is None:
        return None
    first = _strongest(data[longest], step)
    if first is None:
        return None
    window = max(60.0, _PERIODS / first)
    size, hop = int(window / step), max(1, int(0.5 * window / step))
    times, values = [], []
    for cut in segments:
        length = cut.stop - cut.start
        for begin in range(cut.start, max(cut.start + 1, cut.stop - size + 1), hop):
            piece = data[begin : min(begin + size, cut.stop)]
            if piece.size < min(size, length) or piece.size * step < 3.0 / first:
                continue
            found = _strongest(piece, step)
            times.append(step * (begin + 0.5 * piece.size))
            values.append(np.nan if found is None else _cycle(piece, step, found))
    middles, periods = np.array(times), np.array(values)
    known = np.isfinite(periods)
    if known.sum() < max(1.0, _SHARE * periods.size):
        return None
    # A window in which something else swings is none of this swing, which is that of most windows;
    # of as many, the slower one, for a harmonic may pass for it.
    seen = periods[known]
    alike = (np.abs(seen[:, None] / seen - 1.0) <= _OTHER).sum(axis=1)
    swing = seen[alike == alike.max()].max()
    periods[np.abs(periods / swing - 1.0) > _OTHER] = np.nan
    known = np.isfinite(periods)
    drift = 0.0
    if known.sum() > 2:
        drift = 3600.0 * float(np.polyfit(middles[known], periods[known], 1)[0])
    return Period(float(np.median(periods[known])), middles, periods, drift)


def _strongest(data: FloatArray, step: float) -> float | None:
    """Return the frequency of the strongest line, Hz."""
    import scipy.signal

    flat = scipy.signal.detrend(data) * np.hanning(data.size)
    size = 8 * data.size
    density = np.abs(np.fft.rfft(flat, size)) ** 2
    frequency = np.fft.rfftfreq(size, step)
    band = (frequency >= max(_SLOWEST, 2.0 / (data.size * step))) & (
        frequency <= min(_FASTEST, 0.25 / step)
    )
    if not band.any() or not density[band].max() > 0.0:
        return None
    place = int(np.flatnonzero(band)[np.argmax(density[band])])
    # The line may be a harmonic: half or a third of it is the swing if it is there too.
    for part in (3, 2):
        low = place // part
        near = slice(max(1, int(0.97 * low)), int(1.03 * low) + 2)
        if frequency[low] > _SLOWEST and density[near].max() > 0.15 * density[place]:
            place = near.start + int(np.argmax(density[near]))
            break
    return float(frequency[place])


def _cycle(data: FloatArray, step: float, near: float) -> float:
    """Return the period near a frequency by its recurrence; NaN where the swing forgets itself."""
    import scipy.signal

    flat = scipy.signal.detrend(data)
    # Noise far above the swing says nothing of it.
    slow = scipy.signal.butter(2, min(6.0 * near, 0.4 / step) * 2.0 * step, output="sos")
    flat = scipy.signal.sosfiltfilt(slow, flat) if flat.size > 30 else flat
    size = 2 * flat.size
    power = np.abs(np.fft.rfft(flat, size)) ** 2
    recurrence = np.fft.irfft(power, size)[: flat.size]
    recurrence /= recurrence[0] * (1.0 - np.arange(flat.size) / flat.size)
    periods, value = 0.0, 1.0 / near
    for turn in range(1, int(_MEMORY) + 1):
        at = turn * value / step
        low, high = int(at * (1.0 - 0.12 / turn)), int(at * (1.0 + 0.12 / turn)) + 2
        if high >= 0.8 * flat.size:
            break
        peak = low + int(np.argmax(recurrence[low:high]))
        if not 0 < peak < flat.size - 1:
            break
        before, top, after = recurrence[peak - 1 : peak + 2]
        shift = 0.5 * (before - after) / min(before - 2.0 * top + after, -1e-30)
        value = step * (peak + float(np.clip(shift, -1.0, 1.0))) / turn
        periods, kept = float(turn), float(top)
    return value if periods and kept > _KEPT else float("nan")


class Windows(NamedTuple):
    """What was measured in windows of time.

    Attributes
    ----------
    times : array, (w,)
        Their middles, s.
    values : array, (w,)
        What was measured; NaN in gaps.
    """

    times: FloatArray
    values: FloatArray


def swing_index(
    data: FloatArray, step: float, window: float = WINDOW, least: float = 0.0
) -> Windows:
    """Return (largest − smallest)/(2 mean) in windows that follow each other by half their length.

    Parameters
    ----------
    data : array, (k,)
        Speed or torque.
    step, window : float
        s.
    least : float
        Windows of a smaller mean are passed over: nothing turns.
    """
    size = min(data.size, max(4, round(window / step)))
    times, values = [], []
    for begin in range(0, data.size - size + 1, max(1, size // 2)):
        piece = data[begin : begin + size]
        times.append(step * (begin + 0.5 * size))
        mean = piece.mean()
        good = np.isfinite(mean) and mean > least
        values.append(np.ptp(piece) / (2.0 * mean) if good else np.nan)
    return Windows(np.array(times), np.array(values))


def without_noise(found: Windows, speed: FloatArray, error: float, band: float) -> Windows:
    """Return indices without what noise adds to largest and smallest.

    As they are where that would be more than half of them: the error is then a bound.

    Parameters
    ----------
    found : Windows
        Of `swing_index`, in its usual windows.
    speed : array
        Of which they are.
    error : float
        Its standard error.
    band : float
        Hz, that of the noise: it has so many independent values in a window.
    """
    count = max(2.0, 2.0 * band * WINDOW)
    mean = float(np.nanmean(speed))
    added = np.sqrt(2.0 * np.log(count)) * error / mean if mean > 0.0 else 0.0
    left = np.sqrt(np.maximum(found.values**2 - added**2, 0.0))
    return found._replace(values=np.where(added < 0.5 * found.values, left, found.values))


def window_means(data: FloatArray, step: float, window: float = WINDOW) -> FloatArray:
    """Return the means in the windows of `swing_index`, NaN where part of one is missing."""
    size = min(data.size, max(4, round(window / step)))
    begins = range(0, data.size - size + 1, max(1, size // 2))
    return np.array([data[begin : begin + size].mean() for begin in begins])


def sticking_share(speed: FloatArray, error: float) -> float:
    """Return the share of the time in which a bit stands still.

    Parameters
    ----------
    speed : array
        Of the bit, NaN where it is not known.
    error : float
        Of the speed: so much is no motion.
    """
    known = speed[np.isfinite(speed)]
    if not known.size:
        return float("nan")
    return float((known < max(STICKS_BELOW * known.mean(), 2.0 * error)).mean())


def quiet(data: FloatArray, step: float) -> FloatArray:
    """Return a measured speed without noise that is faster than anything it does.

    A Wiener filter: the floor between 0.6 and 0.95 of half the sampling rate is the noise.
    """
    known = np.isfinite(data)
    if known.sum() < 64 or not known.any():
        return data
    filled = np.interp(np.arange(data.size), np.flatnonzero(known), data[known])
    import scipy.signal

    size = min(1024, filled.size)
    frequency, density = scipy.signal.welch(filled, 1.0 / step, nperseg=size)
    top = frequency[-1]
    floor = np.quantile(density[(frequency > 0.6 * top) & (frequency < 0.95 * top)], 0.4)
    gain = np.clip(1.0 - 1.5 * floor / np.maximum(density, 1e-300), 0.0, 1.0)
    gain[:2] = 1.0
    more = min(size, filled.size - 1)
    wide = np.pad(filled, more, mode="reflect", reflect_type="odd")
    bins = np.fft.rfftfreq(wide.size, step)
    kept = np.fft.irfft(np.fft.rfft(wide) * np.interp(bins, frequency, gain), wide.size)
    return np.where(known, kept[more : more + data.size], np.nan)
