"""How a run ended, and what became of the motion: each a word with a sentence."""

from __future__ import annotations

from enum import StrEnum


class _Told(StrEnum):
    """Words that carry a sentence for people."""

    sentence: str

    def __new__(cls, word: str, sentence: str) -> _Told:
        """Make a word that is told by a sentence."""
        member = str.__new__(cls, word)
        member._value_ = word
        member.sentence = sentence
        return member


class Status(_Told):
    """How a run ended."""

    DONE = "done", "the run lasted as long as was asked"
    REVERSED = "reverse rotation", "the bit turned backwards"
    STEP_LIMIT = "step limit", "the steps that were permitted are used up"
    DIVERGED = "diverges", "the motion grew beyond what a bounded motion of the rig reaches"
    INTERRUPTED = "interrupted", "the run was stopped by hand"
    TIME_LIMIT = "time limit", "the wall time that was permitted is used up"
    COLLAPSE = "step collapse", "no step is short enough for the error that was asked"
    NOT_FINITE = "not finite", "the motion left the numbers that a computer has"


class Outcome(_Told):
    """What became of a motion; all but the last three by its last quarter."""

    SETTLES = "settles", "the motion settles"
    ORBIT = "orbit", "the bit goes on swinging"
    CHAOTIC = "chaotic", "the bit goes on swinging and never repeats itself"
    BOUNCES = "bounces", "the bit bounces"
    STICK_SLIP = "stick-slip", "the bit sticks and slips"
    LATE = "does-not-keep-up", "the bit falls behind the feed"
    STALLS = "stalls", "the bit stands still"
    TURNS_BACK = "turns-back", "the bit turns backwards"
    DIVERGES = "diverges", "the motion grows without bound"
    UNDECIDED = (
        "undecided",
        "the run ends before it can tell",
    )

    @property
    def severity(self) -> int:
        """Rank from the best to the worst; an undecided run may be as bad as falling behind."""
        return _BY_SEVERITY.index(self)

    @property
    def calm(self) -> bool:
        """Whether the bit stays in the rock, turning, and keeps up with its feed."""
        return self in (Outcome.SETTLES, Outcome.ORBIT, Outcome.CHAOTIC)


_BY_SEVERITY = (
    Outcome.SETTLES,
    Outcome.ORBIT,
    Outcome.CHAOTIC,
    Outcome.BOUNCES,
    Outcome.STICK_SLIP,
    Outcome.LATE,
    Outcome.UNDECIDED,
    Outcome.STALLS,
    Outcome.TURNS_BACK,
    Outcome.DIVERGES,
)

OUTCOME_NAMED = {str(outcome): outcome for outcome in Outcome}
