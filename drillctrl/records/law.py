"""A bit's torque over its speed, as a recording carried down the string shows it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray


class BitLaw(NamedTuple):
    """Torque that falls as the bit turns faster: level + drop · exp(−speed/decay).

    Attributes
    ----------
    level : float
        Of a fast bit, N m.
    drop : float
        By which a bit that just turns has more, N m.
    decay : float
        Speed over which that falls, rad/s.
    """

    level: float
    drop: float
    decay: float

    def torque(self, speed: FloatArray) -> FloatArray:
        """Return the torque at speeds above zero, N m."""
        return np.asarray(self.level + self.drop * np.exp(-speed / self.decay))

    def distance(
        self, speed: FloatArray, torque: FloatArray, units: tuple[float, float]
    ) -> FloatArray:
        """Return how far points lie from the law, a bit that stands still included.

        Parameters
        ----------
        speed, torque : array
            At the bit, rad/s and N m.
        units : (float, float)
            Of both: what is one off.
        """
        turning = np.maximum(speed, 0.0)
        slope = self.drop / self.decay * np.exp(-turning / self.decay)
        beside = (torque - self.torque(turning)) / np.hypot(units[1], slope * units[0])
        still = speed / units[0]
        # On either branch it vanishes, and far from one it is the distance from the other.
        both = still * beside / np.sqrt(still**2 + beside**2 + 1e-30)
        holds = torque < self.level + self.drop
        near = np.where(holds, both, np.where(np.abs(beside) < np.abs(both), beside, both))
        return np.where((speed < 0.0) & holds, still, np.where(holds, near, beside))


def first_law(speed: FloatArray, torque: FloatArray) -> BitLaw:
    """Return a first guess of the law from points at the bit."""
    fast = speed > np.quantile(speed, 0.7)
    level = float(np.median(torque[fast]))
    most = float(np.quantile(torque, 0.98))
    return BitLaw(max(level, 1.0), max(most - level, 0.05 * abs(level) + 1.0), 5.0)
