"""Damping of the torsional modes on the motion that is drilled with, as what a design wants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import checked_integer, checked_number
from drillctrl.base.text import finite_or_none
from drillctrl.base.workers import spread_out
from drillctrl.delay.structure import FeedbackStructure, no_control
from drillctrl.delay.system import DelaySystem
from drillctrl.designs.worst_case import cases_in_box, errors_of
from drillctrl.drilling.case import Case
from drillctrl.motion.loop import torsional_system
from drillctrl.motion.response import FEWEST_PERIODS, TOLERANCE, bit_response
from drillctrl.motion.swing import mode_at
from drillctrl.motion.torsion import TorsionalMode, torsional_modes
from drillctrl.spectrum.roots import dominant_roots
from drillctrl.synthesis.descent import Objective
from drillctrl.synthesis.family import LoopFamily, loop_family
from drillctrl.synthesis.objectives import WorstLoop

ASKED = "it was asked for"
_AMPLITUDES = (0.03, 0.1, 0.2, 0.3)
# Errors of H, over the torque per speed of the string, with which nothing is designed.
_UNKNOWN = 0.25
# Where H of one frequency stands for that of another, over it.
_BAND = (0.5, 2.0)
# Modes that a root of the loop may belong to; growth above that is no rounding.
_MODES, _GROWS = 20, 1e-6
# Share of the frequency by which a root moves before H is measured anew there.
_MOVED = 0.1
# Cost of gains on their bounds, over the largest of these.
_EFFORT = 0.01


@dataclass(frozen=True)
class Drilling(WorstLoop):
    """The slowest decay of torsional modes on the motion that is drilled with.

    The bit, on its axial orbit, answers a swing of its speed with a torque (`bit_response`);
    what is minimised is the largest growth rate of the torsional loop with that answer, over
    all swings up to a kick, and all answers within their errors. How much of the bounds is
    used is decided by trial runs.

    Attributes
    ----------
    kick : float
        Largest swing of the bit's speed, share of it, in (0, 0.95].
    modes : int
        So many of the slowest torsional modes.
    psi, delta0, omega0, depth, mud : float
        Relative errors, 0 to 0.9, of the point and of a real string's length and mud, as in
        `WorstCase`: motions are looked at there too.
    """

    kick: float = 0.45
    modes: int = 1
    psi: float = 0.0
    delta0: float = 0.0
    omega0: float = 0.0
    depth: float = 0.0
    mud: float = 0.0
    name = "drilling"

    def __post_init__(self) -> None:
        checked_number("kick", self.kick, 0.0, 0.95, open_low=True)
        checked_integer("modes", self.modes, 1, 20)
        for name, size in errors_of(self).items():
            checked_number(f"{name} error", size, 0.0, 0.9)

    def around(self, case: Case) -> tuple[Case, ...]:
        """Return all cases looked at, the given one first."""
        return cases_in_box(self, case)

    @property
    def amplitudes(self) -> tuple[float, ...]:
        """Swings at which the bit's answer is measured."""
        return (*(a for a in _AMPLITUDES if a < 0.9 * self.kick), self.kick)


@dataclass(frozen=True)
class Swing:
    """What becomes of a torsional mode at one swing of the bit's speed.

    Attributes
    ----------
    point : int
        Of `Drilling.around`, 0 for the point itself.
    mode : int
        1 for the slowest.
    amplitude : float
        A, share of the rotary speed.
    frequency : float
        At which H was measured.
    response : complex
        H. NaN where a run broke off.
    error : float
        Of its modulus, infinite where a run broke off.
    growth : float
        Rate without control, NaN where H is not known.
    growth_error : float
        Of that rate.
    """

    point: int
    mode: int
    amplitude: float
    frequency: float
    response: complex
    error: float
    growth: float
    growth_error: float

    @property
    def known(self) -> bool:
        """Whether H is known well enough to design with."""
        return self.error < _UNKNOWN

    @property
    def answers(self) -> tuple[complex, ...]:
        """H and what lies at its error from it with less damping or another spring."""
        if self.error <= TOLERANCE:
            return (self.response,)
        return tuple(self.response + self.error * turn for turn in (-1.0, 1j, -1j))


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
                    **_swing_fields(each.swing),
                    "controlled_growth_rate": each.growth,
                    "controlled_frequency": each.frequency,
                    "controlled_mode": each.mode,
                    "in_band": each.in_band,
                }
                for each in self.swings
            ],
            "unknown": [_swing_fields(swing) for swing in self.unknown],
        }


def _swing_fields(swing: Swing) -> dict[str, Any]:
    return {
        "point": swing.point,
        "mode": swing.mode,
        "amplitude": swing.amplitude,
        "frequency": swing.frequency,
        "response_re": finite_or_none(swing.response.real),
        "response_im": finite_or_none(swing.response.imag),
        "response_error": finite_or_none(swing.error),
        "growth_rate": finite_or_none(swing.growth),
        "growth_rate_error": finite_or_none(swing.growth_error),
    }


def largest_growth(swings: Sequence[Swing]) -> float:
    """Return the largest growth rate without control, at its error; NaN where none is known."""
    known = [swing.growth + swing.growth_error for swing in swings if swing.known]
    return max(known, default=float("nan"))


def measured_swings(
    case: Case, objective: Drilling, executor: Executor | None = None
) -> tuple[Swing, ...]:
    """Measure what the bit answers to every mode and swing, at every point.

    Raises
    ------
    InputError
        If nothing is cut, or axial and torsional motion are coupled elsewhere than at the bit.
    """
    tasks = [
        (number, there, mode, amplitude)
        for number, there in enumerate(objective.around(case))
        for mode in torsional_modes(there, objective.modes)
        for amplitude in objective.amplitudes
    ]
    indexed = list(enumerate(tasks))
    return tuple(swing for _, swing in sorted(spread_out(executor, _measure, indexed), key=_first))


def _first(pair: tuple[int, Swing]) -> int:
    return pair[0]


def _measure(indexed: tuple[int, tuple[int, Case, TorsionalMode, float]]) -> tuple[int, Swing]:
    place, (number, case, mode, amplitude) = indexed
    at = mode_at(case, mode, amplitude, most_periods=FEWEST_PERIODS)
    found = at.response
    return place, Swing(
        number, mode.number, found.amplitude if np.isfinite(found.amplitude) else amplitude,
        found.frequency, found.value, found.error, float(at.root.real), at.error,
    )  # fmt: skip


def swing_systems(case: Case, swing: Swing, inputs: Sequence[str]) -> tuple[DelaySystem, ...]:
    """Return the torsional motion with every answer that a swing may have."""
    return tuple(
        torsional_system(case, answer, swing.frequency, inputs) for answer in swing.answers
    )


def swing_families(
    case: Case, objective: Drilling, swings: Sequence[Swing], structure: FeedbackStructure
) -> list[LoopFamily]:
    """Return the loops whose slowest decay is to be made fastest.

    Where no answer is known, they are of the string alone.
    """
    cases = objective.around(case)
    known = [swing for swing in swings if swing.known]
    systems = [s for w in known for s in swing_systems(cases[w.point], w, structure.inputs)]
    if not systems:
        systems = [torsional_system(there, 0j, 1.0, structure.inputs) for there in cases]
    return [loop_family(system, structure) for system in systems]


def cost_of_gains(families: Sequence[LoopFamily], frequency: float) -> Objective:
    """Return what gains cost: a little for their size, and much for moving the frequency.

    The bit's answer is known near one frequency, so that gains which damp the mode there are
    better than those that move it away. To first order a gain moves the mode by ∂s/∂g of the
    loop without it; the cost is the square of the imaginary part over the frequency.

    Parameters
    ----------
    families : sequence of LoopFamily
        Loops with each answer.
    frequency : float
        At which the answers were measured.
    """
    feedback = families[0].feedback
    bound = np.maximum(np.abs(feedback.lower), np.abs(feedback.upper))
    shifts = np.array([_root_slopes(family, frequency).imag for family in families])
    size = _EFFORT * float(bound.max(initial=0.0)) / bound.size

    def cost(gains: FloatArray) -> tuple[float, FloatArray]:
        moved, share = shifts @ gains, gains / bound
        value = float(np.mean(moved**2)) / frequency + size * float(share @ share)
        slope = 2.0 * (moved @ shifts) / (len(shifts) * frequency) + 2.0 * size * share / bound
        return value, slope

    return cost


def _root_slopes(family: LoopFamily, frequency: float) -> ComplexArray:
    """Return ∂s/∂g of the root of the loop without gains that is nearest to iω, (k,)."""
    roots, right = np.linalg.eig(family.system.A0)
    i = int(np.argmin(np.abs(roots - 1j * frequency)))
    left = np.linalg.inv(right)[i]
    delayed = np.exp(-roots[i] * family.lags)
    return np.asarray(
        ((left @ family.drive) * (family.seen @ right[:, i]) * delayed) @ family.spread
    )


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
