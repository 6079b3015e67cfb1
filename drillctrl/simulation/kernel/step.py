"""One step of the Dormand-Prince pair of order 5(4), and its dense output.

Source: Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19-26. The dense output is the
quintic through value, rate and acceleration at both ends, which the pair has at no cost.
"""

from __future__ import annotations

import numba
import numpy as np

from .data import (
    ACTUATOR,
    ACTUATORS,
    AXIAL,
    CONTACT,
    FACE,
    HELD_U,
    LAG,
    LENGTH,
    LEVEL,
    P_DEPTH,
    PASSES,
    PROBES,
    SATURATED,
    START,
    THETA,
    TORSION,
    X,
)
from .interpolate import fit_cubic, fit_quintic
from .model import rate_of_change

NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
WEIGHTS = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
ERROR = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
STAGES = 7
STAGE_COLUMNS = PROBES + 2


@numba.njit(cache=True, error_model="numpy")
def attempt(settings, history, steps, mode, t, h, y, k, new, increment, stages):
    """Try a step from t to t + h.

    Parameters
    ----------
    y, new, increment : array, (6,)
        State, state at the end, their difference.
    k : array, (7, 6)
        Rates at the stages; the first is given.
    stages : array, (7, PROBES + 2)
        Takes the probe of each stage but the first, with x' and θ' after it.

    Returns
    -------
    float
        Largest ratio of error to tolerance; negative if a delayed instant is not known yet.
    """
    size = 6 if settings.flags[ACTUATOR] == 1 else 4
    probe = np.zeros(PROBES)
    for stage in range(1, STAGES):
        for i in range(size):
            total = 0.0
            for m in range(stage):
                total += WEIGHTS[stage, m] * k[m, i]
            increment[i] = h * total
            new[i] = y[i] + increment[i]
        known = rate_of_change(
            settings, history, steps, mode, t + NODES[stage] * h, new, k[stage], probe
        )
        if not known:
            return -1.0
        for i in range(PROBES):
            stages[stage, i] = probe[i]
        stages[stage, PROBES] = new[1]
        stages[stage, PROBES + 1] = new[3]
    worst = 0.0
    for i in range(size):
        total = 0.0
        for m in range(STAGES):
            total += ERROR[m] * k[m, i]
        allowed = settings.tolerance[1] + settings.tolerance[0] * max(abs(y[i]), abs(new[i]))
        ratio = abs(h * total) / allowed
        if not ratio <= worst:  # also where it is no number
            worst = ratio
    if not np.isfinite(stages[STAGES - 1, P_DEPTH]):
        return np.nan
    return worst


@numba.njit(cache=True, error_model="numpy")
def record(settings, history, j, mode, t, h, y, k, new, increment, level):
    """Write a step into place j of the history."""
    last = STAGES - 1
    history.real[j, START], history.real[j, LENGTH] = t, h
    fit_quintic(history.real, X, j, h, y[0], y[1], new[1], increment[0], k[0, 1], k[last, 1])
    fit_quintic(history.real, THETA, j, h, y[2], y[3], new[3], increment[2], k[0, 3], k[last, 3])
    if settings.flags[ACTUATOR] == 1:
        for i in range(2):
            n = 4 + i
            fit_cubic(
                history.real, ACTUATORS + 4 * i, j, h, y[n], k[0, n], k[last, n], increment[n]
            )
    history.real[j, HELD_U], history.real[j, HELD_U + 1] = mode.held0, mode.held1
    history.whole[j, CONTACT], history.whole[j, TORSION], history.whole[j, AXIAL] = (
        mode.contact,
        mode.torsion,
        mode.axial,
    )
    history.whole[j, LEVEL] = level
    history.whole[j, LAG], history.whole[j, FACE], history.whole[j, PASSES] = (
        mode.lag,
        mode.face,
        mode.passes,
    )
    history.whole[j, SATURATED] = mode.saturated
