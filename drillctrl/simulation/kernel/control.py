"""The controller's clock: activation, gain changes, pieces of the drive, samples."""

from __future__ import annotations

import numpy as np

from .data import (
    ACTUATOR,
    CURRENT_DELAY,
    DRIVE_T,
    FEEDBACK,
    INPUTS,
    LAG,
    LENGTH,
    LIMITS,
    MEASURE_DELAY,
    PAST_AGE,
    PERIOD,
    SAMPLED,
    SINCE,
    START,
    STATES,
    T_ON,
)
from .interpolate import furthest, locate_angle, state_at, step_at
from .jit import entry, inner
from .model import add_earlier, piece_at, within

PIECE, GAINS, ON, SAMPLE = 6, 7, 8, 9
NEXT_SAMPLE = 2


@inner
def next_clock(settings, ints, reals, t):
    """Next time at which something is switched."""
    goal = np.inf
    if ints[PIECE] + 1 < settings.drive.shape[0]:
        goal = min(goal, settings.drive[ints[PIECE] + 1, DRIVE_T])
    if settings.whole[FEEDBACK] == 1:
        if ints[GAINS] + 1 < settings.schedule.shape[0]:
            goal = min(goal, settings.schedule[ints[GAINS] + 1, SINCE])
        if ints[ON] == 0:
            goal = min(goal, settings.real[T_ON])
        if settings.whole[SAMPLED] == 1:
            goal = min(goal, reals[NEXT_SAMPLE])
    return goal


@inner
def place_of(history, steps, time):
    """Step that holds an instant that has passed, and place on it."""
    j = step_at(history, steps, time)
    return j, (time - history.real[j, START]) / history.real[j, LENGTH]


@entry
def take_sample(settings, history, steps, ints, reals, t, y):
    """Switch whatever is due at t; return whether anything was.

    A sample reads the outputs (a measurement delay ago), and its command is held in y; limits of
    torque are kept where it acts. The delayed outputs come from the record of earlier samples'
    instants.
    """
    due = False
    piece = piece_at(settings.drive[:, DRIVE_T], t)
    if piece != ints[PIECE]:
        ints[PIECE] = piece
        due = True
    if settings.whole[FEEDBACK] == 0:
        return due
    gains = piece_at(settings.schedule[:, SINCE], t)
    if gains != ints[GAINS]:
        ints[GAINS] = gains
        due = True
    if ints[ON] == 0 and t >= settings.real[T_ON]:
        ints[ON] = 1
        due = True
    if settings.whole[SAMPLED] == 0 or ints[ON] == 0 or t < reals[NEXT_SAMPLE]:
        return due
    sample, period = ints[SAMPLE], settings.real[PERIOD]
    t_now = t - settings.real[MEASURE_DELAY]
    j_now, s_now = place_of(history, steps, t_now)
    lag = settings.schedule[gains, PAST_AGE]
    if settings.whole[CURRENT_DELAY] == 1:
        theta, near = state_at(history, j_now, s_now)[2], history.whole[j_now, LAG]
        there, theta = furthest(history, j_now, t_now, theta)
        j, s = locate_angle(history, settings.bit, steps, near, there, theta, 0.0)
        lag = t_now - history.real[j, START] - s * history.real[j, LENGTH]
    j_then, s_then = place_of(history, steps, t_now - lag)
    earlier = sample - int(np.rint(lag / period))
    m, held = settings.whole[INPUTS], settings.whole[STATES] + settings.whole[INPUTS]
    for i in range(m):
        y[held + m + i] = 0.0
    add_earlier(settings, history, 0, gains, (t_now, j_now, s_now), sample, y)
    add_earlier(settings, history, 1, gains, (t_now - lag, j_then, s_then), earlier, y)
    for i in range(m):
        u, before = y[held + m + i], y[held + i]
        step = settings.real[LIMITS + m + i] * period
        if settings.whole[ACTUATOR] == 0 and np.isfinite(step):
            u = within(u, settings.real[LIMITS + i])
            u = min(max(u, before - step), before + step)
        y[held + i] = u
    ints[SAMPLE] = sample + 1
    reals[NEXT_SAMPLE] = settings.real[T_ON] + (sample + 1) * period
    return True
