"""What a fit to a recording says, as values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from drillctrl.base.text import finite_or_none
from drillctrl.records.law import BitLaw
from drillctrl.records.peaks import Peak
from drillctrl.records.surface import Carrier
from drillctrl.strings.line import Line

# What is less well known than this is not known (95 %, relative).
_KNOWN = 0.34
# And of what is less well known than this nothing is.
_SEEN = 1e3


@dataclass(frozen=True)
class Estimate:
    """A number that was fitted.

    Attributes
    ----------
    value : float
        In SI units.
    low, high : float
        Its 95 % interval.
    """

    value: float
    low: float
    high: float

    @property
    def relative(self) -> float:
        """Half the interval over the value."""
        return (self.high - self.low) / (2.0 * abs(self.value)) if self.value else math.inf

    @property
    def known(self) -> bool:
        """Whether the record says it to a third."""
        return self.relative < _KNOWN

    @property
    def seen(self) -> bool:
        """Whether the record says anything of it."""
        return self.relative < _SEEN

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        return {
            "value": self.value,
            "low": finite_or_none(self.low),
            "high": finite_or_none(self.high),
            "known": self.known,
        }


@dataclass(frozen=True, eq=False)
class RecordFit:
    """A string and a bit's law that were fitted to a recording.

    Attributes
    ----------
    stiffness, inertia : Estimate
        Effective: of the string lumped to one spring and one disc, N m/rad and kg m².
    damping : Estimate
        Viscous, over the inertia, 1/s.
    level, drop, decay : Estimate
        Of the bit's law, N m, N m and rad/s: level + drop · exp(−speed/decay). The level holds
        friction along the string as well.
    lag : Estimate
        By which the torque comes later than the speed, s; its interval may hold 0.
    factors : (float, float) or None
        Stiffness and inertia over those of the rig that was given.
    modes : tuple of Peak
        Of the fitted string, top held, bit free.
    line : Line
        The fitted string in torsion.
    drive_inertia : float
        That was taken from the torque, kg m².
    used, kept_back : (float, float)
        Parts of the record, s: for the fit, and to check it.
    weight_on_bit : float or None
        That the law is of, N; None where it was not recorded.
    misfit, misfit_kept_back : float
        Mean distance of the bit from its law in both, in units of what noise explains.
    identifiable : bool
        Whether stiffness and inertia are known to a third, and so the string.
    reasons : tuple of str
        What the record does not say, and why.
    """

    stiffness: Estimate
    inertia: Estimate
    damping: Estimate
    level: Estimate
    drop: Estimate
    decay: Estimate
    lag: Estimate
    factors: tuple[float, float] | None
    modes: tuple[Peak, ...]
    line: Line
    drive_inertia: float
    used: tuple[float, float]
    kept_back: tuple[float, float]
    weight_on_bit: float | None
    misfit: float
    misfit_kept_back: float
    identifiable: bool
    reasons: tuple[str, ...]

    @property
    def law(self) -> BitLaw:
        """The bit's law."""
        return BitLaw(self.level.value, self.drop.value, self.decay.value)

    @property
    def carrier(self) -> Carrier:
        """What carries speed and torque down to the bit."""
        return Carrier(self.line, self.drive_inertia, self.lag.value)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        names = ("stiffness", "inertia", "damping", "level", "drop", "decay", "lag")
        return {
            **{name: getattr(self, name).to_dict() for name in names},
            "factors": None
            if self.factors is None
            else dict(zip(("stiffness", "inertia"), self.factors, strict=True)),
            "modes": [mode._asdict() for mode in self.modes],
            "identifiable": self.identifiable,
            "reasons": list(self.reasons),
            "used": list(self.used),
            "kept_back": list(self.kept_back),
            "weight_on_bit": self.weight_on_bit,
            "misfit": self.misfit,
            "misfit_kept_back": finite_or_none(self.misfit_kept_back),
        }
