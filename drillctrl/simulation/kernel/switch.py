"""Which mode follows an event, from the loads that the contact would have to bear."""

from __future__ import annotations

import numpy as np

from .data import (
    AT_LIMIT,
    AXIAL_RATE,
    BARRIER,
    BEGIN,
    CUT,
    DEPTH,
    DOWN,
    FEEDBACK,
    FORWARD,
    HELD,
    HELD_TO_DOWN,
    HELD_TO_UP,
    INPUTS,
    LINEAR,
    P_DEPTH,
    P_DOWN,
    P_FORWARD,
    P_REVERSE,
    P_ROOM,
    P_UP,
    RELEASE_FORWARD,
    RELEASE_REVERSE,
    REVERSE,
    RIDING,
    RTOL,
    SAMPLED,
    SCALE,
    STAGES,
    STUCK,
    TORSION_RATE,
    UP,
    Mode,
)
from .events import watched
from .jit import inner
from .model import above_face, cutting_edges, rate_of_change
from .physics import rates


@inner
def with_branch(mode, contact, torsion, axial):
    """The mode on another branch."""
    return Mode(
        contact,
        torsion,
        axial,
        mode.saturated,
        mode.lag,
        mode.face,
        mode.passes,
        mode.lag0,
        mode.lag1,
        mode.lag2,
        mode.piece,
        mode.gains,
        mode.on,
        mode.behind,
        mode.turned_t,
        mode.turned_theta,
    )


@inner
def snap(kind, mode, y, bit):
    """Make a velocity that has just been found to vanish vanish exactly."""
    zero = rates((0.0, 0.0, 0.0, 0.0), bit)
    if kind == TORSION_RATE:
        y[3] = -zero[1]
    # A face falls only under a bit that turns.
    if kind == AXIAL_RATE or (kind == TORSION_RATE and mode.axial == RIDING):
        y[1] = -zero[0]


@inner
def set_on_face(settings, history, steps, mode, t, y):
    """Put a bit that rides on the face where that is, at its speed."""
    way, faster, _ = above_face(settings, history, steps, mode, t, y)
    y[0] -= way
    y[1] -= faster


@inner
def rides(settings, history, steps, mode, t, y, work):
    """Whether a bit at the face follows it: it falls away, and what is left are no bounces.

    Between none and all of the wear-flat force the bit has to come back to the face from either
    side. Bounces that are lower than the tolerance times the depth of cut are none.
    """
    _, faster, fall = above_face(settings, history, steps, mode, t, y)
    if not 0.0 < fall < np.inf:
        return False
    trial, probe = with_branch(mode, 1, FORWARD, RIDING), work.stages[STAGES]
    rate_of_change(settings, history, steps, trial, t, y, work.rates[STAGES], probe)
    least = min(probe[P_UP], -probe[P_DOWN])
    height = settings.real[RTOL] * settings.real[CUT] / cutting_edges(settings.bit)
    return (
        least > 1e-12 * settings.real[SCALE + HELD_TO_UP] and faster * faster < 2.0 * least * height
    )


@inner
def next_saturation(settings, history, steps, mode, kind, t, y, work):
    """Which limits hold the inputs after an event or a jump, as bits; see `Mode`."""
    if kind >= AT_LIMIT:
        return mode.saturated ^ (1 << (kind - AT_LIMIT))
    if settings.whole[FEEDBACK] == 0:
        return 0
    rate_of_change(settings, history, steps, mode, t, y, work.rates[STAGES], work.stages[STAGES])
    saturated, m = 0, settings.whole[INPUTS]
    for limit in range(2 * m):
        left = work.stages[STAGES, P_ROOM + limit]
        if watched(settings, AT_LIMIT + limit, mode):
            beyond = left < 0.0
        else:
            # A held command meets no limit on its way: it is at it, or beyond, or not.
            beyond = settings.whole[SAMPLED] == 1 and limit < m and left <= 0.0
        if beyond:
            saturated |= 1 << limit
    return saturated


@inner
def next_mode(settings, history, steps, mode, kind, t, y, work):
    """Return contact, torsion and axial branch after an event, or at the start.

    At Φ' = 0 the bit stays if the torque offered lies between what full friction (and
    cutting) can bear in either direction, else it goes where it is pushed. Z' = 0 likewise,
    with a wear-flat force anywhere in [0, λ]; and at the face, see `rides`.
    """
    if settings.whole[LINEAR] == 1:
        return 1, FORWARD, DOWN
    out, probe = work.rates[STAGES], work.stages[STAGES]
    axial_rate, rotary_rate = rates((y[0], y[1], y[2], y[3]), settings.bit)
    push, turn = (
        1e-13 * settings.real[SCALE + HELD_TO_UP],
        1e-13 * settings.real[SCALE + RELEASE_FORWARD],
    )
    contact, torsion, axial = mode.contact, mode.torsion, mode.axial
    at_rest = torsion == STUCK or kind == TORSION_RATE or rotary_rate == 0.0
    at_face = kind == DEPTH
    if kind == DEPTH:
        contact = 1 - contact
    elif kind == HELD_TO_UP and axial == RIDING:
        contact = 0
    elif kind in (BARRIER, BEGIN):
        rate_of_change(settings, history, steps, mode, t, y, out, probe)
        tolerance = 1e-11 * settings.real[SCALE + DEPTH]
        if probe[P_DEPTH] < -tolerance:
            contact = 0
        elif probe[P_DEPTH] > tolerance:
            contact = 1
        else:
            at_face = True
    turns = not at_rest and rotary_rate > 0.0 and mode.behind == 0
    if at_face and turns and rides(settings, history, steps, mode, t, y, work):
        return 1, FORWARD, RIDING
    level = axial_rate == 0.0 or (mode.contact == 1 and axial == HELD)
    if contact == 0:
        axial = DOWN
    elif level:
        # Torque does not enter the axial balance, so this comes first.
        trial = with_branch(mode, 1, torsion if torsion == REVERSE else STUCK, HELD)
        rate_of_change(settings, history, steps, trial, t, y, out, probe)
        axial = HELD
        if kind == HELD_TO_UP or (kind != HELD_TO_DOWN and probe[P_UP] < -push):
            axial = UP
        elif kind == HELD_TO_DOWN or probe[P_DOWN] > push:
            axial = DOWN
    else:
        axial = DOWN if axial_rate > 0.0 else UP
    if not at_rest:
        return contact, FORWARD if rotary_rate > 0.0 else REVERSE, axial
    trial = with_branch(mode, contact, STUCK, axial)
    rate_of_change(settings, history, steps, trial, t, y, out, probe)
    torsion = STUCK
    if kind == RELEASE_FORWARD or (kind != RELEASE_REVERSE and probe[P_FORWARD] > turn):
        torsion = FORWARD
    elif kind == RELEASE_REVERSE or probe[P_REVERSE] < -turn:
        torsion = REVERSE
    return contact, torsion, axial
