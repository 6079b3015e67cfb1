"""Starts by name, and what becomes of a motion from each of them.

A nonlinear motion may have several ends side by side, so that one start proves little.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.case import Where, as_case
from drillctrl.simulation.begin import check_start
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import Figures, figures
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.simulation.structure import structure_of


@dataclass(frozen=True)
class Start:
    """How a motion begins.

    Attributes
    ----------
    name : str
        What it is called.
    begin : {"steady", "rest", "stick"}
        As ``start`` of a `Scenario`.
    feed, speed : float
        Perturbation of the axial rate as a share of V0, and of the bit's speed as one of Ω0; a
        string moves with its bit, see ``kick`` of `Scenario`.
    text : str
        In words.
    activation : float
        When control is switched on, in trials of gains.
    """

    name: str
    begin: str = "steady"
    feed: float = 0.0
    speed: float = 0.0
    text: str = ""
    activation: float = 0.0

    def scenario(self, changes: tuple[Change, ...] = ()) -> Scenario:
        """Return the scenario that begins so."""
        return Scenario(self.begin, changes=changes, kick=(self.feed, self.speed))


STARTS = (
    Start("small", "steady", 0.05, 0.1, "a small disturbance"),
    Start("kick", "steady", 0.5, 0.5, "a kick forward by half the speed"),
    Start("back", "steady", 0.5, -0.5, "a kick back by half the speed"),
    Start("rest", "rest", text="a start from rest"),
    Start("stick", "stick", text="a long stick"),
)
START_NAMES = tuple(start.name for start in STARTS)


def start_named(name: str) -> Start:
    """Return one of `STARTS`.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in START_NAMES:
        raise InputError("start", name, f"one of {', '.join(START_NAMES)}")
    return STARTS[START_NAMES.index(name)]


@dataclass(frozen=True, eq=False)
class StartRun:
    """What became of one start.

    Attributes
    ----------
    start : str
        Its name.
    figures : Figures
        Outcome and figures of the run.
    simulation : Simulation
        The run.
    """

    start: str
    figures: Figures
    simulation: Simulation = field(repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        run = self.simulation
        reached = {"status": str(run.status), "reached": float(run.times[-1])}
        return {"start": self.start, **reached, **self.figures.to_dict()}


@dataclass(frozen=True, eq=False)
class StartSet:
    """What became of a motion from several starts.

    Attributes
    ----------
    runs : tuple of StartRun
        In the order asked for.
    """

    runs: tuple[StartRun, ...]

    @property
    def worst(self) -> StartRun:
        """The start with the worst outcome; among equal ones that which swings most."""
        return max(self.runs, key=lambda run: (run.figures.outcome.severity, _swing(run)))

    @property
    def calm(self) -> bool:
        """Whether from every start the bit stays in the rock, turning and near its feed."""
        return all(run.figures.outcome.calm for run in self.runs)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        worst = self.worst
        return {
            "starts": [run.to_dict() for run in self.runs],
            "worst": {"start": worst.start, "outcome": str(worst.figures.outcome)},
        }

    def __repr__(self) -> str:
        worst = self.worst
        return (
            f"<StartSet: {len(self.runs)} starts, the worst {worst.start}: {worst.figures.outcome}>"
        )


def _swing(run: StartRun) -> float:
    return run.figures.swing or 0.0


def possible_starts(where: Where, linear: bool = False) -> tuple[str, ...]:
    """Return the names of the starts that a string has.

    Without a hold at its top end it has no rest, and small motion has neither rest nor stick.
    """
    case = as_case(where)
    _, point = case.physics("a simulation")
    structure = structure_of(case)
    names = []
    for start in STARTS:
        try:
            check_start(point, structure, start.scenario(), linear)
        except InputError:
            continue
        names.append(start.name)
    return tuple(names)


def start_runs(
    where: Where,
    controller: Controller | None = None,
    *,
    starts: Sequence[str] | None = None,
    changes: tuple[Change, ...] = (),
    **options: Any,
) -> Iterator[StartRun]:
    """Yield what becomes of one start after another; arguments are those of `simulate_starts`.

    All of them are checked before the first run.
    """
    case = as_case(where)
    _, point = case.physics("a simulation")
    linear = options.get("model") == "linear"
    names = possible_starts(case, linear) if starts is None else tuple(starts)
    if not names or len(set(names)) < len(names):
        wanted = f"some of {', '.join(START_NAMES)}, each once"
        raise InputError("starts", ", ".join(names), wanted)
    structure = structure_of(case)
    scenarios = [start_named(name).scenario(changes) for name in names]
    for scenario in scenarios:
        check_start(point, structure, scenario, linear)
    for name, scenario in zip(names, scenarios, strict=True):
        run = simulate(case, controller, scenario=scenario, **options)
        yield StartRun(name, figures(run), run)


@checks_kinds
def simulate_starts(
    where: Where,
    controller: Controller | None = None,
    *,
    starts: Sequence[str] | None = None,
    changes: tuple[Change, ...] = (),
    **options: Any,
) -> StartSet:
    """Simulate from several starts.

    Parameters
    ----------
    where, controller
        As in `simulate`.
    starts : sequence of str
        Some of ``"small"``: 5 % of V0 and 10 % of Ω0 at the bit, with which a string moves;
        ``"kick"``, ``"back"``: half of V0, and of Ω0 forward or back; ``"rest"``: a bit at rest
        that touches flat rock; ``"stick"``: a bit that has stood still in the rock while the top
        end went on. By default all that the string has.
    changes : tuple of Change
        Of drive and rock on the way, from every start.
    **options
        Those of `simulate` but for ``initial`` and ``scenario``.

    Raises
    ------
    InputError
        If there is no such start, or the string has none: nothing holds the top end of one
        under a drive that is free to turn.
    """
    return StartSet(tuple(start_runs(where, controller, starts=starts, changes=changes, **options)))
