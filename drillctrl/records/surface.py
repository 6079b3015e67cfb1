"""What the surface says of the bit: a string carries speed and torque from one end to the other.

With rotation u and torque T at both ends of a line, (u, −T) at the bit is its transfer matrix
times (u, −T) at the top, exactly and without dividing by anything small: both ends follow from
one. Noise is held back first by what top speed and torque have in common, for one cause, the
bit, moves both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.strings.line import Line

# Share of the band, up to half the sampling rate, in which noise alone is looked for.
_FLOOR = (0.6, 0.95)
_MOST_HERTZ = 8.0
_NEARLY_NOTHING = 1e-6


@dataclass(frozen=True, eq=False)
class Spectra:
    """Spectral densities of top speed and torque, and what of them is noise.

    Attributes
    ----------
    frequency : array, (q,)
        Hz.
    matrix : array, (q, 2, 2)
        Cross spectra of speed and torque, one-sided, per Hz.
    noise : array, (2,)
        Of each, per Hz.
    averages : float
        Independent stretches that were averaged.
    """

    frequency: FloatArray
    matrix: ComplexArray
    noise: FloatArray
    averages: float

    def gains(self) -> ComplexArray:
        """Return what turns measured speed and torque into the best guess of both, (q, 2, 2).

        In units of the noise one direction carries what the bit causes; where the larger
        eigenvalue is λ that direction is kept with (λ − 1)/λ, unless noise alone may be so large.
        """
        values, vectors = self.directions()
        # Noise alone reaches this in as few averages (Marchenko and Pastur).
        least = (1.0 + np.sqrt(2.0 / self.averages)) ** 2
        kept = np.where(values > least, 1.0 - 1.0 / np.maximum(values, least), 0.0)
        size = np.sqrt(self.noise)
        filtered = np.einsum("qij,qj,qkj->qik", vectors, kept, vectors.conj())
        return np.asarray(size[:, None] * filtered / size[None, :])

    def directions(self) -> tuple[FloatArray, ComplexArray]:
        """Return eigenvalues, rising, and vectors of the spectra in units of their noise."""
        size = np.sqrt(self.noise)
        values, vectors = np.linalg.eigh(self.matrix / (size[:, None] * size[None, :]))
        return np.asarray(values), np.asarray(vectors)

    def left(self) -> ComplexArray:
        """Return the spectra of the error of that guess, (q, 2, 2)."""
        # Of a Gaussian signal in white noise: gain times the noise.
        return np.asarray(self.gains() * self.noise[None, None, :])


def surface_spectra(
    speed: list[FloatArray], torque: list[FloatArray], step: float, longest: float
) -> Spectra:
    """Return the spectra of stretches without gaps.

    Parameters
    ----------
    speed, torque : list of array
        Stretches of both, SI.
    step : float
        s.
    longest : float
        Of the pieces into which stretches are cut, s.
    """
    import scipy.signal

    size = min(int(longest / step), *(data.size for data in speed))
    window = np.hanning(size)
    total, count = np.zeros((size // 2 + 1, 2, 2), dtype=complex), 0
    for first, second in zip(speed, torque, strict=True):
        for begin in range(0, first.size - size + 1, max(1, size // 2)):
            cut = [data[begin : begin + size] for data in (first, second)]
            both = np.stack(
                [np.fft.rfft(window * scipy.signal.detrend(data)) for data in cut], axis=-1
            )
            total += both[:, :, None] * both[:, None, :].conj()
            count += 1
    matrix = total / count * (2.0 * step / (window**2).sum())
    frequency = np.fft.rfftfreq(size, step)
    top = frequency[-1]
    band = (frequency > _FLOOR[0] * top) & (frequency < _FLOOR[1] * top)
    densities = np.real(np.stack([matrix[band, i, i] for i in (0, 1)]))
    # Lines of the motion stand above the floor: the lower half of it is the noise.
    noise = np.quantile(densities, 0.4, axis=1)
    whole = np.real(np.stack([matrix[:, i, i] for i in (0, 1)]))
    noise = np.maximum(noise, 1e-12 * whole.max(axis=1) + 1e-30)
    floor = np.asarray(noise, dtype=np.float64)
    return Spectra(np.asarray(frequency), matrix, floor, 0.5 * count + 0.5)


def extended(data: FloatArray, more: int) -> tuple[FloatArray, float]:
    """Return a stretch about its mean, led on to nothing at both ends, and the mean."""
    mean = float(data.mean())
    wide = np.pad(data - mean, more, mode="reflect", reflect_type="odd")
    fade = 0.5 - 0.5 * np.cos(np.pi * np.arange(more) / more)
    wide[:more] *= fade
    wide[wide.size - more :] *= fade[::-1]
    return wide, mean


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of a recording, transformed, its noise held back.

    Attributes
    ----------
    where : slice
        Of the record.
    s : array, (q,)
        i ω of the frequencies that are kept, 1/s.
    speed, torque : array, (q,)
        Fourier coefficients of both.
    means : (float, float)
        Of both.
    more : int
        Samples added at each end.
    size : int
        Of the transform.
    weight : array, (k,)
        Weight on bit over its mean, which the bit's torque follows; 1 where it is not known.
    """

    where: slice
    s: ComplexArray
    speed: ComplexArray
    torque: ComplexArray
    means: tuple[float, float]
    more: int
    size: int
    weight: FloatArray

    def back(self, coefficients: ComplexArray, mean: float) -> FloatArray:
        """Return what some coefficients are in time."""
        whole = np.zeros(self.size // 2 + 1, dtype=complex)
        whole[: coefficients.size] = coefficients
        data = np.fft.irfft(whole, self.size)
        length = self.where.stop - self.where.start
        return np.asarray(mean + data[self.more : self.more + length])


def transformed(
    speed: FloatArray,
    torque: FloatArray,
    where: slice,
    step: float,
    spectra: Spectra,
    reach: float,
    highest: float,
    weight: FloatArray | None = None,
) -> Stretch:
    """Return a stretch ready to be carried down a string.

    Parameters
    ----------
    speed, torque : array
        Of the whole record.
    where : slice
        The stretch.
    step : float
        s.
    spectra : Spectra
        Of the record.
    reach : float
        Seconds that are added at each end.
    highest : float
        Hz, up to which coefficients are kept, falling off over the last fifth.
    weight : array, optional
        Of the whole record: see `Stretch`.
    """
    import scipy.fft

    length = where.stop - where.start
    more = min(int(reach / step), length - 1)
    wide = [extended(data[where], more) for data in (speed, torque)]
    size = scipy.fft.next_fast_len(length + 2 * more, real=True)
    frequency = np.fft.rfftfreq(size, step)
    kept = frequency <= highest
    found = np.stack([np.fft.rfft(data, size)[kept] for data, _ in wide], axis=-1)
    gains = spectra.gains()
    flat = gains.reshape(gains.shape[0], 4)
    at = np.stack(
        [
            np.interp(frequency[kept], spectra.frequency, part)
            for column in flat.T
            for part in (column.real, column.imag)
        ],
        axis=-1,
    )
    filters = (at[:, 0::2] + 1j * at[:, 1::2]).reshape(-1, 2, 2)
    # Slow changes are of the set point, not of the bit: they pass.
    slow = frequency[kept] < 2.0 * spectra.frequency[1]
    filters[slow] = np.eye(2)
    found = np.einsum("qij,qj->qi", filters, found)
    edge = np.clip((highest - frequency[kept]) / (0.2 * highest), 0.0, 1.0)
    found = found * (0.5 - 0.5 * np.cos(np.pi * edge))[:, None]
    s = np.asarray(2j * np.pi * frequency[kept])
    means = wide[0][1], wide[1][1]
    load = np.ones(length) if weight is None else weight[where]
    return Stretch(where, s, found[:, 0], found[:, 1], means, more, size, load)


@dataclass(frozen=True)
class Carrier:
    """How speed and torque at the top become those at the bit.

    Attributes
    ----------
    line : Line
        The string in torsion.
    inertia : float
        Of the drive where its own torque is measured, kg m²; 0 where that in the pipe is.
    lag : float
        By which the torque comes later than the speed, s.
    """

    line: Line
    inertia: float = 0.0
    lag: float = 0.0

    def matrix(self, s: ComplexArray) -> ComplexArray:
        """Return what (speed, torque) at the top is multiplied by, (q, 2, 2)."""
        at = np.where(s == 0.0, 1j * _NEARLY_NOTHING, s)
        m = self.line.transfer(at)
        # u' = m00 u − m01 T, T' = −m10 u + m11 T, and u = speed over s.
        down = np.stack(
            [
                np.stack([m[..., 0, 0], -at * m[..., 0, 1]], axis=-1),
                np.stack([-m[..., 1, 0] / at, m[..., 1, 1]], axis=-1),
            ],
            axis=-2,
        )
        in_time = np.exp(np.minimum(np.abs(at) * self.lag, 50.0) * 1j * np.sign(at.imag))
        pipe = np.zeros((*at.shape, 2, 2), dtype=complex)
        pipe[..., 0, 0] = 1.0
        pipe[..., 1, 0] = -self.inertia * at
        pipe[..., 1, 1] = in_time
        return np.asarray(down @ pipe)

    def at_bit(self, stretch: Stretch) -> tuple[FloatArray, FloatArray]:
        """Return speed and torque at the bit of a stretch, rad/s and N m."""
        m = self.matrix(stretch.s)
        steady = self.matrix(np.zeros(1, dtype=complex))[0].real
        top = np.stack([stretch.speed, stretch.torque], axis=-1)
        below = np.einsum("qij,qj->qi", m, top)
        mean = steady @ np.array(stretch.means)
        return stretch.back(below[:, 0], float(mean[0])), stretch.back(below[:, 1], float(mean[1]))

    def spread(self, spectra: Spectra, highest: float) -> tuple[FloatArray, FloatArray]:
        """Return error spectra of speed and torque at the bit up to a frequency, and signal's.

        Both (q, 2), one-sided, per Hz.
        """
        kept = spectra.frequency <= highest
        m = self.matrix(np.asarray(2j * np.pi * spectra.frequency[kept]))
        gains = spectra.gains()[kept]
        signal = gains @ spectra.matrix[kept]
        both = [
            np.real(np.einsum("qij,qjk,qik->qi", m, part, m.conj()))
            for part in (spectra.left()[kept], signal)
        ]
        return both[0], both[1]


def best_highest(carrier: Carrier, spectra: Spectra, step: float) -> float:
    """Return the frequency up to which carrying down the bit's speed gains more than it costs."""
    most = min(_MOST_HERTZ, 0.4 / step)
    error, signal = (part[:, 0] for part in carrier.spread(spectra, most))
    frequency = spectra.frequency[: error.size]
    left = signal.sum() - np.cumsum(signal) + np.cumsum(error)
    least = max(2, int(np.argmin(left[2:])) + 2)
    return float(max(frequency[least], min(0.5, most)))
