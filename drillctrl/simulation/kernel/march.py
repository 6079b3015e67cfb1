"""The march: steps, events, breaks, and the controller's clock."""

from __future__ import annotations

import numpy as np

from .breaks import (
    advance,
    angle_limits,
    follow,
    least_angle_left,
    passed_on,
    retrace,
)
from .control import next_clock, take_sample
from .data import (
    ACTUATOR,
    AT_LIMIT,
    BACKWARDS,
    BARRIER,
    BETWEEN,
    BOUNDS,
    COLLAPSE,
    CURRENT_DELAY,
    DIVERGED,
    DONE,
    END,
    FAR,
    FEEDBACK,
    INPUTS,
    LATE,
    LEVEL,
    LINEAR,
    MORE_ROOM,
    NEAR,
    NO_BREAK,
    NOT_FINITE,
    P_ROOM,
    PAUSED,
    PIVOTS,
    RATE_FEEDBACK,
    RESUME,
    REVERSE,
    REVERSED,
    RIDING,
    SIDES,
    STAGES,
    START,
    STATES,
    STUCK,
    Mode,
    Work,
)
from .events import NONE, SHORTEST, first_zero, refine, watched
from .interpolate import gains_no_angle, locate_time, step_at
from .jit import entry, inner
from .model import lag_of, rate_of_change
from .physics import rates
from .side import hold_sides
from .step import attempt, moving, record
from .switch import next_mode, next_saturation, set_on_face, snap

# Places in `ints` and `reals`, where the march is resumed from.
(STEPS, I_CONTACT, I_TORSION, I_AXIAL, I_PASSES, I_LEVEL, PIECE, GAINS, ON, SAMPLE, STALLS,
 REJECTED, EVALUATIONS, UNSETTLED, I_SATURATED, I_BEHIND, LAG0) = range(17)  # fmt: skip
TIME, STEP, NEXT_SAMPLE, TURNED_T, TURNED_THETA, REALS = range(6)
REFINE = 6
# A break that is nearer than this, relative to the angle turned, is met.
PASSED = 5e-14
# Tries without a step after which no step is to be had.
MOST_TRIES = 1000


@inner
def mode_of(ints, reals, chain):
    """Collect the present mode."""
    passes = ints[I_PASSES]
    return Mode(
        ints[I_CONTACT],
        ints[I_TORSION],
        ints[I_AXIAL],
        ints[I_SATURATED],
        chain[NEAR],
        chain[FAR] if passes > 1 else chain[NEAR],
        passes,
        ints[LAG0],
        ints[LAG0 + 1],
        ints[LAG0 + 2],
        ints[PIECE],
        ints[GAINS],
        ints[ON],
        ints[I_BEHIND],
        reals[TURNED_T],
        reals[TURNED_THETA],
    )


@entry
def workplace(settings):
    """Arrays of the size of the plant."""
    n, m = settings.whole[STATES], settings.whole[INPUTS]
    probes, length = P_ROOM + 3 * m, n + 4 * m + 6 + PIVOTS + settings.whole[SIDES]
    return Work(
        np.zeros((STAGES + 1, n + m)),
        np.zeros((STAGES + 1, probes + 2)),
        np.zeros((3, length)),
    )


@entry
def enter(settings, history, steps, ints, reals, chain, kind, t, y, work):
    """Enter the mode that follows an event, a break or the start."""
    if kind == RESUME:
        ints[I_BEHIND] = 0
    mode = mode_of(ints, reals, chain)
    if kind < AT_LIMIT:
        branch = next_mode(settings, history, steps, mode, kind, t, y, work)
        ints[I_CONTACT], ints[I_TORSION], ints[I_AXIAL] = branch
        if branch[2] == RIDING:
            set_on_face(settings, history, steps, mode, t, y)
        if branch[1] == REVERSE and ints[I_BEHIND] == 0:
            ints[I_BEHIND], reals[TURNED_T], reals[TURNED_THETA] = 1, t, y[2]
        mode = mode_of(ints, reals, chain)
    ints[I_SATURATED] = next_saturation(settings, history, steps, mode, kind, t, y, work)


@inner
def level_of(settings, kind):
    """Level of the break that an event makes; see `LAST_LEVEL`."""
    if kind < AT_LIMIT:
        return 2
    return 4 if settings.whole[ACTUATOR] == 1 else 3


@inner
def time_limits(settings, history, steps, ints, following, t):
    """Nearest time at which a constant delay meets a break; and the longest step they allow."""
    nearest, longest = np.inf, np.inf
    for i in range(3):
        lag = lag_of(settings, i, ints[GAINS])
        if lag > 0.0:
            longest = min(longest, lag)
            b = advance(history, steps, following, LATE + i, ints[LAG0 + i])
            if b < steps:
                nearest = min(nearest, history.real[b, START] + lag)
    return nearest, longest


@inner
def pass_time_breaks(settings, history, steps, ints, following, t):
    """Move constant delays along; return the level of the break that they bring."""
    level = NO_BREAK
    for i in range(3):
        lag = lag_of(settings, i, ints[GAINS])
        if lag == 0.0:
            continue
        gain = 1 if i > 0 and settings.whole[RATE_FEEDBACK] == 1 else 2
        b = following[LATE + i]
        # Breaks that several delays bring at once differ by rounding; no step fits in between.
        while b < steps and history.real[b, START] + lag <= t + SHORTEST * max(1.0, abs(t)):
            level = min(level, history.whole[b, LEVEL] + gain)
            ints[LAG0 + i] = b
            b = advance(history, steps, following, LATE + i, b)
        j, _ = locate_time(history, steps, ints[LAG0 + i], t - lag)
        ints[LAG0 + i] = j
    return level


@inner
def seek_past(settings, history, steps, ints, following, t):
    """Find the delayed outputs anew, where other gains may want older or newer ones."""
    lag = lag_of(settings, 2, ints[GAINS])
    if lag > 0.0:
        ints[LAG0 + 2] = step_at(history, steps, t - lag)
        following[LATE + 2] = 0


@inner
def pass_angle_break(settings, history, steps, ints, reals, chain, following, which, t, theta):
    """Move the lag in angle over the break that it has met; return the level this brings."""
    b, whole = following[which], settings.whole
    gain = 1 if whole[RATE_FEEDBACK] + whole[CURRENT_DELAY] == 2 else 2
    if ints[I_AXIAL] == RIDING:
        gain = 0
    level = passed_on(history.whole[b, LEVEL], gains_no_angle(history, b), gain)
    chain[which] = b
    tolerance = 2.0 * PASSED * turned_by(settings, t, theta)
    before = ints[I_PASSES]
    passes = retrace(settings, history, steps, chain, following, before, t, theta, tolerance)
    ints[I_PASSES] = passes
    follow(settings, history, steps, mode_of(ints, reals, chain), chain, t, theta)
    # Another pass may have left a step in the face; and a pitch on the change is to be seen.
    return level if passes == before else min(level, 2)


@inner
def turned_by(settings, t, theta):
    """Size of the angles that a difference of angles is formed of."""
    return 1.0 + abs(theta) + rates((0.0, 0.0, 0.0, 0.0), settings.bit)[1] * abs(t)


@inner
def out_of_bounds(settings, t, y):
    """Whether a rate of the bit is beyond what a bounded motion reaches."""
    real = settings.real
    return (
        abs(y[1]) > real[BOUNDS] + real[BOUNDS + 1] * t
        or abs(y[3]) > real[BOUNDS + 2] + real[BOUNDS + 3] * t
    )


@entry
def march(settings, history, ints, reals, y, chain, following, end, max_step, tries):
    """Integrate until ``end`` or until the history is full.

    Parameters
    ----------
    settings, history : Settings, History
        See there.
    ints, reals, chain, following : array
        Where the march stands; changed in place.
    y : array
        Vector of `Settings` now; changed in place.
    end, max_step : float
        Time to stop at, and longest step.
    tries : int
        Steps tried before it pauses.

    Returns
    -------
    int
        Why it stopped: DONE, PAUSED, MORE_ROOM, COLLAPSE, REVERSED, NOT_FINITE or DIVERGED.
    """
    bit, size = settings.bit, moving(settings)
    linear = settings.whole[LINEAR] == 1
    first_kind = AT_LIMIT if linear else 0
    kinds = AT_LIMIT
    if settings.whole[FEEDBACK] == 1:
        kinds += 2 * settings.whole[INPUTS]
    work = workplace(settings)
    k, stages, new = work.rates, work.stages, work.vectors[END]
    probes = stages.shape[1] - 2
    known = False  # whether the rates at the start of the step are
    fresh = True  # whether no step has been tried from here
    for _ in range(tries):
        t, steps = reals[TIME], ints[STEPS]
        if t >= end:
            return DONE
        if out_of_bounds(settings, t, y):
            return DIVERGED
        if steps + 1 >= history.real.shape[0]:
            return MORE_ROOM
        if ints[I_TORSION] == REVERSE and settings.whole[BACKWARDS] == 0:
            return REVERSED
        ints[STALLS] += 1
        if ints[STALLS] > MOST_TRIES:
            return COLLAPSE
        mode = mode_of(ints, reals, chain)
        level = ints[I_LEVEL]
        if not known:
            rate_of_change(settings, history, steps, mode, t, y, k[0], stages[0])
            stages[0, probes], stages[0, probes + 1] = y[1], y[3]
            known = True

        goal, longest = time_limits(settings, history, steps, ints, following, t)
        goal = min(goal, end, next_clock(settings, ints, reals, t))
        near, front = np.inf, np.inf
        if not linear:
            near, front = angle_limits(history, bit, steps, mode, chain, following, t, y, k[0, 3])
            left, which = least_angle_left(history, bit, steps, mode, following, t, y[2])
            if which >= 0 and left <= PASSED * turned_by(settings, t, y[2]):
                # No step fits in between.
                level = pass_angle_break(
                    settings, history, steps, ints, reals, chain, following, which, t, y[2]
                )
                if level <= 2:
                    enter(settings, history, steps, ints, reals, chain, BARRIER, t, y, work)
                ints[I_LEVEL] = min(ints[I_LEVEL], level)
                known = False
                continue
        h = min(reals[STEP], longest, front, max_step)
        aim = near <= 1.02 * h
        if aim:
            h = near
        at_goal = t + 1.000001 * h >= goal
        if at_goal:
            h = goal - t
            aim = False
        if not h > SHORTEST * max(1.0, abs(t)) and not (at_goal or aim):
            return COLLAPSE
        h = max(h, 1e-15 * max(1.0, abs(t)))
        # A step that an event cuts short is no time in which to stop what moves.
        reach = max(h, reals[STEP])
        if fresh and settings.whole[SIDES] > 0:
            held, settled = hold_sides(settings, mode, reach, y, k[0], work.vectors[BETWEEN])
            if held:
                rate_of_change(settings, history, steps, mode, t, y, k[0], stages[0])
            if not settled:
                ints[UNSETTLED] += 1
        fresh = False

        error = attempt(settings, history, steps, mode, t, h, y, work)
        ints[EVALUATIONS] += STAGES
        if error != error:
            if h < 1e-10:
                return NOT_FINITE
            error = 1e4
        if error < 0.0 or error > 1.0:
            factor = 0.5 if error < 0.0 else max(0.2, 0.9 * error**-0.2)
            reals[STEP] = factor * h
            ints[REJECTED] += 1
            if reals[STEP] < SHORTEST * max(1.0, abs(t)):
                return COLLAPSE
            continue
        record(settings, history, steps, mode, t, h, y, work, level)
        growth = min(5.0, 0.9 * max(error, 1e-8) ** -0.2)
        # A step that was cut short and was easy says nothing of the next.
        if not (aim or at_goal) or (growth < 5.0 and growth * h < reals[STEP]):
            reals[STEP] = growth * h

        # End at the break that the lag in angle has met.
        reached = -1
        if not linear and mode.torsion != STUCK and mode.behind == 0:
            turns = turned_by(settings, t, new[2])
            for _ in range(REFINE):
                left, which = least_angle_left(history, bit, steps, mode, following, t + h, new[2])
                if abs(left) <= 4e-15 * turns:
                    reached = which
                    break
                rate = rates((0.0, 0.0, 0.0, new[3]), bit)[1]
                if which < 0 or rate <= 0.0 or (left > 0.0 and not left < 0.1 * h * rate):
                    break
                if t + h + left / rate >= goal + 1e-15:
                    break
                change = max(left / rate, -0.9 * h)
                if abs(change) < 1e-15 * max(1.0, t):
                    reached = which
                    break
                h += change
                at_goal = False
                attempt(settings, history, steps, mode, t, h, y, work)
                record(settings, history, steps, mode, t, h, y, work, level)
                left, which = least_angle_left(history, bit, steps, mode, following, t + h, new[2])
            if reached < 0 and which >= 0 and left < -1e-9 * turns:
                reals[STEP] = 0.5 * h
                ints[REJECTED] += 1
                continue

        # End at the first event.
        kind, where = -1, NONE
        for candidate in range(first_kind, kinds):
            if watched(settings, candidate, mode):
                s = first_zero(settings, history, steps, mode, candidate, work)
                if s < where:
                    kind, where = candidate, s
        if kind >= 0:
            if where * h < SHORTEST * max(1.0, abs(t)):
                # Negative from the start: no step, another mode.
                snap(kind, mode, y, bit)
                enter(settings, history, steps, ints, reals, chain, kind, t, y, work)
                ints[I_LEVEL] = min(ints[I_LEVEL], level_of(settings, kind))
                known = False
                continue
            if where < 1.0:
                h = refine(settings, history, steps, mode, kind, t, where, y, work, level)
                if h < 0.0:
                    reals[STEP] = -0.5 * h
                    ints[REJECTED] += 1
                    continue
                reached, at_goal = -1, False

        # Accept.
        ints[STALLS] = 0
        t = goal if at_goal else t + h
        for i in range(size):
            y[i] = new[i]
        if mode.axial == RIDING:
            set_on_face(settings, history, steps + 1, mode, t, y)
        steps, fresh = steps + 1, True
        ints[STEPS], reals[TIME] = steps, t
        level = pass_time_breaks(settings, history, steps, ints, following, t)
        if not linear:
            follow(settings, history, steps, mode, chain, t, y[2])
        if reached >= 0:
            level = min(
                level,
                pass_angle_break(
                    settings, history, steps, ints, reals, chain, following, reached, t, y[2]
                ),
            )
        gains = ints[GAINS]
        if take_sample(settings, history, steps, ints, reals, t, y):
            level = 2
            if ints[GAINS] != gains:
                seek_past(settings, history, steps, ints, following, t)
        if kind >= 0:
            snap(kind, mode, y, bit)
            level = min(level, level_of(settings, kind))
        # The last stage is the first of the next step, unless something breaks there.
        known = level == NO_BREAK and reached < 0
        if known:
            for i in range(size):
                k[0, i] = k[STAGES - 1, i]
            for i in range(probes + 2):
                stages[0, i] = stages[STAGES - 1, i]
        if kind >= 0 or level <= 2:
            cause = kind if kind >= 0 else BARRIER
            enter(settings, history, steps, ints, reals, chain, cause, t, y, work)
        ints[I_LEVEL] = level
    return PAUSED
