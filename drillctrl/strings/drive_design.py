"""Dynamic output feedback of a top drive, designed to let the bit's torque fall most steeply.

What is maximised over the laws of `drive_family` is the smallest critical slope over the first
modes, over shorter and longer strings and a later drive too. It is nonsmooth, as the largest real
part of roots is, and BFGS descends it as it does that.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.strings.bit_load import BitLoad
from drillctrl.strings.drive_control import DriveControl, DriveMachine
from drillctrl.strings.drive_family import DriveSignals, LawFamily, drive_signals
from drillctrl.strings.drive_rules import soft_torque_control, z_torque_control
from drillctrl.strings.line import Line
from drillctrl.strings.slopes import (
    HIGHEST,
    drive_is_stable,
    lowest_impedance,
    mode_bands,
    mode_slopes,
)
from drillctrl.synthesis.descent import bfgs

MODES = 4
# Higher modes count in proportion to what they stand under a held top: where the first ones reach
# the second share of the impedance of the lowest stretch, they keep the first share of that.
_KEPT, _AIM = 0.2, 0.15
_LATER = 1.5
# What the string stands with a free bit, over what it does under the rules, where laws for a bit
# reach that: stick-slip begins at a lower speed then.
_ABOVE = 1.5
# Samples up to the first mode, between modes, and of an echo from mode to mode.
_PER_MODE, _BETWEEN, _TURN = 80.0, 40.0, 14.0
_GROWTH = 1e-3
# Above those frequencies up to this one in Hz: how many, and samples of the string for each.
_HIGHEST, _FAR, _WITHIN, _ALONE = 60.0, 60, 40, 80
_FEWER = 4
_BEGUN, _STEPS = 3, 220
_CHANGE = 1e-6
# What a law makes of the speed of the top and of the pipe's torque; see `DriveControl.ends`.
_Ends = tuple[ComplexArray, ComplexArray]


class _Loop(NamedTuple):
    """One string and one drive at the frequencies that are looked at.

    Attributes
    ----------
    s : array, (q,)
        iω.
    matrix : array, (q, 2, 2)
        The string's transfer matrix there.
    drive : DriveSignals
        The drive there.
    weights : array, (q,)
        By which a critical slope there counts.
    answer, force : complex array and array, (q,)
        What the bit answers there, N m s/rad; the square of the torque by which it shakes the
        string, over that of its mean speed.
    near, echo : DriveSignals and array, (r,)
        The drive a little right of the axis, from the real axis on, and what the string with a
        free bit returns there of a wave from the top.
    far, loudest : DriveSignals and array, (p,)
        The drive above these frequencies, and the most that the string returns around there.
    alone : DriveSignals
        The drive from the real axis to where it is its inertia and nothing else.
    """

    s: ComplexArray
    matrix: ComplexArray
    drive: DriveSignals
    weights: FloatArray
    answer: ComplexArray
    force: FloatArray
    near: DriveSignals
    echo: ComplexArray
    far: DriveSignals
    loudest: FloatArray
    alone: DriveSignals


class _Slopes:
    """Minus the smallest weighted critical slope over all loops, and its gradient."""

    def __init__(self, family: LawFamily, loops: list[_Loop]) -> None:
        self.family, self.loops = family, loops
        # All that is looked at, in one array: laws are evaluated once for all loops.
        drives = [one for loop in loops for one in (loop.far, loop.alone, loop.near, loop.drive)]
        self._drives = DriveSignals(
            *(np.concatenate(values) for values in zip(*drives, strict=True))
        )
        ends = np.cumsum([0, *(one.x.size for one in drives)]).tolist()
        self._places = [slice(*pair) for pair in pairwise(ends)]

    def _ends(self, numbers: FloatArray) -> list[list[_Ends]]:
        """Return what a law makes of each loop: far, alone, near, and where slopes are read."""
        speed, torque = self.family.ends(numbers, self._drives)
        found = [(speed[place], torque[place]) for place in self._places]
        return [found[i : i + 4] for i in range(0, len(found), 4)]

    def value(self, numbers: FloatArray) -> tuple[float, int, int]:
        """Return the slope, and the loop and the sample before the crossing that decide it.

        Where a root grows without any slope it is minus infinity.
        """
        best = (np.inf, 0, 0)
        for i, (loop, ends) in enumerate(zip(self.loops, self._ends(numbers), strict=True)):
            if self._grows(loop, *ends[:3]):
                return -np.inf, i, 0
            z = _impedance(loop.s, loop.matrix, ends[3]) + loop.answer
            up, slopes = _crossings(z)
            counted = slopes * loop.weights[up]
            if counted.size and counted.min() < best[0]:
                least = int(np.argmin(counted))
                best = float(counted[least]), i, int(up[least])
        return best

    def __call__(self, numbers: FloatArray) -> tuple[float, FloatArray]:
        """Return the value to minimise and its gradient; infinite where a root grows."""
        value, i, at = self.value(numbers)
        if not np.isfinite(value):
            return np.inf, np.zeros(numbers.size)
        loop, here, pipe = self.loops[i], slice(at, at + 2), self.family.pipe
        s, matrix, drive = loop.s[here], loop.matrix[here], loop.drive.pick(here)
        answer = loop.answer[here]

        def crossing(moved: FloatArray) -> float:
            z = _impedance(s, matrix, self.family.ends(moved, drive)) + answer
            share = -z.imag[0] / (z.imag[1] - z.imag[0])
            return float(z.real[0] + share * (z.real[1] - z.real[0]))

        known = crossing(numbers)
        steps = _CHANGE * np.eye(numbers.size)
        slope = np.array([crossing(numbers + step) - known for step in steps]) / _CHANGE
        return -value / pipe, -slope * loop.weights[at] / pipe

    def _grows(self, loop: _Loop, far: _Ends, alone: _Ends, near: _Ends) -> bool:
        """Whether a root of string and drive grows, or might above the frequencies looked at.

        The characteristic function is N + ζ D, the drive on an endless pipe, times 1 − r E with
        the drive's reflection r and the string's echo E, times what has no zeros there.
        """
        pipe = self.family.pipe

        def reflected(ends: _Ends) -> ComplexArray:
            speed, torque = ends
            return (torque - pipe * speed) / (torque + pipe * speed)

        # Above, no more comes back than a wave loses on its way.
        if (np.abs(reflected(far)) * loop.loudest >= 1.0).any():
            return True
        whole = (alone[1] + pipe * alone[0]) / (loop.alone.inertia + pipe)
        return _turns(whole) or _turns(1.0 - reflected(near) * loop.echo)


class _Swing(_Slopes):
    """The logarithm of the mean square of the bit's speed over all loops, and its gradient.

    Infinite where a mode grows with what the bit answers, or where without that the string as it
    is stands less than the largest of some slopes, or half as much again, that a known law reaches.
    """

    def __init__(
        self, family: LawFamily, loops: list[_Loop], slopes: Iterable[float], known: FloatArray
    ) -> None:
        super().__init__(family, loops)
        most = self.free_slope(known)
        wanted = [more * slope for slope in slopes for more in (1.0, _ABOVE)]
        self.floor = max((slope for slope in wanted if slope <= most), default=0.0)

    def value(self, numbers: FloatArray) -> tuple[float, int, int]:
        """Return minus the logarithm, and where the smallest slope is."""
        slope, i, at = super().value(numbers)
        good = slope > 0.0 and self.free_slope(numbers) >= self.floor
        return -self._mean_square(numbers) if good else -np.inf, i, at

    def free_slope(self, numbers: FloatArray) -> float:
        """Return the smallest slope of the first modes of the string as it is, its bit free."""
        loop = self.loops[0]
        ends = self.family.ends(numbers, loop.drive)
        up, slopes = _crossings(_impedance(loop.s, loop.matrix, ends))
        return float(slopes[loop.weights[up] == 1.0].min(initial=np.inf))

    def __call__(self, numbers: FloatArray) -> tuple[float, FloatArray]:
        """Return the value to minimise and its gradient."""
        value = -self.value(numbers)[0]
        if not np.isfinite(value):
            return np.inf, np.zeros(numbers.size)
        steps = _CHANGE * np.eye(numbers.size)
        around = np.array([self._mean_square(numbers + step) for step in steps])
        return value, (around - value) / _CHANGE

    def _mean_square(self, numbers: FloatArray) -> float:
        found = 0.0
        for loop in self.loops:
            ends = self.family.ends(numbers, loop.drive)
            z = _impedance(loop.s, loop.matrix, ends) + loop.answer
            found += float((loop.force / np.abs(z) ** 2).sum())
        return math.log(found / len(self.loops))


def _impedance(s: ComplexArray, matrix: ComplexArray, ends: _Ends) -> ComplexArray:
    """Return the impedance that the bit sees."""
    speed, force = ends[0], s * ends[1]
    moment = matrix[:, 1, 0] * speed + matrix[:, 1, 1] * force
    return np.asarray(moment / ((matrix[:, 0, 0] * speed + matrix[:, 0, 1] * force) * s))


def _crossings(z: ComplexArray) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return the samples before which Im Z rises through zero, and Re Z there."""
    up = np.nonzero((z.imag[:-1] < 0.0) & (z.imag[1:] >= 0.0))[0]
    share = -z.imag[up] / (z.imag[up + 1] - z.imag[up])
    return up, z.real[up] + share * (z.real[up + 1] - z.real[up])


def _turns(values: ComplexArray) -> bool:
    """Whether a function turns about 0 on its way from a real value to its last one."""
    below = values.imag < 0.0
    at = np.flatnonzero(below[1:] != below[:-1])
    one, other = values[at], values[at + 1]
    # It does where it crosses the negative axis more often one way than the other.
    behind = (one.real * other.imag - other.real * one.imag) / (other.imag - one.imag) < 0.0
    return bool(np.where(below[at], -1, 1)[behind].sum() != 0)


def stretched(line: Line, factor: float) -> Line:
    """Return the string as much longer as a factor says, all of it in its longest stretch."""
    lengths = [stretch.length for stretch in line.stretches]
    longest = int(np.argmax(lengths))
    share = 1.0 + (factor - 1.0) * sum(lengths) / lengths[longest]
    stretch = line.stretches[longest]
    repeats = max(1, round(stretch.repeats * max(share, 0.1)))
    rest = max(share, 0.1) * stretch.repeats / repeats
    pieces = tuple(piece._replace(length=piece.length * rest) for piece in stretch.pieces)
    others = list(line.stretches)
    others[longest] = stretch._replace(pieces=pieces, repeats=repeats)
    return Line(tuple(others))


def _loop(line: Line, machine: DriveMachine, aim: float, rate: float, bit: BitLoad | None) -> _Loop:
    modes, ends = mode_bands(line, MODES)
    step = float(modes[0]) / _PER_MODE
    # Between their poles impedances are smooth: so many samples between modes will do.
    apart = 0.5 / line.transit_time
    frequencies = np.concatenate(
        [
            np.arange(step, ends[0], step),
            np.arange(ends[0], ends[-1], apart / _BETWEEN),
            np.arange(ends[-1], max(HIGHEST, 2.0 * ends[-1]), 2.0 * apart / _BETWEEN),
        ]
    )
    s = np.asarray(2j * np.pi * frequencies, dtype=complex)
    matrix, _ = line.scaled_transfer(s)
    # Under a held top, by the same samples.
    held = matrix[:, 1, 1] / (matrix[:, 0, 1] * s)
    up = np.nonzero((held.imag[:-1] < 0.0) & (held.imag[1:] >= 0.0))[0]
    stand = np.interp(frequencies, frequencies[up], held.real[up])
    weights = np.where(frequencies <= ends[-1], 1.0, aim / np.clip(_KEPT * stand, 1e-3 * aim, aim))
    pipe = line.wave_impedance

    def right_of(hertz: FloatArray) -> ComplexArray:
        return np.asarray(_GROWTH + 2j * np.pi * hertz, dtype=complex)

    def echo(at: ComplexArray) -> ComplexArray:
        there, _ = line.scaled_transfer(at)
        moment, angle = there[:, 1, 0], pipe * there[:, 1, 1] * at
        return np.asarray((moment - angle) / (moment + angle))

    # An echo turns once from mode to mode.
    slow, last = frequencies[frequencies < ends[0]][::_FEWER], float(frequencies[-1])
    turning = np.arange(ends[0], last, apart / _TURN)
    near = right_of(np.concatenate([np.linspace(0.0, step, 10)[:-1], slow, turning, [last]]))
    edges = np.geomspace(frequencies[-1], _HIGHEST, _FAR + 1)
    within = np.linspace(edges[:-1], edges[1:], _WITHIN, axis=1)
    loudest = np.abs(echo(right_of(within.ravel()))).reshape(within.shape).max(axis=1)
    alone = right_of(np.append(0.0, np.geomspace(1e-3, _HIGHEST, _ALONE)))
    answer, force = np.zeros(s.size, dtype=complex), np.zeros(s.size)
    if bit is not None:
        answer = bit.answer(frequencies)
        force = bit.shaking(frequencies) * np.gradient(frequencies) / bit.speed**2
    drives = [
        drive_signals(machine, pipe, rate, at) for at in (s, near, right_of(edges[1:]), alone)
    ]
    return _Loop(
        s, matrix, drives[0], weights, answer, force,
        drives[1], echo(near), drives[2], loudest, drives[3],
    )  # fmt: skip


@checks_kinds
def dynamic_drive_control(
    line: Line,
    machine: DriveMachine,
    order: int = 2,
    length_error: float = 0.2,
    bit: BitLoad | None = None,
    others: Sequence[Line] = (),
) -> DriveControl:
    """Design dynamic feedback for the largest smallest critical slope of the first four modes.

    Parameters
    ----------
    line : Line
        The string in torsion.
    machine : DriveMachine
        The drive. Its torque limit bounds the gain on speed: a swing of 10 rpm must not take more.
    order : int
        Number of states beside the integrator of speed and the filters of the machine, 0 to 4.
    length_error : float
        The design holds for strings that are shorter and longer by that share, and for a drive
        whose delay is half as long again.
    bit : BitLoad, optional
        What the bit does where it drills: slopes are then what its answer leaves of them, and of
        the laws under which none vanishes the law is that under which the bit is shaken least.
        With a free bit the string stands half as much again as under soft torque and Z-torque by
        their rules, or as much, where a law of that order reaches that.

    others : sequence of Line
        Strings that the design holds for instead of shorter and longer ones.

    Returns
    -------
    DriveControl
        ``dynamic-N``, the best that was found; no order does worse than one of two states less.
        Where a string is damped so little that high modes make all of these unstable, or leave
        nothing better, it is soft torque.
    """
    n = checked_integer("order", order, 0, 4)
    error = checked_number("length_error", length_error, 0.0, 0.5)
    modes, _ = mode_bands(line, MODES)
    rate = 2.0 * math.pi * math.sqrt(float(modes[0] * modes[-1]))
    aim = _AIM * lowest_impedance(line)
    signs = (-1, 1) if error and not others else ()
    strings = (line, *others, *(stretched(line, 1.0 + sign * error) for sign in signs))
    loops = [_loop(each, machine, aim, rate, bit) for each in strings]
    if machine.delay > 0.0:
        later = replace(machine, delay=_LATER * machine.delay)
        loops.append(_loop(line, later, aim, rate, bit))
    known = np.array([[4.0, 0.25, 0.0], [30.0, 0.1, 4.0], [40.0, 0.175, 9.0]])
    for grown in range(n % 2, n + 1, 2):
        family = LawFamily(grown, line.wave_impedance, rate, machine)
        known = _best(family, _Slopes(family, loops), known)[None, :]
    soft = soft_torque_control(machine, line.wave_impedance, float(modes[0]))

    def stands(law: DriveControl) -> float:
        return min(mode.slope for mode in mode_slopes(line, law, MODES))

    if bit is not None:
        rules = soft, z_torque_control(machine, line.wave_impedance)
        slopes = [stands(law) for law in rules if drive_is_stable(line, law)]
        goal = _Swing(family, loops, slopes, known[0])
        if np.isfinite(goal.value(known[0])[0]):
            known = _best(family, goal, known)[None, :]
    found = DriveControl(f"dynamic-{n}", machine, *family.laws(known[0]))
    # What stands less than soft torque was found for the sake of the longer and shorter strings,
    # or of the torque of the bit.
    enough = bit is not None or stands(found) >= stands(soft) or not drive_is_stable(line, soft)
    if drive_is_stable(line, found) and enough:
        return found
    return replace(found, speed=soft.speed, torque=soft.torque)


def _best(family: LawFamily, goal: _Slopes, known: FloatArray) -> FloatArray:
    """Return the best numbers that descents from laws with fewer states find."""
    starts = family.starts(known)
    values = -np.array([goal.value(start)[0] for start in starts])
    # The known ones first, whatever they are worth.
    order = [*range(len(known)), *(len(known) + np.argsort(values[len(known) :]))]
    chosen = [i for i in order if np.isfinite(values[i])][:_BEGUN]
    ends = [bfgs(goal, starts[i], family.lower, family.upper, most=_STEPS) for i in chosen]
    best = min(ends, key=lambda end: end.value)
    # Learned curvature misleads once other crossings decide: begin again from the best end.
    inset = 1e-6 * (family.upper - family.lower)
    start = np.clip(best.gains, family.lower + inset, family.upper - inset)
    again = bfgs(goal, start, family.lower, family.upper, most=_STEPS)
    return min(best, again, key=lambda end: end.value).gains
