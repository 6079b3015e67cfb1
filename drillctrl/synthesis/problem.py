"""From what is wanted of a design to gains: choose the method and run it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.closing import with_channels
from drillctrl.robustness.norm import h_infinity_norm
from drillctrl.robustness.radius import pseudospectral_abscissa
from drillctrl.robustness.transfer import frequency_grid, loop_transfer
from drillctrl.spectrum.semidiscretization import semidiscretize
from drillctrl.synthesis import descent, measures
from drillctrl.synthesis.certificate import OptimalityCertificate, certify_optimality
from drillctrl.synthesis.constrained import certify_sampled, constrained_search
from drillctrl.synthesis.family import LoopFamily
from drillctrl.synthesis.objectives import (
    Exact,
    HInfinity,
    Objective,
    Requirements,
    Robust,
    SemiDiscrete,
    WorstLoop,
)
from drillctrl.synthesis.rounding import hold_multiple_root
from drillctrl.synthesis.search import global_search

# A requirement is met with this relative margin, so that rounding does not break it.
_MARGIN = 1e-6
_CANDIDATES = 3


@dataclass(frozen=True, eq=False)
class Solution:
    """Gains that solve a design problem.

    Attributes
    ----------
    gains : array, (k,)
        Within the bounds.
    optimality : OptimalityCertificate
        What is known of their optimality.
    evaluations : int
        Of all objectives.
    """

    gains: FloatArray
    optimality: OptimalityCertificate
    evaluations: int


def solve(
    family: LoopFamily,
    objective: Objective,
    requirements: Requirements,
    others: Sequence[LoopFamily] = (),
    seed: int = 0,
    cost: descent.Objective | None = None,
) -> Solution:
    """Find the gains of a design.

    Parameters
    ----------
    family : LoopFamily
        Nominal loops.
    objective : Objective
        What is minimised.
    requirements : Requirements
        What must hold as well.
    others : sequence of LoopFamily
        Further loops of a `WorstLoop`.
    seed : int
        Of the starting points.
    cost : callable, optional
        Value and gradient of what is added to the objective.
    """
    search = global_search(family, seed)
    family = search.family or family
    plain = isinstance(objective, Exact) and cost is None
    # What the unconstrained optimum meets is no constraint.
    if plain and meets(family, search.best.gains, requirements):
        gains = hold_multiple_root(family, search.best)
        return Solution(gains, certify_optimality(family, gains, search), search.evaluations)
    goal, excesses = _goal(family, objective, others), _excesses(family, requirements)
    if cost is not None:
        goal = _sum(goal, cost)
    candidates = [basin.gains for basin in search.basins[:_CANDIDATES]]
    found = constrained_search(family, goal, excesses, candidates, seed)
    certificate = certify_sampled(family, goal, excesses, found, seed)
    return Solution(found.gains, certificate, search.evaluations + found.evaluations)


def meets(family: LoopFamily, gains: FloatArray, requirements: Requirements) -> bool:
    """Whether gains meet all requirements, by the quick measures."""
    return all(excess(gains)[0] <= _MARGIN for excess in _excesses(family, requirements))


def reported_value(family: LoopFamily, objective: Objective, gains: FloatArray) -> float | None:
    """Return an objective computed with care; None where it is an exact abscissa."""
    loop = family.loop(gains)
    if isinstance(objective, SemiDiscrete):
        return semidiscretize(loop, objective.m, objective.order).growth_rate
    if isinstance(objective, Robust):
        matrices = family.system.A0, *map(family.system.delayed_matrix, loop.delays)
        weights = [float(np.linalg.norm(matrix, 2)) for matrix in matrices]
        return pseudospectral_abscissa(loop, objective.epsilon, weights)
    if isinstance(objective, HInfinity):
        return norm_between(family, objective, gains)
    return None


def norm_between(family: LoopFamily, between: HInfinity, gains: FloatArray) -> float:
    """Return the H∞ norm of a loop, infinite for an unstable one."""
    chosen = with_channels(family.loop(gains), between.inputs, between.outputs)
    return h_infinity_norm(chosen).value


def input_gain(family: LoopFamily, gains: FloatArray) -> float:
    """Return the peak gain from a disturbance beside the input to the fed-back input."""
    K1, K2 = family.feedback.gains(gains)
    omega = frequency_grid(family.loop(gains))
    loop = np.moveaxis(-loop_transfer(family.system, family.feedback, K1, K2, omega), -1, 0)
    transfer = np.linalg.solve(np.eye(loop.shape[-1]) - loop, loop)
    sampled = float(np.linalg.norm(transfer, 2, axis=(1, 2)).max())
    inverse = measures.inverse_input_gain(family)(gains)[0]
    return max(sampled, 1.0 / inverse if inverse > 0.0 else np.inf)


def _goal(
    family: LoopFamily, objective: Objective, others: Sequence[LoopFamily]
) -> descent.Objective:
    if isinstance(objective, SemiDiscrete):
        return measures.growth_rate(family, objective.m, objective.order)
    if isinstance(objective, WorstLoop):
        return measures.worst_case([family, *others])
    if isinstance(objective, Robust):
        return measures.pseudospectral(family, objective.epsilon)
    if isinstance(objective, HInfinity):
        return _negative(measures.inverse_norm(family, objective.inputs, objective.outputs))
    return family.abscissa


def _sum(measure: descent.Objective, other: descent.Objective) -> descent.Objective:
    def both(gains: FloatArray) -> tuple[float, FloatArray]:
        (a, slope_a), (b, slope_b) = measure(gains), other(gains)
        return a + b, slope_a + slope_b

    return both


def _negative(measure: descent.Objective) -> descent.Objective:
    def negated(gains: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = measure(gains)
        return -value, -gradient

    return negated


def _at_least(measure: descent.Objective, wanted: float) -> descent.Objective:
    def excess(gains: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = measure(gains)
        return 1.0 + _MARGIN - value / wanted, -gradient / wanted

    return excess


def _excesses(family: LoopFamily, requirements: Requirements) -> list[descent.Objective]:
    """Return what must not be positive: each shortfall relative to what is required."""

    def norm(loops: LoopFamily) -> descent.Objective:
        between = requirements.between
        return measures.inverse_norm(loops, between.inputs, between.outputs)

    pairs: list[tuple[float | None, Callable[[LoopFamily], descent.Objective]]] = [
        (requirements.decay, lambda loops: _negative(loops.abscissa)),
        (requirements.stability_radius, measures.distance),
        (_inverse(requirements.input_gain), measures.inverse_input_gain),
        (_inverse(requirements.h_infinity), norm),
    ]
    return [_at_least(measure(family), wanted) for wanted, measure in pairs if wanted is not None]


def _inverse(limit: float | None) -> float | None:
    return None if limit is None else 1.0 / limit
