"""Which mode follows an event, from the loads that the contact would have to bear."""

from __future__ import annotations

from .data import (
    AT_LIMIT,
    AXIAL_RATE,
    BARRIER,
    BEGIN,
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
from .model import rate_of_change
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
def snap(kind, y, bit):
    """Make a velocity that has just been found to vanish vanish exactly."""
    zero = rates((0.0, 0.0, 0.0, 0.0), bit)
    if kind == AXIAL_RATE:
        y[1] = -zero[0]
    elif kind == TORSION_RATE:
        y[3] = -zero[1]


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
    with a wear-flat force anywhere in [0, λ].
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
    if kind == DEPTH:
        contact = 1 - contact
    elif kind in (BARRIER, BEGIN):
        rate_of_change(settings, history, steps, mode, t, y, out, probe)
        tolerance = 1e-11 * settings.real[SCALE + DEPTH]
        if probe[P_DEPTH] < -tolerance:
            contact = 0
        elif probe[P_DEPTH] > tolerance:
            contact = 1
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
