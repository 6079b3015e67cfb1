"""Breaks of the history, which reach the present one delay later, and where steps must end.

A lag in angle sees a break when the bit has turned on by the lag from where the break was
made; a lag in time when that time has passed. Steps end there, so that what is delayed is
smooth within each step and the method keeps its order.

Two lags in angle are followed: one blade pitch, and that of the pass which left the rock
face. A bit off the rock leaves the face that it has under itself, so that one pitch later it
is known without a look at the passes in between, however many there are.
"""

from __future__ import annotations

import numpy as np

from .data import (
    CONTACT,
    FACE,
    FAR,
    LAST_LEVEL,
    LEVEL,
    MULTIPLE,
    NEAR,
    PASSES,
    STUCK,
)
from .interpolate import beyond, locate_angle, pitch_of, step_before_angle
from .jit import entry, inner
from .physics import rates


@inner
def lags_of(mode):
    """How many lags in angle there are: two where the face is not that of the last pass."""
    return 2 if mode.passes > 1 else 1


@inner
def pitches_beyond(mode, k):
    """Blade pitches by which lag k is longer than one."""
    return mode.passes - 1 if k == FAR else 0


@inner
def advance(history, steps, following, k, at):
    """Move ``following[k]`` to the first break after step ``at``; ``steps`` if none."""
    b = max(following[k], at + 1)
    while b < steps and history.whole[b, LEVEL] > LAST_LEVEL:
        b += 1
    following[k] = b
    return b


@inner
def angle_left(history, bit, b, pitches, t, theta):
    """Angle the bit has yet to turn until the lag of pitches + 1 reaches break b."""
    return -beyond(history, bit, b, 0.0, t, theta, pitches * pitch_of(bit))


@inner
def time_to_turn(angle, rate, acceleration):
    """Time in which the bit turns by an angle at constant acceleration; infinite if never."""
    if angle <= 0.0:
        return 0.0 if rate > 0.0 or acceleration > 0.0 else np.inf
    root = rate * rate + 2.0 * acceleration * angle
    if root < 0.0:
        return np.inf
    denominator = rate + np.sqrt(root)
    return 2.0 * angle / denominator if denominator > 0.0 else np.inf


@inner
def angle_limits(history, bit, steps, mode, chain, following, t, y, acceleration):
    """Return the time to the nearest break seen through the angle, and to the last step."""
    if mode.torsion == STUCK or mode.behind == 1:
        return np.inf, np.inf
    rate = rates((0.0, 0.0, 0.0, y[3]), bit)[1]
    nearest = np.inf
    for k in range(lags_of(mode)):
        b = advance(history, steps, following, k, chain[k])
        if b < steps:
            left = angle_left(history, bit, b, pitches_beyond(mode, k), t, y[2])
            nearest = min(nearest, time_to_turn(left, rate, acceleration))
    return nearest, time_to_turn(0.9 * pitch_of(bit), rate, acceleration)


@inner
def least_angle_left(history, bit, steps, mode, following, t, theta):
    """Least angle left over all lags, and which lag it is (-1: no break ahead)."""
    least, which = np.inf, -1
    if mode.torsion == STUCK or mode.behind == 1:
        return least, which
    for k in range(lags_of(mode)):
        b = following[k]
        if b < steps:
            left = angle_left(history, bit, b, pitches_beyond(mode, k), t, theta)
            if left < least:
                least, which = left, k
    return least, which


@inner
def follow(settings, history, steps, mode, chain, t, theta):
    """Move the places of the lagged instants along, within their smooth pieces."""
    if mode.behind == 1:
        return
    pitch = pitch_of(settings.bit)
    for k in range(lags_of(mode)):
        extra = pitches_beyond(mode, k) * pitch
        j, _ = locate_angle(history, settings.bit, steps, chain[k], t, theta, extra)
        if j >= 0:
            chain[k] = j


@entry
def retrace(settings, history, steps, chain, following, passes, t, theta, tolerance):
    """Find the lagged instants anew, across breaks; return how many passes back the face is.

    With one lag the face is what the blade ahead left, wherever it was. With all passes
    counted, a blade that was off the rock left the face that it had under itself.
    """
    pitch, last = pitch_of(settings.bit), steps - 1
    start = min(max(following[NEAR], chain[NEAR]), last)
    j = step_before_angle(history, settings.bit, start, t, theta, 0.0, tolerance)
    chain[NEAR], following[NEAR] = j, j + 1
    if settings.whole[MULTIPLE] == 0 or history.whole[j, CONTACT] == 1:
        return 1
    now = history.whole[j, PASSES] + 1
    start = min(chain[FAR] if now == passes else history.whole[j, FACE], last)
    extra = (now - 1) * pitch
    j = step_before_angle(history, settings.bit, start, t, theta, extra, tolerance)
    chain[FAR], following[FAR] = j, j + 1
    return now


@inner
def passed_on(level, stuck, gain):
    """Level of the break that a delayed break makes; the lag jumps over what gains no angle."""
    return 2 if stuck else level + gain
