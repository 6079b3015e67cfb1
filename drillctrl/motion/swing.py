"""Damping left to the torsional modes over how far the bit swings, and where it ends."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.workers import Progress, open_executor, spread_out
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.quantities import response_scale
from drillctrl.motion.crossings import sign_changes
from drillctrl.motion.orbit import AxialOrbit, axial_orbit
from drillctrl.motion.response import FEWEST_PERIODS, TOLERANCE, BitResponse, bit_response
from drillctrl.motion.torsion import TorsionalMode, ripple_of, torsional_modes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Of a long string, whose bit takes a minute to answer, fewer.
AMPLITUDES_OF_STRING = (0.03, 0.1, 0.3, 0.5, 0.8)
AMPLITUDES = (0.01, 0.03, 0.1, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.65, 0.8, 0.95)
# The frequency follows the root until they differ by no more than this share, at most so
# often, and not below that share of the string's own.
_NEAR, _FOLLOWED, _LOWEST = 2e-2, 3, 0.2
# Times that the amplitudes about a crossing are halved.
_HALVED = 3
_DIRECTIONS = np.exp(2j * np.pi * np.arange(8) / 8)


@dataclass(frozen=True, eq=False)
class ModeAt:
    """What becomes of a mode at one amplitude of the bit's swing.

    Attributes
    ----------
    response : BitResponse
        H at the mode's own frequency.
    root : complex
        Of the mode with that answer; its real part is the growth rate. NaN where H is.
    error : float
        Of the growth rate, for all H within their error.
    """

    response: BitResponse
    root: complex
    error: float

    @property
    def amplitude(self) -> float:
        """A, share of the rotary speed."""
        return self.response.amplitude

    @property
    def sign(self) -> int:
        """+1 where the mode grows for all H within their error, −1 where it decays, else 0."""
        if not abs(self.root.real) > self.error:
            return 0
        return 1 if self.root.real > 0.0 else -1


@dataclass(frozen=True)
class Crossing:
    """An amplitude at which a mode neither grows nor decays.

    Attributes
    ----------
    kind : {"swing", "kick"}
        ``"swing"``: smaller ones grow and larger ones decay, the rig swings by that much;
        ``"kick"``: the other way round, beyond it the motion goes on to a larger swing.
    amplitude : float
        A, interpolated.
    low, high : float
        Amplitudes between which it lies, at both of which the sign is sure.
    """

    kind: str
    amplitude: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class ModeSwing:
    """A torsional mode over the amplitude of the bit's swing.

    Attributes
    ----------
    mode : TorsionalMode
        Of the string alone.
    at : tuple of ModeAt
        By rising amplitude.
    """

    mode: TorsionalMode
    at: tuple[ModeAt, ...]

    @property
    def amplitudes(self) -> FloatArray:
        """A, (k,)."""
        return np.array([each.amplitude for each in self.at])

    @property
    def values(self) -> ComplexArray:
        """H, (k,)."""
        return np.array([each.response.value for each in self.at])

    @property
    def damping_left(self) -> FloatArray:
        """Own damping and Re H, (k,)."""
        return np.asarray(self.mode.damping + self.values.real)

    @property
    def crossings(self) -> tuple[Crossing, ...]:
        """Amplitudes at which it neither grows nor decays, those of no sure sign left out."""
        found = sign_changes([each.amplitude for each in self.at], self.at)
        return tuple(
            Crossing("swing" if known.grows_below else "kick", known.place, known.low, known.high)
            for known in found
        )


@dataclass(frozen=True, eq=False)
class DrillingMotion:
    """The motion that a rig drills with, as the torsional loop about the axial orbit tells it.

    Attributes
    ----------
    case : Case
        What drills, and where.
    orbit : AxialOrbit
        Of a bit that turns evenly.
    modes : tuple of ModeSwing
        The slowest first.
    floor : float or None
        Swing of the speed, (max − min)/(2 mean), that the torque of the axial orbit forces by
        itself, beside which every other swing stands; None where it is not sure that small
        swings decay.
    """

    case: Case
    orbit: AxialOrbit
    modes: tuple[ModeSwing, ...]
    floor: float | None

    def plot(self, mode: int = 1, name: str | None = None) -> Axes:
        """Draw the damping left to a mode over the swing, in SI where there is a rig.

        Parameters
        ----------
        mode : int
            Its number.
        name : str, optional
            Of the rig, for the title.

        Raises
        ------
        InputError
            If there is no such mode.
        """
        from drillctrl.motion.figure import plot_damping

        mode = checked_integer("mode", mode, 1, len(self.modes))
        swing = self.modes[mode - 1]
        scale, unit = response_scale(self.case.told_rig, self.case.language)
        return plot_damping(
            swing.amplitudes,
            swing.damping_left * scale,
            np.array([each.response.error for each in swing.at]) * scale,
            [(crossing.kind, crossing.amplitude) for crossing in swing.crossings],
            unit,
            f"torsional mode {swing.mode.number}",
            ", ".join(text for text in (name, self.case.place) if text),
        )


@checks_kinds
def drilling_motion(
    where: Where,
    amplitudes: Sequence[float] = AMPLITUDES,
    *,
    modes: int = 1,
    workers: int = 1,
    progress: Progress | None = None,
    **options: Any,
) -> DrillingMotion:
    """Return the axial orbit of a point, and the damping left to its torsional modes over swing.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where.
    amplitudes : sequence of float
        A in (0, 1), rising. Where the growth rate changes its sign in between, more follow.
    modes : int
        So many torsional modes, the slowest.
    workers : int
        Processes.
    progress : callable, optional
        Called with the name of a stage, amplitudes done and amplitudes to do.
    **options
        Of `mode_at`.

    Raises
    ------
    InputError
        If an argument is out of its range; see `bit_response` and `torsional_modes`.
    """
    wanted = [checked_number("amplitudes", a, 0.0, 0.999, open_low=True) for a in amplitudes]
    if not wanted or any(b <= a for a, b in itertools.pairwise(wanted)):
        raise InputError("amplitudes", str(list(amplitudes)), "rising, one or more in (0, 1)")
    workers = checked_integer("workers", workers, 1, 1000)
    case = as_case(where)
    found = torsional_modes(case, modes)
    orbit = axial_orbit(case)
    with open_executor(workers, None) as executor:
        swings = tuple(_swing(case, mode, wanted, executor, progress, options) for mode in found)
    return DrillingMotion(case, orbit, swings, _floor(case, orbit, swings))


def _floor(case: Case, orbit: AxialOrbit, swings: tuple[ModeSwing, ...]) -> float | None:
    """Return the forced swing, with what the bit answers to the smallest amplitude."""
    smallest = swings[0].at[0]
    if orbit.broken is not None or smallest.sign >= 0:
        return None
    mode, value = swings[0].mode, smallest.response.value
    speed = ripple_of(mode, value, orbit.torque_samples, orbit.spacing)
    _, point = case.physics("a forced swing")
    return float(np.ptp(speed)) / (2.0 * point.omega0)


@checks_kinds
def mode_at(
    where: Where, mode: TorsionalMode, amplitude: float, *, ripple: bool = True, **options: Any
) -> ModeAt:
    """Return what becomes of a mode where the bit swings by an amplitude.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where.
    mode : TorsionalMode
        Of `torsional_modes`.
    amplitude : float
        A in (0, 1).
    ripple : bool
        Whether the speed ripples under the torque of the orbit, which makes rates exact; where
        the bit would turn back, as near A = 1, the rotation is imposed all the same.
    **options
        Of `bit_response`.
    """
    if not isinstance(mode, TorsionalMode):
        raise InputError("mode", repr(mode), "a TorsionalMode, one of those of torsional_modes")
    found = _followed(where, mode, amplitude, {**options, "ripple": ripple})
    if ripple and found.broken is not None:
        found = _followed(where, mode, amplitude, options)
    if not math.isfinite(found.error):
        return ModeAt(found, complex(math.nan, math.nan), math.inf)
    root = mode.with_response(found.value)
    around = [mode.with_response(found.value + found.error * d) for d in _DIRECTIONS]
    return ModeAt(found, root, max(abs(each.real - root.real) for each in around))


def _followed(
    where: Where, mode: TorsionalMode, amplitude: float, options: dict[str, Any]
) -> BitResponse:
    """Return the response at the frequency of the root that follows from it."""
    frequency = mode.root.imag
    # The frequency follows few windows; its own error moves H little.
    quick = {**options, "most_periods": FEWEST_PERIODS}
    for _ in range(_FOLLOWED):
        response = bit_response(where, frequency, amplitude, **quick)
        if not math.isfinite(response.error):
            return response
        root = mode.with_response(response.value)
        shift = abs(root.imag - frequency)
        # An error of H that moves the frequency further than that says nothing of it.
        unsure = response.error * abs(mode.follows) > shift
        if unsure or shift <= _NEAR * frequency or root.imag < _LOWEST * mode.root.imag:
            break
        frequency = root.imag
    if response.frequency == frequency and response.error <= options.get("tolerance", TOLERANCE):
        return response
    return bit_response(where, frequency, amplitude, **options)


def _task(task: tuple[int, Case, TorsionalMode, float, dict[str, Any]]) -> tuple[int, ModeAt]:
    index, case, mode, amplitude, options = task
    return index, mode_at(case, mode, amplitude, **options)


def _swing(
    case: Case,
    mode: TorsionalMode,
    amplitudes: list[float],
    executor: Executor | None,
    progress: Progress | None,
    options: dict[str, Any],
) -> ModeSwing:
    def every(wanted: list[float], stage: str = "swings") -> list[ModeAt]:
        tasks = [(i, case, mode, a, options) for i, a in enumerate(wanted)]
        found: dict[int, ModeAt] = {}
        for index, each in spread_out(executor, _task, tasks):
            found[index] = each
            if progress is not None:
                progress(f"{stage} of mode {mode.number}", len(found), len(wanted))
        return [found[index] for index in sorted(found)]

    at = every(amplitudes)
    for _ in range(_HALVED):
        crossings = ModeSwing(mode, tuple(at)).crossings
        known = {each.amplitude for each in at}
        middles = [math.sqrt(crossing.low * crossing.high) for crossing in crossings]
        wanted = [a for a in middles if all(abs(a - b) > 1e-3 for b in known)]
        if not wanted:
            break
        at = sorted([*at, *every(wanted, "nearer swings")], key=lambda each: each.amplitude)
    return ModeSwing(mode, tuple(at))
