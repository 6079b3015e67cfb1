"""The controller's clock: activation, gain changes, pieces of the drive, samples."""

from __future__ import annotations

import numba
import numpy as np

from .data import (
    ACTUATOR,
    CURRENT_DELAY,
    DRIVE_T,
    FEEDBACK,
    LAG,
    LENGTH,
    MEASURE_DELAY,
    PAST_AGE,
    PERIOD,
    SAMPLED,
    START,
    T_ON,
)
from .interpolate import locate_angle, state_at, step_at
from .model import command, measured, piece_at, within

PIECE, GAINS, ON, SAMPLE = 6, 7, 8, 9
HELD0, HELD1, NEXT_SAMPLE = 2, 3, 4


@numba.njit(cache=True, error_model="numpy")
def next_clock(settings, ints, reals, t):
    """Next time at which something is switched."""
    goal = np.inf
    if ints[PIECE] + 1 < settings.drive.shape[0]:
        goal = min(goal, settings.drive[ints[PIECE] + 1, DRIVE_T])
    if settings.flags[FEEDBACK] == 1:
        if ints[GAINS] + 1 < settings.gains.shape[0]:
            goal = min(goal, settings.gains[ints[GAINS] + 1, 0])
        if ints[ON] == 0:
            goal = min(goal, settings.control[T_ON])
        if settings.flags[SAMPLED] == 1:
            goal = min(goal, reals[NEXT_SAMPLE])
    return goal


@numba.njit(cache=True, error_model="numpy")
def state_then(settings, history, steps, time):
    """State at an instant that has passed."""
    j = step_at(history, steps, time)
    return state_at(history, j, (time - history.real[j, START]) / history.real[j, LENGTH])


@numba.njit(cache=True, error_model="numpy")
def noisy(settings, sample, state):
    """State with the noise of the sample that measured it."""
    n = settings.noise.shape[0]
    if sample < 0 or n == 0:
        return state
    row = settings.noise[min(sample, n - 1)]
    return (state[0] + row[0], state[1] + row[1], state[2] + row[2], state[3] + row[3])


@numba.njit(cache=True, error_model="numpy")
def take_sample(settings, history, steps, ints, reals, t):
    """Switch whatever is due at t; return whether anything was.

    A sample reads the states (a measurement delay ago), commands within the limits, and is
    held. The delayed signal comes from the record of earlier samples' instants.
    """
    due = False
    piece = piece_at(settings.drive[:, DRIVE_T], t)
    if piece != ints[PIECE]:
        ints[PIECE] = piece
        due = True
    if settings.flags[FEEDBACK] == 0:
        return due
    gains = piece_at(settings.gains[:, 0], t)
    if gains != ints[GAINS]:
        ints[GAINS] = gains
        due = True
    if ints[ON] == 0 and t >= settings.control[T_ON]:
        ints[ON] = 1
        due = True
    if settings.flags[SAMPLED] == 0 or ints[ON] == 0 or t < reals[NEXT_SAMPLE]:
        return due
    k, period = ints[SAMPLE], settings.control[PERIOD]
    t_now = t - settings.control[MEASURE_DELAY]
    state = state_then(settings, history, steps, t_now)
    lag = settings.gains[ints[GAINS], PAST_AGE]
    if settings.flags[CURRENT_DELAY] == 1:
        last = step_at(history, steps, t_now)
        j, s = locate_angle(
            history, settings.p, steps, history.whole[last, LAG], t_now, state[2], 0.0
        )
        lag = t_now - history.real[j, START] - s * history.real[j, LENGTH]
    then = state_then(settings, history, steps, t_now - lag)
    earlier = k - int(np.rint(lag / period))
    now = measured(settings.drive, noisy(settings, k, state), t_now)
    then = measured(settings.drive, noisy(settings, earlier, then), t_now - lag)
    for i in range(2):
        u = within(command(settings.gains, ints[GAINS], now, then, i), settings.limit[i])
        before = reals[HELD0 + i]
        if settings.flags[ACTUATOR] == 0:
            step = settings.rate[i] * period
            u = min(max(u, before - step), before + step)
        reals[HELD0 + i] = u
    ints[SAMPLE] = k + 1
    reals[NEXT_SAMPLE] = settings.control[T_ON] + (k + 1) * period
    return True
