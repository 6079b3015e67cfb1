"""Swings of the bit's speed, what the bit answers to them, and their loops."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.text import finite_or_none
from drillctrl.base.workers import spread_out
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.designs.drilling import Drilling
from drillctrl.drilling.case import Case
from drillctrl.motion.loop import torsional_system
from drillctrl.motion.response import FEWEST_PERIODS, TOLERANCE
from drillctrl.motion.swing import mode_at
from drillctrl.motion.torsion import TorsionalMode, torsional_modes
from drillctrl.synthesis.descent import Objective
from drillctrl.synthesis.family import LoopFamily, loop_family

# Errors of H, over the torque per speed of the string, with which nothing is designed.
UNKNOWN = 0.25
# Cost of gains on their bounds, over the largest of these.
_EFFORT = 0.01


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
        return self.error < UNKNOWN

    @property
    def answers(self) -> tuple[complex, ...]:
        """H and what lies at its error from it with less damping or another spring."""
        if self.error <= TOLERANCE:
            return (self.response,)
        return tuple(self.response + self.error * turn for turn in (-1.0, 1j, -1j))

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields; dimensionless."""
        return {
            "point": self.point,
            "mode": self.mode,
            "amplitude": self.amplitude,
            "frequency": self.frequency,
            "response_re": finite_or_none(self.response.real),
            "response_im": finite_or_none(self.response.imag),
            "response_error": finite_or_none(self.error),
            "growth_rate": finite_or_none(self.growth),
            "growth_rate_error": finite_or_none(self.growth_error),
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
