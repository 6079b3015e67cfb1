"""A drive's law in float: its source, and by how much it differs."""

from __future__ import annotations

import math
import re
import textwrap
from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.strings.drive_sampled import DriveNode, SampledDrive
from drillctrl.tables.arithmetic import Cost

# Half a unit in the last place of a float, relative.
_ROUNDING = 2.0**-24
_MARGIN, _FORGOTTEN, _MOST = 1.01, 1e-9, 1_000_000
# What float may change of the torque, of its limit.
_MOST_ROUNDED = 0.01
# Comments, and numbers with a point, of C.
_COMMENT = re.compile(r"(/\*.*?\*/)", re.DOTALL)
_NUMBER = re.compile(r"(?<![\w.])\d+\.\d*(?:e[+-]?\d+)?")


def drive_worst_cost(law: SampledDrive) -> Cost:
    """Return the most operations of one step of the C source: on, where another law begins."""
    n, inputs, switches = law.order, len(law.largest), sum(map(len, law.edges))
    several, integrates, rated = len(law.nodes) > 1, law.integrates, law.rate is not None
    value = 3 + 2 * n
    # A law hands over while it acts, and its states rest at what is measured while it does not.
    over = (value + 1) * several + max(3 * n, (1 if integrates else 4) * several)
    # Error, filters and the torque in the pipe, the law, the growth of its integral, its states.
    follow = 1 + 4 + 3 + 3 + value + 3 + n * (3 + 2 * n) + over
    # The first sample sets out with a difference; what a limit keeps is taken from the integral.
    operations = 1 + follow + (4 if integrates else 6) + 2 * rated + 2 * integrates
    divisions = 1 + (several and not integrates)
    sample = 3 + 3 + 2 * inputs + 2 + 2 * (inputs - 3) + 2 * switches
    return Cost(operations, divisions, sample + 2 + 2 + 2 * rated + 10 * integrates + 2 + 2 + 2)


class FloatDifference(NamedTuple):
    """By how much a law in float differs from that in double on the same samples.

    Attributes
    ----------
    torque : float
        At most, N m, beside the drift of the integral.
    drift : float
        Of the integral, at most, N m in a sample. In a loop the integral makes up for it, as for
        an error of the speed.
    speed : float
        What error of the speed drifts as much, rad/s; 0 without an integral.
    """

    torque: float
    drift: float
    speed: float


def drive_float_difference(law: SampledDrive) -> FloatDifference:
    """Bound the difference over all samples that a law takes and all its places.

    The torque in the pipe is taken to stay within what counts as a torque at all.

    Rounding errors of each operation are added up with their signs against us, through the states
    by the sum of the magnitudes of their responses. Samples within rounding of a switch, from one
    law to the next or to a fade, may fall on its other side.
    """
    found = [_of_node(law, node) for node in law.nodes]
    return FloatDifference(*(max(each[i] for each in found) for i in range(3)))


def _of_node(law: SampledDrive, node: DriveNode) -> FloatDifference:
    r, (speed, _, torque, *_) = _ROUNDING, law.largest
    stiff, kept, new, held = law.filters
    # Filters forget: what they round adds up over their memory.
    slow = r * (1.0 + 2.0 * (abs(kept) + 4.0 * new) / (1.0 - abs(kept))) * speed
    drag = r * (1.0 + 4.0 / (1.0 - held)) * torque
    most = np.array([2.0 * speed, torque])
    pipe = stiff * (r * speed + slow) + drag + 3.0 * r * most[1]
    off = np.array([4.0 * r * speed, pipe])
    n = law.order
    responses = _responses(node)
    if responses is None:
        # A memory that was not seen to fade bounds nothing.
        return FloatDifference(math.inf, math.inf, math.inf)
    through, passed = responses
    states = through[:n] @ most
    rounded = (n + 4) * r * (np.abs(node.F) @ states + np.abs(node.G) @ most)
    value = np.abs(node.C) @ states + np.abs(node.D) @ most
    difference = (
        (np.abs(node.D) + through[n]) @ off
        + passed @ rounded
        + (n + 5) * r * value
        + 4.0 * r * (value + law.most)
    )
    gained = abs(node.K) * law.period
    drift = r * law.most + gained * (off[0] + 4.0 * r * most[0]) if node.K else 0.0
    return FloatDifference(
        float(_MARGIN * difference),
        float(_MARGIN * drift),
        float(_MARGIN * drift / gained) if node.K else 0.0,
    )


def _responses(node: DriveNode) -> tuple[FloatArray, FloatArray] | None:
    """Return Σ abs(F^k G), and below it Σ abs(C F^k G), (n + 1, 2); and Σ abs(C F^k), (n,).

    None where they do not fade.
    """
    moved, row = node.G.copy(), node.C.copy()
    states, command = np.zeros_like(moved), np.zeros(moved.shape[1])
    passed = np.zeros_like(row)
    first = max(np.abs(moved).max(), 1e-300), max(np.abs(row).max(), 1e-300)
    for _ in range(_MOST):
        states += np.abs(moved)
        command += np.abs(node.C @ moved)
        passed += np.abs(row)
        if (
            np.abs(moved).max() < _FORGOTTEN * first[0]
            and np.abs(row).max() < _FORGOTTEN * first[1]
        ):
            break
        moved, row = node.F @ moved, row @ node.F
    else:
        return None
    return np.vstack([states, command]), passed


def float_words(law: SampledDrive) -> list[str]:
    """Say what float arithmetic changes.

    Raises
    ------
    InputError
        If that is more than a hundredth of the limit.
    """
    found = drive_float_difference(law)
    if found.torque > _MOST_ROUNDED * law.limit:
        wanted = f"double: float could change the torque of {law.name} by {found.torque:.2g} N m"
        raise InputError("real", "float", wanted)
    text = f"float, which changes the torque by at most {found.torque:.3g} N m on any samples"
    if found.drift:
        text += f", beside a drift of the integral as by {found.speed:.2g} rad/s of speed at most"
    return textwrap.wrap(f"{text}.", 76)


def in_float(source: str) -> str:
    """Return C in float instead of double; comments stay."""
    parts = _COMMENT.split(source)
    for i in range(0, len(parts), 2):
        parts[i] = _NUMBER.sub(r"\g<0>F", re.sub(r"\bdouble\b", "float", parts[i]))
    return "".join(parts)
