"""The figures of a motion: settled or not, stick, period, extremes."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.optimize import elementwise

from drillctrl.base.arrays import FloatArray
from drillctrl.simulation.kernel import data
from drillctrl.simulation.status import Status
from drillctrl.simulation.trace import Motion, Trace

SETTLED = 1e-3
SETTLED_WITHIN = 0.02
RETURNED = 1e-3
PER_STEP = 9
MAX_RETURNS = 40
# A run that lasts no period of the torsional pendulum shows no motion that goes on.
SHORTEST = 2.0 * math.pi


@dataclass(frozen=True)
class Summary:
    """Figures over the last quarter of a run, unless said otherwise.

    Attributes
    ----------
    settled : bool
        Whether the largest |x| and |θ| are below 1e-3 of their largest over the whole run, or
        below what the integration resolves, in a run of 2π and more.
    stick_fraction : float
        Share of the time in torsional stick.
    period : float or None
        Of the orbit, if the motion repeats within 1e-3 of its amplitude and is not settled.
    bit_speed_min, bit_speed_max : float
        Extremes of Φ'.
    axial_min, axial_max : float
        Extremes of x.
    delay_max : float
        Largest τ.
    max_abs_u : float
        Largest input over the whole run.
    lost_contact : bool
        Whether the bit left the rock.
    axial_stick_fraction : float
        Share of the time held at Z' = 0 in contact.
    events, steps : int
        Numbers of events and of steps over the whole run.
    elapsed_seconds : float
        Wall time of the integration.
    reversals : int
        How often the bit turned back over the whole run.
    settling_time : float or None
        When |x| and |θ| stay below 2 % of their largest values; see `settling_time`.
    """

    settled: bool
    stick_fraction: float
    period: float | None
    bit_speed_min: float
    bit_speed_max: float
    axial_min: float
    axial_max: float
    delay_max: float
    max_abs_u: float
    lost_contact: bool
    axial_stick_fraction: float
    events: int
    steps: int
    elapsed_seconds: float
    settling_time: float | None = None
    reversals: int = 0

    def as_dict(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)


def summarise(simulation: Trace, resolved: float = 0.0) -> Summary:
    """Return the figures of a run.

    Parameters
    ----------
    simulation : Trace
        A run.
    resolved : float
        Amplitude below which it says nothing.
    """
    end = float(simulation.times[-1])
    since = 0.75 * end
    # Without feedback they are 0, and to work them out costs more than the run.
    inputs = simulation.input_names if simulation.settings.whole[data.FEEDBACK] else ()
    if simulation.steps == 0:
        tail = run = driven = simulation.at([0.0])
    else:
        run = simulation.on_steps(PER_STEP, names=("x", "theta"))
        driven = simulation.on_steps(PER_STEP, names=inputs) if inputs else run
        # The run is in order of time; its tail starts with the step that holds `since`.
        tail = simulation.on_steps(PER_STEP, since, ("x", "theta", "dtheta", "delay", "contact"))
    settled = end >= SHORTEST and all(
        float(abs(getattr(tail, name)).max())
        <= max(SETTLED * float(abs(getattr(run, name)).max()), resolved)
        for name in ("x", "theta")
    )
    omega0 = simulation.point.omega0
    return Summary(
        settled=settled,
        stick_fraction=_share(simulation, "stuck", since, end),
        period=None if settled else period(simulation, since),
        bit_speed_min=omega0 + _extreme(simulation, tail, "dtheta", least=True),
        bit_speed_max=omega0 + _extreme(simulation, tail, "dtheta"),
        axial_min=_extreme(simulation, tail, "x", least=True),
        axial_max=_extreme(simulation, tail, "x"),
        delay_max=_extreme(simulation, tail, "delay"),
        max_abs_u=max((float(abs(getattr(driven, name)).max()) for name in inputs), default=0.0),
        lost_contact=not bool(tail.contact.all()),
        axial_stick_fraction=_share(simulation, "held", since, end),
        events=len(simulation.events),
        steps=simulation.steps,
        elapsed_seconds=simulation.elapsed_seconds,
        settling_time=_settled_from(simulation, run),
        reversals=len(simulation.phases("behind")),
    )


def settling_time(simulation: Trace, within: float = SETTLED_WITHIN) -> float | None:
    """Return when |x| and |θ| stay below a share of their largest values.

    Parameters
    ----------
    simulation : Trace
        A finished run.
    within : float
        The share.

    Returns
    -------
    float or None
        None if the run broke off, or either is still beyond in the last tenth of it.
    """
    return _settled_from(simulation, simulation.on_steps(PER_STEP, names=("x", "theta")), within)


def _settled_from(
    simulation: Trace, motion: Motion, within: float = SETTLED_WITHIN
) -> float | None:
    """Return `settling_time` from the whole motion."""
    if simulation.status != Status.DONE or simulation.steps == 0:
        return None
    last = 0.0
    for values in (abs(motion.x), abs(motion.theta)):
        beyond = np.flatnonzero(values > within * values.max(initial=0.0))
        if beyond.size:
            last = max(last, float(motion.times[min(beyond[-1] + 1, values.size - 1)]))
    return None if last > 0.9 * simulation.duration else last


def _share(simulation: Trace, phase: str, since: float, end: float) -> float:
    """Share of [since, end] spent in a phase."""
    if end <= since:
        return 0.0
    spent = sum(max(0.0, b - max(a, since)) for a, b in simulation.phases(phase))
    return spent / (end - since)


def _extreme(simulation: Trace, tail: Motion, name: str, *, least: bool = False) -> float:
    """Extreme of a quantity, looked for again between the samples around the extreme one."""
    sign = -1.0 if least else 1.0
    values = sign * getattr(tail, name)
    k = int(values.argmax())
    low, high = tail.times[max(k - 1, 0)], tail.times[min(k + 1, values.size - 1)]
    best = float(values[k])
    if high > low:
        finer = simulation.at(np.linspace(low, high, 65), (name,))
        best = max(best, float((sign * getattr(finer, name)).max()))
    return sign * best


def section_crossings(simulation: Trace, since: float) -> FloatArray:
    """Return the times at which θ rises through the middle of its range, sharpened."""
    tail = simulation.on_steps(PER_STEP, since, ("theta",))
    middle = 0.5 * (tail.theta.max() + tail.theta.min())
    beyond = tail.theta - middle
    rising = np.flatnonzero((beyond[:-1] < 0.0) & (beyond[1:] >= 0.0))
    if not rising.size:
        return np.zeros(0)
    found = elementwise.find_root(
        lambda times: simulation.at(times, ("theta",)).theta - middle,
        (tail.times[rising], tail.times[rising + 1]),
    )
    return np.asarray(found.x)


def period(simulation: Trace, since: float) -> float | None:
    """Return the time after which the motion since some instant repeats, or None.

    The states at the crossings of a section are compared with those so many crossings later.
    """
    if simulation.steps == 0:
        return None
    times = section_crossings(simulation, since)
    if times.size < 3:
        return None
    names = simulation.state_names
    tail = simulation.on_steps(PER_STEP, since, names)
    motion = simulation.at(times, names)
    size = np.array([np.ptp(getattr(tail, name)) for name in names])[:, None]
    moving = size[:, 0] > 0.0
    if not moving[:4].all():
        return None
    states = np.stack([getattr(motion, name) for name in names])[moving]
    size = size[moving]
    for count in range(1, min(times.size - 1, MAX_RETURNS)):
        apart = abs(states[:, count:] - states[:, :-count]) / size
        if apart.max() < RETURNED:
            return float((times[count:] - times[:-count]).mean())
    return None
