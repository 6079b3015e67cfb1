"""A bit's torque that falls as it turns faster, and the speeds from which modes stand that."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drillctrl.base.errors import checked_number


@dataclass(frozen=True)
class FallingTorque:
    """A torque of drop · exp(−speed/decay) beside what does not fall, as of `Stribeck`.

    The defaults are a guess at a worn bit in hard rock; replace them by what the bit shows.

    Attributes
    ----------
    drop : float
        N m.
    decay : float
        rad/s.

    Raises
    ------
    InputError
        If a value is not positive.
    """

    drop: float = 2000.0
    decay: float = 5.0

    def __post_init__(self) -> None:
        checked_number("drop", self.drop, 0.0, 1e7, open_low=True)
        checked_number("decay", self.decay, 0.0, 1e4, open_low=True)

    def slope(self, speed: float) -> float:
        """Return by how much the torque falls per unit of speed at a rotary speed, N m s/rad."""
        return self.drop / self.decay * math.exp(-speed / self.decay)

    def threshold_speed(self, slope: float) -> float:
        """Return the speed above which the torque falls less steeply than a slope, rad/s.

        Infinite where that slope is not positive, 0 where it is never exceeded.
        """
        if slope <= 0.0:
            return math.inf
        return max(0.0, self.decay * math.log(self.drop / (self.decay * slope)))
