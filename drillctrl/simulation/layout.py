"""Lay out a run for the compiled integrator."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.drilling.branches import (
    branch_functions,
    dimensionless_plant,
    linear_depth,
    linearisation,
    parameter_vector,
)
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.compile import kernel
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.past import Past
from drillctrl.simulation.scenario import Scenario

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
    point: OperatingPoint,
    controller: Controller | None,
    scenario: Scenario,
    *,
    duration: float,
    linear: bool,
    multiple: bool,
    rtol: float,
    atol: float,
) -> Any:
    """Return the `Settings` of a run."""
    data = kernel("data")
    p = parameter_vector(point)
    a1, a2, b, _ = (value.full() for value in linearisation(dimensionless_plant())(p))
    linear_rows = np.zeros((5, 10))
    linear_rows[:4] = np.hstack([a1, a2, b])
    linear_rows[4, :8] = linear_depth()(p).full().ravel()
    linear_rows[4, 8] = 2.0 * np.pi * point.delta0
    flags = np.zeros(7, dtype=np.int64)
    flags[data.LINEAR], flags[data.MULTIPLE] = linear, multiple
    control = np.zeros(4)
    limit, rate, lags = np.full(2, np.inf), np.full(2, np.inf), np.zeros(2)
    times, K1, K2 = np.zeros(1), np.zeros((1, 2, 4)), np.zeros((1, 2, 4))
    noise, ages = np.zeros((0, 4)), np.zeros(1)
    if linear:
        lags[0] = point.delay
    if controller is not None:
        times, K1, K2 = controller.gains()
        past, ages = bool(K2.any()), controller.delays(point.delay)
        sampled = controller.period is not None
        current = controller.delay == "current" and not linear
        flags[data.FEEDBACK] = 1
        flags[data.CURRENT_DELAY] = current and past
        flags[data.SAMPLED] = sampled
        flags[data.ACTUATOR] = controller.actuator_lag > 0.0
        flags[data.RATE_FEEDBACK] = bool(K1[:, :, [1, 3]].any() or K2[:, :, [1, 3]].any())
        control[data.T_ON] = controller.activation
        control[data.MEASURE_DELAY] = controller.measurement_delay
        control[data.LAG_TIME] = controller.actuator_lag
        if controller.limit is not None:
            limit[:] = controller.limit
        if controller.rate_limit is not None:
            rate[:] = controller.rate_limit
        if controller.period is not None:
            control[data.PERIOD] = controller.period
            noise = _noise(controller, duration)
        else:
            lags[1] = controller.measurement_delay
            reach = past and not current
            ages = controller.measurement_delay + ages if reach else np.zeros_like(ages)
    return data.Settings(
        p=tuple(p.tolist()),
        flags=tuple(flags.tolist()),
        control=tuple(control.tolist()),
        limit=tuple(limit.tolist()),
        rate=tuple(rate.tolist()),
        gains=np.column_stack([times, K1.reshape(-1, 8), K2.reshape(-1, 8), ages]),
        drive=scenario.drive(point),
        linear=linear_rows,
        lags=tuple(lags.tolist()),
        noise=noise,
        tolerance=(rtol, atol),
        scale=tuple(_scales(point, limit, rate).tolist()),
    )


def _noise(controller: Controller, duration: float) -> FloatArray:
    assert controller.period is not None
    count = max(0.0, (duration - controller.activation) / controller.period) + 2.0
    if count > MAX_SAMPLES:
        shortest = f"at least {duration / MAX_SAMPLES:.3g} for this duration"
        raise InputError("period", controller.period, shortest)
    deviation = np.array(
        [controller.noise.get(name, 0.0) for name in dimensionless_plant().state_names]
    )
    if not deviation.any():
        return np.zeros((0, 4))
    generator = np.random.default_rng(controller.seed)
    draws: FloatArray = deviation * generator.normal(size=(int(count), 4))
    return draws


def _scales(point: OperatingPoint, limit: FloatArray, rate_limit: FloatArray) -> FloatArray:
    """Size of each event function at the point, in the order of the kinds of event."""
    assert point.lam is not None
    depth = max(2.0 * np.pi * point.delta0, 1e-3)
    torque = depth + point.beta + 1.0
    force = point.psi * depth + point.lam + 1.0
    rate = max(point.penetration_rate, 1e-3)
    scales = [point.omega0, torque, torque, rate, force, force, depth, *limit, *rate_limit]
    return np.where(np.isfinite(scales), scales, 1.0)


def empty_history(room: int) -> Any:
    """Return a `History` with room for so many steps."""
    data = kernel("data")
    real = np.zeros((room, data.REALS))
    return data.History(real, np.zeros((room, data.WHOLES), dtype=np.int64))


def resized(history: Any, room: int, used: int) -> Any:
    """Return a copy of a history with other room."""
    copies = []
    for old in history:
        new = np.zeros((room, *old.shape[1:]), dtype=old.dtype)
        new[:used] = old[:used]
        copies.append(new)
    return type(history)(*copies)


def check_start(point: OperatingPoint, scenario: Scenario, linear: bool) -> None:
    """Refuse a start that the model does not cover.

    Raises
    ------
    InputError
        If the bit would start turning backwards, the linear model from rest, or a run from
        the past of another operating point or model.
    """
    start = scenario.start
    low = -point.omega0
    if isinstance(start, Past):
        if start.point != point:
            raise InputError("start", repr(start), f"a past of {point!r}, not of {start.point!r}")
        if (start.model == "linear") != linear:
            raise InputError("model", "linear" if linear else "nonlinear", "that of the past")
        low -= float(start.state[3])
    elif start == "rest":
        if linear:
            raise InputError("start", "rest", "steady for the linear model")
        low = 0.0
    kick = scenario.perturbation()[3]
    if not linear and kick < low:
        raise InputError("initial dtheta", kick, f"at least {low:g}: the bit must not turn back")


def begin(
    point: OperatingPoint,
    controller: Controller | None,
    settings: Any,
    scenario: Scenario,
    room: int = FIRST_ROOM,
) -> March:
    """Return a march that stands at t = 0.

    Before t = 0 there is step 0: steady drilling, or flat rock under a bit at rest (which
    is any motion with constant Z; the delay it implies is that of steady drilling); and the
    steps of a run that is gone on from. The start has passed `check_start`.
    """
    march, control = kernel("march"), kernel("control")
    standing = (
        _resume(scenario.start, settings, room)
        if isinstance(scenario.start, Past)
        else _set_off(point, settings, scenario.start, room)
    )
    _, history, ints, reals, y, chain, _, first = standing
    kick = scenario.perturbation()
    y[:4] += kick
    if kick[1]:
        ints[march.I_AXIAL] = kernel("data").DOWN
    if kick[3]:
        ints[march.I_TORSION] = kernel("data").FORWARD
    if kick[0] or kick[2]:
        ints[march.I_LEVEL] = 0
    reals[march.STEP] = 1e-2 * point.delay
    reals[march.NEXT_SAMPLE] = settings.control[kernel("data").T_ON]
    if controller is not None and controller.activation == 0.0:
        # What the drive gives at this instant is where its limits of rate begin.
        reals[[march.HELD0, march.HELD1]] = y[4:]
    control.take_sample(settings, history, first, ints, reals, 0.0)
    march.enter(settings, history, first, ints, reals, chain, kernel("data").BEGIN, 0.0, y)
    return standing


def _blank(settings: Any, room: int) -> March:
    """Return a march before anything."""
    data, march = kernel("data"), kernel("march")
    chain = np.zeros(data.MAX_FACE_LEVELS, dtype=np.int64)
    following = np.ones(data.MAX_FACE_LEVELS + 3, dtype=np.int64)
    ints, reals = np.zeros(march.LAG0 + 3, dtype=np.int64), np.zeros(5)
    ints[[march.STEPS, march.I_CONTACT, march.I_PASSES, march.I_LEVEL]] = 1
    return March(settings, empty_history(room), ints, reals, np.zeros(6), chain, following, 1)


def _set_off(point: OperatingPoint, settings: Any, start: str, room: int) -> March:
    """Return a march after steady drilling, or with a bit at rest."""
    data = kernel("data")
    standing = _blank(settings, room)
    before, y = standing.history.real[0], standing.y
    before[[data.START, data.LENGTH]] = -1.0, 1.0
    if start == "rest":
        y[[0, 2]] = branch_functions()[-1](np.array(settings.p)).full().ravel()
        before[data.X : data.X + 2] = y[0] + point.penetration_rate, -point.penetration_rate
        before[data.THETA] = y[2]
        y[[1, 3]] = -point.penetration_rate, -point.omega0
    standing.history.whole[0, [data.CONTACT, data.PASSES]] = 1
    return standing


def _resume(past: Past, settings: Any, room: int) -> March:
    """Return a march that goes on from what another has left behind."""
    data, march, breaks = kernel("data"), kernel("march"), kernel("breaks")
    steps = len(past.real)
    standing = _blank(settings, steps + room)._replace(first=steps)
    _, history, ints, _, y, chain, following, _ = standing
    history.real[:steps], history.whole[:steps] = past.real, past.whole
    y[:] = past.state
    last = past.whole[-1]
    ints[march.STEPS] = steps
    ints[march.I_CONTACT] = last[data.CONTACT]
    ints[march.I_TORSION], ints[march.I_AXIAL] = last[data.TORSION], last[data.AXIAL]
    # Another controller takes over: its torque need not continue the one before.
    ints[march.I_LEVEL] = 2
    for i in range(3):
        lag = kernel("model").lag_of(settings, i, 0)
        if lag > 0.0:
            ints[march.LAG0 + i] = kernel("interpolate").step_at(history, steps, -lag)
    if past.model == "nonlinear":
        where = settings, history, steps, chain, following, 0.0, y[2]
        ints[march.I_PASSES] = breaks.retrace(*where, 1e-13 * (1.0 + abs(y[2])))
    return standing
