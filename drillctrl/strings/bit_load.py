"""What a bit that cuts does to the torsion of its string, for the design of a drive.

On its axial orbit it answers a change of its speed with a torque, H, as a damper and a spring of
its own, and shakes the string by the torque of the orbit, whatever the drive does. What is left of
that at the bit is the speed S/(Z + H), with Z the impedance that string and drive show it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.line import Line
from drillctrl.strings.slopes import ModeSlope, bit_impedance

# Share of a frequency over which the power of the shaking is evened out: where its peaks lie is
# known no better.
_EVEN = 0.1
# Hz between which the shaking is looked at: below it is no vibration, above hardly felt.
_LOWEST, _HIGHEST, _STEP = 0.03, 15.0, 2e-3
# Power of what else shakes it, evenly over frequency, over that of the torque: rock that is not
# alike everywhere and kicks set off modes that the orbit does not, which need damping too.
_ROUGH = 0.05
# Seconds of a record in one spectrum, and parts of it whose swings are averaged.
_WINDOW, _PIECES = 40.0, 6


class BitAnswer(NamedTuple):
    """H at one frequency and one swing.

    Attributes
    ----------
    frequency : float
        Hz.
    amplitude : float
        Swing of the bit's speed, share of it.
    value : complex
        H, torque per speed, N m s/rad; a positive real part damps.
    error : float
        Of its modulus, N m s/rad; infinite where a run broke off.
    known : bool
        Whether the error is small enough to design with.
    """

    frequency: float
    amplitude: float
    value: complex
    error: float
    known: bool

    @property
    def least(self) -> complex:
        """H with as much less damping as its error allows."""
        return self.value - self.error


@dataclass(frozen=True, eq=False)
class BitLoad:
    """What a bit does at a point, in SI.

    Attributes
    ----------
    speed : float
        Mean, rad/s.
    answers : tuple of BitAnswer
        By rising frequency.
    spacing : float
        s between the samples of the torque.
    torque : array, (n,)
        Torque on the bit while it turns evenly, less its mean, N m.
    """

    speed: float
    answers: tuple[BitAnswer, ...]
    spacing: float = field(repr=False)
    torque: FloatArray = field(repr=False)

    @property
    def weakest(self) -> tuple[BitAnswer, ...]:
        """Of the known answers at each frequency that which damps least."""
        found: dict[float, BitAnswer] = {}
        for each in self.answers:
            known = found.get(each.frequency, each)
            if each.known and each.least.real <= known.least.real:
                found[each.frequency] = each
        return tuple(found.values())

    def answer(self, hertz: npt.ArrayLike) -> ComplexArray:
        """Return H of all swings that damps least, less its error, (...).

        Beyond the frequencies at which it is known it is that of the nearest; 0 where none is.
        """
        known = self.weakest
        at = np.log(np.maximum(np.asarray(hertz, dtype=float), 1e-9))
        if not known:
            return np.zeros(at.shape, dtype=complex)
        places = np.log([each.frequency for each in known])
        values = np.array([each.least for each in known])
        parts = [np.interp(at, places, part) for part in (values.real, values.imag)]
        return np.asarray(parts[0] + 1j * parts[1])

    def damping_left(self, slope: ModeSlope) -> float:
        """Return what of a mode's critical slope the bit leaves, N m s/rad."""
        at = slope.mode_frequency if slope.frequency is None else slope.frequency
        return slope.slope + float(self.answer(at).real)

    def power(self, hertz: FloatArray) -> FloatArray:
        """Return the power of the torque per Hz, evened out, (N m)²/Hz, (...)."""
        length = min(self.torque.size, round(_WINDOW / self.spacing))
        at, found = scipy.signal.welch(self.torque, 1.0 / self.spacing, nperseg=length)
        whole = scipy.integrate.cumulative_trapezoid(found, at, initial=0.0)
        low, high = hertz / (1.0 + _EVEN), hertz * (1.0 + _EVEN)
        return np.asarray((np.interp(high, at, whole) - np.interp(low, at, whole)) / (high - low))

    def shaking(self, hertz: FloatArray) -> FloatArray:
        """Return the power that laws are designed for, (N m)²/Hz: that, and a little everywhere."""
        return self.power(hertz) + _ROUGH * float(self.torque.var()) / _HIGHEST

    def mean_square(self, line: Line, control: DriveControl) -> float:
        """Return the mean square of the speed that it gives the bit, over that of its mean."""
        hertz = np.arange(_LOWEST, _HIGHEST, _STEP)
        z = _impedance(line, control, hertz) + self.answer(hertz)
        return float((self.shaking(hertz) / np.abs(z) ** 2).sum()) * _STEP / self.speed**2

    def forced_speed(self, line: Line, control: DriveControl | None) -> FloatArray:
        """Return the speed that the torque forces on the bit, beside its mean, rad/s, (n,).

        Parameters
        ----------
        line : Line
            The string in torsion.
        control : DriveControl or None
            Of its drive; None for a top that returns nothing of a wave.
        """
        size = self.torque.size
        hertz = scipy.fft.rfftfreq(size, self.spacing)
        felt = (hertz >= _LOWEST) & (hertz <= _HIGHEST)
        speed = np.zeros(hertz.size, dtype=complex)
        torque = scipy.fft.rfft(self.torque)[felt]
        speed[felt] = torque / (_impedance(line, control, hertz[felt]) + self.answer(hertz[felt]))
        return np.asarray(scipy.fft.irfft(speed, size))

    def forced_swing(self, line: Line, control: DriveControl | None) -> float:
        """Return the swing that is left at the bit, (max − min)/2 over its mean speed."""
        pieces = np.array_split(self.forced_speed(line, control), _PIECES)
        return float(np.mean([np.ptp(piece) for piece in pieces]) / (2.0 * self.speed))

    def main_frequency(self, line: Line, control: DriveControl | None) -> float:
        """Return the frequency at which the bit is forced most, Hz."""
        speed = np.abs(scipy.fft.rfft(self.forced_speed(line, control))) ** 2
        hertz = scipy.fft.rfftfreq(self.torque.size, self.spacing)
        whole = np.cumsum(speed)
        low, high = hertz / (1.0 + _EVEN), hertz * (1.0 + _EVEN)
        return float(hertz[np.argmax(np.interp(high, hertz, whole) - np.interp(low, hertz, whole))])


def _impedance(line: Line, control: DriveControl | None, hertz: FloatArray) -> ComplexArray:
    s = np.asarray(2j * np.pi * hertz, dtype=complex)
    if control is not None:
        return bit_impedance(line, control, s)
    return np.asarray(line.bit_stiffness(s, s * line.wave_impedance) / s)
