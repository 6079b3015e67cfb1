"""What a long run tends to: the limit cycle and how fast it attracts, and whether it is chaos."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.status import Status
from drillctrl.simulation.summary import section_crossings

# Returns nearer than this many tolerances say nothing of the motion.
_NOISE = 300.0
_FAR = 1e-2
_FEWEST = 4


@dataclass(frozen=True)
class LimitCycle:
    """A periodic motion that a run approached.

    Attributes
    ----------
    period : float
        Mean return time of the last returns.
    multiplier : float or None
        Modulus of the largest Floquet multiplier beside the 1 along the orbit, from how fast
        the returns of this run came together; None where they did too soon to tell.
    spread : float
        Largest change of the state from one of the last returns to the next, relative to the
        motion's size.
    returns : int
        Crossings of the section that were used.
    """

    period: float
    multiplier: float | None
    spread: float
    returns: int


@checks_kinds
def limit_cycle(run: Simulation, since: float = 0.0) -> LimitCycle | None:
    """Return the periodic motion that a run tends to, or None if its returns do not close.

    Parameters
    ----------
    run : Simulation
        Long enough to have forgotten its start.
    since : float
        Returns before this are left out.

    Notes
    -----
    The section is θ rising through the middle of its range. Where the distance of
    successive returns falls by a steady factor, that factor is the multiplier of the slowest
    direction transverse to the orbit. It is read off the states at the section; the past
    that the delay carries has by then come under the same factor.
    """
    start = checked_number("since", since, 0.0, float(run.times[-1]))
    times = section_crossings(run, start)
    if times.size < 4:
        return None
    states = _states(run, times)
    apart = np.abs(np.diff(states, axis=1)).max(axis=0)
    if apart[-3:].max() > 1e-3:
        return None
    # The last stretch over which the returns come together, above what is noise.
    noisy = np.flatnonzero(apart <= _NOISE * run.rtol)
    last = int(noisy[0]) if noisy.size else apart.size
    first = last
    while first > 0 and apart[first - 1] < _FAR:
        if first < last and apart[first - 1] <= apart[first]:
            break
        first -= 1
    multiplier = None
    if last - first >= _FEWEST:
        slope = np.polyfit(np.arange(first, last), np.log(apart[first:last]), 1)[0]
        multiplier = float(np.exp(slope))
    return LimitCycle(
        float(np.diff(times)[-3:].mean()), multiplier, float(apart[-3:].max()), times.size
    )


def _states(run: Simulation, times: FloatArray) -> FloatArray:
    """Return the states at some instants, each scaled by its range over the end of the run."""
    names = run.state_names
    motion = run.at(times, names)
    tail = run.on_steps(9, 0.75 * float(run.times[-1]), names)
    sizes = [max(float(np.ptp(getattr(tail, name))), 1e-300) for name in names]
    return np.stack([getattr(motion, name) / size for name, size in zip(names, sizes, strict=True)])


@dataclass(frozen=True, eq=False)
class Separation:
    """How two runs that start next to each other come apart.

    Attributes
    ----------
    exponent : float
        Slope of the logarithm of their distance over the end of the run: the largest
        Lyapunov exponent while the distance stays small.
    scatter : float
        Standard error of that slope.
    times, distance : array
        The distance of the states over time.
    """

    exponent: float
    scatter: float
    times: FloatArray
    distance: FloatArray


@checks_kinds
def separation(
    point: OperatingPoint,
    controller: Controller | None = None,
    *,
    duration: float = 400.0,
    initial: Mapping[str, float] | None = None,
    size: float = 1e-6,
    rtol: float = 1e-11,
    **options: Any,
) -> Separation:
    """Estimate the largest Lyapunov exponent of the motion that a run tends to.

    Parameters
    ----------
    point, controller
        As in `simulate`.
    duration : float
        The second half is evaluated.
    initial : mapping, optional
        Perturbation of steady drilling that the first run starts with; the second one starts
        with ``size`` more in θ'.
    size : float
        Small against the motion, large against the tolerance.
    rtol : float
        Of the integrations.
    **options
        Of `simulate`.

    Returns
    -------
    Separation
        An exponent near 0 is a periodic motion (the two runs differ in phase for good), a
        positive one chaos, a negative one rest.

    Raises
    ------
    InputError
        If a run breaks off, or the runs come so far apart or so close that their distance
        says nothing.
    """
    step = checked_number("size", size, 1e-12, 1e-2, open_low=True)
    first = dict(initial or {})
    second = {**first, "dtheta": first.get("dtheta", 0.0) + step}
    runs = [
        simulate(point, controller, duration=duration, initial=start, rtol=rtol, **options)
        for start in (first, second)
    ]
    for run in runs:
        if run.status != Status.DONE:
            raise InputError("duration", duration, f"before the run ends with {run.status}")
    times = np.linspace(0.5 * duration, duration, 4001)
    names = runs[0].state_names
    motions = [run.at(times, names) for run in runs]
    states = [np.stack([getattr(motion, name) for name in names]) for motion in motions]
    distance = np.linalg.norm(states[1] - states[0], axis=0)
    motion = float(np.linalg.norm(np.ptp(states[0], axis=1)))
    reach = max(motion, float(distance.max()))
    if not distance.min() > 0.0 or distance.max() > 0.1 * reach > 10.0 * step:
        raise InputError("size", size, "such that the runs stay close but apart")
    # Peaks of many short windows: the distance itself beats with the motion.
    windows = np.array_split(np.arange(times.size), 40)
    peaks = np.array([distance[window].max() for window in windows])
    middles = np.array([times[window].mean() for window in windows])
    (slope, _), covariance = np.polyfit(middles, np.log(peaks), 1, cov=True)
    return Separation(float(slope), float(np.sqrt(covariance[0, 0])), times, distance)
