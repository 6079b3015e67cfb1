"""A sampled drive in Python, sample by sample."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from drillctrl.base.kinds import makes_of_kinds
from drillctrl.strings.drive_sampled import DRIVE_BITS, SampledDrive

_BIT = {name: value for name, value, _ in DRIVE_BITS}
# A torque beyond it is none.
_NO_TORQUE = 1e30


@makes_of_kinds
class SteppedDrive:
    """What the exported source of a drive's law computes, operation by operation.

    Attributes
    ----------
    vouched : bool
        Whether there is a law for the depth of the last step.
    status : int
        Sum of bits of `DRIVE_BITS`.
    limit, elapsed : float
        What the caller may set before a step: a lower limit, N m, and the time since the last
        sample, s, where it is measured.
    """

    def __init__(self, law: SampledDrive) -> None:
        self._law = law
        self._filters, self._edges, self._ends = law.filters, law.edges, law.ends
        # Plain lists: an array of numpy would cost more than the law.
        self._laws = [tuple(part.tolist() for part in node[:-1]) for node in law.nodes]
        self._gains = [node.K for node in law.nodes]
        self._fading = _BIT["LOST"] | (_BIT["FROZEN"] if law.watched else 0)
        self._x = [0.0] * law.order
        self._good = (0.0,) * (3 + len(law.axes))
        self._seen = self._tracking = False
        self._active = self._missing = self._equal = self._trust = self._releasing = 0
        self._node = 0
        self._slow = self._drag = self._speed = self._error = 0.0
        self._integral = self._start = self._command = 0.0
        self.vouched, self.status = False, 0
        self.limit, self.elapsed = law.limit, law.period

    def step(
        self,
        speed: float,
        set_point: float,
        torque: float,
        depth: float | Sequence[float] = 0.0,
        on: bool = True,
    ) -> float:
        """Take one sample and return the torque, N m, within the limit.

        Parameters
        ----------
        speed, set_point : float
            Of the drive, rad/s: measured, and wanted.
        torque : float
            What the drive gave since the last sample, N m: this controller's last command, or
            that of whatever else is in control, from which it then takes over without a bump.
        depth : float or sequence of float
            Length of the string, m, which picks the law; or a coordinate on each of its axes, SI.
        on : bool
            Whether the controller is switched on.
        """
        law = self._law
        limit = max(self.limit, 0.0) if self.limit < law.limit else law.limit
        at = (depth,) if isinstance(depth, int | float) else tuple(depth)
        bits = self._take((speed, set_point, torque, *at))
        now, wanted, given, *place = self._good
        error = now - wanted
        within = (low <= x <= high for x, (low, high) in zip(place, self._ends, strict=True))
        self.vouched = self._seen and all(within)
        if not self.vouched:
            bits |= _BIT["OUTSIDE"]
        value, change = self._follow(now, error, given, self._nearest(place))
        trusted = self._seen and not bits & self._fading
        u = 0.0
        if on:
            u = self._control(value, change, given, limit, trusted)
            if not -_NO_TORQUE < u < _NO_TORQUE:
                u, bits = 0.0, bits | _BIT["LOST"]
            held = self._slowed(u)
            bits |= _BIT["SLOWED"] * (held != u)
            if trusted and not self._tracking and law.integrates:
                # What has no effect is not added up.
                beyond = u - min(max(held, -limit), limit)
                if change > 0.0 and beyond > 0.0:
                    self._integral -= min(change, beyond)
                elif change < 0.0 and beyond < 0.0:
                    self._integral -= max(change, beyond)
            self._tracking = not trusted
            u = held
        else:
            if law.release and self._active:
                self._start, self._releasing = self._command, law.release
            if self._releasing:
                self._releasing -= 1
                u = self._start * (self._releasing / law.release)
            self._active = 0
        self._command = min(max(u, -limit), limit)
        self.status = bits | _BIT["LIMITED"] * (self._command != u)
        return self._command

    def _slowed(self, u: float) -> float:
        rate = self._law.rate
        if rate is None:
            return u
        return max(min(u, self._command + rate), self._command - rate)

    def _take(self, sample: tuple[float, ...]) -> int:
        law, bits = self._law, 0
        if not 0.5 * law.period < self.elapsed < 1.5 * law.period:
            bits |= _BIT["CLOCK"]
        good = self.elapsed > 0.5 * law.period
        good &= all(abs(value) < most for value, most in zip(sample, law.largest, strict=True))
        self.elapsed = law.period
        if good:
            same = self._seen and sample[0] == self._good[0]
            self._equal = min(self._equal + 1, law.frozen) if same else 0
            if not self._seen:
                self._begin(sample)
            self._good, self._seen, self._missing = sample, True, 0
        else:
            bits |= _BIT["HELD"]
            self._missing = min(self._missing + 1, law.hold + 1)
        bits |= _BIT["LOST"] * (self._missing > law.hold)
        bits |= _BIT["FROZEN"] * (self._equal >= law.frozen)
        return bits

    def _nearest(self, place: Sequence[float]) -> int:
        node = 0
        for edges, x in zip(self._edges, place, strict=True):
            node = node * (len(edges) + 1) + bisect_right(edges, x)
        return node

    def _begin(self, sample: tuple[float, ...]) -> None:
        """Let filters of what is measured rest where the first sample finds them."""
        speed, wanted, torque, *place = sample
        self._node = self._nearest(place)
        self._slow, self._drag = speed, torque
        self._speed, self._error = speed, speed - wanted

    def _follow(self, now: float, error: float, given: float, node: int) -> tuple[float, float]:
        """Return the law without its integral, and by how much that grows; move the states."""
        stiff, kept, new, held = self._filters
        self._slow = kept * self._slow + new * (now + self._speed)
        self._drag = held * self._drag + (1.0 - held) * given
        pipe = stiff * (now - self._slow) - self._drag
        if self._tracking or not self._active:
            # While others are in control the law rests at what is measured.
            self._x = [row[0] * error + row[1] * pipe for row in self._laws[node][2]]
        before = self._value(self._node, error, pipe)
        value = self._value(node, error, pipe)
        if node != self._node:
            # One law takes over from another without a bump.
            self._hand_over(before - value)
            self._node = node
        F, G, *_ = self._laws[node]
        change = -self._gains[node] * (0.5 * self._law.period * (error + self._error))
        moved = []
        for i in range(len(self._x)):
            total = G[i][0] * error + G[i][1] * pipe
            for j, x in enumerate(self._x):
                total += F[i][j] * x
            moved.append(total)
        self._x = moved
        self._speed, self._error = now, error
        return value, change

    def _value(self, node: int, error: float, pipe: float) -> float:
        *_, C, D = self._laws[node]
        total = D[0] * error + D[1] * pipe
        for c, x in zip(C, self._x, strict=True):
            total += c * x
        return float(total)

    def _hand_over(self, bump: float) -> None:
        if self._tracking or not self._active:
            return
        if self._law.integrates:
            self._integral += bump
        else:
            share = 1.0 - self._active / self._law.ramp
            self._start = share * self._start + bump
            self._active = min(self._active, 1)

    def _control(
        self, value: float, change: float, given: float, limit: float, trusted: bool
    ) -> float:
        law = self._law
        if not self._active:
            if not self._releasing:
                self._command = min(max(given, -limit), limit) if self._seen else 0.0
            self._releasing, self._tracking, self._trust = 0, True, law.fade
            self._start = self._command
        if not trusted:
            if not self._tracking:
                self._start = self._command
            self._active = max(self._active, 1)
            self._trust = max(self._trust - 1, 0)
            return self._start * (self._trust / law.fade)
        self._trust = law.fade
        if self._tracking:
            # It goes on from what the drive gives.
            self._active = 0
            self._start = 0.0
            if law.integrates:
                self._integral = self._command - value
            else:
                self._start = self._command - value
        elif law.integrates:
            self._integral += change
        self._integral = min(max(self._integral, -law.most), law.most)
        self._active = min(self._active + 1, law.ramp)
        share = 0.0 if law.integrates else 1.0 - self._active / law.ramp
        return value + self._integral + share * self._start
