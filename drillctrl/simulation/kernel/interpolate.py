"""Dense output of the steps, and the search for the step that holds a delayed instant."""

from __future__ import annotations

import numpy as np

from .data import (
    BEHIND,
    LAST_LEVEL,
    LENGTH,
    LEVEL,
    START,
    STUCK,
    THETA,
    TORSION,
    X,
)
from .jit import entry, inner
from .physics import rates, turned

SOLVE_STEPS = 60


@inner
def quintic(c, n, j, s):
    """Value at s of the quintic whose coefficients start in column n of row j."""
    return c[j, n] + s * (
        c[j, n + 1] + s * (c[j, n + 2] + s * (c[j, n + 3] + s * (c[j, n + 4] + s * c[j, n + 5])))
    )


@inner
def quintic_slope(c, n, j, s):
    """Derivative in s of the quintic in row j."""
    return c[j, n + 1] + s * (
        2.0 * c[j, n + 2]
        + s * (3.0 * c[j, n + 3] + s * (4.0 * c[j, n + 4] + s * 5.0 * c[j, n + 5]))
    )


@inner
def quintic_curve(c, n, j, s):
    """Second derivative in s of the quintic in row j."""
    return 2.0 * c[j, n + 2] + s * (
        6.0 * c[j, n + 3] + s * (12.0 * c[j, n + 4] + s * 20.0 * c[j, n + 5])
    )


@inner
def quartic(c, n, j, s):
    """Value at s of the quartic whose coefficients start in column n of row j."""
    return c[j, n] + s * (c[j, n + 1] + s * (c[j, n + 2] + s * (c[j, n + 3] + s * c[j, n + 4])))


@inner
def state_at(history, j, s):
    """State (x, x', θ, θ') on step j at s."""
    c = history.real
    h = c[j, LENGTH]
    return (
        quintic(c, X, j, s),
        quintic_slope(c, X, j, s) / h,
        quintic(c, THETA, j, s),
        quintic_slope(c, THETA, j, s) / h,
    )


@inner
def face_at(history, bit, j, s, rotary):
    """How the rock face that was left on step j at s falls under a bit that turns at Φ'.

    Returns
    -------
    rate, share, rest : float
        Speed at which it falls, Z'(t − τ) Φ'/Φ'(t − τ); and its acceleration share Φ'' + rest.
    """
    c, h = history.real, history.real[j, LENGTH]
    axial, turning = rates(state_at(history, j, s), bit)
    if not turning > 0.0:
        return np.inf, 0.0, np.inf
    ratio, share = rotary / turning, axial / turning
    curves = quintic_curve(c, X, j, s), quintic_curve(c, THETA, j, s)
    return share * rotary, share, (curves[0] - share * curves[1]) * (ratio / h) ** 2


@inner
def fit_quintic(c, n, j, h, value, rate, rate_end, increment, curve, curve_end):
    """Quintic through value, rate and acceleration at both ends (Hermite).

    The increment is taken instead of the end value: it does not cancel for short steps.
    """
    first, second = h * rate, 0.5 * h * h * curve
    d = increment - first - second
    e = h * rate_end - first - 2.0 * second
    f = h * h * curve_end - 2.0 * second
    c[j, n], c[j, n + 1], c[j, n + 2] = value, first, second
    c[j, n + 3] = 10.0 * d - 4.0 * e + 0.5 * f
    c[j, n + 4] = -15.0 * d + 7.0 * e - f
    c[j, n + 5] = 6.0 * d - 3.0 * e + 0.5 * f


@inner
def pitch_of(bit):
    """2π/n, from the plant's own condition on the delay."""
    zero = (0.0, 0.0, 0.0, 0.0)
    return -turned(zero, zero, 0.0, bit)


@inner
def beyond(history, bit, j, s, t, theta, extra):
    """Angle from the bit's angle less the lag back to step j at s; positive if s is too early.

    ``extra`` is the lag in angle beyond 2π/n.
    """
    delay = t - history.real[j, START] - s * history.real[j, LENGTH]
    then = (0.0, 0.0, quintic(history.real, THETA, j, s), 0.0)
    return turned((0.0, 0.0, theta, 0.0), then, delay, bit) - extra


@inner
def angle_slope(history, bit, j, s):
    """Angle turned per unit of s on step j."""
    h = history.real[j, LENGTH]
    rate = quintic_slope(history.real, THETA, j, s) / h
    return h * rates((0.0, 0.0, 0.0, rate), bit)[1]


@inner
def gains_no_angle(history, j):
    """Whether the bit comes to no new angle on step j, which the lag in angle jumps over."""
    return history.whole[j, TORSION] == STUCK or history.whole[j, BEHIND] == 1


@entry
def furthest(history, j, t, theta):
    """Time and θ at which the bit reached its furthest angle until t, which is on step j."""
    if history.whole[j, BEHIND] == 0:
        return t, theta
    while history.whole[j - 1, BEHIND] == 1:
        j -= 1
    return history.real[j, START], history.real[j, THETA]


@inner
def locate_angle(history, bit, steps, j, t, theta, extra):
    """Find the step and s at which the bit was a blade pitch (and ``extra``) back.

    The search starts at step j and stays within the smooth piece of the history that j
    belongs to; beyond its end the last step is extrapolated, for trial steps only.

    Returns
    -------
    j, s
        Step and place on it; j = -1 if the instant lies beyond the last step.
    """
    while (
        j > 0
        and history.whole[j, LEVEL] > LAST_LEVEL
        and (beyond(history, bit, j, 0.0, t, theta, extra) < 0.0)
    ):
        j -= 1
    after = beyond(history, bit, j, 1.0, t, theta, extra)
    while (
        after > 0.0
        and j + 1 < steps
        and history.whole[j + 1, LEVEL] > LAST_LEVEL
        and not gains_no_angle(history, j + 1)
    ):
        j += 1
        after = beyond(history, bit, j, 1.0, t, theta, extra)
    if after > 0.0 or j == 0:
        slope = angle_slope(history, bit, j, 1.0)
        if j == 0:  # steady motion: linear, without end on either side
            return j, 1.0 + after / slope
        if j + 1 >= steps and after > 1e-9:
            return -1, 1.0
        if after > 0.2 * slope:
            return j, 1.0
        s = 1.0 + after / slope
        slope = angle_slope(history, bit, j, s)
        if slope > 0.0:
            s += beyond(history, bit, j, s, t, theta, extra) / slope
        return j, min(max(s, 1.0), 1.3)
    before = beyond(history, bit, j, 0.0, t, theta, extra)
    if before <= 0.0:
        return j, 0.0
    # Newton inside a bracket; the slope is zero where the bit came to rest.
    low, high = 0.0, 1.0
    s = before / (before - after)
    for _ in range(SOLVE_STEPS):
        value = beyond(history, bit, j, s, t, theta, extra)
        if value > 0.0:
            low = s
        else:
            high = s
        slope = angle_slope(history, bit, j, s)
        new = s + value / slope if slope > 0.0 else -1.0
        if new < low or new > high:
            new = 0.5 * (low + high)
        change = abs(new - s)
        s = new
        # Newton squares the error; near rest it is the relative one that counts.
        if change <= 1e-7 * s or change < 1e-14:
            break
    return j, s


@inner
def locate_time(history, steps, j, time):
    """Find the step and s of an instant, searching from j within its smooth piece."""
    while j > 0 and history.whole[j, LEVEL] > LAST_LEVEL and time < history.real[j, START]:
        j -= 1
    while (
        j + 1 < steps
        and history.whole[j + 1, LEVEL] > LAST_LEVEL
        and time > history.real[j, START] + history.real[j, LENGTH]
    ):
        j += 1
    return j, (time - history.real[j, START]) / history.real[j, LENGTH]


@entry
def step_at(history, steps, time):
    """Index of the last step that starts at or before an instant (bisection)."""
    low, high = 0, steps - 1
    while low < high:
        middle = (low + high + 1) // 2
        if history.real[middle, START] <= time:
            low = middle
        else:
            high = middle - 1
    return low


@inner
def step_before_angle(history, bit, j, t, theta, extra, tolerance):
    """Search from step j, across breaks, for the step in which the lagged angle lies next.

    At a break it is the step after it, since the bit goes on forward.
    """
    while j > 0 and (
        history.whole[j, BEHIND] == 1 or beyond(history, bit, j, 0.0, t, theta, extra) < -tolerance
    ):
        j -= 1
    while gains_no_angle(history, j) or (
        beyond(history, bit, j, 1.0, t, theta, extra) >= -tolerance
    ):
        j += 1
    return j
