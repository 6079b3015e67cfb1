"""The motion on one smooth branch: delayed signals, control, loads, rates of change."""

from __future__ import annotations

import numpy as np

from .contact import bit_load
from .data import (
    ACTUATOR,
    BY_TORQUE,
    BY_WEIGHT,
    CURRENT_DELAY,
    CUT,
    DRIVE_STRENGTH,
    DRIVE_T,
    DRIVE_THETA,
    DRIVE_X,
    FED,
    FEEDBACK,
    HELD,
    INPUTS,
    LAG_TIME,
    LAGS,
    LENGTH,
    LIMITS,
    LINEAR,
    OTHERS,
    OUTPUTS,
    P_DELAY,
    P_DEPTH,
    P_LEFT,
    P_PRESSED,
    P_ROOM,
    PAST,
    PAST_AGE,
    PIVOT,
    PIVOTS,
    QUARTIC,
    RIDING,
    ROWS,
    SAMPLED,
    START,
    STATES,
    STUCK,
    TORQUE,
    WALL,
    WEIGHT,
)
from .interpolate import face_at, locate_angle, locate_time, pitch_of, quartic, state_at
from .jit import entry, inner
from .physics import depth, rates, turned


@inner
def top_at(drive, piece, t):
    """Motion of the top end beyond V0 t and Ω0 t: x, x', θ, θ'."""
    dt = t - drive[piece, DRIVE_T]
    x, theta = DRIVE_X, DRIVE_THETA
    return (
        drive[piece, x] + dt * (drive[piece, x + 1] + 0.5 * dt * drive[piece, x + 2]),
        drive[piece, x + 1] + dt * drive[piece, x + 2],
        drive[piece, theta] + dt * (drive[piece, theta + 1] + 0.5 * dt * drive[piece, theta + 2]),
        drive[piece, theta + 1] + dt * drive[piece, theta + 2],
    )


@inner
def strength_at(drive, piece, t):
    """Rock strength relative to the starting point's."""
    return (
        drive[piece, DRIVE_STRENGTH]
        + (t - drive[piece, DRIVE_T]) * (drive[piece, DRIVE_STRENGTH + 1])
    )


@inner
def piece_at(times, t):
    """Index of the last entry of a rising list that is not after t (the first otherwise)."""
    k = 0
    while k + 1 < times.shape[0] and times[k + 1] <= t:
        k += 1
    return k


@inner
def row_of(whole, value, i, y):
    """Row i of the matrix of `Settings` times y."""
    total = 0.0
    # Places without a sign are not looked at for being negative.
    for e in range(np.uint64(whole[ROWS + i]), np.uint64(whole[ROWS + i + 1])):
        total += value[e] * y[np.uint64(whole[e])]
    return total


@inner
def noise_of(noise, sample, f):
    """Noise of the output that is fed back in place f, in the sample that measured it."""
    count = noise.shape[0]
    return 0.0 if sample < 0 or count == 0 else noise[min(sample, count - 1), f]


@inner
def add_earlier(settings, history, which, row, place, sample, y):
    """Add to the places of u what gains give on the outputs at an earlier instant.

    ``place`` is the instant, the step it lies on and where; a negative ``sample`` has no noise.
    """
    whole, value, gains = settings.whole, settings.value, settings.gains
    n, m = whole[STATES], whole[INPUTS]
    time, j, s = place
    state, moved = state_at(history, j, s), (0.0, 0.0, 0.0, 0.0)
    if settings.drive.shape[0] > 1:
        moved = top_at(settings.drive, piece_at(settings.drive[:, DRIVE_T], time), time)
    for f in range(gains.shape[3]):
        k = whole[whole[FED] + f]
        total = noise_of(settings.noise, sample, f)
        for e in range(whole[ROWS + n + k], whole[ROWS + n + k + 1]):
            i = whole[e]
            if i < 4:
                total += value[e] * state[i]
            elif i < n:
                total += value[e] * quartic(history.real, OTHERS + QUARTIC * (i - 4), j, s)
            else:
                total += value[e] * moved[i - n - 3 * m]
        for i in range(m):
            y[n + 2 * m + i] += gains[which, row, i, f] * total


@inner
def add_present(settings, which, row, y):
    """Add to the places of u what gains give on the outputs now."""
    whole, gains = settings.whole, settings.gains
    n, m = whole[STATES], whole[INPUTS]
    for f in range(gains.shape[3]):
        output = row_of(whole, settings.value, n + whole[whole[FED] + f], y)
        for i in range(m):
            y[n + 2 * m + i] += gains[which, row, i, f] * output


@inner
def within(value, limit):
    """The value, or the limit it is beyond."""
    return min(max(value, -limit), limit)


@entry
def lag_of(settings, i, gains):
    """Constant delays: of the linear model, the measured and the fed back signal; 0: none."""
    if i < 2:
        return settings.real[LAGS + i]
    return 0.0 if settings.whole[SAMPLED] == 1 else settings.schedule[gains, PAST_AGE]


@inner
def command_at(settings, history, steps, mode, t, y, place):
    """Write the command of the controller at t, before its limits, into the places of u."""
    n, m = settings.whole[STATES], settings.whole[INPUTS]
    u = n + 2 * m
    if settings.whole[SAMPLED] == 1:
        for i in range(m):
            y[u + i] = y[n + m + i]
        return
    age = settings.real[LAGS + 1]
    for which in range(1 + settings.whole[PAST]):
        current = which == 1 and settings.whole[CURRENT_DELAY] == 1
        near = mode.lag1
        if which == 1 and lag_of(settings, 2, mode.gains) > 0.0:
            age, near = lag_of(settings, 2, mode.gains), mode.lag2
        if age > 0.0 and not current:
            j, s = locate_time(history, steps, near, t - age)
            place = t - age, j, s
        if age > 0.0 or current:
            add_earlier(settings, history, which, mode.gains, place, -1, y)
        else:
            add_present(settings, which, mode.gains, y)


@inner
def feed_back(settings, history, steps, mode, t, y, place, out, probe):
    """Write the inputs to the plant at t: commands, or actuators that follow with a lag (Eq. 36).

    Commands and rates of actuators are held within their limits here; the probe takes what
    is left of these, so that an event can meet them, and y what the commands are beyond them.
    """
    n, m, real = settings.whole[STATES], settings.whole[INPUTS], settings.real
    u, beyond = n + 2 * m, n + 3 * m + 6
    for i in range(m):
        y[u + i] = 0.0
    if mode.on == 1:
        command_at(settings, history, steps, mode, t, y, place)
    for i in range(m):
        wanted = y[u + i]
        probe[P_ROOM + i] = real[LIMITS + i] - abs(wanted)
        value = within(wanted, real[LIMITS + i])
        y[beyond + i] = wanted - value
        if settings.whole[ACTUATOR] == 1:
            slew = (value - y[n + i]) / settings.real[LAG_TIME]
            probe[P_ROOM + m + i] = real[LIMITS + m + i] - abs(slew)
            out[n + i] = within(slew, real[LIMITS + m + i])
            value = y[n + i]
        y[u + i] = value
        probe[P_ROOM + 2 * m + i] = value


@inner
def far_face(settings, history, steps, mode, t, theta):
    """Step and place on it where the rock face was left that several passes have not reached."""
    extra = (mode.passes - 1) * pitch_of(settings.bit)
    return locate_angle(history, settings.bit, steps, mode.face, t, theta, extra)


@inner
def cutting_edges(bit):
    """Depth of cut per unit of way: n, as all blades cut."""
    zero = (0.0, 0.0, 0.0, 0.0)
    return depth((1.0, 0.0, 0.0, 0.0), zero, 0.0, bit) - depth(zero, zero, 0.0, bit)


@inner
def above_face(settings, history, steps, mode, t, y):
    """How far a bit that turns forward is in the rock, and how much faster it falls than the face.

    Returns
    -------
    way, speed, fall : float
        ``fall`` is the speed of the face.
    """
    bit, state = settings.bit, (y[0], y[1], y[2], y[3])
    j, s = locate_angle(history, bit, steps, mode.lag, t, y[2], 0.0)
    if mode.passes > 1:
        j, s = far_face(settings, history, steps, mode, t, y[2])
    since = t - history.real[j, START] - s * history.real[j, LENGTH]
    axial, rotary = rates(state, bit)
    fall = face_at(history, bit, j, s, rotary)[0]
    way = depth(state, state_at(history, j, s), since, bit) / cutting_edges(bit)
    return way, axial - fall, fall


@inner
def rate_of_change(settings, history, steps, mode, t, y, out, probe):
    """Right-hand side on one branch; False if a delayed instant lies beyond the history.

    Parameters
    ----------
    y : array
        The vector of `Settings`; its places of u and top are written here.
    out : array
        Takes the rates of change of states and actuators.
    probe : array
        Takes depth, accelerations at the limits of what contact can bear, loads, delay, the angle
        left to where the bit turned back, inputs.
    """
    bit, n = settings.bit, settings.whole[STATES]
    state = (y[0], y[1], y[2], y[3])
    if settings.whole[LINEAR] == 1:
        return linear_rate(settings, history, steps, mode, t, y, out, probe)
    there, theta, probe[P_LEFT] = t, y[2], 0.0
    if mode.behind == 1:
        there, theta = mode.turned_t, mode.turned_theta
        now, then = (0.0, 0.0, y[2], 0.0), (0.0, 0.0, theta, 0.0)
        probe[P_LEFT] = -turned(now, then, t - there, bit) - pitch_of(bit)
    j, s = locate_angle(history, bit, steps, mode.lag, there, theta, 0.0)
    if j < 0:
        return False
    delay = t - history.real[j, START] - s * history.real[j, LENGTH]
    place = t - delay, j, s
    since = delay
    if mode.passes > 1:
        j, s = far_face(settings, history, steps, mode, there, theta)
        since = t - history.real[j, START] - s * history.real[j, LENGTH]
    d = depth(state, state_at(history, j, s), since, bit)
    face = 0.0, 0.0, 0.0
    if mode.axial == RIDING:
        face = face_at(history, bit, j, s, rates(state, bit)[1])
    strength = 1.0
    if settings.drive.shape[0] > 1:
        moved, top = top_at(settings.drive, mode.piece, t), n + 3 * settings.whole[INPUTS]
        y[top], y[top + 1], y[top + 2], y[top + 3] = moved
        strength = strength_at(settings.drive, mode.piece, t)
    if settings.whole[FEEDBACK] == 1:
        feed_back(settings, history, steps, mode, t, y, place, out, probe)
    probe[P_DEPTH], probe[P_DELAY] = d, delay
    excess = n + 3 * settings.whole[INPUTS] + 4
    y[excess], y[excess + 1] = 0.0, 0.0
    axial = row_of(settings.whole, settings.value, 1, y)
    angular = row_of(settings.whole, settings.value, 3, y)
    weight, torque = bit_load(
        axial,
        angular,
        0.0 if mode.axial == RIDING else strength * d,
        rates(state, bit),
        mode.contact,
        mode.torsion,
        mode.axial,
        mode.behind,
        face,
        settings.real,
        settings.law,
        probe,
    )
    y[excess] = weight - settings.real[WEIGHT]
    y[excess + 1] = torque - settings.real[TORQUE] - settings.real[WALL]
    # What is held does not move by rounding either.
    held = mode.contact == 1 and mode.axial == HELD
    out[1] = 0.0 if held else axial + settings.real[BY_WEIGHT] * y[excess]
    out[3] = 0.0 if mode.torsion == STUCK else angular + settings.real[BY_TORQUE] * y[excess + 1]
    move(settings, y, out)
    return True


@inner
def move(settings, y, out):
    """Write the rates of all states but x' and θ', whose rates are known."""
    whole, value = settings.whole, settings.value
    n = whole[STATES]
    place = n + 4 * whole[INPUTS] + 6
    for k in range(PIVOTS):
        row = whole[PIVOT + k]
        if row > 3:
            out[row] = row_of(whole, value, row, y)
        if row >= 0:
            y[place + k] = out[row]
    out[0], out[2] = row_of(whole, value, 0, y), row_of(whole, value, 2, y)
    for i in range(4, n):
        out[i] = row_of(whole, value, i, y)


@inner
def linear_rate(settings, history, steps, mode, t, y, out, probe):
    """Right-hand side of the linear model (Eqs. 22, 34)."""
    n, lag = settings.whole[STATES], settings.real[LAGS + 0]
    then = n + 3 * settings.whole[INPUTS]
    j, s = locate_time(history, steps, mode.lag0, t - lag)
    y[then], y[then + 1], y[then + 2], y[then + 3] = state_at(history, j, s)
    if settings.whole[FEEDBACK] == 1:
        feed_back(settings, history, steps, mode, t, y, (t - lag, j, s), out, probe)
    out[1] = row_of(settings.whole, settings.value, 1, y)
    out[3] = row_of(settings.whole, settings.value, 3, y)
    move(settings, y, out)
    d = settings.real[CUT] + row_of(settings.whole, settings.value, n + settings.whole[OUTPUTS], y)
    probe[P_DEPTH], probe[P_DELAY], probe[P_PRESSED] = d, lag, 1.0
    return True
