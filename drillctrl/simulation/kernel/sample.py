"""Evaluate a finished run between its steps."""

from __future__ import annotations

import numba
import numpy as np

from .data import (
    ACTUATOR,
    ACTUATORS,
    AXIAL,
    CONTACT,
    DRIVE_T,
    FACE,
    FEEDBACK,
    HELD,
    HELD_U,
    LAG,
    LENGTH,
    LINEAR,
    P_DELAY,
    P_DEPTH,
    P_FORWARD,
    P_PRESSED,
    P_U0,
    PASSES,
    PROBES,
    REVERSE,
    SATURATED,
    START,
    STUCK,
    T_ON,
    TORSION,
    Mode,
)
from .interpolate import cubic, state_at, step_at
from .model import lag_of, piece_at, rate_of_change, strength_at
from .physics import load, rates

COLUMNS = 14


@numba.njit(cache=True, error_model="numpy")
def mode_on(settings, history, j):
    """The mode in which step j was taken."""
    t = history.real[j, START] + 0.5 * history.real[j, LENGTH]
    lags = np.zeros(3, np.int64)
    gains = piece_at(settings.gains[:, 0], t)
    for i in range(3):
        lag = lag_of(settings, i, gains)
        if lag > 0.0:
            lags[i] = step_at(history, j, t - lag) if j > 0 else 0
    return Mode(
        history.whole[j, CONTACT],
        history.whole[j, TORSION],
        history.whole[j, AXIAL],
        history.whole[j, SATURATED],
        history.whole[j, LAG],
        history.whole[j, FACE],
        history.whole[j, PASSES],
        lags[0],
        lags[1],
        lags[2],
        piece_at(settings.drive[:, DRIVE_T], t),
        gains,
        1 if settings.flags[FEEDBACK] == 1 and t >= settings.control[T_ON] else 0,
        history.real[j, HELD_U],
        history.real[j, HELD_U + 1],
    )


@numba.njit(cache=True, error_model="numpy")
def evaluate(settings, history, steps, places, times):
    """Return everything at some instants, each on a given step, shape (len(times), 14).

    Columns: x, x', θ, θ', x'', θ'', τ, depth of cut, share of the wear-flat force, weight on
    bit, torque on bit, both inputs, contact.
    """
    result = np.zeros((times.shape[0], COLUMNS))
    y, out, probe = np.zeros(6), np.zeros(6), np.zeros(PROBES)
    # At rest the velocity is known; its interpolation is off by rounding.
    standing = rates((0.0, 0.0, 0.0, 0.0), settings.p)
    for i in range(times.shape[0]):
        j, t = places[i], times[i]
        mode = mode_on(settings, history, j)
        s = (t - history.real[j, START]) / history.real[j, LENGTH]
        state = state_at(history, j, s)
        for n in range(4):
            y[n] = state[n]
        if settings.flags[LINEAR] == 0:
            if mode.torsion == STUCK:
                y[3] = -standing[1]
            if mode.contact == 1 and mode.axial == HELD:
                y[1] = -standing[0]
        if settings.flags[ACTUATOR] == 1:
            for n in range(2):
                y[4 + n] = cubic(history.real, ACTUATORS + 4 * n, j, s)
        rate_of_change(settings, history, steps, mode, t, y, out, probe)
        strength = strength_at(settings.drive, mode.piece, t)
        cut = strength * probe[P_DEPTH] if mode.contact == 1 and mode.torsion != REVERSE else 0.0
        pressed = probe[P_PRESSED] if mode.contact == 1 else 0.0
        direction = -1.0 if mode.torsion == REVERSE else 1.0
        weight, torque = load((cut, pressed, direction), settings.p)
        if mode.torsion == STUCK and settings.flags[LINEAR] == 0:
            torque += probe[P_FORWARD]  # what is offered is what the rock bears
        result[i, 0:4] = y[0:4]
        result[i, 4], result[i, 5] = out[1], out[3]
        result[i, 6], result[i, 7], result[i, 8] = probe[P_DELAY], probe[P_DEPTH], pressed
        result[i, 9], result[i, 10] = weight, torque
        result[i, 11], result[i, 12] = probe[P_U0], probe[P_U0 + 1]
        result[i, 13] = mode.contact
    return result
