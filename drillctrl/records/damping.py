"""Damping of a string apart from the form of the bit's law.

At the collars damping does nearly what a slope of the bit's torque does, so a law of a wrong form
spoils it first. Here the law is any smooth one, and the bit that stands still, whose speed is
nothing whatever the law, counts with it. What is carried down is weighted by the covariance of
the noise carried down by the same string; what the noise itself gives to the sum of squares is
then alike for all strings, and no string is preferred because it carries less of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.records.downhole import Prepared, prepare
from drillctrl.records.families import scaled
from drillctrl.records.record import Record
from drillctrl.records.surface import Carrier, Spectra

# The band, Hz: noise that is carried down grows with frequency.
_BAND = 4.0
# A bit slower than these shares of the mean speed stands; both are tried. Means over so many s.
_STANDS, _MEAN = (0.08, 0.05), 0.3
# What is left out between standing and turning, s, and turning slower than a share of the mean.
_BETWEEN, _TURNS = 0.2, 0.2
# The law: a polynomial of this degree.
_DEGREE = 5
# Noise is correlated within blocks of so many s, of no more samples.
_BLOCK, _MOST = 8.0, 160
_ROUNDS, _LEAST_STANDING = (3, 2), 5.0
# Errors that are not the noise's: of a standing bit over the mean speed, of the law over torque.
_STILL, _ROUGH = 0.01, 0.01
# Steps for slopes, and the longest of a round: of ln stiffness, inertia, damping; of the lag, s.
_SMALL = np.array([1e-3, 1e-3, 1e-2, 1e-4])
# Errors of what the fit knows before: of these and of damping next to nothing.
_FIT = np.array([0.01, 0.015, 2.0, 0.02])
_FAR = np.array([0.03, 0.03, 0.7, 0.03])


class _Unfiltered(Spectra):
    """Spectra whose noise is not held back: what is weighted must not be smoothed before."""

    def gains(self) -> ComplexArray:
        """Return what leaves both as they are, (q, 2, 2)."""
        return np.tile(np.eye(2, dtype=complex), (self.frequency.size, 1, 1))


@dataclass(frozen=True, eq=False)
class _Sorted:
    """Samples of a standing and of a turning bit, with what is expected of them."""

    stands: npt.NDArray[np.bool_]
    turns: npt.NDArray[np.bool_]
    expected: FloatArray
    speed: FloatArray
    slope: FloatArray
    law: FloatArray
    rough: FloatArray
    load: FloatArray

    def residuals(self, speed: FloatArray, torque: FloatArray) -> FloatArray:
        """Return the speed of a standing bit, and a turning one's torque less its law's."""
        beside = torque / self.load - self.expected - self.slope * (speed - self.speed)
        return np.where(self.turns, beside, speed)

    def weights(self) -> tuple[FloatArray, FloatArray]:
        """Return how both depend on speed and on torque."""
        one = np.where(self.turns, -self.slope, 1.0)
        return one, np.where(self.turns, 1.0 / self.load, 0.0)


def damping_apart(record: Record, carrier: Carrier, damping: float) -> tuple[float, float] | None:
    """Return the damping of a string, 1/s, and the error of its logarithm.

    Parameters
    ----------
    record : Record
        In which the bit sticks and slips.
    carrier : Carrier
        The string that was fitted.
    damping : float
        Its viscous damping, 1/s.

    Returns
    -------
    (float, float) or None
        None where the bit hardly stands.
    """
    record = record.slower(0.05)
    filtered = prepare(record, carrier)
    spectra = filtered.spectra
    plain = _Unfiltered(spectra.frequency, spectra.matrix, spectra.noise, spectra.averages)
    highest = min(_BAND, 0.4 / record.step)
    wide = prepare(record, carrier, like=replace(filtered, spectra=plain, highest=highest))
    place, found = np.array([0.0, 0.0, 0.0, carrier.lag]), []
    for share, rounds in zip(_STANDS, _ROUNDS, strict=True):
        for _ in range(rounds):
            told = _round(record, carrier, damping, place, filtered, wide, share)
            if told is None:
                return None
            place, error = told
        found.append((float(place[2]), error))
    logs, errors = zip(*found, strict=True)
    apart = 0.5 * (logs[0] - logs[1])
    return float(damping * np.exp(np.mean(logs))), float(np.hypot(max(errors), apart))


def _moved(carrier: Carrier, damping: float, place: FloatArray) -> Carrier:
    stiffer, heavier, more = np.exp(place[:3]).tolist()
    line = scaled(carrier.line, stiffer, heavier, damping * more)
    return replace(carrier, line=line, lag=float(place[3]))


def _points(carrier: Carrier, prepared: Prepared) -> tuple[FloatArray, FloatArray]:
    cut = prepared.margin
    pairs = [carrier.at_bit(stretch) for stretch in prepared.stretches]
    speed, torque = (
        [one[cut : one.size - cut] for one in each] for each in zip(*pairs, strict=True)
    )
    return np.concatenate(speed), np.concatenate(torque)


def _round(
    record: Record,
    carrier: Carrier,
    damping: float,
    place: FloatArray,
    filtered: Prepared,
    wide: Prepared,
    share: float,
) -> tuple[FloatArray, float] | None:
    """Return the next place, and the error of ln damping; None where the bit hardly stands."""
    from scipy.linalg import solve_triangular

    def carried(where: FloatArray) -> tuple[FloatArray, FloatArray]:
        return _points(_moved(carrier, damping, where), wide)

    load = np.concatenate(
        [s.weight[wide.margin : s.weight.size - wide.margin] for s in wide.stretches]
    )
    speed, torque = _points(_moved(carrier, damping, place), filtered)
    sample = _sorted(speed, torque / load, load, share, record.step)
    if sample is None:
        return None
    known = np.flatnonzero(sample.stands | sample.turns)

    def whitened(where: FloatArray, columns: FloatArray) -> FloatArray:
        off = sample.residuals(*carried(where))
        data = np.column_stack([off, columns])
        blocks = _blocks(_moved(carrier, damping, where), wide, sample, known, record.step)
        return np.concatenate(
            [solve_triangular(root, data[block], lower=True) for block, root in blocks]
        )

    now = whitened(place, sample.law)
    none = np.empty((speed.size, 0))
    slopes = np.column_stack(
        [
            (whitened(place + step * axis, none)[:, 0] - now[:, 0]) / step
            for step, axis in zip(_SMALL, np.eye(4), strict=True)
        ]
    )
    # What the law explains is taken out of both.
    basis = np.linalg.qr(now[:, 1:])[0]
    slopes = slopes - basis @ (basis.T @ slopes)
    left = now[:, 0] - basis @ (basis.T @ now[:, 0])
    # What the fit knows of stiffness, inertia and lag holds on.
    known_before = 1.0 / _FIT**2
    inverse = np.linalg.pinv(slopes.T @ slopes + np.diag(known_before), rcond=1e-14)
    apart = place - np.array([0.0, 0.0, 0.0, carrier.lag])
    step = np.clip(-inverse @ (slopes.T @ left + known_before * apart), -_FAR, _FAR)
    scores = np.array([a.T @ b for a, b in _pieces(slopes, left)])
    scores = scores - scores.mean(axis=0)
    spread = inverse @ (scores.T @ scores) @ inverse
    return place + step, float(np.sqrt(max(spread[2, 2], inverse[2, 2])))


def _pieces(slopes: FloatArray, left: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    count = max(8, left.size // (2 * _MOST))
    return zip(np.array_split(slopes, count), np.array_split(left, count), strict=True)


def _sorted(
    speed: FloatArray, torque: FloatArray, load: FloatArray, share: float, step: float
) -> _Sorted | None:
    """Tell where the bit stands and where it turns, with a smooth law of the latter."""
    from numpy.polynomial import Legendre
    from scipy.ndimage import binary_erosion, binary_opening, uniform_filter1d

    mean, between = float(speed.mean()), max(1, round(_BETWEEN / step))
    slow = uniform_filter1d(speed, max(1, int(_MEAN / step))) < share * mean
    slow = binary_opening(slow, iterations=2)
    stands = binary_erosion(slow, iterations=between)
    turns = binary_erosion(~slow, iterations=between) & (speed > _TURNS * mean)
    if stands.sum() * step < _LEAST_STANDING or turns.sum() * step < _LEAST_STANDING:
        return None
    ends = _TURNS * mean, float(np.quantile(speed[turns], 0.995))
    inside = np.clip(speed, *ends)
    law = Legendre.fit(inside[turns], torque[turns], _DEGREE, domain=list(ends))
    expected, slope = law(inside), np.where(inside == speed, law.deriv()(inside), 0.0)
    rough = 1.48 * float(np.median(np.abs(torque - expected)[turns]))
    rough = max(rough, _ROUGH * float(np.abs(torque).mean()))
    columns = np.polynomial.legendre.legvander(
        law.mapparms()[0] + law.mapparms()[1] * inside, _DEGREE
    )
    return _Sorted(
        stands, turns, expected, speed, slope, np.where(turns[:, None], columns, 0.0),
        np.where(turns, rough, _STILL * mean), load,
    )  # fmt: skip


def _blocks(
    carrier: Carrier, wide: Prepared, sample: _Sorted, known: npt.NDArray[np.intp], step: float
) -> Iterator[tuple[npt.NDArray[np.intp], FloatArray]]:
    """Yield blocks of samples, and a root of the covariance of what noise does to them."""
    spectra = wide.spectra
    kept = spectra.frequency <= wide.highest
    frequency = spectra.frequency[kept]
    down = carrier.matrix(np.asarray(2j * np.pi * frequency))
    edge = np.clip((wide.highest - frequency) / (0.2 * wide.highest), 0.0, 1.0)
    size = (0.5 - 0.5 * np.cos(np.pi * edge)) ** 2
    density = np.einsum("qij,j,qkj,q->qik", down, spectra.noise, down.conj(), size)
    count = 2 * (spectra.frequency.size - 1)
    later = np.fft.irfft(density, count, axis=0) * (0.5 * count * spectra.frequency[1])
    one, two = sample.weights()
    length = min(_MOST, max(20, int(_BLOCK / step)))
    for begin in range(0, sample.speed.size, length):
        block = known[(known >= begin) & (known < begin + length)]
        if block.size < 5:
            continue
        lag = block[:, None] - block[None, :]
        a, b = one[block], two[block]
        covariance = (
            np.outer(a, a) * later[lag, 0, 0] + np.outer(a, b) * later[lag, 0, 1]
            + np.outer(b, a) * later[lag, 1, 0] + np.outer(b, b) * later[lag, 1, 1]
        )  # fmt: skip
        yield block, np.linalg.cholesky(covariance + np.diag(sample.rough[block] ** 2))
