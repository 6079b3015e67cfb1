"""What became of a run, in one word, and the figures that an engineer judges it by."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.drilling.hoist import HOOK
from drillctrl.simulation.bounds import BEYOND, rate_scales
from drillctrl.simulation.irregular import irregular
from drillctrl.simulation.loads import loads
from drillctrl.simulation.status import Outcome, Status
from drillctrl.simulation.summary import SHORTEST

if TYPE_CHECKING:
    from drillctrl.simulation.result import Simulation
    from drillctrl.simulation.trace import Motion

# Rates that stay within this share of their largest range have settled; within the second
# one too, if they still come together.
_SETTLED, _SETTLING, _FALLING = 1e-3, 2e-2, 0.7
# Share of the imposed rate of penetration below which the bit does not keep up.
_KEEPS_UP = 0.9
# Mean weight on bit over the steady one beyond which the bit has fallen behind.
_PRESSED = 2.0
_PER_STEP = 5


@dataclass(frozen=True)
class Figures:
    """What became of a run; of one that broke off only the first and the last are known.

    Attributes
    ----------
    outcome : Outcome
        ``"settles"``: steady drilling, reached or nearly so and still nearing;
        ``"orbit"``: a bounded motion without stick and on the rock, of which nothing says that
        it is ``"chaotic"``: one that does not repeat and whose neighbours come apart;
        ``"bounces"``: the bit leaves the rock; ``"stick-slip"``: it stands still at times;
        ``"does-not-keep-up"``: it falls behind the feed of the top end, or has, so that the
        string presses on it with more than twice the steady weight; ``"stalls"``: it
        stands still; ``"turns-back"``, ``"diverges"``; ``"undecided"``: the run ended before
        it can tell, or lasted less than 2π. All but the last three are of the last quarter.
    swing : float or None
        Stick-slip index, (max − min)/(2 mean) of the bit's speed in the last quarter; None
        too where the bit stands still.
    stick_fraction : float or None
        Share of the last quarter in torsional stick.
    feed : float or None
        By how much the deepest place that the bit has been at advances in the last quarter,
        over the feed of the top end; None too without feed.
    max_abs_u : float
        Largest input over the whole run.
    """

    outcome: Outcome
    swing: float | None
    stick_fraction: float | None
    feed: float | None
    max_abs_u: float

    def to_dict(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)


def figures(run: Simulation) -> Figures:
    """Say what became of a run.

    Parameters
    ----------
    run : Simulation
        Any, finished or broken off.

    Notes
    -----
    Whether an orbit is chaotic takes two short runs beside it; see `irregular`, which also
    tells it of motions that bounce or stick and slip, and are named so.
    """
    whole = run.motion
    largest = float(max(np.abs(whole.axial).max(), np.abs(whole.torque).max()))
    broken = _broken(run, whole)
    if broken is not None:
        return Figures(broken, None, None, None, largest)
    end = float(run.times[-1])
    since = 0.75 * end
    tail = run.on_steps(_PER_STEP, since, ("x", "dx", "dtheta", "contact"))
    speed = run.point.omega0 + tail.dtheta
    mean = float(np.trapezoid(speed, tail.times)) / (end - since)
    stuck = sum(max(0.0, b - max(a, since)) for a, b in run.phases("stuck")) / (end - since)
    swing = float(np.ptp(speed)) / (2.0 * mean) if mean > 1e-9 * run.point.omega0 else None
    fed = _feed(run, whole, tail)
    outcome = Outcome.TURNS_BACK if run.phases("reverse") else _bounded(run, tail, stuck, fed)
    return Figures(outcome, swing, stuck, fed, largest)


def grows_without_bound(run: Simulation, motion: Motion | None = None) -> bool:
    """Whether a rate has gone beyond anything that a bounded motion of the rig reaches.

    The scale is that of `rate_scales`. A bit that falls behind is loaded by what it lags behind
    on the mean, so that its rates are judged by that load.
    """
    if run.status == Status.DIVERGED:
        return True
    motion = run.motion if motion is None else motion
    weight, torque = run.steady_load
    p = run.point
    if run.status in (Status.DONE, Status.REVERSED) and run.model == "nonlinear":
        # Of a linear motion, which swings to both sides, the mean says nothing.
        mean = float(np.trapezoid(motion.x, motion.times)) / max(float(run.times[-1]), 1e-300)
        weight += p.eta**2 * max(0.0, -mean)
    scales = rate_scales(p, weight, torque)
    for rate, limit in zip((motion.dx, motion.dtheta), scales, strict=True):
        if not float(np.abs(rate).max()) <= BEYOND * limit:
            return True
    return False


def _broken(run: Simulation, motion: Motion) -> Outcome | None:
    """Return what became of a run that says nothing of a lasting motion."""
    if grows_without_bound(run, motion):
        return Outcome.DIVERGES
    if run.status == Status.REVERSED:
        return Outcome.TURNS_BACK
    short = float(run.times[-1]) < SHORTEST and not run.phases("reverse")
    return Outcome.UNDECIDED if short or run.status != Status.DONE else None


def _bounded(run: Simulation, tail: Motion, stuck: float, fed: float | None) -> Outcome:
    """Name a motion that goes on."""
    if stuck > 0.999:
        return Outcome.STALLS
    # What the feed pressed into the string before counts too, though the bit keeps up by now.
    pressed = loads(run).weight_ratio
    # A string that is fed by its weight, or hangs on a constant one, has no feed to keep up with.
    slow = fed is not None and fed < _KEEPS_UP and not _fed_by_weight(run)
    if fed is not None and (slow or (pressed is not None and pressed > _PRESSED)):
        return Outcome.LATE
    if stuck > 0.0:
        return Outcome.STICK_SLIP
    if _settles(run, tail):
        return Outcome.SETTLES
    if not bool(tail.contact.all()):
        return Outcome.BOUNCES
    return Outcome.CHAOTIC if irregular(run) else Outcome.ORBIT


def _fed_by_weight(run: Simulation) -> bool:
    """Whether the weight says how fast the top end goes down."""
    return run.point.eta == 0.0 or f"d{HOOK}" in run.state_names


def _settles(run: Simulation, tail: Motion) -> bool:
    """Whether both rates have come to rest, or nearly so and still do.

    Rates, because positions go on where the drive was changed.
    """
    end = float(run.times[-1])
    third = run.on_steps(3, 0.5 * end, ("dx", "dtheta"))
    before = third.times < 0.75 * end
    whole = run.motion
    for name in ("dx", "dtheta"):
        now, largest = np.ptp(getattr(tail, name)), np.ptp(getattr(whole, name))
        if now <= max(_SETTLED * largest, run.resolved):
            continue
        earlier = np.ptp(getattr(third, name)[before]) if before.any() else 0.0
        if now > _SETTLING * largest or now > _FALLING * earlier:
            return False
    return True


def _feed(run: Simulation, whole: Motion, tail: Motion) -> float | None:
    """Return the advance of the hole over that of the top end, in the tail.

    The bit itself goes up and down by more than it advances where it bounces.
    """
    times = np.concatenate([whole.times, tail.times])
    order = np.argsort(times, kind="stable")
    position = run.point.penetration_rate * times + np.concatenate([whole.x, tail.x])
    bottom = np.maximum.accumulate(position[order])
    first = int(np.searchsorted(times[order], tail.times[0]))
    fed = _top(run, float(times[order][-1])) - _top(run, float(tail.times[0]))
    return float(bottom[-1] - bottom[first]) / fed if fed > 0.0 else None


def _top(run: Simulation, time: float) -> float:
    """Return how far the top end has been fed."""
    rows = run.scenario.drive(run.point)
    start, offset, speed, slope = rows[np.searchsorted(rows[:, 0], time, side="right") - 1][:4]
    after = time - start
    beyond = offset + speed * after + 0.5 * slope * after**2
    return float(run.point.penetration_rate * time + beyond)
