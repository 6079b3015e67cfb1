"""What a drive leaves the bit: critical slopes, mode by mode, and what endangers the drive itself.

All from exact transfer matrices, delays included. A bit whose torque falls by d per unit of its
speed swings undamped at s = iω where the impedance that the string shows it is d.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_rules import drive_poles
from drillctrl.strings.elements import ELEMENT_LENGTH, elements, free_modes
from drillctrl.strings.line import Line
from drillctrl.strings.winding import zeros_right_of

_HALVINGS = 50
# Samples up to the first mode's frequency; crossings closer together are missed.
_PER_MODE = 400.0
# Growth, 1/s, from which a drive counts as unstable: a string that turns freely has a root at 0.
_GROWTH = 1e-4
# Hz up to which all modes are looked at; the first few are sampled more closely than the others,
# which stand a mode's distance apart.
HIGHEST, _CLOSE, _CLOSER = 30.0, 4, 5.0
# Share of J ω that the drive's feedback still has where nothing above needs to be looked at.
_INERTIAL = 0.1
# Samples across the width of a resonance.
_WIDTHS = 10.0


@dataclass(frozen=True)
class CriticalSlope:
    """How steeply the bit's torque may fall with its speed before a root crosses the axis.

    Attributes
    ----------
    frequency : float
        Hz at which it then swings.
    slope : float
        d*, N m s/rad.
    grows : bool
        Whether steeper slopes make that root grow; else they damp one that grew.
    """

    frequency: float
    slope: float
    grows: bool = True


@dataclass(frozen=True)
class ModeSlope:
    """The critical slope of a mode of torsion.

    Attributes
    ----------
    number : int
        Of the mode.
    mode_frequency : float
        Hz, top held, bit free, undamped.
    frequency : float or None
        Hz at which the mode swings at its critical slope; None if it has none.
    slope : float
        d*, N m s/rad: the smallest at which a root leaves the stable side between the middles
        to the neighbouring modes. Where no slope does it, the impedance of the lowest stretch,
        which sets off all high modes at once.
    """

    number: int
    mode_frequency: float
    frequency: float | None
    slope: float


def lowest_impedance(line: Line) -> float:
    """Return √(m k) of the lowest stretch, N m s/rad."""
    lowest = line.stretches[-1].mean()
    return float(np.sqrt(lowest.mass * lowest.stiffness))


def bit_impedance(line: Line, control: DriveControl | None, s: npt.ArrayLike) -> ComplexArray:
    """Return the impedance that a string shows its bit, torque per speed, (...).

    Parameters
    ----------
    line : Line
        The string in torsion.
    control : DriveControl or None
        Of the drive; None for an imposed speed.
    s : complex, (...)
        1/s, not 0.
    """
    at = np.asarray(s, dtype=complex)
    top = np.inf if control is None else at * control.impedance(at)
    return np.asarray(line.bit_stiffness(at, top) / at)


@checks_kinds
def critical_slopes(
    line: Line, control: DriveControl | None, frequency: float, step: float = 1e-3
) -> tuple[CriticalSlope, ...]:
    """Return the slopes at which roots cross the imaginary axis, in order of frequency.

    Im Z(iω) = 0 there, d* = Re Z(iω), and the root goes right where Im Z rises. Slopes above the
    wave impedance of the lowest stretch are left out: none is needed to set off all high modes
    at once.

    Parameters
    ----------
    line : Line
        The string in torsion.
    control : DriveControl or None
        Of the drive; None for an imposed speed.
    frequency : float
        Hz, up to which to look.
    step : float
        Hz between the samples; crossings closer than that are missed.
    """
    if not 0.0 < step < frequency:
        raise InputError("step", step, f"in (0, {frequency:g}) Hz")
    return _crossings(line, control, np.arange(step, frequency + step, step))


def _bands_and_crossings(
    line: Line, control: DriveControl | None, count: int, highest: float | None = None
) -> tuple[FloatArray, FloatArray, tuple[CriticalSlope, ...]]:
    """Return `mode_bands`, and crossings up to their end or, by coarser samples, beyond."""
    modes, ends = mode_bands(line, count)
    step, near = float(modes[0]) / _PER_MODE, float(ends[-1])
    if highest is None:
        return modes, ends, critical_slopes(line, control, near, step)
    near = min(near, highest)
    at = np.concatenate([np.arange(step, near, step), np.arange(near, highest, _CLOSER * step)])
    return modes, ends, _crossings(line, control, np.append(at, highest))


def _crossings(
    line: Line, control: DriveControl | None, at: FloatArray
) -> tuple[CriticalSlope, ...]:
    """Return the crossings that samples at some frequencies in Hz tell of."""

    def impedance(f: FloatArray) -> ComplexArray:
        return bit_impedance(line, control, 2j * np.pi * f)

    found, rising = sign_changes(lambda f: impedance(f).imag, at)
    values = impedance(found)
    # Where the sign changes through infinity the bit is held.
    most = lowest_impedance(line)
    at_zero = (np.abs(values.imag) < 1e-3 * most) & (values.real < most)
    return tuple(
        CriticalSlope(float(f), float(z.real), bool(up))
        for f, z, up in zip(found[at_zero], values[at_zero], rising[at_zero], strict=True)
    )


def sign_changes(
    function: Callable[[FloatArray], FloatArray], at: FloatArray
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return where a function changes sign between samples, by bisection, and whether it rises."""
    values = function(at)
    places = np.nonzero(np.signbit(values[:-1]) != np.signbit(values[1:]))[0]
    low, high, rising = at[places], at[places + 1], values[places + 1] >= 0.0
    for _ in range(_HALVINGS if places.size else 0):
        middle = 0.5 * (low + high)
        before = (function(middle) < 0.0) == rising
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return high, np.asarray(rising)


@functools.lru_cache(maxsize=64)
def mode_bands(line: Line, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the first frequencies of torsion, (count,), and where each one's band ends, Hz."""
    # A short string needs short elements for as many modes.
    chain = elements(line, min(ELEMENT_LENGTH, line.length / (20.0 * count)))
    known = free_modes(chain, count + 1).frequencies
    return known[:count], 0.5 * (known[1:] + known[:-1])


@checks_kinds
def mode_slopes(line: Line, control: DriveControl | None, count: int = 4) -> tuple[ModeSlope, ...]:
    """Return the critical slope of each of the first modes of torsion.

    Of a drive that is unstable by itself they say nothing: see `drive_is_stable`.

    Parameters
    ----------
    line : Line
        The string in torsion.
    control : DriveControl or None
        Of the drive; None for an imposed speed.
    count : int
        Number of modes, 1 to 20.
    """
    checked_integer("modes", count, 1, 20)
    modes, ends, crossings = _bands_and_crossings(line, control, count)
    most = lowest_impedance(line)
    found, low = [], 0.0
    for i, (mode, high) in enumerate(zip(modes.tolist(), ends.tolist(), strict=True)):
        own = [c for c in crossings if c.grows and c.slope > 0.0 and low < c.frequency <= high]
        first = min(own, key=lambda c: c.slope, default=None)
        slope = most if first is None else first.slope
        found.append(ModeSlope(i + 1, mode, None if first is None else first.frequency, slope))
        low = high
    return tuple(found)


@checks_kinds
def weakest_slope(
    line: Line, control: DriveControl | None, highest: float = HIGHEST
) -> CriticalSlope | None:
    """Return the smallest critical slope of all modes of torsion up to a frequency.

    A law that does much for the first modes may do harm to a higher one.

    Parameters
    ----------
    line : Line
        The string in torsion.
    control : DriveControl or None
        Of the drive; None for an imposed speed.
    highest : float
        Hz.

    Returns
    -------
    CriticalSlope or None
        None where no slope below the impedance of the lowest stretch makes any of them grow.
    """
    checked_number("highest", highest, 0.0, 1e3, open_low=True)
    _, _, crossings = _bands_and_crossings(line, control, _CLOSE, highest)
    grown = [c for c in crossings if c.grows and 0.0 < c.slope < lowest_impedance(line)]
    return min(grown, key=lambda c: c.slope, default=None)


@checks_kinds
def count_growing(
    line: Line, control: DriveControl, slope: float = 0.0, highest: float = 0.0
) -> int:
    """Return how many roots grow, by the argument principle on the exact string.

    Parameters
    ----------
    line : Line
        The string in torsion.
    control : DriveControl
        Of the drive.
    slope : float
        By which the bit's torque falls with its speed, N m s/rad.
    highest : float
        Hz, modulus up to which roots are counted; by default where the drive is its inertia
        and nothing else.
    """
    return _growing(line, control, slope, highest or _inertial_frequency(control))


@functools.lru_cache(maxsize=64)
def _growing(line: Line, control: DriveControl, slope: float, highest: float) -> int:
    radius = 2.0 * np.pi * highest
    impedance = lowest_impedance(line)

    def characteristic(s: ComplexArray) -> ComplexArray:
        speed, torque = control.ends(s)
        matrix, exponent = line.scaled_transfer(s)
        angle = matrix[..., 0, 0] * speed + matrix[..., 0, 1] * s * torque
        moment = matrix[..., 1, 0] * speed + matrix[..., 1, 1] * s * torque
        # The integrator's pole at 0 is taken away; the scale keeps numbers near 1.
        found = (moment - slope * s * angle) / (impedance * (1.0 + np.abs(s)) ** 2)
        return np.asarray(found * np.exp(1j * exponent.imag))

    samples = int(8.0 * (1.0 + radius * (line.transit_time + control.machine.delay)))
    zeros = zeros_right_of(characteristic, _GROWTH, radius, samples)
    return zeros + drive_poles(control)


def _inertial_frequency(control: DriveControl) -> float:
    """Return the frequency in Hz above which a drive is its inertia and nothing else."""
    frequencies = np.geomspace(1.0, 1e3, 400)
    s = 2j * np.pi * frequencies
    speed, torque = control.ends(s)
    beside = np.abs(torque / (control.machine.inertia * s) - 1.0) + np.abs(speed - 1.0)
    busy = np.flatnonzero(beside > _INERTIAL)
    return float(frequencies[min(busy[-1] + 1, 399)]) if busy.size else 1.0


def drive_is_stable(line: Line, control: DriveControl) -> bool:
    """Whether string and drive are stable without any slope at the bit."""
    return count_growing(line, control) == 0


@checks_kinds
def drive_delay_margin(line: Line, control: DriveControl, step: float = 2e-3) -> float:
    """Return by how much later the drive may act before it is unstable by itself, s.

    The bit turns freely. Infinite where no delay does it; nan where it is unstable as it is.

    Parameters
    ----------
    line : Line
        The string in torsion.
    control : DriveControl
        Of the drive.
    step : float
        Hz between the samples, wider where damping makes all resonances wide; a narrower
        resonance is missed.
    """
    if not drive_is_stable(line, control):
        return float("nan")
    inertia, delay = control.machine.inertia, control.machine.delay

    def loop(f: FloatArray) -> ComplexArray:
        s = np.asarray(2j * np.pi * f, dtype=complex)
        lag = 1.0 / (1.0 + control.machine.lag * s)
        speed, torque = control.laws(s)
        matrix, _ = line.scaled_transfer(s)
        string = matrix[..., 1, 0] / (matrix[..., 1, 1] * s)
        return np.asarray(lag * (speed + torque * string) / (inertia * s + string))

    at = _by_widths(line, step, _inertial_frequency(control))
    places, _ = sign_changes(lambda f: np.abs(loop(f)) - 1.0, at)
    if not places.size:
        return float("inf")
    omega = 2.0 * np.pi * places
    # 1 + L exp(−τ s) vanishes where ω τ is the phase of −L.
    late = np.angle(-loop(places)) / omega
    period = 2.0 * np.pi / omega
    late = late + period * np.ceil((delay - late) / period)
    return float(np.min(late) - delay)


def _by_widths(line: Line, step: float, highest: float) -> FloatArray:
    """Return frequencies, Hz, closer together than resonances are wide, unless a step is wider.

    A wave that decays at the rate σ makes resonances as wide as σ/π.
    """
    pieces = [piece for stretch in line.stretches for piece in stretch.pieces if piece.mass]

    def apart(f: float) -> float:
        omega = 2.0 * np.pi * f
        rates = [0.5 * (p.damping / p.mass + p.retardation * omega**2) for p in pieces]
        return max(step, min(rates) / (_WIDTHS * np.pi))

    at = [step]
    while at[-1] < highest:
        at.append(at[-1] + apart(at[-1]))
    return np.array(at)
