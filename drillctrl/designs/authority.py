"""How much of the bounds a design on the drilling motion uses: shares of them, tried by runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.workers import spread_out
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.controlled_swings import ControlledSwing, controlled_swings
from drillctrl.designs.drilling import Drilling
from drillctrl.designs.swings import Swing, cost_of_gains, swing_families
from drillctrl.designs.trials import MORE_STARTS, STARTS, UNDER_WAY, Trial, trial_run
from drillctrl.designs.verdict import FAILURES, Verdict, judge, with_engagement
from drillctrl.drilling.case import Case
from drillctrl.motion.torsion import torsional_modes
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import Figures
from drillctrl.simulation.starts import Start
from drillctrl.synthesis import problem
from drillctrl.synthesis.objectives import Requirements, WorstLoop
from drillctrl.synthesis.problem import Solution

# Largest swings of two candidates that are alike, and that are far apart.
_ALIKE, _APART = 0.02, 0.1
# Gains that differ by less than this share of their bounds are the same.
_SAME = 1e-3


@dataclass(frozen=True, eq=False)
class Candidate:
    """Gains within a share of the bounds, and what became of them.

    Attributes
    ----------
    share : float
        Of the bounds.
    solution : Solution
        The gains, with the evidence that none within that share let swings decay sooner.
    growth : float
        Largest growth rate of the torsional loop over all swings.
    met : bool
        Whether the requirements are met on the torsional loop.
    swings : tuple of ControlledSwing
        Each swing whose H is known.
    verdict : Verdict or None
        Of trial runs.
    """

    share: float
    solution: Solution
    growth: float
    met: bool
    swings: tuple[ControlledSwing, ...]
    verdict: Verdict | None = None

    @property
    def in_band(self) -> bool:
        """Whether every motion is near the frequency at which the bit's answer was measured."""
        return all(each.in_band for each in self.swings)

    @property
    def spoils(self) -> bool:
        """Whether a mode grows that was left alone without control."""
        return any(each.spoils for each in self.swings)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """The runs, if there were any."""
        return () if self.verdict is None else self.verdict.trials

    @property
    def harmful(self) -> bool:
        """Whether runs showed that it does harm."""
        return self.verdict is not None and self.verdict.harm

    @property
    def score(self) -> tuple[bool, int, float]:
        """What runs showed, the worse the larger: harm, how it ended, largest swing."""
        assert self.verdict is not None
        ends = [trial.controlled for trial in self.trials if trial.start not in UNDER_WAY]
        largest = max(np.inf if end.swing is None else end.swing for end in ends)
        severity = max(FAILURES.get(end.outcome, 0) for end in ends)
        return (self.verdict.harm, severity, largest)


def candidates(
    case: Case,
    objective: Drilling,
    swings: Sequence[Swing],
    structure: FeedbackStructure,
    requirements: Requirements,
    seed: int,
    shares: Sequence[float],
) -> list[Candidate]:
    """Return the gains of slowest decay made fastest within falling shares of the bounds.

    Left out are gains that take a mode out of the band of frequencies for which the bit's
    answer was measured, or make another grow, except where all do.
    """
    frequency = torsional_modes(case)[0].root.imag
    found: list[Candidate] = []
    for share in shares:
        within = _scaled(structure, share)
        families = swing_families(case, objective, swings, within)
        cost = cost_of_gains(families, frequency)
        solution = problem.solve(families[0], WorstLoop(), requirements, families[1:], seed, cost)
        gains = solution.gains
        width = within.upper - within.lower
        if found and (np.abs(gains - found[-1].solution.gains) < _SAME * width).all():
            continue
        growth = max(family.exact(gains) for family in families)
        met = all(problem.meets(family, gains, requirements) for family in families)
        made = controlled_swings(case, objective, swings, structure, gains)
        found.append(Candidate(share, solution, growth, met, made))
    return [each for each in found if each.in_band and not each.spoils] or found[-1:]


def _scaled(structure: FeedbackStructure, share: float) -> FeedbackStructure:
    """Return the structure with the bounds of its free gains scaled."""

    def scaled(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        factor = np.where(low < high, share, 1.0)
        return low * factor, high * factor

    (a, b), (c, d) = (
        scaled(structure.K1_lower, structure.K1_upper),
        scaled(structure.K2_lower, structure.K2_upper),
    )
    return replace(structure, K1_lower=a, K1_upper=b, K2_lower=c, K2_upper=d)


def irregular(order: Sequence[Candidate]) -> bool:
    """Whether runs differ so much that gains in between may do better than the best."""
    swings = [trial.controlled.swing for each in order for trial in each.trials]
    smallest = min((swing for swing in swings if swing is not None), default=np.inf)
    return order[0].harmful or order[0].score[2] > smallest + _APART


def between(found: Sequence[Candidate], shares: Sequence[float]) -> list[float]:
    """Return the shares that lie between those of the candidates."""
    first = max(each.share for each in found)
    return [share / np.sqrt(2.0) for share in shares if share <= first]


def tried(
    case: Case,
    objective: Drilling,
    structure: FeedbackStructure,
    found: Sequence[Candidate],
    free_growth: float,
    surroundings: Mapping[str, Any],
    executor: Executor | None,
    uncontrolled: dict[str, Figures],
) -> list[Candidate]:
    """Return the candidates after trial runs, the one to take first.

    A candidate counts as what its worst start leads to; among those alike as what the one with
    about twice its gains leads to, so that it stands that; among those the one of fastest decay
    is taken. The first has been tried from more starts, and at the other points of the objective
    it does no harm either. ``uncontrolled`` takes what becomes of the case's starts without
    control, and is asked before they are run again.
    """

    def judged(
        there: Case, some: Sequence[Candidate], starts: Sequence[Start]
    ) -> list[tuple[Trial, ...]]:
        free = uncontrolled if there is case else {}
        new = [(there, start) for start in starts if start.name not in free]
        free.update(spread_out(executor, _free, new))
        tasks = [
            (i, there, structure.gains(each.solution.gains), structure, free, surroundings, start)
            for i, each in enumerate(some)
            for start in starts
        ]
        runs = list(spread_out(executor, _try, tasks))
        order = {start.name: place for place, start in enumerate(starts)}
        runs.sort(key=lambda run: (run[0], order[run[1].start.name]))
        return [tuple(trial for i, trial in runs if i == place) for place in range(len(some))]

    def verdict(candidate: Candidate, trials: tuple[Trial, ...]) -> Candidate:
        growth = candidate.growth, free_growth
        return replace(candidate, verdict=judge(trials, False, growth))

    new = [each for each in found if each.verdict is None]
    made = iter(judged(case, new, STARTS))
    known = [verdict(each, next(made)) if each.verdict is None else each for each in found]
    while True:
        order = _ranked(known)
        best = order[0]
        before = known[best].trials
        if len(before) > len(STARTS) or known[best].harmful:
            break
        (more,) = judged(case, [known[best]], MORE_STARTS)
        known[best] = verdict(known[best], before + more)
        for there in objective.around(case)[1:]:
            if known[best].harmful:
                break
            (runs,) = judged(there, [known[best]], STARTS)
            elsewhere = judge(runs, False, (known[best].growth, free_growth))
            if elsewhere.harm:
                reason = f"{_place(there)}: {elsewhere.reason}"
                known[best] = replace(known[best], verdict=replace(elsewhere, reason=reason))
    first = known[best]
    if first.verdict is not None and first.verdict.recommended and not _engaged(first):
        (runs,) = judged(case, [first], UNDER_WAY)
        known[best] = replace(first, verdict=with_engagement(first.verdict, runs))
    return [known[i] for i in order]


def _engaged(candidate: Candidate) -> bool:
    """Whether control was switched on under way already."""
    return any(trial.start in UNDER_WAY for trial in candidate.trials)


def _free(task: tuple[Case, Start]) -> tuple[str, Figures]:
    case, start = task
    return start.name, trial_run(case, None, start)


def _try(
    task: tuple[
        int,
        Case,
        tuple[FloatArray, FloatArray],
        FeedbackStructure,
        Mapping[str, Figures],
        Mapping[str, Any],
        Start,
    ],
) -> tuple[int, Trial]:
    index, case, gains, structure, free, surroundings, start = task
    controller = Controller(structure, *gains, **surroundings)
    return index, Trial(start, trial_run(case, controller, start), free[start.name])


def _ranked(known: Sequence[Candidate]) -> list[int]:
    """Return the places of the candidates, the best first; those with more gains come before."""

    def alike(i: int) -> tuple[int, float]:
        # In steps, so that what is alike is decided by what comes next.
        _, severity, swing = known[i].score
        return severity, float(np.ceil(swing / _ALIKE)) if np.isfinite(swing) else swing

    def rank(i: int) -> tuple[bool, bool, tuple[int, float], tuple[int, float], float]:
        # Beside it what about twice the gains would lead to.
        more = alike(max(i - 1, 0))
        return known[i].score[0], not known[i].met, alike(i), more, known[i].growth

    return sorted(range(len(known)), key=rank)


def _place(there: Case) -> str:
    _, point = there.physics("a trial run")
    return f"at ω0 = {point.omega0:.4g}, δ0 = {point.delta0:.4g}, ψ = {point.psi:.4g}"
