"""Boxes of gains from those that matter beside the plant up to the bounds.

Wide bounds say little of where the good gains lie, and gains that make the loop much faster
than its plant need a fine collocation. So a wide box is searched from the inside out.
"""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.closing import feedback_lags, loop_channels, with_terms
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum.characteristic import magnitude_bound

# Gains of the innermost box make the loop at most this much faster than its plant, those of
# each further box as much faster again as the second says.
_FIRST, _FURTHER = 2.0, 4.0
_HALVINGS, _SHRUNK = 30, 16.0
# A chain of integrators without delay is as fast as its gains make it: below the first it has no
# speed of its own, and the innermost box takes this share of what its bounds permit.
_NO_SPEED, _OF_REACH = 1e-200, 1e-6


def fastest(
    system: DelaySystem, feedback: FeedbackStructure, entries: FloatArray, line: float = 0.0
) -> float:
    """Bound the distance of roots right of a line from where it meets the real axis.

    Parameters
    ----------
    system, feedback : DelaySystem and FeedbackStructure
        Plant and structure.
    entries : array, (2 m p,)
        Largest moduli of the entries of the gain matrices, flattened.
    line : float
        Real part.
    """
    return magnitude_bound(largest_loop(system, feedback, entries, line), 0.0)


def largest_loop(
    system: DelaySystem, feedback: FeedbackStructure, entries: FloatArray, line: float = 0.0
) -> DelaySystem:
    """Return a loop whose matrices bound those of every loop with such entries.

    Its roots are counted from ``line``: s − line.
    """
    drive, measure = (np.abs(channel) for channel in loop_channels(system, feedback))
    lags = feedback_lags(system, feedback)
    a0, late = counted_from(system, line)
    magnitude = DelaySystem(np.abs(a0), tuple(map(np.abs, late)), system.delays)
    entries = entries.reshape(lags.shape) * np.exp(-line * lags)
    return with_terms(magnitude, drive, measure, entries, lags)


def counted_from(system: DelaySystem, line: float) -> tuple[FloatArray, list[FloatArray]]:
    """Return A0 and Ai of the system whose roots are s − ``line``."""
    late = [a * np.exp(-line * tau) for a, tau in zip(system.delayed, system.delays, strict=True)]
    return system.A0 - line * np.eye(system.order), late


def bound_of_entries(feedback: FeedbackStructure) -> FloatArray:
    """Return the largest modulus of every entry of K1 and K2 within the bounds, (2 m p,)."""
    return np.asarray(np.maximum(np.abs(feedback.flat_lower), np.abs(feedback.flat_upper)))


def nested_boxes(
    system: DelaySystem, feedback: FeedbackStructure, line: float = 0.0
) -> list[FeedbackStructure]:
    """Return the structure with bounds that widen, its own last.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    feedback : FeedbackStructure
        With free gains.
    line : float
        Near which the rightmost roots of good loops lie.

    Returns
    -------
    list of FeedbackStructure
        The structure alone where its bounds are not wide.
    """
    speed = natural_speed(system, feedback, line)
    reach = fastest(system, feedback, bound_of_entries(feedback), line)
    if speed < _NO_SPEED:
        speed = _OF_REACH * reach
    boxes: list[FeedbackStructure] = []
    # The gains that do least.
    centre = np.clip(0.0, feedback.lower, feedback.upper)
    while 0.0 < speed < reach:
        scales = _scales(system, feedback, speed, line)
        lower = np.maximum(feedback.lower, centre - scales)
        upper = np.minimum(feedback.upper, centre + scales)
        sides = zip(feedback.gain_names, lower.tolist(), upper.tolist(), strict=True)
        box = feedback.with_bounds({name: (low, high) for name, low, high in sides})
        last = boxes[-1] if boxes else None
        if last is None or (box.lower < last.lower).any() or (box.upper > last.upper).any():
            boxes.append(box)
        speed *= _FURTHER
    own = feedback.lower, feedback.upper
    return [b for b in boxes if not np.array_equal((b.lower, b.upper), own)] + [feedback]


def natural_speed(system: DelaySystem, feedback: FeedbackStructure, line: float = 0.0) -> float:
    """Return the distance of roots from a line that gains of the innermost box are to permit."""
    lags = [*system.delays, *feedback_lags(system, feedback).ravel().tolist()]
    shortest = min((lag for lag in lags if lag), default=np.inf)
    none = np.zeros_like(bound_of_entries(feedback))
    return _FIRST * max(fastest(system, feedback, none, line), 1.0 / shortest)


def _scales(
    system: DelaySystem, feedback: FeedbackStructure, speed: float, line: float
) -> FloatArray:
    """Return the size up to which each gain alone makes the loop no faster than that, (k,)."""
    spread = np.abs(feedback.spread)
    low = np.zeros(spread.shape[1])
    high = np.maximum(np.abs(feedback.lower), np.abs(feedback.upper))
    for j in range(low.size):
        if fastest(system, feedback, high[j] * spread[:, j], line) <= speed:
            low[j] = high[j]
            continue
        # Bounds may be wider than any halving ends at.
        while not fastest(system, feedback, high[j] / _SHRUNK * spread[:, j], line) <= speed:
            high[j] /= _SHRUNK
        for _ in range(_HALVINGS):
            middle = 0.5 * (low[j] + high[j])
            quick = fastest(system, feedback, middle * spread[:, j], line) > speed
            low[j], high[j] = (low[j], middle) if quick else (middle, high[j])
    return low
