"""Whether gains can be recommended: what their trial runs showed, in one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.trials import Trial, trial_runs
from drillctrl.drilling.case import Case
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import Figures
from drillctrl.simulation.status import Outcome
from drillctrl.simulation.structure import structure_of

# Differences between two runs below which they are alike: irregular motions repeat their
# figures no better.
_SWING, _STUCK, _FEED = 0.02, 0.02, 0.05
_SEVERITY = {Outcome.LATE: 1, Outcome.STALLS: 2, Outcome.TURNS_BACK: 3, Outcome.DIVERGES: 4}
_STARTS = {
    "small": "a small disturbance",
    "kick": "a kick forward by half the speed",
    "back": "a kick back by half the speed",
}
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
    """

    recommended: bool | None
    reason: str
    trials: tuple[Trial, ...] = ()

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
    """
    if structure is None:
        return Verdict(None, NO_GAINS)
    if not case.drills:
        return Verdict(None, f"{LEFT_OUT}: no nonlinear model of this plant is known")
    try:
        controller = Controller(structure, K1, K2)
        simulated = structure_of(case)
        controller.gains(simulated.input_names, simulated.output_names)
    except InputError as error:
        return Verdict(None, f"{LEFT_OUT}: the simulator cannot close this loop ({error})")
    trials = trial_runs(case, controller, uncontrolled=uncontrolled, spare=spare)
    return judge(trials, stable)


def judge(trials: Sequence[Trial], stable: bool) -> Verdict:
    """Say whether gains can be recommended.

    They are refused where from any start they do worse than no control, and where they
    neither stabilise nor do measurable good.

    Parameters
    ----------
    trials : sequence of Trial
        At least one.
    stable : bool
        Whether the linear loop is.
    """
    runs = tuple(trials)
    for trial in runs:
        if (harm := _harm(trial)) is not None:
            return Verdict(False, harm, runs)
    good = next((text for trial in runs if (text := _good(trial)) is not None), None)
    settled = [trial for trial in runs if trial.controlled.outcome == Outcome.SETTLES]
    if not settled and good is None:
        what = "they do not settle it" if stable else "they do not stabilise smooth drilling"
        return Verdict(False, f"{what}, and do no measurable good: {_beside(runs[0])}", runs)
    if len(settled) == len(runs):
        return Verdict(True, "with these gains the motion settles from every start", runs)
    if not settled:
        return Verdict(True, f"smooth drilling is not reached, but {good}", runs)
    rest = next(trial for trial in runs if trial not in settled)
    small = f"the motion settles from {_STARTS[settled[0].start]}, but not from every start"
    return Verdict(True, f"{small}: {_beside(rest)}", runs)


def _beside(trial: Trial) -> str:
    """Say what a start led to, with the gains and without."""
    mine, free = trial.controlled, trial.uncontrolled
    text = f"after {_STARTS[trial.start]} {_what(mine)}"
    return text if free is None else f"{text}; without control {_what(free)}"


def _what(found: Figures) -> str:
    text = found.outcome.sentence
    if found.swing is None or found.outcome == Outcome.SETTLES:
        return text
    return f"{text} ({_swing(found)})"


def _harm(trial: Trial) -> str | None:
    """Say in what the controlled run is worse, if it is."""
    mine, free = trial.controlled, trial.uncontrolled
    ends = _SEVERITY.get(mine.outcome, 0)
    if mine.outcome in (Outcome.TURNS_BACK, Outcome.DIVERGES):
        return _beside(trial)
    if free is None:
        # Left out where the motion settles: nothing can be better without control.
        return None
    if ends > _SEVERITY.get(free.outcome, 0):
        return _beside(trial)
    if mine.outcome == Outcome.UNDECIDED and free.outcome != Outcome.UNDECIDED:
        return _beside(trial)
    after = f"after {_STARTS[trial.start]}"
    if _more(mine.swing, free.swing, _SWING):
        return f"{after} the bit swings more than without control: {_swing(mine, free)}"
    if _more(mine.stick_fraction, free.stick_fraction, _STUCK):
        shares = _percent(mine.stick_fraction, free.stick_fraction)
        return f"{after} the bit sticks for {shares} of the time"
    if _more(free.feed, mine.feed, _FEED):
        return f"{after} the bit advances at {_percent(mine.feed, free.feed)} of the feed"
    return None


def _good(trial: Trial) -> str | None:
    """Say in what the controlled run is better, if it is."""
    mine, free = trial.controlled, trial.uncontrolled
    if free is None or Outcome.UNDECIDED in (mine.outcome, free.outcome):
        return None
    after = f"after {_STARTS[trial.start]}"
    if _SEVERITY.get(mine.outcome, 0) < _SEVERITY.get(free.outcome, 0):
        return _beside(trial)
    if _more(free.swing, mine.swing, _SWING):
        return f"{after} the bit swings less than without control: {_swing(mine, free)}"
    if _more(free.stick_fraction, mine.stick_fraction, _STUCK):
        shares = _percent(mine.stick_fraction, free.stick_fraction)
        return f"{after} the bit sticks for {shares} of the time"
    return None


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
