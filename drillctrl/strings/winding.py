"""Zeros of a function right of a line, by the argument principle on an adapted contour."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drillctrl.base.arrays import ComplexArray
from drillctrl.base.errors import InputError

_COARSE = 0.4
_ROUNDS = 40
# Share of the height from which the straight side is sampled by ratios.
_NEAR = 1e-7


def zeros_right_of(
    function: Callable[[ComplexArray], ComplexArray], line: float, height: float, count: int
) -> int:
    """Return how many zeros a function without poles has in a half disc right of a line.

    Parameters
    ----------
    function : callable
        Of an array of s.
    line : float
        Where the half disc's straight side stands.
    height : float
        Its radius.
    count : int
        Samples of each side to begin with; more are put in where the phase turns fast.

    Raises
    ------
    InputError
        If a zero lies on the contour.
    """
    # A string that turns freely has zeros beside 0 that turn the phase in one short stretch.
    near = np.geomspace(_NEAR * height, height, count)
    side = line + 1j * np.sort([*np.linspace(-height, height, count), *-near[:-1], *near[:-1], 0.0])
    arc = line + height * np.exp(1j * np.linspace(0.5, -0.5, count) * np.pi)
    path = np.concatenate([side, arc[1:]])
    values = function(path)
    for _ in range(_ROUNDS):
        turned = np.angle(values[1:] / values[:-1])
        coarse = np.nonzero(np.abs(turned) > _COARSE)[0]
        if not coarse.size:
            return -round(float(turned.sum()) / (2.0 * np.pi))
        between = 0.5 * (path[coarse] + path[coarse + 1])
        path = np.insert(path, coarse + 1, between)
        values = np.insert(values, coarse + 1, function(between))
    raise InputError("line", line, "one on which no root lies")
