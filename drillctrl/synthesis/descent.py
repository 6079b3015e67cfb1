"""BFGS for nonsmooth functions in a box (Lewis and Overton 2013)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray

Objective = Callable[[FloatArray], tuple[float, FloatArray]]


@dataclass(frozen=True, eq=False)
class Descent:
    """Where a local descent ended.

    Attributes
    ----------
    gains : array, (k,)
        Best point found.
    value : float
        Objective there.
    evaluations : int
        Calls of the objective.
    """

    gains: FloatArray
    value: float
    evaluations: int


def to_box(y: FloatArray, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Map the whole space onto a box, x = centre + half · sin y; return x and dx/dy.

    The bounds hold exactly in every evaluation, and a minimum on a face is a stationary
    point in y.
    """
    half = 0.5 * (upper - lower)
    x = np.clip(0.5 * (lower + upper) + half * np.sin(y), lower, upper)
    return x, half * np.cos(y)


def from_box(x: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return a y with `to_box` (y) = x."""
    return np.arcsin(np.clip((2.0 * x - lower - upper) / (upper - lower), -1.0, 1.0))


def bfgs(
    objective: Objective,
    start: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    *,
    most: int = 200,
    tolerance: float = 1e-10,
    below: float = -np.inf,
) -> Descent:
    """Minimise a locally Lipschitz function within a box from one start.

    Parameters
    ----------
    objective : callable
        Returns value and gradient; where several gradients exist, any one of them.
    start : array, (k,)
        Strictly inside the box: on a face the transformed gradient vanishes.
    lower, upper : array, (k,)
        The box.
    most : int
        Evaluations permitted.
    tolerance : float
        Ends when steps in y or predicted decreases are this small.
    below : float
        Ends at the first value below this.

    Notes
    -----
    A weak Wolfe search with bisection keeps the curvature condition that lets BFGS learn
    the ridges of a nonsmooth function; no stationarity test on the single gradient exists
    at a kink, so the search ends when no step descends any more.
    """
    y = from_box(start, lower, upper)

    def evaluate(point: FloatArray) -> tuple[float, FloatArray]:
        x, slope = to_box(point, lower, upper)
        value, gradient = objective(x)
        return value, gradient * slope

    value, gradient = evaluate(y)
    used = 1
    inverse = np.eye(y.size)
    first = True
    while used < most and not value < below:
        direction = -inverse @ gradient
        slope = float(gradient @ direction)
        if not slope < -tolerance * 1e-3:
            break
        if first:
            direction, slope = (
                direction / max(1.0, np.abs(gradient).max()),
                slope / max(1.0, float(np.abs(gradient).max())),
            )
        low, high, t = 0.0, np.inf, 1.0
        accepted = False
        while used < most:
            trial = y + t * direction
            new_value, new_gradient = evaluate(trial)
            used += 1
            if not new_value <= value + 1e-4 * t * slope:
                high = t
            elif float(new_gradient @ direction) < 0.5 * slope:
                low = t
                best = trial, new_value, new_gradient
                accepted = True
            else:
                best = trial, new_value, new_gradient
                accepted = True
                break
            if high < np.inf:
                t = 0.5 * (low + high)
            else:
                t = 2.0 * low
            if (high - low) * float(np.abs(direction).max()) < tolerance:
                break
        if not accepted:
            break
        step = best[0] - y
        change = best[2] - gradient
        y, value, gradient = best
        curvature = float(step @ change)
        if curvature > 0.0:
            if first:
                inverse *= curvature / float(change @ change)
                first = False
            left = np.eye(y.size) - np.outer(step, change) / curvature
            inverse = left @ inverse @ left.T + np.outer(step, step) / curvature
        if float(np.abs(step).max()) < tolerance:
            break
    return Descent(to_box(y, lower, upper)[0], value, used)
