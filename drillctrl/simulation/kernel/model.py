"""The motion on one smooth branch: delayed signals, control, loads, accelerations."""

from __future__ import annotations

import numba

from .data import (
    ACTUATOR,
    CURRENT_DELAY,
    DOWN,
    DRIVE_STRENGTH,
    DRIVE_T,
    DRIVE_THETA,
    DRIVE_X,
    FEEDBACK,
    HELD,
    LAG_TIME,
    LENGTH,
    LINEAR,
    P_DELAY,
    P_DEPTH,
    P_DOWN,
    P_FORWARD,
    P_PRESSED,
    P_REVERSE,
    P_ROOM,
    P_U0,
    P_U1,
    P_UP,
    PAST_AGE,
    REVERSE,
    SAMPLED,
    START,
    STUCK,
)
from .interpolate import locate_angle, locate_time, pitch_of, state_at
from .physics import acceleration, depth


@numba.njit(cache=True, error_model="numpy")
def top_at(drive, piece, t):
    """Motion of the top end beyond V0 t and Ω0 t: (x, θ) and their rates."""
    dt = t - drive[piece, DRIVE_T]
    x, theta = DRIVE_X, DRIVE_THETA
    return (
        drive[piece, x] + dt * (drive[piece, x + 1] + 0.5 * dt * drive[piece, x + 2]),
        drive[piece, x + 1] + dt * drive[piece, x + 2],
        drive[piece, theta] + dt * (drive[piece, theta + 1] + 0.5 * dt * drive[piece, theta + 2]),
        drive[piece, theta + 1] + dt * drive[piece, theta + 2],
    )


@numba.njit(cache=True, error_model="numpy")
def strength_at(drive, piece, t):
    """Rock strength relative to the starting point's."""
    return (
        drive[piece, DRIVE_STRENGTH]
        + (t - drive[piece, DRIVE_T]) * (drive[piece, DRIVE_STRENGTH + 1])
    )


@numba.njit(cache=True, error_model="numpy")
def piece_at(times, t):
    """Index of the last entry of a rising list that is not after t (the first otherwise)."""
    k = 0
    while k + 1 < times.shape[0] and times[k + 1] <= t:
        k += 1
    return k


@numba.njit(cache=True, error_model="numpy")
def measured(drive, state, t):
    """State as the controller sees it: beyond what the top end has been told to do."""
    if drive.shape[0] == 1:
        return state
    k = piece_at(drive[:, DRIVE_T], t)
    top = top_at(drive, k, t)
    return (state[0] - top[0], state[1] - top[1], state[2] - top[2], state[3] - top[3])


@numba.njit(cache=True, error_model="numpy")
def command(rows, gains, now, then, i):
    """K1 Y + K2 Y_delayed for input i (Eqs. 36, 38)."""
    u = 0.0
    for k in range(4):
        u += rows[gains, 1 + 4 * i + k] * now[k] + rows[gains, 9 + 4 * i + k] * then[k]
    return u


@numba.njit(cache=True, error_model="numpy")
def within(value, limit):
    """The value, or the limit it is beyond."""
    return min(max(value, -limit), limit)


@numba.njit(cache=True, error_model="numpy")
def lag_of(settings, i, gains):
    """Constant delays: of the linear model, the measured and the fed back signal; 0: none."""
    if i < 2:
        return settings.lags[i]
    return 0.0 if settings.flags[SAMPLED] == 1 else settings.gains[gains, PAST_AGE]


@numba.njit(cache=True, error_model="numpy")
def wanted_at(settings, history, steps, mode, t, state, lagged):
    """Command of the controller at t before its limits."""
    flags = settings.flags
    if flags[SAMPLED] == 1:
        return mode.held0, mode.held1
    now, t_now = state, t
    if settings.lags[1] > 0.0:
        t_now = t - settings.lags[1]
        j, s = locate_time(history, steps, mode.lag1, t_now)
        now = state_at(history, j, s)
    then, t_then = now, t_now
    if flags[CURRENT_DELAY] == 1:
        then, t_then = (lagged[0], lagged[1], lagged[2], lagged[3]), t - lagged[4]
    elif lag_of(settings, 2, mode.gains) > 0.0:
        t_then = t - lag_of(settings, 2, mode.gains)
        j, s = locate_time(history, steps, mode.lag2, t_then)
        then = state_at(history, j, s)
    now = measured(settings.drive, now, t_now)
    then = measured(settings.drive, then, t_then)
    return (
        command(settings.gains, mode.gains, now, then, 0),
        command(settings.gains, mode.gains, now, then, 1),
    )


@numba.njit(cache=True, error_model="numpy")
def inputs_at(settings, history, steps, mode, t, y, state, lagged, out, probe):
    """Inputs to the plant at t: commands, or actuators that follow them with a lag (Eq. 36).

    Commands and rates of actuators are held within their limits here; the probe takes what
    is left of these, so that an event can meet them.
    """
    wanted = (0.0, 0.0)
    if mode.on == 1:
        wanted = wanted_at(settings, history, steps, mode, t, state, lagged)
    limit = settings.limit
    probe[P_ROOM], probe[P_ROOM + 1] = limit[0] - abs(wanted[0]), limit[1] - abs(wanted[1])
    u = within(wanted[0], limit[0]), within(wanted[1], limit[1])
    if settings.flags[ACTUATOR] == 0:
        return u
    for i in range(2):
        slew = (u[i] - y[4 + i]) / settings.control[LAG_TIME]
        probe[P_ROOM + 2 + i] = settings.rate[i] - abs(slew)
        out[4 + i] = within(slew, settings.rate[i])
    return y[4], y[5]


@numba.njit(cache=True, error_model="numpy")
def rate_of_change(settings, history, steps, mode, t, y, out, probe):
    """Right-hand side on one branch; False if a delayed instant lies beyond the history.

    Parameters
    ----------
    y, out : array, (6,)
        x, x', θ, θ' and the two actuator states; their rates of change.
    probe : array, (13,)
        Takes depth, accelerations at the limits of what contact can bear, delay, inputs.
    """
    p = settings.p
    state = (y[0], y[1], y[2], y[3])
    if settings.flags[LINEAR] == 1:
        return linear_rate(settings, history, steps, mode, t, y, out, probe)
    j, s = locate_angle(history, p, steps, mode.lag, t, y[2], 0.0)
    if j < 0:
        return False
    then = state_at(history, j, s)
    delay = t - history.real[j, START] - s * history.real[j, LENGTH]
    face, since = then, delay
    if mode.passes > 1:
        extra = (mode.passes - 1) * pitch_of(p)
        j, s = locate_angle(history, p, steps, mode.face, t, y[2], extra)
        face = state_at(history, j, s)
        since = t - history.real[j, START] - s * history.real[j, LENGTH]
    d = depth(state, face, since, p)
    lagged = (then[0], then[1], then[2], then[3], delay)
    u = (0.0, 0.0)
    if settings.flags[FEEDBACK] == 1:
        u = inputs_at(settings, history, steps, mode, t, y, state, lagged, out, probe)
    top, strength = (0.0, 0.0), 1.0
    if settings.drive.shape[0] > 1:
        moved = top_at(settings.drive, mode.piece, t)
        top = (moved[0], moved[2])
        strength = strength_at(settings.drive, mode.piece, t)
    out[0], out[2] = y[1], y[3]
    probe[P_DEPTH], probe[P_DELAY], probe[P_U0], probe[P_U1] = d, delay, u[0], u[1]
    out[1], out[3] = branch_acceleration(
        state, u, top, strength * d, mode.contact, mode.torsion, mode.axial, p, probe
    )
    return True


@numba.njit(cache=True, error_model="numpy")
def branch_acceleration(state, u, top, cut, contact, torsion, axial, p, probe):
    """x'' and θ'' in a mode, with the set-valued loads of Φ' = 0 and Z' = 0 resolved.

    At Z' = 0 the share of the wear-flat force is the one that holds the bit; at Φ' = 0 the
    torque is, and the cutters press as for Φ' > 0, since H(0) = 1 (Eq. 5).
    """
    direction = -1.0 if torsion == REVERSE else 1.0
    if contact == 0 or torsion == REVERSE:
        cut = 0.0
    up, _ = acceleration(state, u, top, (cut, 0.0, direction), p)
    pressed = 0.0
    probe[P_UP] = up
    if contact == 1:
        down, _ = acceleration(state, u, top, (cut, 1.0, direction), p)
        probe[P_DOWN] = down
        if axial == DOWN:
            pressed = 1.0
        elif axial == HELD:
            pressed = up / (up - down) if up != down else 0.0
    probe[P_PRESSED] = pressed
    ax, at = acceleration(state, u, top, (cut, pressed, direction), p)
    probe[P_FORWARD] = at
    if torsion == STUCK:
        _, probe[P_REVERSE] = acceleration(state, u, top, (0.0, pressed, -1.0), p)
        at = 0.0
    if contact == 1 and axial == HELD:
        ax = 0.0
    return ax, at


@numba.njit(cache=True, error_model="numpy")
def linear_rate(settings, history, steps, mode, t, y, out, probe):
    """Right-hand side of the linear model (Eqs. 22, 34)."""
    j, s = locate_time(history, steps, mode.lag0, t - settings.lags[0])
    then = state_at(history, j, s)
    state = (y[0], y[1], y[2], y[3])
    lagged = (then[0], then[1], then[2], then[3], settings.lags[0])
    u = (0.0, 0.0)
    if settings.flags[FEEDBACK] == 1:
        u = inputs_at(settings, history, steps, mode, t, y, state, lagged, out, probe)
    rows = settings.linear
    d = rows[4, 8]  # 2πδ0
    for i in range(4):
        total = rows[i, 8] * u[0] + rows[i, 9] * u[1]
        for k in range(4):
            total += rows[i, k] * state[k] + rows[i, 4 + k] * then[k]
        out[i] = total
        d += rows[4, i] * state[i] + rows[4, 4 + i] * then[i]
    probe[P_DEPTH], probe[P_DELAY] = d, settings.lags[0]
    probe[P_U0], probe[P_U1], probe[P_PRESSED] = u[0], u[1], 1.0
    return True
