"""The drive as a recording shows it: what it returns of a wave, from speed and torque alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.records.surface import Spectra

# Hz; beyond, drives are stiff discs.
_LOW, _HIGH = 0.05, 5.0
_CLEAR = 10.0


@dataclass(frozen=True, eq=False)
class DriveSeen:
    """Impedance of a drive where the string shook it enough to tell.

    Attributes
    ----------
    frequency : array, (q,)
        Hz.
    impedance : array, (q,)
        Torque per speed, N m s, of what the string meets at its top.
    error : array, (q,)
        Its relative standard error.
    pipe : float or None
        Impedance of the pipe, N m s.
    """

    frequency: FloatArray
    impedance: ComplexArray
    error: FloatArray
    pipe: float | None

    @property
    def reflection(self) -> FloatArray | None:
        """What is returned of a wave, (q,); None where the pipe is not known."""
        if self.pipe is None:
            return None
        return np.asarray(np.abs((self.impedance - self.pipe) / (self.impedance + self.pipe)))

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        reflection = self.reflection
        return {
            "frequencies": self.frequency.tolist(),
            "impedance": [{"real": z.real, "imag": z.imag} for z in self.impedance.tolist()],
            "error": self.error.tolist(),
            "pipe_impedance": self.pipe,
            "magnitudes": None if reflection is None else reflection.tolist(),
        }


def drive_seen(spectra: Spectra, inertia: float, lag: float, pipe: float | None) -> DriveSeen:
    """Return the drive that a recording shows.

    The bit alone moves speed and torque, so their ratio is the drive's; it is taken where both
    rise clearly above their noise, each with its own.

    Parameters
    ----------
    spectra : Spectra
        Of speed and torque.
    inertia : float
        Between measured torque and pipe, kg m².
    lag : float
        Of the torque, s.
    pipe : float or None
        Impedance of the uppermost pipe, N m s.
    """
    values, vectors = spectra.directions()
    top = vectors[..., 1] * np.sqrt(spectra.noise)
    frequency = spectra.frequency
    own = np.abs(vectors[..., 0, 1]) ** 2 * (values[..., 1] - 1.0)
    kept = (frequency >= _LOW) & (frequency <= _HIGH) & (own > _CLEAR)
    s = 2j * np.pi * frequency[kept]
    ratio = top[kept, 1] / top[kept, 0]
    impedance = -(ratio * np.exp(lag * s) - inertia * s)
    error = np.abs(ratio) / np.sqrt(spectra.averages * own[kept]) / np.abs(impedance)
    return DriveSeen(frequency[kept], np.asarray(impedance), np.asarray(error), pipe)
