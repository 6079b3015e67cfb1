"""Whether a bounded motion is chaotic: it does not repeat, and its neighbours come apart."""

from __future__ import annotations

import dataclasses
import weakref

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.linear import BIT_STATES
from drillctrl.simulation.begin import longest_lag
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Scenario
from drillctrl.simulation.status import Status
from drillctrl.simulation.summary import period

# Of the last quarter; a kick as a share of the motion, and the share at which it has grown.
_KICK, _APART = 1e-6, 1e-2
# By how much the size of a lasting motion may differ from one quarter to the next.
_LASTING = 0.3
_SAMPLES, _INSTANTS = 1001, 41
_RTOL = 1e-8

_known: weakref.WeakKeyDictionary[Simulation, bool] = weakref.WeakKeyDictionary()


@checks_kinds
def irregular(run: Simulation) -> bool:
    """Return whether a motion is chaotic, as far as its last quarter shows.

    Parameters
    ----------
    run : Simulation
        Of a bounded motion, long enough to have forgotten its start.

    Notes
    -----
    It is where the last quarter does not repeat, is of the size of the quarter before, and two
    neighbours of it, which start a millionth of its size beside it in the bit's speed and in its
    axial rate, both come apart from it by a hundredth. That is a factor of 10⁴, so that a
    Lyapunov exponent of more than 37 over the duration is found. Neighbours of a slow orbit, or
    of one with several incommensurate periods, drift apart by far less; those of a motion that
    is still growing are told by its size. After a change on the way, under gains that change,
    or where a run ended early, nothing is said and the answer is no.
    """
    if run not in _known:
        _known[run] = _comes_apart(run)
    return _known[run]


def _comes_apart(run: Simulation) -> bool:
    end = float(run.times[-1])
    since = 0.75 * end
    controller = run.controller
    if run.status != Status.DONE or run.model != "nonlinear" or run.scenario.changes:
        return False
    if controller is not None and (controller.schedule or controller.activation > since):
        return False
    if not _lasts(run, end) or period(run, since) is not None:
        return False
    if controller is not None:
        controller = dataclasses.replace(controller, activation=0.0)
    begin = _turning(run, since, end)
    past, size = run.past(begin, kept=longest_lag(run.settings)), _sizes(run, since, end)
    instants = np.linspace(0.0, end - begin, _SAMPLES)

    def scaled(path: Simulation, times: FloatArray) -> FloatArray:
        names = run.state_names[:BIT_STATES]
        motion = path.at(np.minimum(times, path.times[-1]), names)
        return np.stack([getattr(motion, name) for name in names]) / size[:, None]

    def go_on(kick: dict[str, float]) -> FloatArray | None:
        after = simulate(
            run.case,
            controller,
            duration=end - begin,
            scenario=Scenario(start=past, initial=kick),
            cutting=run.cutting,
            backwards=run.backwards,
            rtol=min(run.rtol, _RTOL),
            max_steps=20 * run.steps + 1000,
        )
        if after.status != Status.DONE:
            return None
        return scaled(after, instants)

    def apart(one: FloatArray | None, other: FloatArray | None) -> bool:
        return one is not None and other is not None and float(abs(one - other).max()) >= _APART

    # What the tolerance of the run adds can but drive its neighbour further away.
    turned = go_on({"dtheta": _KICK * float(size[3])})
    if not apart(turned, scaled(run, begin + instants)):
        return False
    beside = go_on({})
    return apart(turned, beside) and apart(go_on({"dx": _KICK * float(size[1])}), beside)


def _sizes(run: Simulation, since: float, until: float) -> FloatArray:
    """Return the range of the bit's states between two instants, (4,)."""
    names = run.state_names[:BIT_STATES]
    motion = run.at(np.linspace(since, until, _SAMPLES), names)
    return np.array([max(float(np.ptp(getattr(motion, name))), 1e-300) for name in names])


def _lasts(run: Simulation, end: float) -> bool:
    """Whether the rates of the bit go on at the size that they have had."""
    before, now = _rates(run, end)
    return bool((abs(now - before) <= _LASTING * np.maximum(now, before)).all())


def still_grows(run: Simulation) -> bool:
    """Whether a rate of the bit is larger in the last quarter than in the one before by far."""
    before, now = _rates(run, float(run.times[-1]))
    return bool((now > (1.0 + _LASTING) * before).any())


def _rates(run: Simulation, end: float) -> tuple[FloatArray, FloatArray]:
    """Return the ranges of both rates in the third quarter and the last, (2,) each."""
    return _sizes(run, 0.5 * end, 0.75 * end)[1::2], _sizes(run, 0.75 * end, end)[1::2]


def _turning(run: Simulation, since: float, end: float) -> float:
    """Return an instant soon after another at which the bit cuts, so that kicks are not lost."""
    times = np.linspace(since, since + 0.1 * (end - since), _INSTANTS)
    motion = run.at(times, ("contact",))
    free = motion.contact & ~motion.stuck & ~motion.held
    return float(times[int(np.argmax(free))])
