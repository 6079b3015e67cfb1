"""Evaluate a finished run between its steps."""

from __future__ import annotations

import numpy as np

from .data import (
    AXIAL,
    BEHIND,
    C_CONTACT,
    C_DELAY,
    C_DEPTH,
    C_PRESSED,
    C_STATES,
    C_TORQUE,
    C_WEIGHT,
    CONTACT,
    DRIVE_T,
    FACE,
    FEEDBACK,
    HELD,
    INPUTS,
    LAG,
    LENGTH,
    LINEAR,
    P_DELAY,
    P_DEPTH,
    P_PRESSED,
    P_ROOM,
    P_TORQUE,
    P_WEIGHT,
    PASSES,
    PIVOTS,
    RIDING,
    SATURATED,
    SIDES,
    SINCE,
    START,
    STATES,
    STUCK,
    T_ON,
    TORSION,
    Mode,
)
from .interpolate import furthest, step_at
from .jit import entry, inner
from .law import load
from .model import lag_of, piece_at, rate_of_change, row_of
from .physics import rates
from .step import recall


@inner
def mode_on(settings, history, j):
    """The mode in which step j was taken."""
    t = history.real[j, START] + 0.5 * history.real[j, LENGTH]
    lags = np.zeros(3, np.int64)
    turned_t, turned_theta = furthest(history, j, t, 0.0)
    gains = piece_at(settings.schedule[:, SINCE], t)
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
        1 if settings.whole[FEEDBACK] == 1 and t >= settings.real[T_ON] else 0,
        history.whole[j, BEHIND],
        turned_t,
        turned_theta,
    )


@entry
def evaluate(settings, history, steps, places, times, wanted):
    """Return some columns at some instants, each on a given step, (len(wanted), len(times)).

    ``wanted`` are places in `sample_columns`.
    """
    n, m = settings.whole[STATES], settings.whole[INPUTS]
    result = np.zeros((wanted.shape[0], times.shape[0]))
    y = np.zeros(n + 4 * m + 6 + PIVOTS + settings.whole[SIDES])
    out, probe = np.zeros(n + m), np.zeros(P_ROOM + 3 * m)
    # At rest the velocity is known; its interpolation is off by rounding.
    standing = rates((0.0, 0.0, 0.0, 0.0), settings.bit)
    linear = settings.whole[LINEAR] == 1
    # States are on the steps; all else has to be worked out.
    stored = True
    for c in range(wanted.shape[0]):
        which = wanted[c]
        stored = stored and (which == C_CONTACT or C_STATES <= which < C_STATES + n)
    mode = mode_on(settings, history, 0)
    for i in range(times.shape[0]):
        j, t = places[i], times[i]
        if not stored:
            mode = mode_on(settings, history, j)
        s = (t - history.real[j, START]) / history.real[j, LENGTH]
        recall(settings, history, j, s, y)
        if not linear:
            if history.whole[j, TORSION] == STUCK:
                y[3] = -standing[1]
            if history.whole[j, CONTACT] == 1 and history.whole[j, AXIAL] == HELD:
                y[1] = -standing[0]
        if not stored:
            rate_of_change(settings, history, steps, mode, t, y, out, probe)
            if mode.axial == RIDING:
                probe[P_DEPTH] = 0.0
        if linear and not stored:
            speeds = rates((y[0], y[1], y[2], y[3]), settings.bit)
            probe[P_WEIGHT], probe[P_TORQUE] = load(
                (probe[P_DEPTH], 1.0, 1.0), speeds, settings.law
            )
        for c in range(wanted.shape[0]):
            which = wanted[c]
            if which >= C_STATES:
                k = which - C_STATES
                if k < n:
                    result[c, i] = y[k]
                elif k < 2 * n:
                    result[c, i] = out[k - n]
                elif k < 2 * n + m:
                    result[c, i] = probe[P_ROOM + 2 * m + k - 2 * n]
                else:
                    result[c, i] = row_of(settings.whole, settings.value, k - n - m, y)
            elif which == C_DELAY:
                result[c, i] = probe[P_DELAY]
            elif which == C_DEPTH:
                result[c, i] = probe[P_DEPTH]
            elif which == C_PRESSED:
                result[c, i] = probe[P_PRESSED]
            elif which == C_WEIGHT:
                result[c, i] = probe[P_WEIGHT]
            elif which == C_TORQUE:
                result[c, i] = probe[P_TORQUE]
            elif which == C_CONTACT:
                result[c, i] = history.whole[j, CONTACT]
    return result
