"""What an exported controller is to do beside its law, checked."""

from __future__ import annotations

from typing import NamedTuple, TypedDict

from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.gain_units import rig_gain_units
from drillctrl.tables.grid import Grid

# What the status of a controller says, bit by bit.
STATUS_BITS = (
    ("OUTSIDE", 1, "the table vouches for no gains here: the last ones that it vouched for stand"),
    ("HELD", 2, "the sample was none: the last good one stands"),
    ("LOST", 4, "too many samples in a row were none"),
    ("FROZEN", 8, "too many samples in a row were equal"),
    ("CLOCK", 16, "the sample did not come a period after the one before, within half of it"),
    ("DELAY", 32, "the delay is longer than any of the table's"),
    ("SLOWED", 64, "the fastest change of u was met"),
    ("LIMITED", 128, "the limit of u was met"),
)
OUTSIDE = ("fade", "hold")
# A ring of samples longer than this fits no drive.
_DEEPEST = 1_000_000
_LONGEST = 1_000_000_000


class Options(TypedDict, total=False):
    """Settings of an exported controller that have a default.

    Attributes
    ----------
    ramp : int
        Samples over which the command goes from what it was before switch-on to its full
        size, 0 for none; by default as many as the longest delay has.
    outside : {"fade", "hold"}
        Where the table vouches for no gains the last ones that it vouched for stay; by default
        ("fade") they fade to zero, else ("hold") they stay at their full size.
    fade : int
        Samples of a fade, 0 for none; by default as many as the longest delay has.
    hold : int
        Samples that are none (no finite number, of no new instant) for which the last good one
        stands in; with the next one the command fades to zero. 3 by default.
    watchdog : int
        Equal samples of all outputs in a row after which the signals count as frozen and
        the command fades to zero. By default that is only reported, after those of the
        longest delay.
    rate_limit : float
        Fastest change of u, per unit of the period; by default any.
    release : int
        Samples over which the command falls to zero when it is switched off; by default at
        once.
    """

    ramp: int | None
    outside: str
    fade: int | None
    hold: int
    watchdog: int | None
    rate_limit: float | None
    release: int


class Settings(NamedTuple):
    """Checked settings of a controller, and what follows from them.

    Attributes
    ----------
    period, limit : float
        Sampling period and largest ``|u|``, in the units of the table.
    depth : int
        Samples that the ring holds: the longest delay, what is in between two, and the newest.
    ramp, fade : int
        As in `Options`, at least 1.
    hold, release : int
        As in `Options`.
    outside : str
        As in `Options`.
    frozen : int
        Equal samples after which the signals count as frozen, and
    watched : bool
        whether the command then fades.
    rate : float, optional
        Largest change of u from sample to sample.
    """

    period: float
    limit: float
    depth: int
    ramp: int
    fade: int
    hold: int
    outside: str
    frozen: int
    watched: bool
    rate: float | None
    release: int

    @property
    def fading(self) -> tuple[str, ...]:
        """Names of the bits of the status for which the command fades."""
        outside = ("OUTSIDE",) if self.outside == "fade" else ()
        return ("LOST", *outside, *(("FROZEN",) if self.watched else ()))


def checked_settings(
    grid: Grid,
    structure: FeedbackStructure,
    period: float,
    limit: float,
    options: Options,
) -> Settings:
    """Check what a controller is to be, for which no gains need be known.

    Parameters
    ----------
    grid, structure : Grid, FeedbackStructure
        Of the table.
    period, limit : float
        As for `export_c`.
    options : Options
        Those that are not the default.

    Raises
    ------
    InputError
        As `export_c` does.
    """
    step = checked_number("period", period, 0.0, 1e6, open_low=True)
    bound = checked_number("limit", limit, 0.0, 1e9, open_low=True)
    # The words go into comments, which other names might end.
    known = grid.plant.output_names
    if not set(structure.outputs) <= set(known):
        raise InputError("outputs", list(structure.outputs)[:4], f"of {', '.join(known)}")
    if len(structure.inputs) != 1:
        raise InputError("structure", structure.name, "one with a single input")
    if grid.rig is not None and rig_gain_units(structure, grid.plant, grid.rig) is None:
        raise InputError("structure", structure.name, "torque fed back from θ and θ'")
    longest = max(point.delay for point in grid.points)
    longest *= grid.rig.time_scale if grid.rig is not None else 1.0
    # A period that is tiny makes a number of samples that is none.
    if not longest / step < _DEEPEST:
        least = longest / _DEEPEST
        raise InputError("period", step, f"above {least:g}, for a delay of {longest:g}")
    whole = int(longest / step)

    def count(name: str, given: int | None, usual: int, low: int) -> int:
        return max(low, usual if given is None else checked_integer(name, given, 0, _LONGEST))

    outside = options.get("outside", "fade")
    if outside not in OUTSIDE:
        raise InputError("outside", outside, f"one of {', '.join(OUTSIDE)}")
    rate, watchdog = options.get("rate_limit"), options.get("watchdog")
    if rate is not None:
        rate = step * checked_number("rate_limit", rate, 0.0, 1e12, open_low=True)
    if watchdog is not None:
        checked_integer("watchdog", watchdog, 1, _LONGEST)
    return Settings(
        step,
        bound,
        whole + 3,
        count("ramp", options.get("ramp"), whole, 1),
        count("fade", options.get("fade"), whole, 1),
        count("hold", options.get("hold"), 3, 0),
        outside,
        max(whole, 1) if watchdog is None else watchdog,
        watchdog is not None,
        rate,
        count("release", options.get("release"), 0, 0),
    )
