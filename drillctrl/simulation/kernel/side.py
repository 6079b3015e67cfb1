"""Coulomb friction along the string: torques that hold or slow it, chosen implicitly for a step.

They are beyond those of steady drilling, in which all slides forward: 0 there, twice the sliding
torque where it slides backward, between where it is held (Moreau 1988; Gauss-Seidel sweeps as of
Jean, Comput. Methods Appl. Mech. Eng. 177, 1999).
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
    accelerations at its start.

    Parameters
    ----------
    y : array
        The vector of `Settings`.
    rate : array
        Rates of change under the torques that y holds.
    speeds : array
        To work in.

    Returns
    -------
    bool
        Whether a torque has changed.
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
        steady = steady and y[first + k] == 0.0 and speeds[k] >= 0.0
    if steady:
        return False
    response = n + 2 + (count if mode.torsion == STUCK else 0)
    changed = False
    for _ in range(SWEEPS):
        moved = 0.0
        for k in range(count):
            sliding, now = side[k, n + 1], y[first + k]
            wanted = now - speeds[k] / (h * side[k, response + k])
            change = min(max(wanted, 0.0), 2.0 * sliding) - now
            if change != 0.0:
                changed = True
                y[first + k] = now + change
                for j in range(count):
                    speeds[j] += h * side[j, response + k] * change
                moved = max(moved, abs(change) / sliding)
        if moved < SETTLED:
            break
    return changed
