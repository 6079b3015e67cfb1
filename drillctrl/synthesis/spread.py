"""Points that fill a cube evenly, at which searches begin."""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import FloatArray


def spread_points(count: int, dimension: int, seed: int) -> FloatArray:
    """Return points that fill the unit cube evenly, (count, dimension).

    Multiples, modulo 1, of numbers that are hardest to approximate by fractions together (a
    Kronecker sequence with powers of the root of x^(d + 1) = x + 1), begun in the middle, and
    at random for any seed but 0. SciPy's sequences lead to no better designs and take longer to
    load than the whole search.
    """
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (dimension + 1))
    steps = root ** -np.arange(1.0, dimension + 1)
    begin = np.random.default_rng(seed).random(dimension) if seed else 0.5
    return np.asarray((begin + np.arange(1, count + 1)[:, None] * steps) % 1.0)
