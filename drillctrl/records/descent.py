"""Least squares over a family of strings: what is carried down must obey one law of the bit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.records.families import Family
from drillctrl.records.law import BitLaw, first_law
from drillctrl.records.surface import Carrier, Stretch

LAW = ("level", "drop", "decay")
# The drop at most so many times the largest torque.
_LAW_LOW, _LAW_HIGH, _MOST_DROP = (1.0, 1.0, 1.0), (1e6, 1e6, 60.0), 2.0
# What part of the weight of far points is kept.
_LOSS = "soft_l1"


@dataclass(frozen=True, eq=False)
class Descent:
    """Where the least squares ended.

    Attributes
    ----------
    names : tuple of str
        Of the parameters: the family's, those of the law, and ``lag`` where it was looked for.
    values : array, (p,)
        Of these; all but the lag are positive.
    spread : array, (p, p)
        Covariance of the logarithms (of the lag itself), from the scatter over blocks of time.
    cost : float
        Mean of the squared distances from the law.
    blocks : int
        Of time, that the spread comes from.
    """

    names: tuple[str, ...]
    values: FloatArray
    spread: FloatArray
    cost: float
    blocks: int

    def value(self, name: str) -> float:
        """Return a parameter."""
        return float(self.values[self.names.index(name)])

    def told(self, function: Callable[[FloatArray], float]) -> tuple[float, float]:
        """Return a positive function of the parameters and the error of its logarithm."""
        value = function(self.values)
        slopes = np.zeros(self.values.size)
        for i in range(self.values.size):
            moved = self.values.copy()
            step = 1e-3 if self.names[i] == "lag" else 1e-3 * float(moved[i])
            moved[i] += step
            slopes[i] = math.log(function(moved) / value) / 1e-3
        return value, math.sqrt(max(float(slopes @ self.spread @ slopes), 0.0))

    def law(self) -> BitLaw:
        """Return the bit's law."""
        return BitLaw(*(self.value(name) for name in LAW))


def descend(
    family: Family,
    stretches: Sequence[Stretch],
    units: tuple[float, float],
    inertia: float,
    *,
    lag: float = 0.0,
    free_lag: bool = False,
    margin: int = 0,
    block: int = 400,
    rounds: int = 60,
    begin: FloatArray | None = None,
) -> Descent:
    """Return the string of a family that makes the bit obey a law best.

    Parameters
    ----------
    family : Family
        Of strings.
    stretches : sequence of Stretch
        Of the record.
    units : (float, float)
        Errors of speed and torque at the bit.
    inertia : float
        Of the drive whose torque is measured, else 0.
    lag : float
        Of the torque, s: a first guess where ``free_lag``.
    free_lag : bool
        Look for it too.
    margin : int
        Samples left out at both ends of each stretch.
    block : int
        Samples of a block of time.
    rounds : int
        Most steps.
    begin : array, (p,), optional
        Values to begin at instead of the family's.
    """
    import scipy.optimize

    count = len(family.names)

    def points(parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        late = float(parameters[-1]) if free_lag else lag
        carrier = Carrier(family.line(np.exp(parameters[:count]).tolist()), inertia, late)
        found = [
            (a, b / stretch.weight) for stretch in stretches for a, b in (carrier.at_bit(stretch),)
        ]
        cut = [(a[margin : a.size - margin], b[margin : b.size - margin]) for a, b in found]
        return np.concatenate([a for a, _ in cut]), np.concatenate([b for _, b in cut])

    def law_of(parameters: FloatArray) -> BitLaw:
        return BitLaw(*np.exp(parameters[count : count + 3]).tolist())

    start = np.log(family.start)
    speed, torque = points(np.append(start, [lag]) if free_lag else start)
    most = max(2.0, _MOST_DROP * float(np.quantile(np.abs(torque), 0.99)))
    law_high = (_LAW_HIGH[0], most, _LAW_HIGH[2])
    guess = np.clip(np.array(first_law(speed, torque)), _LAW_LOW, law_high)
    parameters = np.concatenate([start, np.log(guess), [lag] if free_lag else []])
    low = np.concatenate([np.log(family.low), np.log(_LAW_LOW), [-0.02] if free_lag else []])
    high = np.concatenate([np.log(family.high), np.log(law_high), [1.0] if free_lag else []])

    kept: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def residuals(parameters: FloatArray) -> FloatArray:
        # The law alone costs nothing: the string's part is kept.
        key = np.delete(parameters, range(count, count + 3)).tobytes()
        if key not in kept:
            if len(kept) > 12:
                kept.clear()
            kept[key] = points(parameters)
        return law_of(parameters).distance(*kept[key], units)

    if begin is not None:
        parameters = np.concatenate([np.log(begin[: count + 3]), begin[count + 3 :]])
    inside = np.clip(parameters, low + 1e-6, high - 1e-6)
    found = scipy.optimize.least_squares(
        residuals, inside, bounds=(low, high), loss=_LOSS, f_scale=2.0, x_scale="jac",
        diff_step=1e-4, max_nfev=rounds,
    )  # fmt: skip
    jacobian, left = np.asarray(found.jac), np.asarray(found.fun)
    spread, blocks = _spread(jacobian, left, block)
    values = np.concatenate([np.exp(found.x[: count + 3]), found.x[count + 3 :]])
    names = (*family.names, *LAW, *(("lag",) if free_lag else ()))
    return Descent(names, values, spread, 2.0 * float(found.cost) / left.size, blocks)


def _spread(jacobian: FloatArray, left: FloatArray, block: int) -> tuple[FloatArray, int]:
    """Return a covariance that neighbours in time may share their errors in.

    Scores are summed over blocks, whose scatter is measured: no model of the noise is asked.
    ``jacobian`` and ``left`` are those of scipy, which scales them for the loss already in
    the first.
    """
    size = jacobian.shape[0]
    blocks = max(4, size // block)
    edges = np.linspace(0, size, blocks + 1).astype(int)
    scores = np.array([jacobian[a:b].T @ left[a:b] for a, b in itertools.pairwise(edges)])
    scores -= scores.mean(axis=0)
    curvature = np.linalg.pinv(jacobian.T @ jacobian, rcond=1e-12)
    meat = scores.T @ scores * blocks / max(blocks - jacobian.shape[1], 1)
    return np.asarray(curvature @ meat @ curvature), blocks
