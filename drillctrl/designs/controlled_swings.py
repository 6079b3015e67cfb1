"""What gains make of swings of the bit's speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.text import finite_or_none
from drillctrl.delay.structure import FeedbackStructure, no_control
from drillctrl.designs.drilling import Drilling
from drillctrl.designs.swings import Swing, swing_systems
from drillctrl.drilling.case import Case
from drillctrl.motion.response import FEWEST_PERIODS, bit_response
from drillctrl.motion.torsion import torsional_modes
from drillctrl.spectrum.roots import dominant_roots
from drillctrl.synthesis.family import LoopFamily, loop_family

# Where H of one frequency stands for that of another, over it.
_BAND = (0.5, 2.0)
# Modes that a root of the loop may belong to; growth above that is no rounding.
_MODES, _GROWS = 20, 1e-6
# Share of the frequency by which a root moves before H is measured anew there.
_MOVED = 0.1


@dataclass(frozen=True)
class ControlledSwing:
    """What the gains make of a `Swing`.

    Attributes
    ----------
    swing : Swing
        Without control, with H at the frequency of the controlled mode where it moved.
    growth : float
        Rate with control, the largest of any torsional mode for all H within their error.
    frequency : float
        Of that motion.
    mode : int
        Which mode it is by its frequency, that of the swing or another.
    natural : float
        Frequency of that mode without control.
    spoils : bool
        Whether it is another mode, which grows, and faster than any does without control.
    """

    swing: Swing
    growth: float
    frequency: float
    mode: int
    natural: float
    spoils: bool

    @property
    def in_band(self) -> bool:
        """Whether the motion is near enough to the frequency of its mode, about which H holds."""
        low, high = _BAND
        return low * self.natural <= self.frequency <= high * self.natural


@dataclass(frozen=True)
class OnMotion:
    """What gains do on the motion that is drilled with.

    Attributes
    ----------
    why : str
        Why the gains were designed for it.
    share : float
        Of the bounds, within which they are.
    growth : float
        Largest growth rate of the torsional modes over all swings whose H is known.
    growth_without : float
        That without control, at its error; NaN where no H is known.
    swings : tuple of ControlledSwing
        Each of these swings.
    unknown : tuple of Swing
        Swings at which the bit moves too irregularly for H to be known: there runs decide alone.
    """

    why: str
    share: float
    growth: float
    growth_without: float
    swings: tuple[ControlledSwing, ...]
    unknown: tuple[Swing, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields; dimensionless."""
        return {
            "why": self.why,
            "share_of_bounds": self.share,
            "growth_rate": self.growth,
            "growth_rate_without_control": finite_or_none(self.growth_without),
            "swings": [
                {
                    **each.swing.to_dict(),
                    "controlled_growth_rate": each.growth,
                    "controlled_frequency": each.frequency,
                    "controlled_mode": each.mode,
                    "in_band": each.in_band,
                }
                for each in self.swings
            ],
            "unknown": [swing.to_dict() for swing in self.unknown],
        }


def controlled_swings(
    case: Case,
    objective: Drilling,
    swings: Sequence[Swing],
    structure: FeedbackStructure,
    gains: FloatArray,
) -> tuple[ControlledSwing, ...]:
    """Return what gains make of every swing whose answer is known."""
    cases = objective.around(case)
    own = [{m.number: m.root.imag for m in torsional_modes(there, _MODES)} for there in cases]
    off = no_control(structure)
    found = []
    for swing in swings:
        if not swing.known:
            continue
        families = [
            loop_family(system, structure)
            for system in swing_systems(cases[swing.point], swing, structure.inputs)
        ]
        natural = own[swing.point] | {swing.mode: swing.frequency}
        made = [_controlled(family, gains, off, swing, natural) for family in families]
        found.append(max(made, key=lambda each: each.growth))
    return tuple(found)


def _controlled(
    family: LoopFamily,
    gains: FloatArray,
    off: FloatArray,
    swing: Swing,
    natural: Mapping[int, float],
) -> ControlledSwing:
    """Return the slowest vibration of a loop, and whether it is worse than without control."""
    free, roots = dominant_roots(family.loop(off)), dominant_roots(family.loop(gains))
    slowest = _BAND[0] * min(natural.values())
    grows = max(0.0, free[0].real) + _GROWS
    # A string that is held by its drive alone turns as a whole: no vibration unless it grows.
    whole = any(abs(root.imag) < slowest for root in free)
    counted = [r for r in roots if not whole or abs(r.imag) >= slowest or r.real > grows]
    root = (counted or roots)[0]
    frequency = abs(root.imag)
    mode = min(natural, key=lambda m: abs(np.log(max(frequency, 1e-300) / natural[m])))
    spoils = mode != swing.mode and root.real > grows
    return ControlledSwing(swing, root.real, frequency, mode, natural[mode], spoils)


def followed_swings(
    case: Case,
    objective: Drilling,
    swings: Sequence[Swing],
    structure: FeedbackStructure,
    gains: FloatArray,
    **options: Any,
) -> tuple[ControlledSwing, ...]:
    """Return `controlled_swings` with H measured at the frequency that the gains give a mode."""
    cases = objective.around(case)
    moved = []
    for each in controlled_swings(case, objective, swings, structure, gains):
        swing = each.swing
        own = each.in_band and each.mode == swing.mode
        if own and abs(each.frequency - swing.frequency) > _MOVED * swing.frequency:
            found = bit_response(
                cases[swing.point], each.frequency, swing.amplitude,
                ripple=True, most_periods=FEWEST_PERIODS, **options,
            )  # fmt: skip
            if np.isfinite(found.error):
                swing = Swing(
                    swing.point, swing.mode, found.amplitude, each.frequency, found.value,
                    found.error, swing.growth, swing.growth_error,
                )  # fmt: skip
        moved.append(swing)
    return controlled_swings(case, objective, moved, structure, gains)
