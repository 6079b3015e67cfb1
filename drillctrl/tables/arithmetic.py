"""What a step of an exported controller costs, and what float arithmetic makes of it."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.tables.sampled import SampledController

# Half a unit in the last place of a float, relative.
_ROUNDING = 2.0**-24
# What is left out is of second order.
_MARGIN = 1.01


class Cost(NamedTuple):
    """Most operations on numbers in one step of the C source, as written.

    Attributes
    ----------
    operations : int
        Additions, subtractions, multiplications and divisions.
    divisions : int
        Those among them.
    comparisons : int
        Of numbers.
    """

    operations: int
    divisions: int
    comparisons: int


def worst_cost(controller: SampledController, outputs: int) -> Cost:
    """Return the most operations of one step: switched on, between nodes that all count."""
    varying = [len(ticks) for ticks in controller.axes if len(ticks) > 1]
    axes, corners = len(controller.axes), 2 ** len(controller.axes)
    rated = controller.settings.rate is not None
    # Shares, weights of all corners, and the sum over those that count.
    weights = axes * corners // 2 + (axes - 1) * corners
    lookup = 3 * len(varying) + weights + 2 * 2 ** len(varying) * 2 * outputs
    law = 2 + 8 * outputs
    trust = 7 + 2 * rated
    clock = 3
    searches = sum(math.ceil(math.log2(size - 1)) + 2 for size in varying)
    tests = searches + 2 * axes + corners + 2 * (outputs + axes + 2) + 2 * outputs + 4 + 1
    limits = 3 + 2 + 4 + 4 * rated + 2
    return Cost(lookup + law + trust + clock, len(varying) + 3, tests + limits)


def float_difference(controller: SampledController, outputs: int) -> tuple[float, list[float]]:
    """Bound by how much u differs between float and double arithmetic, anywhere in the table.

    Rounding errors of each operation are added up with their signs against us: of coordinates
    over the narrowest cells, gains over the steepest, the delay in samples, and the sums.

    Returns
    -------
    difference : float
        Largest difference, in the unit of u, while each output is within its size and ever was.
    sizes : list of float, (p,)
        Such sizes of the outputs that the largest gains on all of them command the limit. The
        bound grows in proportion with them.
    """
    shape = [len(ticks) for ticks in controller.axes]
    gains = np.array(controller.node_gains).reshape(*shape, 2 * outputs)
    constant = np.array(controller.cell_gains).reshape(-1, 2 * outputs)
    axes = len(shape)
    largest = np.abs(gains).max(axis=tuple(range(axes)))
    if constant.size:
        largest = np.maximum(largest, np.abs(constant).max(axis=0))
    # Sums over the corners, products of shares, and shares.
    wrong = (2**axes - 1 + 2 * axes + 1) * _ROUNDING * largest + _moved(controller.axes, gains)
    now, then = largest[:outputs], largest[outputs:]
    both = now + then
    sizes = controller.settings.limit / (outputs * np.where(both > 0.0, both, 1.0))
    # A part of a sample is what is left of a long delay.
    part = 6.0 * controller.settings.depth * _ROUNDING
    per_output = (
        wrong[:outputs]
        + wrong[outputs:]
        + 2.0 * _ROUNDING * now
        + (6.0 * _ROUNDING + part) * then
        + (2 * outputs + 6) * _ROUNDING * both
    )
    rounded_limit = 2.0 * _ROUNDING * controller.settings.limit
    return float(_MARGIN * (per_output @ sizes + rounded_limit)), sizes.tolist()


def _moved(axes: tuple[tuple[float, ...], ...], gains: FloatArray) -> FloatArray:
    """Return how far rounded coordinates move each entry of interpolated gains, (2 p,)."""
    found = np.zeros(gains.shape[-1])
    for direction, values in enumerate(axes):
        step = np.abs(np.diff(gains, axis=direction))
        worst = np.zeros(found.size)
        for cell, (low, high) in enumerate(itertools.pairwise(values)):
            share = 4.0 * max(abs(low), abs(high)) / (high - low) + 3.0
            steepest = np.take(step, cell, axis=direction).reshape(-1, found.size).max(axis=0)
            worst = np.maximum(worst, _ROUNDING * share * steepest)
        found += worst
    return found
