"""Speed and torque of the bit from what the surface records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.rig import Rig
from drillctrl.records.families import line_of, lump_frequency
from drillctrl.records.record import Record
from drillctrl.records.surface import (
    Carrier,
    Spectra,
    Stretch,
    best_highest,
    surface_spectra,
    transformed,
)
from drillctrl.strings.rig import StringRig

# Stretches shorter than this are not carried down, s; spectra are of pieces of so much.
_SHORTEST, _PIECE = 60.0, 40.0
# A piece of fewer samples is no motion.
_FEWEST = 16
# Weight on bit is taken over so many seconds, and as at least so much of its mean.
_SMOOTH, _LEAST_WEIGHT, _MOST_MISSING = 5.0, 0.1, 0.2
# A disc on a spring stands for a string up to so many times its frequency, where a second mode is.
_LUMP = 4.0
TORQUE_OF = ("drive", "pipe")


@dataclass(frozen=True, eq=False)
class Downhole:
    """Motion of the bit, carried down from the surface.

    Attributes
    ----------
    time, speed, torque : array, (k,)
        s, rad/s and N m, NaN where they cannot be known. The torque holds what friction along
        the string takes as well.
    band : float
        Hz, up to which they are right; faster motion is left out.
    speed_error, torque_error : float
        Standard errors by the noise of the measurements, rad/s and N m.
    """

    time: FloatArray
    speed: FloatArray
    torque: FloatArray
    band: float
    speed_error: float
    torque_error: float


@dataclass(frozen=True, eq=False)
class Prepared:
    """A recording ready to be carried down any string.

    Attributes
    ----------
    spectra : Spectra
        Of torque and speed.
    stretches : tuple of Stretch
        Without gaps.
    highest : float
        Hz, the end of the band.
    units : (float, float)
        Standard errors of speed and torque at the bit.
    margin : int
        Samples at the ends of a stretch that are not known.
    """

    spectra: Spectra
    stretches: tuple[Stretch, ...]
    highest: float
    units: tuple[float, float]
    margin: int


def drive_inertia(
    record: Record, rig: Rig | None, torque_of: str | None, own: float | None
) -> float:
    """Return the inertia between the measured torque and the pipe's, kg m².

    Parameters
    ----------
    record : Record
        The recording.
    rig : Rig or None
        Its drive's is taken.
    torque_of : {"drive", "pipe"}, optional
        What is measured; by default the drive's torque where an inertia is known.
    own : float, optional
        Given by the user, kg m².

    Raises
    ------
    InputError
        If the drive's torque is measured and nothing says its inertia.
    """
    if torque_of is not None and torque_of not in TORQUE_OF:
        raise InputError("torque_of", torque_of, f"one of {', '.join(TORQUE_OF)}")
    machine = rig.drive if isinstance(rig, StringRig) else None
    known = machine.inertia if machine is not None else None
    if own is not None:
        known = checked_number("drive_inertia", own, 0.0, 1e9)
    if torque_of == "pipe":
        return 0.0
    if torque_of == "drive" and known is None:
        raise InputError("torque_of", torque_of, "pipe, or the drive's inertia known")
    return known or 0.0


def prepare(
    record: Record, carrier: Carrier, *, narrower: float = 1.0, like: Prepared | None = None
) -> Prepared:
    """Return what of a recording can be carried down.

    Parameters
    ----------
    record : Record
        With rotary speed and torque.
    carrier : Carrier
        A string like the one it will be: it says where noise begins to outweigh the motion.
    narrower : float
        Times the band that follows from that.
    like : Prepared, optional
        Whose spectra and band are taken.

    Raises
    ------
    InputError
        If no stretch without gaps lasts a minute, or both do not move.
    """
    transit = carrier.line.transit_time
    shortest = max(_SHORTEST, 20.0 * transit)
    cuts = record.segments("rotary_speed", "torque", shortest=shortest)
    if not cuts:
        raise InputError("record", record.source, f"without gaps for at least {shortest:.0f} s")
    speed, torque = record.values["rotary_speed"], record.values["torque"]
    if like is None:
        found = record_spectra(record)
        if found is None:
            raise InputError(
                "record", record.source, "of a speed and a torque that move, seen often"
            )
        spectra = found
        highest = narrower * best_highest(carrier, spectra, record.step)
        lump = lump_frequency(carrier.line)
        if lump is not None:
            highest = min(highest, _LUMP * lump)
    else:
        spectra, highest = like.spectra, like.highest
    weight = relative_weight(record, mean_weight(record))
    reach = 20.0 + 4.0 * transit
    stretches = tuple(
        transformed(speed, torque, cut, record.step, spectra, reach, highest, weight)
        for cut in cuts
    )
    error, _ = carrier.spread(spectra, highest)
    about = np.sqrt(error.sum(axis=0) * spectra.frequency[1])
    margin = int((2.0 * transit + 2.0) / record.step)
    return Prepared(spectra, stretches, highest, (float(about[0]), float(about[1])), margin)


def mean_weight(record: Record) -> float | None:
    """Return the mean weight on bit, N; None where it is not known well enough to be used."""
    weight = record.values.get("weight_on_bit")
    if weight is None or np.isnan(weight).mean() > _MOST_MISSING or not np.nanmean(weight) > 0.0:
        return None
    return float(np.nanmean(weight))


def relative_weight(record: Record, reference: float | None) -> FloatArray | None:
    """Return weight on bit over a reference, over some seconds; None without either."""
    from scipy.ndimage import uniform_filter1d

    if reference is None or mean_weight(record) is None:
        return None
    weight = record.values["weight_on_bit"]
    known = np.flatnonzero(np.isfinite(weight))
    filled = np.interp(np.arange(weight.size), known, weight[known])
    smooth = uniform_filter1d(filled, max(1, int(_SMOOTH / record.step)), mode="nearest")
    # Off bottom there is no law to obey.
    return np.asarray(np.maximum(smooth / reference, _LEAST_WEIGHT))


def record_spectra(record: Record) -> Spectra | None:
    """Return the spectra of top speed and torque; None where no stretch lasts a minute."""
    cuts = record.segments("rotary_speed", "torque", shortest=_SHORTEST)
    speed, torque = record.values["rotary_speed"], record.values["torque"]
    slow = record.step > _PIECE / _FEWEST
    if slow or not cuts or not (np.nanstd(speed) > 0.0 and np.nanstd(torque) > 0.0):
        return None
    pieces = [speed[cut] for cut in cuts], [torque[cut] for cut in cuts]
    return surface_spectra(*pieces, record.step, _PIECE)


def carried(record: Record, carrier: Carrier, prepared: Prepared) -> Downhole:
    """Return speed and torque of the bit on one string."""
    size = record.values["torque"].size
    speed, torque = np.full(size, np.nan), np.full(size, np.nan)
    for stretch in prepared.stretches:
        where = stretch.where
        inner = slice(where.start + prepared.margin, where.stop - prepared.margin)
        found = carrier.at_bit(stretch)
        cut = slice(prepared.margin, where.stop - where.start - prepared.margin)
        speed[inner], torque[inner] = (data[cut] for data in found)
    error, _ = carrier.spread(prepared.spectra, prepared.highest)
    about = np.sqrt(error.sum(axis=0) * prepared.spectra.frequency[1])
    return Downhole(record.time, speed, torque, prepared.highest, float(about[0]), float(about[1]))


def check_surface(record: Record, needed: Sequence[str] = ("rotary_speed", "torque")) -> None:
    """Raise `InputError` where a recording lacks what a string carries down."""
    for name in needed:
        if name not in record.values:
            raise InputError("record", record.source, f"with a column of {name}")


@checks_kinds
def bit_from_surface(
    record: Record,
    rig: Rig,
    *,
    torque_of: str | None = None,
    lag: float = 0.0,
) -> Downhole:
    """Return speed and torque of the bit from rotary speed and torque at the surface.

    The string's exact transfer matrix carries both down; what noise outweighs is left out.

    Parameters
    ----------
    record : Record
        With rotary speed and torque.
    rig : Rig
        With a string, or lumped.
    torque_of : {"drive", "pipe"}, optional
        What was measured: the drive's torque, from which that of its inertia is taken, or the
        pipe's. By default the drive's where the rig has one.
    lag : float
        By which the torque comes later than the speed, s.

    Raises
    ------
    InputError
        If a column is missing, the record too short, or a parameter not permitted.
    """
    if not isinstance(record, Record):
        raise InputError("record", type(record).__name__, "a Record")
    if not isinstance(rig, Rig):
        raise InputError("rig", type(rig).__name__, "a Rig")
    check_surface(record)
    checked_number("lag", lag, -1.0, 5.0)
    carrier = Carrier(line_of(rig), drive_inertia(record, rig, torque_of, None), lag)
    return carried(record, carrier, prepare(record, carrier))
