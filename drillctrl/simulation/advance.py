"""March a run on to an instant, and make what was marched a result."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from types import ModuleType
from typing import Any

from drillctrl.simulation.begin import March, resized
from drillctrl.simulation.compile import kernel
from drillctrl.simulation.kernel import data
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.status import Status
from drillctrl.simulation.structure import Structure

TRIES = 400_000
# Times the room that is used up.
_MOST_ROOM = 32.0


def go_on(
    standing: March,
    structure: Structure,
    end: float,
    max_step: float,
    max_steps: int,
    until: float = math.inf,
    progress: Callable[[float], None] | None = None,
) -> tuple[March, int]:
    """March on to an instant; return where it stands then, and why it stopped.

    Parameters
    ----------
    standing : March
        Changed in place, but for a history that has grown.
    structure : Structure
        What moves.
    end : float
        The instant.
    max_step : float
        Longest step.
    max_steps : int
        Most steps since t = 0.
    until : float
        When to give up, on `time.perf_counter`.
    progress : callable, optional
        Told the time that was reached, now and then.

    Returns
    -------
    March, int
        DONE and the like of `kernel.data`; an interrupt such as Ctrl-C is INTERRUPTED.
    """
    march = kernel("march")
    # Few enough that an interrupt is heard soon.
    tries = TRIES // (len(structure.state_names) + 16)
    try:
        while True:
            outcome = march.march(*standing[:-1], end, max_step, tries)
            used = int(standing.ints[march.STEPS])
            if outcome == data.PAUSED:
                if progress is not None:
                    progress(float(standing.reals[march.TIME]))
                if time.perf_counter() <= until:
                    continue
                break
            if outcome != data.MORE_ROOM or used - standing.first >= max_steps:
                break
            room = min(_room(standing, march, end), max_steps + 1 + standing.first)
            standing = standing._replace(history=resized(standing.history, room, used))
    except KeyboardInterrupt:
        # Heard between two calls of the march, which leave all in place.
        outcome = data.INTERRUPTED
    return standing, outcome


def _room(standing: March, march: ModuleType, duration: float) -> int:
    """Return for how many steps there is to be room where it is used up.

    As many as the rest takes if it goes on as until now; what is not written to takes no memory.
    """
    used, reached = int(standing.ints[march.STEPS]), float(standing.reals[march.TIME])
    # Steps of the past that it started from took none of that time.
    made = used - standing.first
    foreseen = standing.first + 1.1 * made * duration / max(reached, 1e-9)
    return int(min(max(2.0 * used, foreseen), _MOST_ROOM * used))


def finished(standing: March, outcome: int, **asked: Any) -> Simulation:
    """Return a march that has stopped as a run; ``asked`` are fields of `Simulation`."""
    march = kernel("march")
    used = int(standing.ints[march.STEPS])
    status = {
        data.DONE: Status.DONE,
        data.COLLAPSE: Status.COLLAPSE,
        data.REVERSED: Status.REVERSED,
        data.NOT_FINITE: Status.NOT_FINITE,
        data.DIVERGED: Status.DIVERGED,
        data.PAUSED: Status.TIME_LIMIT,
        data.INTERRUPTED: Status.INTERRUPTED,
    }
    return Simulation(
        status=status.get(outcome, Status.STEP_LIMIT),
        rejected=int(standing.ints[march.REJECTED]),
        evaluations=int(standing.ints[march.EVALUATIONS]),
        unsettled=int(standing.ints[march.UNSETTLED]),
        settings=standing.settings,
        # A view: what was never written to takes no memory.
        history=data.History(*(array[:used] for array in standing.history)),
        first=standing.first,
        rig=asked["case"].rig,
        **asked,
    )
