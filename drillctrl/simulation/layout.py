"""Settings of a run, as the compiled integrator takes them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.drilling.motion import MotionArrays
from drillctrl.simulation.compile import law_address
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.kernel import data
from drillctrl.simulation.pivots import follow_pivots
from drillctrl.simulation.structure import Structure

MAX_SAMPLES = 10_000_000


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
