"""`simulate`: run a scenario on the nonlinear or the linear plant, and return the motion."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds, makes_of_kinds
from drillctrl.drilling.case import Where, as_case
from drillctrl.simulation.advance import finished, go_on
from drillctrl.simulation.begin import FIRST_ROOM, March, begin, check_start
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.kernel import data
from drillctrl.simulation.layout import settings_for
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.scenario import Scenario
from drillctrl.simulation.structure import Structure, structure_of

MODELS = ("nonlinear", "linear")
CUTTINGS = ("multiple", "single")
BACKWARDS = ("rest", "stop")
LONGEST = 1e6


@makes_of_kinds
class Interrupted(KeyboardInterrupt):
    """An interrupt of a run, such as Ctrl-C, that keeps what was reached.

    Attributes
    ----------
    simulation : Simulation
        The run as far as it went.
    """

    def __init__(self, simulation: Simulation) -> None:
        end = float(simulation.times[-1])
        super().__init__(f"at t = {end:g} of {simulation.duration:g}; `simulation` has it so far")
        self.simulation = simulation


def checked_run(
    where: Where,
    scenario: Scenario | None = None,
    *,
    structure: Structure | None = None,
    controller: Controller | None = None,
    duration: float,
    initial: Mapping[str, float] | None = None,
    model: str = "nonlinear",
    cutting: str = "multiple",
    backwards: str = "rest",
    rtol: float = 1e-8,
    atol: float | None = None,
    max_step: float = math.inf,
    max_steps: int = 1_000_000,
) -> tuple[Scenario, float, float, float, int]:
    """Return scenario, duration, tolerances and step limit of a run, checked.

    Nothing is compiled here, so that bad input is refused before the wait for the compiler.

    Parameters
    ----------
    where, scenario, duration, initial, model, cutting, backwards, rtol, atol, max_step, max_steps
        As in `simulate`, and so is ``controller``.
    structure : Structure, optional
        That of the case.

    Raises
    ------
    InputError
        If an argument is out of range.
    """
    duration = checked_number("duration", duration, 0.0, LONGEST, open_low=True)
    rtol = checked_number("rtol", rtol, 1e-13, 1e-1)
    atol = checked_number("atol", 1e-2 * rtol if atol is None else atol, 1e-300, 1.0)
    max_steps = checked_integer("max_steps", max_steps, 1, 100_000_000)
    if isinstance(max_step, bool) or not isinstance(max_step, int | float) or not max_step > 0.0:
        raise InputError("max_step", max_step, "positive")
    if model not in MODELS:
        raise InputError("model", model, f"one of {', '.join(MODELS)}")
    if cutting not in CUTTINGS:
        raise InputError("cutting", cutting, f"one of {', '.join(CUTTINGS)}")
    if backwards not in BACKWARDS:
        raise InputError("backwards", backwards, f"one of {', '.join(BACKWARDS)}")
    if scenario is not None and initial is not None:
        raise InputError("initial", dict(initial), "left out where there is a scenario")
    if scenario is None:
        scenario = Scenario(initial={} if initial is None else dict(initial))
    linear = model == "linear"
    if linear and scenario.changes:
        raise InputError("changes", len(scenario.changes), "left out for the linear model")
    case = as_case(where)
    _, point = case.physics("a simulation")
    structure = structure_of(case) if structure is None else structure
    check_start(point, structure, scenario, linear)
    if controller is not None:
        controller.gains(structure.input_names, structure.output_names)
        for name in controller.back_calculation:
            if name not in structure.state_names:
                raise InputError("back_calculation", name, "a state of the plant")
    return scenario, duration, rtol, atol, max_steps


class Prepared(NamedTuple):
    """A run before its first step.

    Attributes
    ----------
    standing : March
        At t = 0.
    structure : Structure
        What moves.
    steps : (float, int)
        Longest step, and most steps.
    asked : dict
        Fields of `Simulation` that say what was asked for.
    """

    standing: March
    structure: Structure
    steps: tuple[float, int]
    asked: dict[str, Any]


def prepare(
    where: Where,
    controller: Controller | None = None,
    scenario: Scenario | None = None,
    *,
    model: str = "nonlinear",
    cutting: str = "multiple",
    backwards: str = "rest",
    max_step: float = math.inf,
    **options: Any,
) -> Prepared:
    """Return a run that is checked and laid out; arguments are those of `checked_run`."""
    case = as_case(where)
    _, point = case.physics("a simulation")
    structure = structure_of(case)
    scenario, duration, rtol, atol, max_steps = checked_run(
        case,
        scenario,
        structure=structure,
        controller=controller,
        model=model,
        cutting=cutting,
        backwards=backwards,
        max_step=max_step,
        **options,
    )
    settings = settings_for(
        structure,
        controller,
        scenario.drive(point),
        duration=duration,
        linear=model == "linear",
        multiple=cutting == "multiple",
        backwards=backwards == "rest",
        rtol=rtol,
        atol=atol,
    )
    room = min(FIRST_ROOM, max_steps + 1)
    standing = begin(point, structure, controller, settings, scenario, room)
    asked = {
        "case": case,
        "structure": structure,
        "controller": controller,
        "scenario": scenario,
        "model": model,
        "cutting": cutting,
        "backwards": backwards,
        "duration": duration,
        "rtol": rtol,
        "atol": atol,
    }
    return Prepared(standing, structure, (float(max_step), max_steps), asked)


@checks_kinds
def simulate(
    where: Where,
    controller: Controller | None = None,
    *,
    duration: float = 200.0,
    initial: Mapping[str, float] | None = None,
    scenario: Scenario | None = None,
    model: str = "nonlinear",
    cutting: str = "multiple",
    backwards: str = "rest",
    rtol: float = 1e-8,
    atol: float | None = None,
    max_step: float = math.inf,
    max_steps: int = 1_000_000,
    time_limit: float = math.inf,
    other_plant: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Simulation:
    """Simulate the drill string with state-dependent delay, dry friction and loss of contact.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where at the start; a point alone means the paper's plant. All else
        is dimensionless either way; the result of a `RigPoint` can be read in rig units.
    controller : Controller, optional
        Torque (or axial) feedback.
    duration : float
        Dimensionless time to simulate.
    initial : mapping, optional
        Perturbation of steady drilling by state name, x, dx, theta, dtheta, a string moving with
        its bit; short for a `Scenario` that has only this.
    scenario : Scenario, optional
        Start, perturbation and changes on the way.
    model : {"nonlinear", "linear"}
        Eqs. 1-9, or Eqs. 22 and 34, on which neither friction nor loss of contact acts.
    cutting : {"multiple", "single"}
        Whether the rock face is the deepest of all passes before, or the last pass
        alone (Eq. 7). They agree as long as the bit does not leave the rock.
    backwards : {"rest", "stop"}
        What becomes of a bit that turns back in the rock or off it. Until it is again where it
        turned, ``"rest"`` lets its cutters rest on the face that they had before them then: they
        press as at Φ' = 0 and bear no torque, wear flats rub either way. ``"stop"`` ends the run
        with status ``"reverse rotation"``.
    rtol, atol : float
        Relative and absolute error of a step; ``atol`` is ``rtol``/100 unless given.
    max_step : float
        Longest step.
    max_steps : int
        The run stops there with status ``"step limit"``.
    time_limit : float
        Seconds of wall time after which it stops with status ``"time limit"``; looked at
        several times a second.
    other_plant : bool
        Whether the plant may be another than the one that the controller names.
    progress : callable, optional
        Called with the time that was reached, several times a second.

    Returns
    -------
    Simulation
        A run that cannot go on returns what it has, and its status says why.

    Raises
    ------
    InputError
        If an argument is out of range.
    Interrupted
        On Ctrl-C, within a second; it carries the run as far as it went.

    Notes
    -----
    Steps are of the Dormand-Prince pair 5(4) and end at every event and wherever a break of
    the history meets the delay. Of rotation backwards Eq. 3 says that nothing is cut, but
    neither Eq. 8 nor the rock face says what the bit meets in what it had cut already:
    ``backwards="rest"`` is a convention, and each time is an event.
    """
    if time_limit != math.inf:
        checked_number("time_limit", time_limit, 0.0, open_low=True)
    case = as_case(where)
    plant, _ = case.physics("a simulation")
    if controller is not None and not isinstance(controller, Controller):
        kind = type(controller).__name__
        raise InputError("controller", kind, "a Controller, such as Controller(structure, K1, K2)")
    meant = None if controller is None else controller.plant
    if meant is not None and meant != plant and not other_plant:
        wanted = f"the one that the gains were designed for, {meant.text}, or other_plant=True"
        raise InputError("plant", plant.text, wanted)
    prepared = prepare(
        case,
        controller,
        scenario,
        duration=duration,
        initial=initial,
        model=model,
        cutting=cutting,
        backwards=backwards,
        rtol=rtol,
        atol=atol,
        max_step=max_step,
        max_steps=max_steps,
    )
    started = time.perf_counter()
    standing, outcome = go_on(
        prepared.standing,
        prepared.structure,
        prepared.asked["duration"],
        *prepared.steps,
        started + time_limit,
        progress,
    )
    elapsed = time.perf_counter() - started
    run = finished(standing, outcome, elapsed_seconds=elapsed, **prepared.asked)
    if outcome == data.INTERRUPTED:
        raise Interrupted(run)
    return run
