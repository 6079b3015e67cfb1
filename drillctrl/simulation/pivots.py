"""A string's modes in few numbers: those that the bit and the top end carry follow both.

In coordinates of the ends and of modes between them the inertia of the ends is coupled to every
mode, so that each mode's rate depends on the whole string. It does so through the acceleration
of the ends alone: a mode's row is its own frequency and damping, and multiples of their rows.
"""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.simulation.kernel import data

ENDS = ("dx", "dtheta", "dphi")
# Share of the largest in its column up to which a number is rounding.
_ROUNDING = 3e-14
# Entries of a row from which on it pays.
_DENSE = 8


def follow_pivots(rows: FloatArray, names: tuple[str, ...], sides: int = 0) -> list[int]:
    """Write rows by the rates of the ends where this takes fewer numbers, in place.

    Parameters
    ----------
    rows : array, (n + p + 1, `vector_length`)
        The matrix of `Settings`; the columns of its pivots are empty.
    names : tuple of str
        Of the n states.
    sides : int
        Number of columns behind those of the pivots.

    Returns
    -------
    list of int
        Rows of the ends that others follow, at most `PIVOTS`.
    """
    pivots = [names.index(name) for name in ENDS if name in names]
    pivots = [row for row in pivots if np.count_nonzero(rows[row]) > _DENSE]
    ports = {k for row in pivots for k in (row - 1, row)}
    noise = _ROUNDING * abs(rows).max(axis=0)
    followed, column = False, rows.shape[1] - data.PIVOTS - sides
    for i in range(len(names)):
        if i in pivots:
            continue
        rows[i, abs(rows[i]) <= noise] = 0.0
        if np.count_nonzero(rows[i]) <= _DENSE:
            continue
        # Where the row has nothing of its own: the columns of all modes but its.
        others = [k for k in range(len(names)) if k not in ports and k not in (i - 1, i)]
        base = rows[pivots][:, others]
        size = np.linalg.norm(base, axis=1)
        if len(others) <= len(pivots) or not (size > 0.0).all():
            continue
        shares = np.linalg.lstsq((base / size[:, None]).T, rows[i, others], rcond=None)[0]
        shares[abs(shares) <= _ROUNDING * np.linalg.norm(rows[i])] = 0.0
        shares /= size
        left = rows[i] - shares @ rows[pivots]
        left[abs(left) <= noise + _ROUNDING * (abs(shares) @ abs(rows[pivots]))] = 0.0
        if np.count_nonzero(left) + len(pivots) < 0.5 * np.count_nonzero(rows[i]):
            rows[i] = left
            rows[i, column : column + len(pivots)] = shares
            followed = True
    return pivots if followed else []
