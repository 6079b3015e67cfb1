"""Whether gains can be recommended: what their trial runs showed, in one sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.trials import STARTS, USUAL_STARTS, Trial, standing_starts, trial_runs
from drillctrl.drilling.case import Case
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import Figures
from drillctrl.simulation.status import Outcome
from drillctrl.simulation.structure import structure_of

# Differences between two runs below which they are alike: irregular motions repeat their
# figures no better.
_SWING, _STUCK, _FEED = 0.02, 0.02, 0.05
# Swings that are not alike at all, and rates of decay that are alike.
_APART, _RATE = 0.1, 0.01
# Less swing that is good where the bit sticks and slips still.
_HALF = 0.5
# A bit that falls behind bounces ever harder; one that stands still does not.
FAILURES = {Outcome.STALLS: 1, Outcome.LATE: 2, Outcome.TURNS_BACK: 3, Outcome.DIVERGES: 4}
_QUIET = (Outcome.SETTLES, Outcome.ORBIT, Outcome.CHAOTIC, Outcome.BOUNCES)
NO_GAINS = "there is no feedback to try"
LEFT_OUT = "the gains have not been tried on the nonlinear motion"


@dataclass(frozen=True)
class Verdict:
    """What trial runs say of gains.

    Attributes
    ----------
    recommended : bool or None
        None where they were not tried.
    reason : str
        One sentence.
    trials : tuple of Trial
        What was run; empty where nothing was.
    harm : bool
        Whether from some start the motion is worse than without control.
    caution : str or None
        In what it is worse where control need not be on: under way, or with a bit that stands.
    """

    recommended: bool | None
    reason: str
    trials: tuple[Trial, ...] = ()
    harm: bool = False
    caution: str | None = None

    @property
    def refused(self) -> bool:
        """Whether the gains were tried and are not recommended."""
        return self.recommended is False


UNTRIED = Verdict(None, LEFT_OUT)


def try_gains(
    case: Case,
    structure: FeedbackStructure | None,
    K1: FloatArray,
    K2: FloatArray,
    stable: bool,
    *,
    uncontrolled: dict[str, Figures] | None = None,
    spare: bool = False,
    standing: bool = True,
    surroundings: Mapping[str, Any] | None = None,
) -> Verdict:
    """Try gains on the nonlinear motion, and judge them.

    Parameters
    ----------
    case : Case
        What drills, and where.
    structure, K1, K2
        The feedback.
    stable : bool
        Whether the linear loop is.
    uncontrolled, spare
        As in `trial_runs`.
    standing : bool
        Whether gains that are recommended are tried on a bit that stands at first, too.
    surroundings : mapping, optional
        Attributes of the `Controller` that closes the loop: limits, clock, delays.
    """
    if structure is None:
        return Verdict(None, NO_GAINS)
    if not case.drills:
        return Verdict(None, f"{LEFT_OUT}: no nonlinear model of this plant is known")
    try:
        controller = Controller(structure, K1, K2, **(surroundings or {}))
        simulated = structure_of(case)
        controller.gains(simulated.input_names, simulated.output_names)
    except InputError as error:
        return Verdict(None, f"{LEFT_OUT}: the simulator cannot close this loop ({error})")
    trials = trial_runs(case, controller, uncontrolled=uncontrolled, spare=spare)
    verdict = judge(trials, stable)
    if not (standing and verdict.recommended):
        return verdict
    starts = standing_starts(case)
    runs = trial_runs(case, controller, uncontrolled=uncontrolled, spare=spare, starts=starts)
    return with_engagement(verdict, runs, "switch them on once the bit turns")


def judge(
    trials: Sequence[Trial], stable: bool, growth: tuple[float, float] | None = None
) -> Verdict:
    """Say whether gains can be recommended.

    They are refused where from any start they do worse than no control, and where they
    neither stabilise nor do measurable good.

    Parameters
    ----------
    trials : sequence of Trial
        At least one.
    stable : bool
        Whether the linear loop is.
    growth : pair of float, optional
        Largest growth rates of the torsional modes on the drilling motion, with the gains and
        without; that swings die out sooner is a good that the end of a run does not show.
    """
    runs = tuple(trials)
    for trial in runs:
        if (harm := _harm(trial)) is not None:
            return Verdict(False, harm, runs, True)
    # The start at which they do most good says what they are for.
    most = sorted(runs, key=_gained, reverse=True)
    good = next((text for trial in most if (text := _good(trial)) is not None), None)
    settled = [trial for trial in runs if trial.controlled.outcome == Outcome.SETTLES]
    quiet = all(trial.controlled.outcome in _QUIET for trial in runs)
    if not settled and good is None and quiet and growth is not None and _decays(*growth):
        return Verdict(True, _sooner(*growth), runs)
    if not settled and good is None:
        what = "the motion does not settle" if stable else "smooth drilling is not stable"
        return Verdict(False, f"{what}, with no measurable good: {_beside(runs[0])}", runs)
    if len(settled) == len(runs):
        return Verdict(True, f"the motion settles from {starts_text(runs)}", runs)
    if not settled:
        return Verdict(True, f"smooth drilling is not reached, but {good}{_but(runs)}", runs)
    rest = next(trial for trial in runs if trial not in settled)
    small = f"the motion settles from {starts_text(settled)}"
    return Verdict(True, f"{small}, but {_beside(rest)}", runs)


def starts_text(runs: Sequence[Trial]) -> str:
    """Name the starts of runs, those of every trial in short."""
    names = [run.start.name for run in runs]
    texts = list(dict.fromkeys(run.start.text for run in runs))
    if {start.name for start in STARTS} <= set(names):
        usual = {start.text for start in STARTS}
        texts = [USUAL_STARTS, *(text for text in texts if text not in usual)]
    return " and ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)


def with_engagement(
    verdict: Verdict,
    runs: Sequence[Trial],
    advice: str = "switch them on while the bit swings little",
) -> Verdict:
    """Return a verdict with trials in which control is switched on where it need not be.

    Under way, or while the bit stands still. Where gains do worse there than no control, the
    verdict says when to switch them on.
    """
    trials = (*verdict.trials, *runs)
    worse = next((text for trial in runs if (text := _worse(trial)) is not None), None)
    if worse is None or not verdict.recommended:
        return replace(verdict, trials=trials)
    reason = f"{verdict.reason}; but {advice}: {worse}"
    return replace(verdict, reason=reason, trials=trials, caution=worse)


def _but(runs: Sequence[Trial]) -> str:
    """Say what the worst start leads to, where that is far from what the best does."""
    swings = [trial.controlled.swing for trial in runs]
    known = [np.inf if swing is None else swing for swing in swings]
    worst = int(np.argmax(known))
    return f"; {_beside(runs[worst])}" if known[worst] > min(known) + _APART else ""


def _decays(mine: float, free: float) -> bool:
    """Whether swings die out clearly sooner than without control, or die out at all."""
    return mine < 0.0 and mine < free - _RATE


def _sooner(mine: float, free: float) -> str:
    instead = f"{-free:.2g}" if free < 0.0 else "not at all"
    return (
        "they do no harm from any start, and torsional swings decay at a rate of "
        f"{-mine:.2g} instead of {instead}"
    )


def _beside(trial: Trial) -> str:
    """Say what a start led to, with the gains and without."""
    mine, free = trial.controlled, trial.uncontrolled
    text = f"after {trial.start.text} {_what(mine)}"
    return text if free is None else f"{text}; {trial.beside} {_what(free)}"


def _what(found: Figures) -> str:
    text = found.outcome.sentence
    if found.swing is None or found.outcome == Outcome.SETTLES:
        return text
    return f"{text} ({_swing(found)})"


def _worse(trial: Trial) -> str | None:
    """Say in what the controlled run is worse, unless both end the same way."""
    free = trial.uncontrolled
    alike = (
        free is not None and free.outcome in FAILURES and free.outcome == trial.controlled.outcome
    )
    return None if alike else _harm(trial)


def _harm(trial: Trial) -> str | None:
    """Say in what the controlled run is worse, if it is."""
    mine, free = trial.controlled, trial.uncontrolled
    ends = FAILURES.get(mine.outcome, 0)
    if mine.outcome in (Outcome.TURNS_BACK, Outcome.DIVERGES):
        return _beside(trial)
    if free is None:
        # Left out where the motion settles: nothing can be better without control.
        return None
    if ends > FAILURES.get(free.outcome, 0):
        return _beside(trial)
    if mine.outcome == Outcome.UNDECIDED and free.outcome != Outcome.UNDECIDED:
        return _beside(trial)
    after = f"after {trial.start.text}"
    if _more(mine.swing, free.swing, _SWING):
        return f"{after} the bit swings more than {trial.beside}: {_swing(mine, free)}"
    if _more(mine.stick_fraction, free.stick_fraction, _STUCK):
        shares = _percent(mine.stick_fraction, free.stick_fraction)
        return f"{after} the bit sticks for {shares} of the time"
    # A bit that catches up advances at more than the feed for a while.
    kept_up = None if free.feed is None else min(free.feed, 1.0)
    if _more(kept_up, mine.feed, _FEED):
        return f"{after} the bit advances at {_percent(mine.feed, free.feed)} of the feed"
    return None


def _good(trial: Trial) -> str | None:
    """Say in what the controlled run is better, if it is."""
    mine, free = trial.controlled, trial.uncontrolled
    if free is None or Outcome.UNDECIDED in (mine.outcome, free.outcome):
        return None
    after = f"after {trial.start.text}"
    if FAILURES.get(mine.outcome, 0) < FAILURES.get(free.outcome, 0):
        return _beside(trial)
    slips = mine.outcome == Outcome.STICK_SLIP and not _more(free.swing, mine.swing, _HALF)
    if _more(free.swing, mine.swing, _SWING) and not slips:
        return f"{after} the bit swings less than {trial.beside}: {_swing(mine, free)}"
    if _more(free.stick_fraction, mine.stick_fraction, _STUCK):
        shares = _percent(mine.stick_fraction, free.stick_fraction)
        return f"{after} the bit sticks for {shares} of the time"
    return None


def _gained(trial: Trial) -> float:
    """Return by how much the swing is smaller than without control."""
    mine, free = trial.controlled.swing, None
    if trial.uncontrolled is not None:
        free = trial.uncontrolled.swing
    return 0.0 if mine is None or free is None else free - mine


def _more(one: float | None, other: float | None, tolerance: float) -> bool:
    return one is not None and other is not None and one > other + tolerance


def _swing(mine: Figures, free: Figures | None = None) -> str:
    """Return the index of one run, or of one instead of another's."""
    text = f"swing {mine.swing:.2g}"
    return text if free is None else f"{text} instead of {free.swing:.2g}"


def _percent(mine: float | None, free: float | None) -> str:
    assert mine is not None
    assert free is not None
    return f"{100.0 * mine:.3g} % instead of {100.0 * free:.3g} %"
