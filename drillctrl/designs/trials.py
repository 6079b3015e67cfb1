"""Trial runs: gains on the nonlinear motion beside the same runs without control."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from drillctrl.base.errors import InputError
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.begin import check_start
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import (
    Figures,
    figures,
)
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.starts import Start, start_named
from drillctrl.simulation.status import Outcome
from drillctrl.simulation.structure import structure_of

# How long a run is: this many times the decay time of the torsional mode's own damping, of
# which the bit takes half or more away, so that what a start has left is below the swing
# that is compared; within the limits, where there is little damping or a lot.
_DECAYS, _SHORTEST, _LONGEST = 15.0, 150.0, 400.0
# Where a run breaks off for a numerical reason it is made again with the smaller tolerance.
_RTOL, _FINER = 1e-7, 1e-9
# An irregular motion of a bit that falls behind the feed takes a hundred thousand steps.
_STEPS = 400_000


_UNDER_WAY = "control that is switched on in the midst of what follows a kick"
USUAL_STARTS = "a small disturbance and from kicks forward and back by half the speed"
STARTS = tuple(start_named(name) for name in ("small", "kick", "back"))
# A bit that starts from rest or from stick says less of gains than of the rig: many a string
# turns back out of a stick without any. What they do then says when to switch them on.
STANDING = tuple(start_named(name) for name in ("rest", "stick"))
# Irregular motions depend on how they start more than on the gains: what is chosen by runs is
# tried from these too.
MORE_STARTS = (
    *STANDING,
    Start("strong", "steady", 1.0, 0.7, "a kick forward by 70 % of the speed"),
    Start("nudge", "steady", 0.2, 0.25, "a kick forward by a quarter of the speed"),
    Start("nudge back", "steady", 0.2, -0.25, "a kick back by a quarter of the speed"),
)

# Gains that keep a motion quiet need not bring it to rest once the bit sticks and slips.
UNDER_WAY = tuple(
    Start(f"under way {time:.0f}", "steady", 0.5, 0.5, _UNDER_WAY, time) for time in (60.0, 100.0)
)


@dataclass(frozen=True)
class Trial:
    """What became of one start.

    Attributes
    ----------
    start : Start
        Where it began.
    controlled : Figures
        With the gains.
    uncontrolled : Figures or None
        Without; None where nothing depended on it.
    beside : str
        What that is, in words.
    """

    start: Start
    controlled: Figures
    uncontrolled: Figures | None
    beside: str = "without control"

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        free = self.uncontrolled
        return {
            "start": self.start.name,
            "controlled": self.controlled.to_dict(),
            "uncontrolled": None if free is None else free.to_dict(),
        }


def trial_duration(point: OperatingPoint) -> float:
    """Return the dimensionless time in which a slow torsional motion shows what it tends to."""
    usual = _DECAYS / point.kappa if point.kappa > 0.0 else _LONGEST
    return min(max(usual, _SHORTEST), _LONGEST)


def trial_run(case: Case, controller: Controller | None, start: Start) -> Figures:
    """Return what becomes of one start, with control or without."""
    found = figures(_run(case, controller, start, _RTOL))
    if found.outcome == Outcome.UNDECIDED:
        found = figures(_run(case, controller, start, _FINER))
    return found


def _run(case: Case, controller: Controller | None, start: Start, rtol: float) -> Simulation:
    _, point = case.physics("a trial run")
    if controller is not None and start.activation > controller.activation:
        controller = replace(controller, activation=start.activation)
    return simulate(
        case,
        controller,
        duration=start.activation + trial_duration(point),
        scenario=start.scenario(),
        rtol=rtol,
        max_steps=_STEPS,
        backwards="stop",
    )


def standing_starts(case: Case) -> tuple[Start, ...]:
    """Return those of `STANDING` that the string of a case can be in."""
    _, point = case.physics("a trial")
    structure, found = structure_of(case), []
    for start in STANDING:
        try:
            check_start(point, structure, start.scenario(), False)
        except InputError:
            # A drive that is free to turn holds nothing.
            continue
        found.append(start)
    return tuple(found)


def uncontrolled_runs(where: Where) -> dict[str, Figures]:
    """Return what becomes of each start without control, by its name."""
    case = as_case(where)
    starts = (*STARTS, *standing_starts(case))
    return {start.name: trial_run(case, None, start) for start in starts}


def trial_runs(
    case: Case,
    controller: Controller,
    *,
    uncontrolled: dict[str, Figures] | None = None,
    spare: bool = False,
    starts: Sequence[Start] = STARTS,
) -> tuple[Trial, ...]:
    """Try a controller from each start, beside the same runs without it.

    Parameters
    ----------
    case : Case
        What drills, and where.
    controller : Controller
        With its gains, and whatever limits, delays and clock it has.
    uncontrolled : dict, optional
        What `uncontrolled_runs` returned for the case.
    spare : bool
        Leave out runs on which no verdict depends: those without control where the controller
        settles, and all further ones once it does harm.
    starts : sequence of Start
        From where.
    """
    return tuple(_trials(case, controller, uncontrolled, spare, starts))


def _trials(
    case: Case,
    controller: Controller,
    uncontrolled: dict[str, Figures] | None,
    spare: bool,
    starts: Sequence[Start],
) -> Iterable[Trial]:
    for start in starts:
        mine = trial_run(case, controller, start)
        harm = mine.outcome in (Outcome.TURNS_BACK, Outcome.DIVERGES)
        if uncontrolled is not None:
            free = uncontrolled[start.name]
        elif spare and (harm or mine.outcome == Outcome.SETTLES):
            free = None
        else:
            free = trial_run(case, None, start)
        yield Trial(start, mine, free)
        if spare and harm:
            return
