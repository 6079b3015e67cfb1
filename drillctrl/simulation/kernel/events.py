"""Events: functions that are positive in a mode, and the search for their first zero."""

from __future__ import annotations

import numpy as np

from .data import (
    ACTUATOR,
    AT_LIMIT,
    AXIAL_RATE,
    BARRIER,
    BETWEEN,
    DEPTH,
    FORWARD,
    HELD,
    HELD_TO_DOWN,
    HELD_TO_UP,
    INPUTS,
    LENGTH,
    LIMITS,
    P_DEPTH,
    P_DOWN,
    P_FORWARD,
    P_LEFT,
    P_REVERSE,
    P_ROOM,
    P_UP,
    RELEASE_FORWARD,
    RELEASE_REVERSE,
    RESUME,
    RIDING,
    SAMPLED,
    SCALE,
    STAGES,
    START,
    STUCK,
    TORSION_RATE,
    UP,
)
from .interpolate import state_at
from .jit import inner
from .model import rate_of_change
from .physics import rates
from .step import attempt, recall, record

SAMPLES = 10
NONE = 2.0
TANGENTS, REPEATS = 6, 60
# Steps are at least this long, relative to the time.
SHORTEST = 1e-14


@inner
def watched(settings, kind, mode):
    """Whether an event can end the present mode."""
    if kind >= AT_LIMIT:
        limit, of_rate = kind - AT_LIMIT, kind >= AT_LIMIT + settings.whole[INPUTS]
        if mode.on == 0 or not np.isfinite(settings.real[LIMITS + limit]):
            return False
        return settings.whole[ACTUATOR] == 1 if of_rate else settings.whole[SAMPLED] == 0
    if kind >= BARRIER:
        return False
    if kind == TORSION_RATE:
        return mode.torsion != STUCK
    if kind in (RELEASE_FORWARD, RELEASE_REVERSE):
        return mode.torsion == STUCK
    if kind == AXIAL_RATE:
        return mode.contact == 1 and mode.axial != HELD
    if kind == DEPTH:
        return mode.contact == 0 or mode.axial != RIDING
    if kind == RESUME:
        return mode.behind == 1 and mode.torsion == FORWARD
    if kind in (HELD_TO_UP, HELD_TO_DOWN):
        return mode.contact == 1 and (mode.axial == HELD or mode.axial == RIDING)
    return True


@inner
def value_of(kind, mode, probe, dx, dtheta, bit):
    """Event function: positive in the present mode, zero at its end."""
    if kind >= AT_LIMIT:
        left = probe[P_ROOM + kind - AT_LIMIT]
        return left if (mode.saturated >> (kind - AT_LIMIT)) & 1 == 0 else -left
    if kind == RELEASE_FORWARD:
        return -probe[P_FORWARD]
    if kind == RELEASE_REVERSE:
        return probe[P_REVERSE]
    if kind == HELD_TO_UP:
        return probe[P_UP]
    if kind == HELD_TO_DOWN:
        return -probe[P_DOWN]
    if kind == RESUME:
        return probe[P_LEFT]
    if kind == DEPTH:
        return probe[P_DEPTH] if mode.contact == 1 else -probe[P_DEPTH]
    axial_rate, rotary_rate = rates((0.0, dx, 0.0, dtheta), bit)
    if kind == TORSION_RATE:
        return rotary_rate if mode.torsion == FORWARD else -rotary_rate
    return -axial_rate if mode.axial == UP else axial_rate


@inner
def value_on_step(settings, history, steps, mode, kind, s, work):
    """Event function on the step that is written at place ``steps``, at s."""
    probe = work.stages[STAGES]
    if kind in (TORSION_RATE, AXIAL_RATE):
        state = state_at(history, steps, s)
        return value_of(kind, mode, probe, state[1], state[3], settings.bit)
    y = work.vectors[BETWEEN]
    recall(settings, history, steps, s, y)
    t = history.real[steps, START] + s * history.real[steps, LENGTH]
    rate_of_change(settings, history, steps, mode, t, y, work.rates[STAGES], probe)
    return value_of(kind, mode, probe, y[1], y[3], settings.bit)


@inner
def cannot_vanish(kind, mode, stages, bit, tolerance):
    """Whether the stages of a step show an event function far from zero throughout."""
    low, high, probes = np.inf, -np.inf, stages.shape[1] - 2
    for i in range(STAGES):
        value = value_of(kind, mode, stages[i], stages[i, probes], stages[i, probes + 1], bit)
        low, high = min(low, value), max(high, value)
    return low > tolerance and low > 0.5 * (high - low)


@inner
def root_between(settings, history, steps, mode, kind, a, fa, b, fb, work):
    """Zero between a (positive) and b (negative) by the Illinois method."""
    side = 0
    for _ in range(80):
        c = (a * fb - b * fa) / (fb - fa)
        fc = value_on_step(settings, history, steps, mode, kind, c, work)
        if fc > 0.0:
            a, fa = c, fc
            if side == 1:
                fb *= 0.5
            side = 1
        else:
            b, fb = c, fc
            if side == -1:
                fa *= 0.5
            side = -1
        if abs(b - a) < 1e-12 or fc == 0.0:
            break
    return b


@inner
def first_zero(settings, history, steps, mode, kind, work):
    """First s at which an event function turns negative on the step just tried.

    The function is sampled and its interior minima are looked into, so that a pair of zeros
    within one step is found. It may start from zero, where the mode has just been entered.

    Returns
    -------
    float
        s in [0, 1]; 0 if the function is negative from the start, 2 if it never is.
    """
    tolerance = 1e-12 * settings.real[SCALE + kind]
    if cannot_vanish(kind, mode, work.stages, settings.bit, tolerance):
        return NONE
    values = np.empty(SAMPLES + 1)
    for i in range(SAMPLES + 1):
        values[i] = value_on_step(settings, history, steps, mode, kind, i / SAMPLES, work)
    for i in range(1, SAMPLES + 1):
        s, value = i / SAMPLES, values[i]
        left, left_value = (i - 1) / SAMPLES, values[i - 1]
        if i < SAMPLES and 0.0 < value <= left_value and value <= values[i + 1]:
            bend = values[i + 1] - 2.0 * value + left_value
            if bend > 0.0:
                shift = 0.5 * (left_value - values[i + 1]) / bend
                dip = s + shift / SAMPLES
                dip_value = value_on_step(settings, history, steps, mode, kind, dip, work)
                if dip_value < value:
                    s, value = dip, dip_value
        if value >= -tolerance:
            continue
        if left_value > 0.0:
            return root_between(
                settings, history, steps, mode, kind, left, left_value, s, value, work
            )
        if i > 1:
            return left
        # It starts from zero: is it positive anywhere before?
        for _ in range(30):
            middle = 0.5 * s
            middle_value = value_on_step(settings, history, steps, mode, kind, middle, work)
            if middle_value > 0.0:
                return root_between(
                    settings, history, steps, mode, kind, middle, middle_value, s, value, work
                )
            s, value = middle, middle_value
            if value >= -tolerance:
                return 0.0 if s < 1e-6 else s
        return 0.0
    return NONE


@inner
def refine(settings, history, steps, mode, kind, t, s, y, work, level):
    """Repeat the step so that it ends where an event function vanishes; return its length.

    The function is positive at the start of the step, and negative at s or soon after. Its
    zero stays in a bracket, since depth falls like a root where the bit behind had come to
    rest, and a tangent points anywhere.

    Returns
    -------
    float
        Length; negative, that of the whole step, if repeated steps find no zero.
    """
    whole_step = history.real[steps, LENGTH]
    low, high, h, crossed = 0.0, whole_step, s * whole_step, False
    least = SHORTEST * max(1.0, abs(t))
    for i in range(REPEATS):
        attempt(settings, history, steps, mode, t, h, y, work)
        record(settings, history, steps, mode, t, h, y, work, level)
        value = value_on_step(settings, history, steps, mode, kind, 1.0, work)
        if abs(value) <= 1e-11 * settings.real[SCALE + kind]:
            return h
        if value > 0.0:
            low = h
            if h == whole_step:
                return -whole_step
        else:
            high, crossed = h, True
        if high - low <= least:
            break
        before = value_on_step(settings, history, steps, mode, kind, 0.98, work)
        guess = h - 0.02 * h * value / (value - before) if value != before else low
        # Tangents that do not get there give way to halving.
        if not low < guess < high or i >= TANGENTS:
            guess = 0.5 * (low + high) if crossed else whole_step
        h = guess
    attempt(settings, history, steps, mode, t, high, y, work)
    record(settings, history, steps, mode, t, high, y, work, level)
    return high
