"""What becomes of disturbances at one operating point: plain data in and out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from drillctrl.drilling.case import Case
from drillctrl.simulation.basin import basin_edge
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.status import Status
from drillctrl.studies.tasks import linear_abscissa, task_key

OUTCOMES = (
    "settled",
    "orbit",
    "unsettled",
    "stalled",
    "reverse rotation",
    "diverges",
    "undecided",
    "broken",
)
# Decay times that a run lasts: exp(−9) by the end of its third quarter is well settled.
_LASTING = 12.0
_SHORTEST, _LONGEST = 60.0, 600.0


@dataclass(frozen=True, eq=False)
class Trial:
    """What to try at an operating point.

    Attributes
    ----------
    index : int
        Of the point.
    case : Case
        What drills, and where.
    controller : Controller or None
        Closes the loop.
    disturbance : mapping
        Perturbation by state name of size 1.
    sizes : tuple of float
        Rising multiples of it that are tried.
    largest : float
        The basin is followed up to here.
    sharpness : float
        Ratio of the sizes between which its edge is to lie; infinite not to look for it.
    duration : float or None
        Of each run; None for twelve decay times of the linear loop, between 60 and 600.
    cutting : str
    rtol : float
        As in `simulate`.
    """

    index: int
    case: Case
    controller: Controller | None
    disturbance: Mapping[str, float]
    sizes: tuple[float, ...]
    largest: float
    sharpness: float
    duration: float | None
    cutting: str
    rtol: float

    @property
    def key(self) -> str:
        """Hash of all that the result depends on."""
        apart = ("controller", "case")
        settings = (getattr(self, f.name) for f in fields(self) if f.name not in apart)
        return task_key(self.case, self.controller, *settings)


def try_point(trial: Trial) -> dict[str, Any]:
    """Return α of the linear loop and what became of each size, in JSON types.

    The basin is a pair: the largest size below which all that were tried settled, and the
    smallest that did not; None for the second if the largest allowed one settled too, and
    twice None where there is no basin to look for or its runs would be too long.
    """
    alpha = linear_abscissa(trial.case, trial.controller)
    duration = trial.duration
    if duration is None:
        # No decay, no need to wait for it.
        duration = _LASTING / -alpha if alpha < 0.0 else _SHORTEST
        duration = float(np.clip(duration, _SHORTEST, _LONGEST))
    tried = [_outcome(trial, alpha, duration, size) for size in trial.sizes]
    outcomes = [outcome for outcome, _ in tried]
    basin: list[float | None] = [None, None]
    if alpha < 0.0 and outcomes[0] != "undecided" and np.isfinite(trial.sharpness):
        basin = _basin(trial, alpha, duration, outcomes)
    return {
        "index": trial.index,
        "spectral_abscissa": alpha,
        "duration": duration,
        "outcomes": outcomes,
        "settling_times": [time for _, time in tried],
        "basin": basin,
    }


def _basin(trial: Trial, alpha: float, duration: float, outcomes: list[str]) -> list[float | None]:
    """Return the sizes between which the first that does not settle lies."""
    settled = [outcome == "settled" for outcome in outcomes]
    fails = settled.index(False) if False in settled else None
    low = trial.sizes[-1] if fails is None else trial.sizes[fails - 1] if fails else 0.0
    high = None if fails is None else trial.sizes[fails]

    def settles(size: float) -> bool:
        return _outcome(trial, alpha, duration, size)[0] == "settled"

    return list(basin_edge(settles, trial.sizes[0], trial.largest, trial.sharpness, low, high))


def _outcome(trial: Trial, alpha: float, duration: float, size: float) -> tuple[str, float | None]:
    """Simulate; return what became of it and the settling time."""
    start = {name: size * value for name, value in trial.disturbance.items()}
    run = simulate(
        trial.case,
        trial.controller,
        duration=duration,
        initial=start,
        cutting=trial.cutting,
        backwards="stop",
        rtol=trial.rtol,
        atol=1e-3 * size * trial.rtol,
    )
    return outcome_of(run, alpha), run.summary.settling_time


def outcome_of(run: Simulation, alpha: float) -> str:
    """Return one of `OUTCOMES` for a run, of a linear loop with abscissa α."""
    if run.status != Status.DONE:
        return run.status if run.status in OUTCOMES else "broken"
    summary = run.summary
    if summary.settled:
        return "settled"
    if summary.stick_fraction > 1.0 - 1e-9:
        return "stalled"
    if summary.period is not None and summary.stick_fraction > 0.0:
        return "orbit"
    # Small motion that decays more slowly than the run lasts.
    if -0.75 * _LASTING < alpha * run.duration < 0.0 and summary.stick_fraction == 0.0:
        return "undecided"
    return "orbit" if summary.period is not None else "unsettled"
