"""Lay out a run for the compiled integrator: its settings, its past and its first state."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.drilling.motion import MotionArrays
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.bounds import rate_bounds
from drillctrl.simulation.compile import kernel, law_address
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.kernel import data
from drillctrl.simulation.past import Past
from drillctrl.simulation.pivots import follow_pivots
from drillctrl.simulation.scenario import STOOD, Scenario
from drillctrl.simulation.structure import Structure

FIRST_ROOM = 4096
MAX_SAMPLES = 10_000_000


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


def settings_for(
    structure: Structure,
    controller: Controller | None,
    drive: FloatArray,
    *,
    duration: float,
    linear: bool,
    multiple: bool,
    backwards: bool,
    rtol: float,
    atol: float,
) -> data.Settings:
    """Return the `Settings` of a run; ``drive`` is as `Scenario.drive` returns it."""
    arrays = structure.arrays
    n, m = arrays.B.shape
    sides = _count_sides(arrays, linear)
    p = len(structure.output_names)
    whole, real = np.zeros(data.ROWS, dtype=np.int64), np.zeros(data.LIMITS + 2 * m)
    whole[[data.STATES, data.INPUTS, data.OUTPUTS]] = n, m, p
    whole[data.LINEAR], whole[data.MULTIPLE] = linear, multiple
    whole[data.BACKWARDS], whole[data.SIDES] = backwards, sides
    real[[data.WEIGHT, data.TORQUE]] = arrays.steady
    real[data.CUT] = structure.steady_depth
    real[[data.BY_WEIGHT, data.BY_TORQUE]] = arrays.E[1, 0], arrays.E[3, 1]
    real[data.WALL] = arrays.side_torque[:1].sum()
    real[data.WALL_HELD] = arrays.side_held[:1].sum()
    real[[data.RTOL, data.ATOL]] = rtol, atol
    real[data.SCALE : data.LIMITS] = _scales(structure)
    real[data.BOUNDS : data.WALL] = real[data.LIMITS :] = np.inf
    schedule, K1, K2 = np.zeros((1, 2)), np.zeros((1, m, p)), np.zeros((1, m, p))
    fed, noise = np.zeros(0, dtype=np.int64), np.zeros((0, p))
    if linear:
        real[data.LAGS] = structure.delay
    if controller is not None:
        times, K1, K2 = controller.gains(structure.input_names, structure.output_names)
        past, ages = bool(K2.any()), controller.delays(structure.delay)
        current = controller.delay == "current" and not linear
        fed = np.flatnonzero(np.concatenate([K1, K2]).any(axis=(0, 1)))
        whole[data.FEEDBACK] = 1
        whole[data.PAST] = past
        whole[data.CURRENT_DELAY] = current and past
        whole[data.SAMPLED] = controller.period is not None
        whole[data.ACTUATOR] = controller.actuator_lag > 0.0
        whole[data.RATE_FEEDBACK] = _rough(structure)[fed].any()
        real[data.T_ON] = controller.activation
        real[data.MEASURE_DELAY] = controller.measurement_delay
        real[data.LAG_TIME] = controller.actuator_lag
        if controller.limit is not None:
            real[data.LIMITS : data.LIMITS + m] = controller.limit
        if controller.rate_limit is not None:
            real[data.LIMITS + m :] = controller.rate_limit
        if controller.period is not None:
            real[data.PERIOD] = controller.period
            noise = _noise(controller, structure.output_names, duration)
        else:
            real[data.LAGS + 1] = controller.measurement_delay
            reach = past and not current
            ages = controller.measurement_delay + ages if reach else np.zeros_like(ages)
        schedule = np.column_stack([times, ages])
    rows = _rows(structure, controller, linear)
    pivots = follow_pivots(rows, structure.state_names, sides)
    whole[data.PIVOT : data.ROWS] = [*pivots, *[-1] * (data.PIVOTS - len(pivots))]
    index, value = _entries(rows)
    whole[data.FED] = data.ROWS + index.size
    return data.Settings(
        bit=structure.bit,
        law=(law_address(structure.law), np.ascontiguousarray(arrays.q)),
        whole=np.concatenate([whole, index, fed]),
        real=real,
        value=value,
        schedule=schedule,
        gains=np.ascontiguousarray(np.stack([K1, K2])[..., fed]),
        drive=drive,
        noise=np.ascontiguousarray(noise[:, fed]),
        side=np.ascontiguousarray(_side(arrays)[:sides]),
    )


def _rows(structure: Structure, controller: Controller | None, linear: bool) -> FloatArray:
    """Return the matrix of `Settings`, (n + p + 1, `vector_length`)."""
    string = structure.arrays
    n, m = string.B.shape
    p = len(structure.output_names)
    sides = _count_sides(string, linear)
    rows = np.zeros((n + p + 1, data.vector_length(n, m, sides)))
    inputs, top, load = n + 2 * m, n + 3 * m, n + 3 * m + 4
    rows[:n, :n], rows[:n, inputs:top], rows[:n, top:load] = string.A, string.B, string.T
    rows[:n, load : load + 2] = string.E
    if sides:
        rows[:n, -sides:] = string.side_force[:, 1:]
    rows[n : n + p, :n], rows[n : n + p, top:load] = string.C, -string.R
    if linear:
        rows[:n, :n], rows[:n, top:load] = string.linear, string.linear_delayed
        rows[:n, load : load + 2] = rows[n : n + p, top:load] = 0.0
        rows[-1, :4], rows[-1, top:load] = string.depth[:4], string.depth[4:8]
    if controller is not None:
        for state, rate in controller.back_calculation.items():
            for name in controller.driven:
                beyond = load + 2 + structure.input_names.index(name)
                rows[structure.state_names.index(state), beyond] = -rate
    return rows


def _entries(rows: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """Return what `Settings.whole` has from ROWS on, and `Settings.value`."""
    place, column = np.nonzero(rows)
    count = len(rows) + 1
    start = data.ROWS + count
    index = np.concatenate([start + np.searchsorted(place, np.arange(count)), column])
    return index.astype(np.int64), np.concatenate([np.zeros(start), rows[place, column]])


def _rough(structure: Structure) -> npt.NDArray[np.bool_]:
    """Which outputs have a rate that jumps where a load, an input or the drive does, (p,)."""
    string = structure.arrays
    jumps = np.hstack([string.E, string.B, string.T])
    return np.asarray((string.C @ jumps != 0.0).any(axis=1))


def _count_sides(string: MotionArrays, linear: bool) -> int:
    """Return how many parts rub on the wall without the bit's; in small motion all slide."""
    return 0 if linear else max(0, string.side_torque.size - 1)


def _side(string: MotionArrays) -> FloatArray:
    """Return ``side`` of `Settings`."""
    force, rate = string.side_force[:, 1:], string.side_rate[1:]
    free = rate[:, :-1] @ force
    # What holds the bit turns the string back by as much as friction turns the bit.
    held = free - np.outer(rate[:, :-1] @ string.E[:, 1], force[3]) / string.E[3, 1]
    torques = np.stack([string.side_torque, string.side_held], axis=1)[1:]
    return np.hstack([rate, torques, free, held])


def _noise(controller: Controller, names: tuple[str, ...], duration: float) -> FloatArray:
    assert controller.period is not None
    count = max(0.0, (duration - controller.activation) / controller.period) + 2.0
    if count > MAX_SAMPLES:
        shortest = f"at least {duration / MAX_SAMPLES:.3g} for this duration"
        raise InputError("period", controller.period, shortest)
    deviation = np.array([controller.noise.get(name, 0.0) for name in names])
    if not deviation.any():
        return np.zeros((0, len(names)))
    generator = np.random.default_rng(controller.seed)
    draws: FloatArray = deviation * generator.normal(size=(int(count), len(names)))
    return draws


def _scales(structure: Structure) -> tuple[float, ...]:
    """Size of each event function but the limits, in the order of the kinds of event."""
    string = structure.arrays
    force, moment = np.abs([string.E[1, 0], string.E[3, 1]]) * string.steady + 1.0
    rate, depth = max(structure.penetration_rate, 1e-3), max(structure.steady_depth, 1e-3)
    scales = structure.omega0, moment, moment, rate, force, force, depth, 1.0, 1.0, 1.0
    return tuple(float(scale) for scale in scales)


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
