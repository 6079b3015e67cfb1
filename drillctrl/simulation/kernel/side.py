"""Dry friction along the string: torques that hold or slow it, chosen implicitly for a step.

They are beyond those of steady drilling, in which all slides forward: 0 there, twice the sliding
torque where it slides backward, between where it is held (Moreau 1988; Gauss-Seidel sweeps as of
Jean, Comput. Methods Appl. Mech. Eng. 177, 1999). What is held bears up to its torque at rest.
"""

from __future__ import annotations

from .data import INPUTS, PIVOTS, SIDES, STATES, STUCK
from .jit import inner
from .physics import rates

SWEEPS, SETTLED = 200, 1e-9


@inner
def hold_sides(settings, mode, h, y, rate, speeds):
    """Write the torques that friction along the string has over a step of length h into y.

    They are those that belong to its speeds at the end of the step, as these follow from the
    accelerations at its start. A part whose torque is neither that of sliding forward nor that of
    sliding backward is held.

    Parameters
    ----------
    y : array
        The vector of `Settings`.
    rate : array
        Rates of change under the torques that y holds.
    speeds : array
        To work in: speeds of the parts; how much more than while it slides each can bear, held;
        and which way each has slid.

    Returns
    -------
    changed, settled : bool
        Whether a torque has changed; and whether they came to agree with one another.
    """
    side, count, n = settings.side, settings.whole[SIDES], settings.whole[STATES]
    m = settings.whole[INPUTS]
    first, top = n + 4 * m + 6 + PIVOTS, n + 3 * m + 3
    turning = rates((0.0, 0.0, 0.0, 0.0), settings.bit)[1]
    steady = True
    for k in range(count):
        speeds[k] = turning + side[k, n] * y[top]
        for i in range(n):
            speeds[k] += side[k, i] * (y[i] + h * rate[i])
        now = y[first + k]
        way = 1.0 if now == 0.0 else (-1.0 if now == 2.0 * side[k, n + 1] else 0.0)
        more = side[k, n + 2] - side[k, n + 1]
        speeds[count + k], speeds[2 * count + k] = (more if way == 0.0 else 0.0), way
        steady = steady and way == 1.0 and speeds[k] >= 0.0
    if steady:
        return False, True
    response = n + 3 + (count if mode.torsion == STUCK else 0)
    changed = False
    for _ in range(SWEEPS):
        moved = 0.0
        for k in range(count):
            sliding, now, more = side[k, n + 1], y[first + k], speeds[count + k]
            wanted = now - speeds[k] / (h * side[k, response + k])
            y[first + k] = min(max(wanted, -more), 2.0 * sliding + more)
            change = y[first + k] - now
            if change != 0.0:
                changed = True
                for j in range(count):
                    speeds[j] += h * side[j, response + k] * change
                moved = max(moved, abs(change) / sliding)
        if moved < SETTLED:
            again = False
            for k in range(count):
                sliding, now, more = side[k, n + 1], y[first + k], speeds[count + k]
                back = 2.0 * sliding + more
                if more > 0.0 and (now == -more or now == back):
                    # It breaks away, and slides from here on.
                    speeds[count + k], again = 0.0, True
                elif speeds[2 * count + k] * (now - sliding) == sliding:
                    # It comes to rest before it slides the other way, and may stay there.
                    speeds[count + k], speeds[2 * count + k] = side[k, n + 2] - sliding, 0.0
                    again = again or speeds[count + k] > 0.0
            if not again:
                return changed, True
    return changed, False
