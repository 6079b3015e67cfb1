"""Laws of a top drive for a sampled computer: discretised, with what it does beside the law."""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypedDict, Unpack

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.strings.drive_control import DriveControl, DriveMachine, Transfer
from drillctrl.strings.drive_law import companion, without_integral
from drillctrl.strings.drives_words import law_text

# What the status says, bit by bit; the values are those of controllers of tables.
DRIVE_BITS = (
    ("OUTSIDE", 1, "the place is none of the table's: the law of the nearest end stands"),
    ("HELD", 2, "the sample was none, or cannot be: the last good one stands"),
    ("LOST", 4, "too many samples in a row were none"),
    ("FROZEN", 8, "too many samples of the speed in a row were equal"),
    ("CLOCK", 16, "the sample did not come a period after the one before, within half of it"),
    ("SLOWED", 64, "the fastest change of the torque was met"),
    ("LIMITED", 128, "the limit of the torque was met"),
)
# What no top drive turns at, rad/s, and no torque is, in limits of it.
_FASTEST, _STRONGEST = 100.0, 2.0
# Coordinates that a law may be scheduled over: unit, largest, and what a coordinate is.
DRIVE_AXES = {
    "depth": ("m", 1e5, "length of the string"),
    "rotary_speed": ("rad/s", 100.0, "rotary speed that the law is scheduled by"),
    "rock_strength": ("Pa", 1e10, "strength of the rock"),
    "mud": ("kg/m3", 1e4, "density of the mud"),
}
_LONGEST, _MOST_NODES = 1_000_000_000, 200


class DriveOptions(TypedDict, total=False):
    """What a sampled drive does beside its law, where it is not as usual.

    Attributes
    ----------
    ramp : int
        Samples over which a law without an integral takes over; a second by default.
    fade : int
        Samples over which the torque falls to zero once the signals are lost; a second by
        default.
    hold : int
        Samples in a row that are none for which the last good one stands in; 3 by default.
    watchdog : int
        Equal speeds in a row after which they count as frozen and the torque falls to zero. By
        default that is only reported, after a second.
    rate_limit : float
        Fastest change of the torque, N m/s; by default any.
    release : int
        Samples over which the torque falls to zero when it is switched off; by default at once.
    """

    ramp: int
    fade: int
    hold: int
    watchdog: int
    rate_limit: float
    release: int


class DriveNode(NamedTuple):
    """The law at one depth, discretised by the trapezoidal rule.

    With v = (speed error, torque in the pipe), torque = C x + D v + integral; x ← F x + G v, and
    the integral grows by −K T/2 (e + e before). E v is where x rests under v.

    Attributes
    ----------
    F, G, E : array, (n, n), (n, 2), (n, 2)
    C, D : array, (n,), (2,)
    K : float
        Integral gain, N m/rad.
    """

    F: FloatArray
    G: FloatArray
    E: FloatArray
    C: FloatArray
    D: FloatArray
    K: float


@dataclass(frozen=True, eq=False)
class SampledDrive:
    """A law of a top drive, or one a depth, as a sampled controller.

    Attributes
    ----------
    name : str
        Of the law.
    machine : DriveMachine
        The drive; its encoder's filter is taken to be in what is measured.
    period, limit : float
        s, and largest magnitude of the torque, N m.
    axes : tuple of (str, tuple of float)
        Coordinates of `DRIVE_AXES` in SI with their rising values; of one that has a single
        value the law stands anywhere.
    nodes : tuple of DriveNode
        One a place, the last axis running fastest, all of one order.
    ramp, fade, hold, frozen, release : int
        As of `DriveOptions`.
    watched : bool
        Whether frozen signals take the torque away.
    rate : float or None
        Largest change of the torque from sample to sample.
    most : float
        Largest magnitude of the integral: what holds the limit at rest, N m.
    words : tuple of str
        The laws, a line a place.
    """

    name: str
    machine: DriveMachine
    period: float
    limit: float
    axes: tuple[tuple[str, tuple[float, ...]], ...]
    nodes: tuple[DriveNode, ...]
    ramp: int
    fade: int
    hold: int
    frozen: int
    release: int
    watched: bool
    rate: float | None
    most: float
    words: tuple[str, ...]

    @property
    def order(self) -> int:
        """Number of states of the law beside its integral, at least 1."""
        return len(self.nodes[0].C)

    @property
    def integrates(self) -> bool:
        """Whether the law has an integral, at every place."""
        return self.nodes[0].K != 0.0

    @property
    def largest(self) -> tuple[float, ...]:
        """Magnitudes of speed, set point, torque and coordinates beyond which a sample is none.

        States of a law remember for seconds, so that what cannot be is kept from them.
        """
        beyond = (DRIVE_AXES[name][1] for name, _ in self.axes)
        return _FASTEST, _FASTEST, _STRONGEST * self.limit, *beyond

    @property
    def edges(self) -> tuple[tuple[float, ...], ...]:
        """Where one law takes over from the one before, on each axis."""
        return tuple(
            tuple(0.5 * (a + b) for a, b in itertools.pairwise(values)) for _, values in self.axes
        )

    @property
    def ends(self) -> tuple[tuple[float, float], ...]:
        """Between which coordinates the table has a law, on each axis."""
        return tuple(
            (values[0], values[-1])
            if len(values) > 1
            else (-DRIVE_AXES[name][1], DRIVE_AXES[name][1])
            for name, values in self.axes
        )

    @property
    def filters(self) -> tuple[float, float, float, float]:
        """J/T, and of a filter with the time constant T: of the speed, by the trapezoidal rule,
        the share of what it was and of both samples; of a held torque the share of what it was."""
        constant, step = self.machine.torque_filter, self.period
        return (
            self.machine.inertia / constant,
            (2.0 * constant - step) / (2.0 * constant + step),
            step / (2.0 * constant + step),
            math.exp(-step / constant),
        )

    @property
    def stamp(self) -> str:
        """Eight hexadecimal digits that no other controller shares."""
        parts = [repr(value) for name, value in vars(self).items() if name != "nodes"]
        parts += [repr([np.asarray(part).tolist() for part in node]) for node in self.nodes]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:8]


@checks_kinds
def sampled_drive(
    controls: DriveControl | Sequence[DriveControl],
    *,
    period: float,
    limit: float | None = None,
    depths: Sequence[float] | None = None,
    axes: Mapping[str, Sequence[float]] | None = None,
    **options: Unpack[DriveOptions],
) -> SampledDrive:
    """Return laws of a top drive as a sampled controller.

    Parameters
    ----------
    controls : DriveControl or sequence of them
        A proper law, or one for each place, of one drive.
    period : float
        Sampling period, s.
    limit : float, optional
        Largest magnitude of the torque, N m; by default that of the machine.
    depths : sequence of float, optional
        m, rising: short for ``axes={"depth": depths}``.
    axes : mapping, optional
        Coordinates of `DRIVE_AXES`, ``"depth"``, ``"rotary_speed"``, ``"rock_strength"`` and
        ``"mud"``, with rising values in SI; laws run over the last axis fastest. Each law stands
        up to the middle between values.
    **options
        Of `DriveOptions`.

    Raises
    ------
    InputError
        If a value is out of range; a law differentiates, has another pole that does not decay
        beside one integral, or is of another drive than the others.
    """
    laws = (controls,) if isinstance(controls, DriveControl) else tuple(controls)
    places = _places(depths, axes)
    count_of = math.prod(len(values) for _, values in places)
    if not 1 <= len(laws) <= _MOST_NODES or len(laws) != count_of:
        wanted = f"one for each of {count_of} places, at most {_MOST_NODES}"
        which = "controls" if depths is None else "depths"
        raise InputError(which, f"{count_of} places and {len(laws)} laws", wanted)
    machine = laws[0].machine
    if any(law.machine != machine for law in laws):
        raise InputError("controls", laws[0].name, "laws of one drive")
    step = checked_number("period", period, 0.0, 10.0, open_low=True)
    limit = machine.torque_limit if limit is None else limit
    if limit is None:
        raise InputError("limit", "(missing)", "given: the drive is said to have none of its own")
    most = checked_number("limit", limit, 0.0, 1e9, open_low=True)
    parts = [_parts(law) for law in laws]
    if len({bool(part[0]) for part in parts}) > 1:
        raise InputError("controls", laws[0].name, "laws with an integral at every place, or none")
    order = max(1, *(len(part[1][3]) + len(part[2][3]) for part in parts))
    second = max(1, math.ceil(1.0 / step))

    def count(name: str, usual: int, low: int) -> int:
        given = options.get(name)
        return usual if given is None else max(low, checked_integer(name, given, 0, _LONGEST))

    rate, watchdog = options.get("rate_limit"), options.get("watchdog")
    if rate is not None:
        rate = step * checked_number("rate_limit", rate, 0.0, 1e12, open_low=True)
    if watchdog is not None:
        checked_integer("watchdog", watchdog, 1, _LONGEST)
    return SampledDrive(
        laws[0].name,
        machine,
        step,
        most,
        places,
        tuple(_node(part, order, step) for part in parts),
        count("ramp", second, 1),
        count("fade", second, 1),
        count("hold", 3, 0),
        second if watchdog is None else watchdog,
        count("release", 0, 0),
        watchdog is not None,
        rate,
        most * max(1.0 + abs(float(law.torque(0.0).real)) for law in laws),
        tuple(map(law_text, laws)),
    )


def _places(
    depths: Sequence[float] | None, axes: Mapping[str, Sequence[float]] | None
) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """Return the axes that were given, checked."""
    if axes is None:
        axes = {"depth": (0.0,) if depths is None else depths}
    elif depths is not None or not axes:
        raise InputError("axes", list(axes), "one or more, with depths among them or left out")
    found = []
    for name, values in axes.items():
        if name not in DRIVE_AXES:
            raise InputError("axes", name, f"of {', '.join(DRIVE_AXES)}")
        which = "depths" if depths is not None else name
        read = tuple(checked_number(which, value, 0.0, DRIVE_AXES[name][1]) for value in values)
        if not read or any(b <= a for a, b in itertools.pairwise(read)):
            raise InputError(which, read[:4], "one or more values, rising")
        found.append((name, read))
    return tuple(found)


_Part = tuple[FloatArray, FloatArray, float, FloatArray]


def _parts(control: DriveControl) -> tuple[float, _Part, _Part]:
    """Return the integral gain, and both laws without it as (a, c, d, b)."""
    if control.speed.excess > 0:
        wanted = "a law that does not differentiate, such as one without compensated inertia"
        raise InputError("control", control.name, wanted)
    integral, rest = without_integral(control.speed)
    for law in (rest, control.torque):
        if law.poles.size and law.poles.real.max() >= -1e-9 * abs(law.poles).max():
            wanted = "a law whose poles decay, but for one integral of the speed"
            raise InputError("control", control.name, wanted)
    return integral, _part(rest), _part(control.torque)


def _part(law: Transfer) -> _Part:
    a, b, c, through = companion(law)
    return a, c, through, b


def _node(parts: tuple[float, _Part, _Part], order: int, step: float) -> DriveNode:
    """Return a law by the trapezoidal rule, filled up with states that stay zero."""
    integral, speed, torque = parts
    a, b = np.zeros((order, order)), np.zeros((order, 2))
    c, d = np.zeros(order), np.zeros(2)
    place = 0
    # What is ahead brakes, torque in the pipe helps.
    for which, sign, (own, row, through, column) in ((0, -1.0, speed), (1, 1.0, torque)):
        k = len(column)
        inside = slice(place, place + k)
        a[inside, inside], b[inside, which] = own, column
        c[inside], d[which] = sign * row, sign * through
        place += k
    # Unused states decay at once.
    for i in range(place, order):
        a[i, i] = -2.0 / step
    half = np.linalg.inv(np.eye(order) - 0.5 * step * a)
    F, G = half @ (np.eye(order) + 0.5 * step * a), step * half @ b
    C = c @ half
    E, D = np.asarray(-np.linalg.solve(a, b), float), d + 0.5 * step * C @ b
    return DriveNode(F, G, E, C, D, integral)
