"""An exported controller in Python, sample by sample."""

from __future__ import annotations

import functools
import itertools
import math
import operator
from bisect import bisect_right
from collections import deque
from collections.abc import Sequence

from drillctrl.tables.sampled import SampledController
from drillctrl.tables.settings import STATUS_BITS

_BIT = {name: value for name, value, _ in STATUS_BITS}
# As in the templates.
_NONE = 1e15


class SteppedController:
    """What the source of a controller computes, operation by operation in double precision.

    Attributes
    ----------
    vouched : bool
        Whether the table vouches for the gains at the coordinates of the last step.
    status : int
        Sum of bits of `STATUS_BITS`.
    limit, elapsed, other : float
        What the caller may set before a step, as in the C state.
    """

    def __init__(self, controller: SampledController, outputs: int) -> None:
        self._law, self._set = controller, controller.settings
        self._ends = controller.ends()
        self._fading = sum(_BIT[name] for name in self._set.fading)
        self._past = deque([[0.0] * outputs] * self._set.depth, self._set.depth)
        self._good = ([0.0] * outputs, [0.0] * len(controller.axes), 0.0)
        self._gains = [0.0] * (2 * outputs)
        self._seen = False
        self._active = self._missing = self._equal = self._trust = self._releasing = 0
        self._start = self._command = 0.0
        self.vouched, self.status = False, 0
        self.limit, self.elapsed, self.other = self._set.limit, self._set.period, 0.0

    def lookup(self, at: Sequence[float]) -> tuple[list[float], bool]:
        """Return entries of K1, then K2, at coordinates, and whether the table vouches."""
        law, count = self._law, len(self._gains)
        low, share, inside = [], [], True
        for ticks, value, (first, last) in zip(law.axes, at, self._ends, strict=True):
            inside &= first <= value <= last
            index, part = 0, 0.0
            if len(ticks) > 1:
                index = min(max(bisect_right(ticks, value) - 1, 0), len(ticks) - 2)
                part = (value - ticks[index]) / (ticks[index + 1] - ticks[index])
            low.append(index)
            share.append(min(max(part, 0.0), 1.0))
        sizes = [len(ticks) for ticks in law.axes]
        mode = law.cell_mode[_flat(low, [max(size - 1, 1) for size in sizes])]
        if mode > 0:
            return list(law.cell_gains[(mode - 1) * count : mode * count]), inside
        gains = [0.0] * count
        for corner in itertools.product((0, 1), repeat=len(sizes)):
            parts = [s if c else 1.0 - s for s, c in zip(share, corner, strict=True)]
            weight = functools.reduce(operator.mul, parts)
            if weight > 0.0:
                node = _flat([i + o for i, o in zip(low, corner, strict=True)], sizes)
                for k in range(count):
                    gains[k] += weight * law.node_gains[node * count + k]
        return gains, inside and mode >= 0

    def step(self, y: Sequence[float], at: Sequence[float], delay: float, on: bool) -> float:
        """Take one sample and return u, within the limit.

        Parameters
        ----------
        y : sequence of float, (p,)
            Outputs.
        at : sequence of float, (a,)
            Coordinates on the table's axes.
        delay : float
            τ0 in the unit of the period.
        on : bool
            Whether the controller is switched on.
        """
        limit = max(self.limit, 0.0) if self.limit < self._set.limit else self._set.limit
        bits = self._schedule(self._take(list(y), list(at), delay))
        u = 0.0
        if on:
            if not self._active:
                if not self._releasing:
                    other = self.other if abs(self.other) < _NONE else 0.0
                    self._command = min(max(other, -limit), limit)
                self._start, self._releasing = self._command, 0
            self._active = min(self._active + 1, self._set.ramp)
            share = self._active / self._set.ramp
            value, late = self._value()
            bits |= late
            u = share * (self._trust / self._set.fade * value) + (1.0 - share) * self._start
            if self._set.rate is not None:
                held = max(min(u, self._command + self._set.rate), self._command - self._set.rate)
                bits |= _BIT["SLOWED"] * (held != u)
                u = held
        else:
            if self._set.release and self._active:
                self._start, self._releasing = self._command, self._set.release
            if self._releasing:
                self._releasing -= 1
                u = self._start * (self._releasing / self._set.release)
            self._active = 0
        self._command = min(max(u, -limit), limit)
        self.status = bits | _BIT["LIMITED"] * (self._command != u)
        return self._command

    def _take(self, y: list[float], at: list[float], delay: float) -> int:
        period, bits = self._set.period, 0
        if not 0.5 * period < self.elapsed < 1.5 * period:
            bits |= _BIT["CLOCK"]
        good = self.elapsed > 0.5 * period and delay >= 0.0
        good &= all(abs(value) < _NONE for value in (*y, *at, delay))
        self.elapsed = period
        if good:
            same = self._seen and y == self._good[0]
            self._equal = min(self._equal + 1, self._set.frozen) if same else 0
            self._good, self._seen, self._missing = (y, at, delay), True, 0
        else:
            bits |= _BIT["HELD"]
            self._missing = min(self._missing + 1, self._set.hold + 1)
        bits |= _BIT["LOST"] * (self._missing > self._set.hold)
        bits |= _BIT["FROZEN"] * (self._equal >= self._set.frozen)
        self._past.appendleft(self._good[0])
        return bits

    def _schedule(self, bits: int) -> int:
        gains, vouched = self.lookup(self._good[1])
        self.vouched = self._seen and vouched
        if self.vouched:
            self._gains = gains
        else:
            bits |= _BIT["OUTSIDE"]
        trusted = self._seen and not bits & self._fading
        change = 1 if trusted else -1
        if not self._active:
            change *= self._set.fade
        self._trust = min(max(self._trust + change, 0), self._set.fade)
        return bits

    def _value(self) -> tuple[float, int]:
        longest = float(self._set.depth - 2)
        back = self._good[2] / self._set.period
        late = _BIT["DELAY"] * (back > longest)
        whole = math.floor(min(back, longest))
        part = min(back, longest) - whole
        u, half = 0.0, len(self._gains) // 2
        for k, y in enumerate(self._good[0]):
            then = (1.0 - part) * self._past[whole][k] + part * self._past[whole + 1][k]
            u += self._gains[k] * y + self._gains[half + k] * then
        return u, late


def _flat(place: Sequence[int], sizes: Sequence[int]) -> int:
    """Return the index of a place in an array of these sizes, the last axis fastest."""
    index = 0
    for i, size in zip(place, sizes, strict=True):
        index = index * size + i
    return index
