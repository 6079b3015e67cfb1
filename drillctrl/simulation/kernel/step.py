"""One step of the Dormand-Prince pair of order 5(4), and its dense output.

Source: Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19-26. The dense output of the
bit is the quintic through value, rate and acceleration at both ends, which the pair has at no
cost; that of all else is the pair's continuous extension of order 4 (Shampine, Math. Comput.
46 (1986) 135-150).
"""

from __future__ import annotations

import numpy as np

from .data import (
    ACTUATOR,
    ATOL,
    AXIAL,
    BEHIND,
    CONTACT,
    END,
    FACE,
    INCREMENT,
    INPUTS,
    LAG,
    LENGTH,
    LEVEL,
    OTHERS,
    P_DEPTH,
    PASSES,
    PIVOTS,
    QUARTIC,
    RTOL,
    SATURATED,
    SIDES,
    STAGES,
    START,
    STATES,
    THETA,
    TORSION,
    X,
)
from .interpolate import fit_quintic, quartic, state_at
from .jit import inner
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
# y(s) = y(0) + h Σ DENSE[i, q] s^(q + 1) k_i.
DENSE = np.array(
    [
        [
            1.0,
            -8048581381 / 2820520608,
            8663915743 / 2820520608,
            -12715105075 / 11282082432,
        ],
        [0.0, 0.0, 0.0, 0.0],
        [
            0.0,
            131558114200 / 32700410799,
            -68118460800 / 10900136933,
            87487479700 / 32700410799,
        ],
        [
            0.0,
            -1754552775 / 470086768,
            14199869525 / 1410260304,
            -10690763975 / 1880347072,
        ],
        [
            0.0,
            127303824393 / 49829197408,
            -318862633887 / 49829197408,
            701980252875 / 199316789632,
        ],
        [0.0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844],
        [0.0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423],
    ]
)


@inner
def moving(settings):
    """Number of entries of y that are integrated: states, and actuators if there are any."""
    n = settings.whole[STATES]
    return n + settings.whole[INPUTS] if settings.whole[ACTUATOR] == 1 else n


@inner
def attempt(settings, history, steps, mode, t, h, y, work):
    """Try a step from t to t + h.

    Parameters
    ----------
    y : array
        The vector of `Settings` at t.
    work : Work
        Rates and probe of the first stage are given; takes those of the others, and the
        vector at the end.

    Returns
    -------
    float
        Largest ratio of error to tolerance; negative if a delayed instant is not known yet.
    """
    size, n, m = moving(settings), settings.whole[STATES], settings.whole[INPUTS]
    k, stages = work.rates, work.stages
    new, increment = work.vectors[END], work.vectors[INCREMENT]
    probes = stages.shape[1] - 2
    for i in range(n + m, n + 2 * m):
        new[i] = y[i]
    for i in range(n + 4 * m + 6 + PIVOTS, n + 4 * m + 6 + PIVOTS + settings.whole[SIDES]):
        new[i] = y[i]
    for stage in range(1, STAGES):
        # Along the states, which stand side by side.
        for i in range(size):
            increment[i] = WEIGHTS[stage, 0] * k[0, i]
        for q in range(1, stage):
            weight = WEIGHTS[stage, q]
            for i in range(size):
                increment[i] += weight * k[q, i]
        for i in range(size):
            increment[i] *= h
            new[i] = y[i] + increment[i]
        known = rate_of_change(
            settings, history, steps, mode, t + NODES[stage] * h, new, k[stage], stages[stage]
        )
        if not known:
            return -1.0
        stages[stage, probes] = new[1]
        stages[stage, probes + 1] = new[3]
    worst = 0.0
    for i in range(size):
        # Without the second stage, which has no part in it.
        total = (
            ERROR[0] * k[0, i]
            + ERROR[2] * k[2, i]
            + ERROR[3] * k[3, i]
            + ERROR[4] * k[4, i]
            + ERROR[5] * k[5, i]
            + ERROR[6] * k[6, i]
        )
        allowed = settings.real[ATOL] + settings.real[RTOL] * max(abs(y[i]), abs(new[i]))
        ratio = abs(h * total) / allowed
        if not ratio <= worst:  # also where it is no number
            worst = ratio
    if not np.isfinite(stages[STAGES - 1, P_DEPTH]):
        return np.nan
    return worst


@inner
def record(settings, history, j, mode, t, h, y, work, level):
    """Write a step into place j of the history."""
    last, real, whole = STAGES - 1, history.real, history.whole
    k, new, increment = work.rates, work.vectors[END], work.vectors[INCREMENT]
    n, m = settings.whole[STATES], settings.whole[INPUTS]
    real[j, START], real[j, LENGTH] = t, h
    fit_quintic(real, X, j, h, y[0], y[1], new[1], increment[0], k[0, 1], k[last, 1])
    fit_quintic(real, THETA, j, h, y[2], y[3], new[3], increment[2], k[0, 3], k[last, 3])
    for i in range(4, moving(settings)):
        column = OTHERS + QUARTIC * (i - 4)
        real[j, column] = y[i]
        for q in range(QUARTIC - 1):
            total = 0.0
            for stage in range(STAGES):
                total += DENSE[stage, q] * k[stage, i]
            real[j, column + 1 + q] = h * total
    held = OTHERS + QUARTIC * (n + m - 4)
    for i in range(m):
        real[j, held + i] = y[n + m + i]
    for i in range(settings.whole[SIDES]):
        real[j, held + m + i] = y[n + 4 * m + 6 + PIVOTS + i]
    whole[j, CONTACT], whole[j, TORSION], whole[j, AXIAL] = mode.contact, mode.torsion, mode.axial
    whole[j, LEVEL], whole[j, LAG], whole[j, FACE] = level, mode.lag, mode.face
    whole[j, PASSES], whole[j, SATURATED] = mode.passes, mode.saturated
    whole[j, BEHIND] = mode.behind


@inner
def recall(settings, history, j, s, y):
    """Write states, actuators and held outputs on step j at s into the vector of `Settings`."""
    n, m, real = settings.whole[STATES], settings.whole[INPUTS], history.real
    y[0], y[1], y[2], y[3] = state_at(history, j, s)
    for i in range(4, moving(settings)):
        y[i] = quartic(real, OTHERS + QUARTIC * (i - 4), j, s)
    held = OTHERS + QUARTIC * (n + m - 4)
    for i in range(m):
        y[n + m + i] = real[j, held + i]
    for i in range(settings.whole[SIDES]):
        y[n + 4 * m + 6 + PIVOTS + i] = real[j, held + m + i]
