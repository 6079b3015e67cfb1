"""Lay out a run for the compiled integrator."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.errors import InputError
from drillctrl.operating_point import OperatingPoint
from drillctrl.plant import (
    branch_functions,
    dimensionless_plant,
    linear_depth,
    linearisation,
    parameter_vector,
)
from drillctrl.simulation.build import kernel
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.scenario import Scenario

FloatArray = npt.NDArray[np.float64]
FIRST_ROOM = 4096
MAX_SAMPLES = 10_000_000


class March(NamedTuple):
    """Where the integrator stands, and what it has stored."""

    settings: Any
    history: Any
    ints: npt.NDArray[np.int64]
    reals: FloatArray
    y: FloatArray
    chain: npt.NDArray[np.int64]
    following: npt.NDArray[np.int64]


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
    control = np.zeros(5)
    limit, rate, lags = np.full(2, np.inf), np.full(2, np.inf), np.zeros(3)
    times, K1, K2 = np.zeros(1), np.zeros((1, 2, 4)), np.zeros((1, 2, 4))
    noise = np.zeros((0, 4))
    if linear:
        lags[0] = point.delay
    if controller is not None:
        times, K1, K2 = controller.gains()
        past = bool(K2.any())
        sampled = controller.period is not None
        current = controller.delay == "current" and not linear
        flags[data.FEEDBACK] = 1
        flags[data.CURRENT_DELAY] = current and past
        flags[data.SAMPLED] = sampled
        flags[data.ACTUATOR] = controller.actuator_lag > 0.0
        flags[data.RATE_FEEDBACK] = bool(K1[:, :, [1, 3]].any() or K2[:, :, [1, 3]].any())
        control[data.T_ON] = controller.activation
        control[data.MEASURE_DELAY] = controller.measurement_delay
        control[data.FEEDBACK_DELAY] = point.delay
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
            if past and not current:
                lags[2] = controller.measurement_delay + point.delay
    return data.Settings(
        p=tuple(p.tolist()),
        flags=tuple(flags.tolist()),
        control=tuple(control.tolist()),
        limit=tuple(limit.tolist()),
        rate=tuple(rate.tolist()),
        gains=np.column_stack([times, K1.reshape(-1, 8), K2.reshape(-1, 8)]),
        drive=scenario.drive(point),
        linear=linear_rows,
        lags=tuple(lags.tolist()),
        noise=noise,
        tolerance=(rtol, atol),
        scale=tuple(_scales(point).tolist()),
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


def _scales(point: OperatingPoint) -> FloatArray:
    """Size of each event function at the point, in the order of the kinds of event."""
    assert point.lam is not None
    depth = max(2.0 * np.pi * point.delta0, 1e-3)
    torque = depth + point.beta + 1.0
    force = point.psi * depth + point.lam + 1.0
    rate = max(point.penetration_rate, 1e-3)
    return np.array([point.omega0, torque, torque, rate, force, force, depth])


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
        If the bit would start turning backwards, or the linear model from rest.
    """
    if linear and scenario.start == "rest":
        raise InputError("start", "rest", "steady for the linear model")
    kick = scenario.perturbation()[3]
    low = -point.omega0 if scenario.start == "steady" else 0.0
    if not linear and kick < low:
        raise InputError("initial dtheta", kick, f"at least {low:g}: the bit must not turn back")


def begin(
    point: OperatingPoint, settings: Any, scenario: Scenario, linear: bool, room: int = FIRST_ROOM
) -> March:
    """Return a march that stands at t = 0.

    Before t = 0 there is step 0: steady drilling, or flat rock under a bit at rest (which
    is any motion with constant Z; the delay it implies is that of steady drilling). The
    start has passed `check_start`.
    """
    data, march, switch = kernel("data"), kernel("march"), kernel("switch")
    history = empty_history(room)
    before = history.real[0]
    before[[data.START, data.LENGTH]] = -1.0, 1.0
    kick = scenario.perturbation()
    y = np.zeros(6)
    if scenario.start == "rest":
        y[[0, 2]] = branch_functions()[-1](np.array(settings.p)).full().ravel()
        before[data.X : data.X + 2] = y[0] + point.penetration_rate, -point.penetration_rate
        before[data.THETA] = y[2]
        y[[1, 3]] = -point.penetration_rate, -point.omega0
    y[:4] += kick
    history.whole[0, [data.CONTACT, data.PASSES]] = 1
    ints = np.zeros(march.LAG0 + 3, dtype=np.int64)
    reals = np.zeros(5)
    chain = np.zeros(data.MAX_FACE_LEVELS, dtype=np.int64)
    following = np.ones(data.MAX_FACE_LEVELS + 3, dtype=np.int64)
    ints[march.STEPS] = ints[march.I_CONTACT] = ints[march.I_PASSES] = 1
    ints[march.I_LEVEL] = 0 if kick[0] or kick[2] else 1
    reals[march.STEP] = 1e-2 * point.delay
    reals[march.NEXT_SAMPLE] = settings.control[data.T_ON]
    standing = March(settings, history, ints, reals, y, chain, following)
    kernel("control").take_sample(settings, history, 1, ints, reals, 0.0)
    mode = march.mode_of(ints, reals, chain)
    after = switch.next_mode(settings, history, 1, mode, data.BEGIN, 0.0, y)
    march.enter(ints, after)
    return standing
