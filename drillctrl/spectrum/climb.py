"""Rightmost roots by counting, where the collocation does not resolve all that may matter.

The line Re s = α is raised from root to root until none lies right of it. Newton's method
starts from every place at which the line was evaluated, so a root near the line is not
missed; one that is missed shows in the count, and then the line is bisected towards it. What
comes out is as many roots as the argument principle counts, or a refusal.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import UndecidedError
from drillctrl.delay.reduced import ReducedLoops
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum.characteristic import magnitude_bound
from drillctrl.spectrum.count import Followed, follow

_EPSILON = float(np.finfo(float).eps)
_ROUNDS = 60
_BISECTIONS = 12
_MOST_STARTS = 4000
_FINALISTS = 96
MOST_ROOTS = 400
_CIRCLE = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)


@dataclass(eq=False)
class Climb:
    """The roots of one system that have been found so far.

    Attributes
    ----------
    system : DelaySystem
        The system.
    loops : ReducedLoops
        The same, reduced.
    roots : array, (q,)
        Converged roots with imag ≥ 0, each once.
    errors : array, (q,)
        Last corrections of them.
    """

    system: DelaySystem
    loops: ReducedLoops
    roots: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    errors: FloatArray = field(default_factory=lambda: np.zeros(0))

    def refuse(self, what: str) -> UndecidedError:
        """Return the exception that says what could not be decided."""
        system = self.system
        return UndecidedError(
            "system",
            f"{system.order} states with delays up to {system.max_delay:g}",
            f"one whose roots can be told apart: {what}",
        )

    def follow(self, line: float) -> Followed:
        """Follow det Δ up a line."""
        return follow(self.loops, line, magnitude_bound(self.system, line))

    def add(self, starts: ComplexArray, keep: int | None = None) -> None:
        """Run Newton's method from many places and keep the roots that it converges to.

        Parameters
        ----------
        starts : array, (k,)
            Places.
        keep : int, optional
            After a few rounds go on with so many, the rightmost.
        """
        if not starts.size:
            return
        s = np.where(starts.imag < 0, starts.conj(), starts).astype(complex)
        last = np.full(s.shape, np.inf)
        done = np.zeros(s.shape, dtype=bool)
        unit = 1.0 / self.system.max_delay if self.system.delays else 1.0
        ceiling = 1.1 * magnitude_bound(self.system, float(s.real.min()))
        for turn in range(40):
            if keep is not None and turn == 5 and s.size > keep:
                # Those under way to a root first, then the rightmost.
                order = np.lexsort((-s.real, last > 0.1 * unit))
                best = order[:keep]
                s, last, done = s[best], last[best], done[best]
            rest = np.flatnonzero(~done)
            if not rest.size:
                break
            slope = self.loops.evaluate(s[rest][None])[2][0]
            with np.errstate(divide="ignore", invalid="ignore"):
                step = np.where(np.isfinite(slope), 1.0 / slope, 0.0)
            scale = 1.0 + np.abs(s[rest])
            lost = ~np.isfinite(step)
            step[lost] = 0.0
            size = np.abs(step)
            stalled = (size >= last[rest]) & (size < 1e-6 * scale)
            with np.errstate(over="ignore", invalid="ignore"):
                step *= np.minimum(1.0, 0.3 * scale / np.maximum(size, 1e-300))
            step[stalled] = 0.0
            s[rest] = s[rest] - step
            last[rest] = np.where(stalled, last[rest], size)
            done[rest] = stalled | (size <= 8 * _EPSILON * scale)
            # What runs away has nothing to find there.
            gone = rest[lost | (np.abs(s[rest]) > ceiling)]
            if gone.size:
                stay = np.setdiff1d(np.arange(s.size), gone)
                s, last, done = s[stay], last[stay], done[stay]
        s, last = s[done], last[done]
        s = np.where(np.abs(s.imag) <= 10.0 * last + 1e-12 * np.abs(s), s.real + 0j, s)
        s = np.where(s.imag < 0, s.conj(), s)
        self._merge(s, last)

    def _merge(self, s: ComplexArray, errors: FloatArray) -> None:
        every = np.concatenate([self.roots, s])
        error = np.concatenate([self.errors, errors])
        kept: list[int] = []
        # Neighbours in Re s only need be compared.
        by_real = np.argsort(every.real, kind="stable")
        every, error = every[by_real], error[by_real]
        near = 1e-9 * (1.0 + np.abs(every)) + 30.0 * error
        alive = np.ones(every.size, dtype=bool)
        for i in range(every.size):
            if not alive[i]:
                continue
            last = int(np.searchsorted(every.real, every[i].real + near.max(), side="right"))
            group = np.arange(i, last)
            group = group[alive[group]]
            close = np.abs(every[group] - every[i]) <= np.maximum(near[group], near[i])
            close |= np.abs(every[group] - every[i].conjugate()) <= np.maximum(near[group], near[i])
            same = group[close]
            alive[same] = False
            kept.append(int(same[np.argmin(error[same])]))
        chosen = np.array(kept, dtype=int)
        chosen = chosen[np.argsort(-every[chosen].real, kind="stable")]
        self.roots, self.errors = every[chosen], error[chosen]

    def ascend(self, starts: ComplexArray) -> None:
        """Find the rightmost root: none is counted right of the first of ``roots``.

        Raises
        ------
        UndecidedError
            If the count cannot be made, or names roots that are not found.
        """
        self.add(starts)
        high = magnitude_bound(self.system, 0.0)
        for _ in range(20):
            high = min(high, magnitude_bound(self.system, high)) * (1.0 + 1e-9)
        unit = 1.0 / self.system.max_delay if self.system.delays else 1.0
        low = -0.5 * unit
        while not self.roots.size:
            seen = self.follow(low)
            if seen.result.count is None or low < -300.0 * unit:
                raise self.refuse(f"no count right of {low:g} after {seen.result.points} points")
            self.add(places(seen), _FINALISTS)
            low *= 2.0
        width = 1.0
        for _ in range(_ROUNDS):
            top = float(self.roots[0].real)
            line = top + width * max(1e-10 * (1.0 + abs(top)), 10.0 * float(self.errors[0]))
            if line >= high:
                return
            seen = self.follow(line)
            count = seen.result.count
            if count == 0:
                return
            if count is None:
                width *= 10.0
                if width > 1e4:
                    break
                continue
            self.add(places(seen), _FINALISTS)
            low = line
            # A root far from the line: bring the line to it.
            while float(self.roots[0].real) <= line and high - low > 1e-10 * (1.0 + abs(low)):
                middle = 0.5 * (low + high)
                seen = self.follow(middle)
                if seen.result.count is None:
                    raise self.refuse(
                        f"no count right of {middle:g} after {seen.result.points} points"
                    )
                if seen.result.count == 0:
                    high = middle
                else:
                    low = middle
                    self.add(places(seen), _FINALISTS)
            if float(self.roots[0].real) <= line:
                break
        raise self.refuse(f"roots are counted right of {line:.6g} and none is found there")

    def right_of(self, line: float, most: int = MOST_ROOTS) -> ComplexArray | None:
        """Return all roots right of a line, multiple ones repeated; None if more than ``most``.

        Raises
        ------
        UndecidedError
            If the count cannot be made, or is not that of the roots found.
        """
        seen = self.follow(line)
        count = seen.result.count
        if count is None:
            raise self.refuse(f"no count right of {line:g} after {seen.result.points} points")
        if count > most:
            return None
        if count == 0:
            return np.zeros(0, dtype=complex)
        found = self._repeated(line)
        if _total(found) != count:
            self.add(places(seen))
            found = self._repeated(line)
        # What is missing lies far from the line: bisect towards it.
        low, high = line, float(self.roots[0].real) if self.roots.size else line
        for _ in range(_BISECTIONS):
            if _total(found) == count or high <= low:
                break
            middle = 0.5 * (low + high)
            higher = self.follow(middle)
            self.add(places(higher))
            found = self._repeated(line)
            if higher.result.count is None or _total(found[found.real > middle]) == (
                higher.result.count
            ):
                high = middle
            else:
                low = middle
        if _total(found) != count:
            raise self.refuse(
                f"{count} roots are counted right of {line:.6g} and {_total(found)} are found"
            )
        return found

    def _repeated(self, line: float) -> ComplexArray:
        """Return the known roots right of a line, each as often as a small circle counts it."""
        here = self.roots[self.roots.real > line]
        if not here.size:
            return here
        every = np.concatenate([self.roots, self.roots[self.roots.imag > 0].conj()])
        gap = np.full(here.size, np.inf)
        for i, s in enumerate(here):
            apart = np.abs(every - s)
            gap[i] = apart[apart > 0].min(initial=np.inf)
        unit = 0.1 / self.system.max_delay if self.system.delays else 0.1
        radius = np.minimum(0.3 * gap, np.minimum(unit, 0.05 * (1.0 + np.abs(here))))
        ring = radius[:, None] * _CIRCLE
        slope = self.loops.evaluate((here[:, None] + ring).reshape(1, -1))[2].reshape(ring.shape)
        many = np.nan_to_num((slope * ring).mean(axis=1).real)
        times = np.maximum(1, np.rint(many).astype(int))
        spread = []
        for s, k, r in zip(here, times, radius, strict=True):
            turns = 1e-3 * r * np.exp(2j * np.pi * (np.arange(k) + 0.25) / k) if k > 1 else [0.0]
            around = s + np.asarray(turns)
            # Of a real multiple root the members come in conjugate pairs.
            if s.imag == 0.0 and k > 1:
                around = np.concatenate([around[around.imag > 0], [s] * (k % 2)])
            spread.append(around)
        return np.concatenate(spread)


def places(seen: Followed) -> ComplexArray:
    """Return where to start on a line: next to roots, and evenly in between."""
    s = np.asarray(seen.result.line + 1j * seen.omega, dtype=np.complex128)
    size = np.abs(seen.slope)
    if s.size <= _MOST_STARTS:
        return s
    peak = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])) + 1
    with np.errstate(divide="ignore", invalid="ignore"):
        reached = (s - 1.0 / seen.slope).real
    peak = peak[np.argsort(-reached[peak], kind="stable")[: _MOST_STARTS // 2]]
    spaced = np.linspace(0, s.size - 1, _MOST_STARTS // 2).astype(int)
    return np.asarray(s[np.union1d(peak, spaced)])


def _total(s: ComplexArray) -> int:
    return int(s.size + (s.imag > 0).sum())
