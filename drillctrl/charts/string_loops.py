"""Loops of bits on an exact string, at many points at once.

With the string's receptances g = (gx, gθ) and the load L(s) by which a bit answers its motion,

    D(s) = det(I + g L(s)) = 1 + gx L₀₀ + gθ L₁₁ + gx gθ (L₀₀ L₁₁ − L₀₁ L₁₀)

vanishes at the roots. It has the poles of the string alone, tends to 1, and costs the same
however many modes there are. For the paper's law it is 1 + n (1 − E)(kc gx − kt d0 gθ).
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, UndecidedError
from drillctrl.charts.scan import IntArray
from drillctrl.drilling.bit_rock import BitRock
from drillctrl.drilling.linear import bit_responses
from drillctrl.strings.at_bit import StringAtBit
from drillctrl.strings.exact import known_loop

# What acts on a bit, and how it moves.
EFFORTS, MOTIONS = ("axial", "torque"), ("x", "dx", "theta", "dtheta")
# rad/s: nothing of a string that its material damps is left above.
_HIGHEST = 1e5
_SLOW = 1e-6
# Turn of the receptances, and of the delays, from one frequency to the next.
_TURN, _PHASE = 0.3, 0.4
_GRID_ROUNDS = 30
_MOST_TURN, _COUNT_ROUNDS, _PARTS = 1.2, 20, 4
_CHUNK = 400_000


class BitLoads(NamedTuple):
    """What bits answer at N points, SI.

    Attributes
    ----------
    now, then : array, (N, 2, 4)
        Weight and torque per state of the bit, now and τ0 ago.
    delay : array, (N,)
        τ0, s.
    """

    now: FloatArray
    then: FloatArray
    delay: FloatArray

    def take(self, index: IntArray | slice) -> BitLoads:
        """Return those at the given places."""
        return BitLoads(self.now[index], self.then[index], self.delay[index])

    def towards(self, other: BitLoads, share: FloatArray) -> BitLoads:
        """Return those between these and others in which D is affine: for probes."""
        t = share[:, None, None]
        now, then = self.now + t * (other.now - self.now), self.then + t * (other.then - self.then)
        return BitLoads(now, then, self.delay)


def si_loads(
    bit: BitRock,
    rows: FloatArray,
    strings: list[StringAtBit],
    gains: FloatArray | None,
    units: StringAtBit,
) -> BitLoads:
    """Return what bits answer at N points, what is fed back to them taken away.

    Parameters
    ----------
    bit : BitRock
        The law.
    rows : array, (N, k)
        As for `bit_responses`.
    strings : list of StringAtBit
        Each point's, whose lumped equivalent gives the units of its row.
    gains : array, (2, N, 2, 4) or None
        From the bit's states to `EFFORTS`, now and τ0 ago.
    units : StringAtBit
        The string that the gains are dimensionless by.
    """
    now, then, delay = bit_responses(bit, rows)
    scale = np.array([string.scales[0] for string in strings])
    time = np.array([string.scales[1] for string in strings])
    now, then = now * scale, then * scale
    if gains is not None:
        now, then = now - gains[0] * units.scales[0], then - gains[1] * units.scales[0]
    return BitLoads(now, then, delay * time)


def exact_count(string: StringAtBit, loads: BitLoads) -> int:
    """Return how many roots of a bit on a string grow, by the argument principle.

    On another function, without poles, and another contour than `count_growing`.

    Raises
    ------
    InputError
        If a root lies on the imaginary axis.
    """
    scale, time = string.scales
    now, then = (part[0] / scale for part in loads[:2])
    loop = known_loop(string, now, then, float(loads.delay[0]) / time)
    return loop.count_right_of(0.0, 1.2 * time * _highest(string, (loads,)))


def closed(loads: BitLoads, s: ComplexArray, gx: ComplexArray, gt: ComplexArray) -> ComplexArray:
    """Return D of each point at its own or at common s, (N, G).

    Parameters
    ----------
    loads : BitLoads
        Of N points.
    s, gx, gt : array, (G,) or (N, G)
        Places, and the string's receptances there.
    """
    late = np.exp(-loads.delay[:, None] * s)

    def answer(row: int, motion: int) -> Any:
        whole: Any = 0.0
        for rate in (0, 1):
            at = 2 * motion + rate
            now, then = loads.now[:, row, at], loads.then[:, row, at]
            if not (now.any() or then.any()):
                continue
            part = now[:, None] + then[:, None] * late if then.any() else now[:, None]
            whole = whole + (part * s if rate else part)
        return whole

    weight, torque = answer(0, 0), answer(1, 1)
    across = answer(0, 1), answer(1, 0)
    found = (1.0 + gx * weight) * (1.0 + gt * torque) - gx * gt * across[0] * across[1]
    return np.asarray(np.broadcast_to(found, late.shape), dtype=complex)


@dataclass(frozen=True, eq=False)
class Band:
    """A string at all frequencies that matter.

    Attributes
    ----------
    string : StringAtBit
        The string.
    omega : array, (G,)
        rad/s, from 0 on.
    gx, gt : array, (G,)
        Its receptances there.
    """

    string: StringAtBit
    omega: FloatArray
    gx: ComplexArray
    gt: ComplexArray

    @functools.cached_property
    def s(self) -> ComplexArray:
        """iω, a little above 0 at 0."""
        return _places(self.omega, 0.0)

    def closed(self, loads: BitLoads) -> ComplexArray:
        """Return D of N bits, (N, G)."""
        return closed(loads, self.s, self.gx, self.gt)


def band(string: StringAtBit, loads: tuple[BitLoads, ...]) -> Band:
    """Return frequencies that resolve a string and all of these bits.

    Raises
    ------
    InputError
        If the material does not damp what cutting excites.
    """
    delay = max(float(some.delay.max()) for some in loads)
    top = _highest(string, loads)
    waves = max(delay / _PHASE, string.string.tension.transit_time)
    omega = np.linspace(0.0, top, 2 + int(top * waves))
    values = np.stack(string.receptances(_places(omega, 0.0)))
    for _ in range(_GRID_ROUNDS):
        ratio = values[:, 1:] / values[:, :-1]
        change = np.maximum(np.abs(np.angle(ratio)), np.abs(np.log(np.abs(ratio))))
        coarse = np.flatnonzero((change.max(axis=0) > _TURN) & (np.diff(omega) > 1e-9 * top))
        if not coarse.size:
            break
        middle = 0.5 * (omega[coarse] + omega[coarse + 1])
        values = np.insert(
            values, coarse + 1, np.stack(string.receptances(_places(middle, 0.0))), axis=1
        )
        omega = np.insert(omega, coarse + 1, middle)
    return Band(string, omega, *values)


@dataclass(frozen=True, eq=False)
class StringLoops:
    """D = a + t b on many lines of one string at once.

    Attributes
    ----------
    known : Band
        The string.
    low, high : BitLoads
        The bits at t = 0 and at t = 1.
    """

    known: Band
    low: BitLoads
    high: BitLoads

    @property
    def count(self) -> int:
        """Number of lines."""
        return len(self.low.delay)

    def take(self, index: IntArray) -> StringLoops:
        """Return the lines at the given places."""
        return StringLoops(self.known, self.low.take(index), self.high.take(index))

    def _ends(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        gx, gt = self.known.string.receptances(s)
        a = closed(self.low, s, gx, gt)
        return a, closed(self.high, s, gx, gt) - a

    def values(self, omega: FloatArray, line: float) -> tuple[ComplexArray, ComplexArray]:
        """Return a and b on the imaginary axis: of all lines on the band, or at one ω each."""
        if omega.ndim == 2:
            a = self.known.closed(self.low)
            return a, self.known.closed(self.high) - a
        a, b = self._ends(_places(omega, line)[:, None])
        return a[:, 0], b[:, 0]

    def values_and_slopes(
        self, omega: FloatArray, line: float
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """Return a, da/ds, b and db/ds, one ω for each line, (N,)."""
        s = _places(omega, line)[:, None]
        step = 1e-6 * (1.0 + np.abs(s))
        a, b = self._ends(np.concatenate([s, s + step, s - step], axis=1))
        slopes = [(end[:, 1] - end[:, 2]) / (2.0 * step[:, 0]) for end in (a, b)]
        return a[:, 0], slopes[0], b[:, 0], slopes[1]


def _places(omega: FloatArray, line: float) -> ComplexArray:
    return np.asarray(line + 1j * np.where(omega == 0.0, _SLOW, omega))


def _highest(string: StringAtBit, loads: tuple[BitLoads, ...]) -> float:
    """Return the frequency above which no bit comes near to a root, rad/s."""
    damping = string.string.damping
    if not damping.retardation and not (damping.axial and damping.torsional):
        raise InputError("damping of the string", "none", "above 0: else its roots lie on the axis")
    omega = np.geomspace(1.0, _HIGHEST, 4000)
    gx, gt = (np.abs(g) for g in string.receptances(_places(omega, 0.0)))
    most = np.max([(np.abs(some.now) + np.abs(some.then)).max(axis=0) for some in loads], axis=0)
    answer = most[:, 0::2, None] + most[:, 1::2, None] * omega
    far = gx * answer[0, 0] + gt * answer[1, 1]
    far = far + gx * gt * (answer[0, 0] * answer[1, 1] + answer[0, 1] * answer[1, 0])
    near = np.flatnonzero(far > 0.5)
    if near.size and near[-1] > omega.size - 10:
        wanted = "above 0: without it cutting excites modes of any frequency"
        raise InputError("kelvin_voigt damping", damping.retardation, wanted)
    return float(1.1 * omega[near[-1]]) if near.size else 10.0


def count_growing(known: Band, loads: BitLoads) -> IntArray:
    """Return how many roots lie right of the imaginary axis at each point, (N,).

    By the turn of D along the axis, steps being parted where it turns fast.

    Parameters
    ----------
    known : Band
        The string.
    loads : BitLoads
        Of N points.

    Raises
    ------
    UndecidedError
        If a root lies on the axis.
    """
    s = known.s
    counts = np.empty(len(loads.delay), dtype=np.int64)
    for rows in np.array_split(np.arange(counts.size), max(1, counts.size * s.size // _CHUNK)):
        some = loads.take(rows)
        values = known.closed(some)
        steps = np.angle(values[:, 1:] / values[:, :-1])
        fast = np.abs(steps) > _MOST_TURN
        line, at = np.nonzero(fast)
        turned = np.where(fast, 0.0, steps).sum(axis=1)
        ends = (values[line, at], values[line, at + 1])
        turned += _parted(known.string, some, line, (s[at], s[at + 1]), ends)
        # From the highest frequency on D only goes to 1.
        turned -= np.angle(values[:, -1])
        counts[rows] = known.string.growing - np.rint(turned / math.pi)
    return counts


def _parted(
    string: StringAtBit,
    loads: BitLoads,
    line: IntArray,
    ends: tuple[ComplexArray, ComplexArray],
    values: tuple[ComplexArray, ComplexArray],
) -> FloatArray:
    """Return the turn over intervals in which D turns fast, added up by line, (N,)."""
    turned = np.zeros(len(loads.delay))
    low, high = ends
    first, last = values
    for _ in range(_COUNT_ROUNDS):
        if not line.size:
            return turned
        # The string costs as much at a few places as at one.
        s = low[:, None] + (high - low)[:, None] * np.arange(_PARTS + 1) / _PARTS
        seen = string.receptances(s[:, 1:-1])
        between = closed(loads.take(line), s[:, 1:-1], *seen)
        every = np.concatenate([first[:, None], between, last[:, None]], axis=1)
        turn = np.angle(every[:, 1:] / every[:, :-1])
        fast = np.abs(turn) > _MOST_TURN
        turned += np.bincount(line, np.where(fast, 0.0, turn).sum(axis=1), turned.size)
        line = line[np.nonzero(fast)[0]]
        low, high = s[:, :-1][fast], s[:, 1:][fast]
        first, last = every[:, :-1][fast], every[:, 1:][fast]
    raise UndecidedError("level", 0.0, "one that no root lies on")
