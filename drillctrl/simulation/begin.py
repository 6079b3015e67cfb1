"""Where a run begins: what lies before t = 0, and the first state."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.bounds import rate_bounds
from drillctrl.simulation.compile import kernel
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.kernel import data
from drillctrl.simulation.past import Past
from drillctrl.simulation.scenario import STOOD, Scenario
from drillctrl.simulation.structure import Structure

FIRST_ROOM = 4096


class March(NamedTuple):
    """Where the integrator stands, and what it has stored.

    All but the last are what the compiled march takes; ``first`` is the number of steps
    that lie before t = 0.
    """

    settings: Any
    history: Any
    ints: npt.NDArray[np.int64]
    reals: FloatArray
    y: FloatArray
    chain: npt.NDArray[np.int64]
    following: npt.NDArray[np.int64]
    first: int


def empty_history(room: int, states: int, inputs: int, sides: int) -> data.History:
    """Return a `History` with room for so many steps."""
    real = np.zeros((room, data.history_width(states, inputs, sides)))
    return data.History(real, np.zeros((room, data.WHOLES), dtype=np.int64))


def resized(history: data.History, room: int, used: int) -> data.History:
    """Return a copy of a history with other room."""
    copies = []
    for old in history:
        new = np.zeros((room, *old.shape[1:]), dtype=old.dtype)
        new[:used] = old[:used]
        copies.append(new)
    return data.History(*copies)


def check_start(
    point: OperatingPoint, structure: Structure, scenario: Scenario, linear: bool
) -> None:
    """Refuse a start that the model does not cover.

    Raises
    ------
    InputError
        If a perturbed state is unknown, the bit would start turning backwards, the imposed
        motion of a top end changes on which inertia hangs, the linear model is to start from
        rest, or a run from the past of another point, plant or model.
    """
    kick = _added(structure, scenario)
    feed_hangs, turn_hangs = (structure.arrays.drag[:, k].any() for k in range(2))
    for change in scenario.changes:
        for name, hangs in (("penetration_rate", feed_hangs), ("omega0", turn_hangs)):
            if hangs and getattr(change, name) is not None:
                wanted = "left out where a string with inertia hangs on the imposed motion"
                raise InputError(name, getattr(change, name), wanted)
    start = scenario.start
    low = -structure.omega0
    if isinstance(start, Past):
        if start.point != point:
            raise InputError("start", repr(start), f"a past of {point!r}, not of {start.point!r}")
        if not structure.is_same(start.structure):
            raise InputError("start", repr(start), "a past of the same plant")
        if (start.model == "linear") != linear:
            raise InputError("model", "linear" if linear else "nonlinear", "that of the past")
        # A bit that turns back already may go on so.
        low = min(0.0, low - float(start.state[3]))
    elif start != "steady":
        if linear:
            raise InputError("start", start, "steady for the linear model")
        # Refused here where there is no such state.
        _ = structure.rest if start == "rest" else structure.stuck(STOOD)
        low = 0.0
    if not linear and kick[3] < low:
        raise InputError("initial dtheta", kick[3], f"at least {low:g}: the bit must not turn back")


def begin(
    point: OperatingPoint,
    structure: Structure,
    controller: Controller | None,
    settings: data.Settings,
    scenario: Scenario,
    room: int = FIRST_ROOM,
) -> March:
    """Return a march that stands at t = 0.

    Before t = 0 there is step 0: steady drilling, or flat rock under a bit at rest (which
    is any motion with constant Z; the delay it implies is that of steady drilling); and the
    steps of a run that is gone on from. The start has passed `check_start`. What bounds the
    motion from there is written into the settings.
    """
    march, control = (kernel(name) for name in ("march", "control"))
    standing = (
        _resume(scenario.start, structure, settings, room)
        if isinstance(scenario.start, Past)
        else _set_off(structure, settings, scenario.start, room)
    )
    _, history, ints, reals, y, chain, _, first = standing
    n, m = structure.arrays.B.shape
    kick = _added(structure, scenario)
    y[:n] += kick
    if kick[1]:
        ints[march.I_AXIAL] = data.DOWN
    if kick[3]:
        ints[march.I_TORSION] = data.FORWARD
    if kick[0] or kick[2] or kick[4:].any():
        ints[march.I_LEVEL] = 0
    reals[march.STEP] = 1e-2 * structure.delay
    reals[march.NEXT_SAMPLE] = settings.real[data.T_ON]
    if controller is not None and controller.activation == 0.0:
        # What the drive gives at this instant is where its limits of rate begin.
        y[n + m : n + 2 * m] = y[n : n + m]
    if not settings.whole[data.LINEAR]:
        arrays = structure.arrays
        loads = np.array([arrays.steady[0], arrays.top_torque])
        settings.real[data.BOUNDS : data.WALL] = rate_bounds(
            point, loads, settings.drive, y[: n + m]
        )
    control.take_sample(settings, history, first, ints, reals, 0.0, y)
    work = march.workplace(settings)
    march.enter(settings, history, first, ints, reals, chain, data.BEGIN, 0.0, y, work)
    return standing


def _added(structure: Structure, scenario: Scenario) -> FloatArray:
    """Return what is added to the states at t = 0, (n,)."""
    added = scenario.perturbation(structure.state_names)
    speeds = np.array(scenario.kick) * (structure.penetration_rate, structure.omega0)
    if not scenario.alone:
        speeds += added[[1, 3]]
        added[[1, 3]] = 0.0
    return added + structure.kicked(*speeds.tolist())


def _blank(structure: Structure, settings: data.Settings, room: int) -> March:
    """Return a march before anything."""
    march = kernel("march")
    n, m = structure.arrays.B.shape
    chain = np.zeros(data.LATE, dtype=np.int64)
    following = np.ones(data.DELAYS, dtype=np.int64)
    ints, reals = np.zeros(march.LAG0 + 3, dtype=np.int64), np.zeros(march.REALS)
    ints[[march.STEPS, march.I_CONTACT, march.I_PASSES, march.I_LEVEL]] = 1
    sides = int(settings.whole[data.SIDES])
    y = np.zeros(data.vector_length(n, m, sides))
    return March(settings, empty_history(room, n, m, sides), ints, reals, y, chain, following, 1)


def _set_off(structure: Structure, settings: data.Settings, start: str, room: int) -> March:
    """Return a march after steady drilling, or with a bit at rest."""
    standing = _blank(structure, settings, room + 1)
    before, y = standing.history.real[0], standing.y
    before[[data.START, data.LENGTH]] = -1.0, 1.0
    if start == "rest":
        state, after = structure.rest
        n = len(state)
        y[:n] = after
        # Until then all moves as one against the frame of steady drilling.
        top = np.array([0.0, -structure.penetration_rate, 0.0, -structure.omega0])
        string = structure.arrays
        rate = string.A @ state - string.E @ string.steady + string.T @ top
        rate += string.side_force @ string.side_torque
        y[y.size - settings.whole[data.SIDES] :] = string.side_torque[1:]
        before[data.X : data.X + 2] = state[0] - rate[0], rate[0]
        before[data.THETA] = state[2]
        for i in range(4, n):
            column = data.OTHERS + data.QUARTIC * (i - 4)
            before[column : column + 2] = state[i] - rate[i], rate[i]
    standing.history.whole[0, [data.CONTACT, data.PASSES]] = 1
    return _stand_still(standing, structure, settings) if start == "stick" else standing


def _stand_still(standing: March, structure: Structure, settings: data.Settings) -> March:
    """Return a march in which the bit stood still before t = 0, after steady drilling."""
    march = kernel("march")
    row, whole = standing.history.real[1], standing.history.whole[1]
    first, last = structure.stuck(STOOD)
    turn = last - first
    standing.history.real[0, data.START] -= STOOD
    row[[data.START, data.LENGTH]] = -STOOD, STOOD
    for place, i in ((data.X, 0), (data.THETA, 2)):
        row[place : place + 2] = first[i], turn[i]
    for i in range(4, len(first)):
        column = data.OTHERS + data.QUARTIC * (i - 4)
        row[column : column + 2] = first[i], turn[i]
    whole[[data.CONTACT, data.PASSES, data.LEVEL]] = 1
    whole[data.TORSION], whole[data.AXIAL] = data.STUCK, data.HELD
    standing.y[: len(last)] = last
    standing.ints[march.I_TORSION], standing.ints[march.I_AXIAL] = data.STUCK, data.HELD
    standing.ints[march.STEPS] = 2
    _look_back(standing, structure, settings, 2)
    return standing._replace(first=2)


def longest_lag(settings: data.Settings) -> float:
    """Return how far back constant delays look."""
    model, sets = kernel("model"), range(len(settings.schedule))
    return float(max(model.lag_of(settings, i, k) for i in range(3) for k in sets))


def _look_back(
    standing: March,
    structure: Structure,
    settings: data.Settings,
    steps: int,
    known: float = math.inf,
) -> None:
    """Set the steps before t = 0, known for so long, at which constant delays look."""
    march, model, interpolate = (kernel(name) for name in ("march", "model", "interpolate"))
    longest = longest_lag(settings)
    if longest > known:
        raise InputError("start", f"a past of {known:g}", f"one that is known for {longest:g}")
    for i in range(3):
        lag = model.lag_of(settings, i, 0)
        if lag > 0.0:
            standing.ints[march.LAG0 + i] = interpolate.step_at(standing.history, steps, -lag)


def _resume(past: Past, structure: Structure, settings: data.Settings, room: int) -> March:
    """Return a march that goes on from what another has left behind."""
    march, breaks, interpolate = (kernel(name) for name in ("march", "breaks", "interpolate"))
    steps = len(past.real)
    standing = _blank(structure, settings, steps + room)._replace(first=steps)
    _, history, ints, reals, y, chain, following, _ = standing
    history.real[:steps], history.whole[:steps] = past.real, past.whole
    y[: past.state.size] = past.state
    sides = int(settings.whole[data.SIDES])
    y[y.size - sides :] = past.real[-1, past.real.shape[1] - sides :]
    last = past.whole[-1]
    ints[march.STEPS] = steps
    ints[march.I_CONTACT] = last[data.CONTACT]
    ints[march.I_TORSION], ints[march.I_AXIAL] = last[data.TORSION], last[data.AXIAL]
    # Another controller takes over: its torque need not continue the one before.
    ints[march.I_LEVEL] = 2
    _look_back(standing, structure, settings, steps, past.known)
    if past.model == "nonlinear":
        chain[:] = last[[data.LAG, data.FACE]]
        passes = ints[march.I_PASSES] = int(last[data.PASSES])
        if last[data.BEHIND]:
            # The lag in angle stays where it was when the bit turned back.
            turned = interpolate.furthest(history, steps - 1, 0.0, y[2])
            ints[march.I_BEHIND], reals[march.TURNED_T : march.REALS] = 1, turned
            following[: data.LATE] = chain + 1
            return standing
        where = settings, history, steps, chain, following, passes, 0.0, y[2]
        ints[march.I_PASSES] = breaks.retrace(*where, 1e-13 * (1.0 + abs(y[2])))
    return standing
