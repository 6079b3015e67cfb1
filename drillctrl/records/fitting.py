"""A string fitted to a recording: effective stiffness and inertia, damping, and the bit's law."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.rig import Rig
from drillctrl.records.damping import damping_apart
from drillctrl.records.descent import LAW, Descent, descend, with_sharper_law
from drillctrl.records.downhole import (
    Prepared,
    carried,
    check_surface,
    drive_inertia,
    mean_weight,
    prepare,
    relative_weight,
)
from drillctrl.records.families import Family, families_of, unknown_family
from drillctrl.records.fit_values import Estimate, RecordFit
from drillctrl.records.law import BitLaw
from drillctrl.records.peaks import Peak
from drillctrl.records.record import Record
from drillctrl.records.surface import Carrier
from drillctrl.records.swings import period_of
from drillctrl.strings.line import Line

# Twice the standard error holds the truth in 95 of 100.
_TWICE = 2.0
_USED = 0.7
# Errors that no noise explains: edges of the band, a law that is not quite a bit's.
_SPEED_UNIT, _TORQUE_UNIT = 0.005, 0.01
_FIRST_MODES = 3
# The error of a logarithm that says that nothing is known.
_UNKNOWN = 10.0
# Distances from the law are averaged over so many seconds, of one disc on a spring over fewer.
_TOGETHER, _TOGETHER_SINGLE = 0.4, 0.1
# Standard errors of the method itself on recordings of known rigs, beside those of noise: of
# logarithms, of the lag in s. A sharp corner of the law meets motion whose band ends.
_METHOD = {"damping": 0.15, "level": 0.04, "drop": 0.07, "decay": 0.08, "lag": 0.015}
_STRING_METHOD = 0.008
# Slope of a bit's torque that the form of its law misses, as a share of the drop over the range
# of speeds: at the collars viscous damping does just the same as such a slope.
_MISSED_SLOPE = 0.04
# Of a string of which nothing was known, pipe above a rigid disc.
_UNKNOWN_METHOD = {"damping": 0.3, "level": 0.08, "drop": 0.15, "decay": 0.2, "lag": 0.025}
_UNKNOWN_STRING = 0.015
# Lags to begin at, s, and the steps after which the better one is told.
_SOONER, _LATER, _FEW, _MANY = 0.01, 0.12, 15, 60


@checks_kinds
def fit_record(
    record: Record,
    rig: Rig | None = None,
    *,
    torque_of: str | None = None,
    own_inertia: float | None = None,
    lag: float | None = None,
    used: float = _USED,
) -> RecordFit:
    """Fit a string to a recording in which the bit swings.

    Speed and torque are carried down a string; the one is looked for on which the bit obeys a
    law, standing still or turning against a torque that falls with speed and, where weight on
    bit is recorded, grows with that. Bounded least squares; intervals from the scatter over
    blocks of time, from what a narrower band changes, and from what the method itself was off on
    known rigs.

    Parameters
    ----------
    record : Record
        With rotary speed and torque.
    rig : Rig, optional
        What is scaled; without one uniform pipe above a disc is fitted, of which nothing needs
        to be known.
    torque_of : {"drive", "pipe"}, optional
        What was measured; by default the drive's torque where its inertia is known.
    own_inertia : float, optional
        Of the drive, kg m², instead of the rig's.
    lag : float, optional
        By which the torque comes later than the speed, s; by default it is looked for.
    used : float
        Share of the record that is used, 0.2 to 1; the rest checks the fit.

    Raises
    ------
    InputError
        If a column is missing, the record too short, nothing swings, or a parameter is not
        permitted.
    """
    if not isinstance(record, Record):
        raise InputError("record", type(record).__name__, "a Record")
    if rig is not None and not isinstance(rig, Rig):
        raise InputError("rig", type(rig).__name__, "a Rig")
    check_surface(record)
    share = checked_number("used", used, 0.2, 1.0)
    if lag is not None:
        checked_number("lag", lag, -1.0, 5.0)
    inertia = drive_inertia(record, rig, torque_of, own_inertia)
    end = share * record.duration
    first = record.part(0.0, end) if share < 1.0 else record
    for families in [_unknown(first)] if rig is None else families_of(rig):
        fit = _fitted(record, first, end, families, inertia, lag)
        if fit.identifiable:
            break
    return fit


def _fitted(
    record: Record,
    first: Record,
    end: float,
    families: list[Family],
    inertia: float,
    lag: float | None,
) -> RecordFit:
    """Return the best fit of some families."""
    best: tuple[Descent, Family, Prepared] | None = None
    for family in families:
        prepared = _floored(prepare(first, Carrier(family.line(family.start), inertia)), first)
        lags = (_SOONER, _LATER) if lag is None else (lag,)
        starts = [
            _descended(family, prepared, inertia, lag, first.step, None, late, _FEW)
            for late in lags
        ]
        found = min(starts, key=lambda each: each.cost)
        if best is None or found.cost < best[0].cost:
            best = found, family, prepared
    assert best is not None
    found, family, prepared = best
    found = _descended(family, prepared, inertia, lag, first.step, found.values)
    found = _with_method(found, family, first, inertia, lag, prepared)
    return _told(record, end, found, family, prepared, inertia, lag, mean_weight(first))


def _unknown(record: Record) -> list[Family]:
    """Return first guesses of a string of which nothing is known.

    While the bit stands the torque rises by the stiffness times the top's speed.
    """
    import scipy.signal

    cuts = record.segments("rotary_speed", "torque", shortest=20.0)
    torque, speed = record.values["torque"], record.values["rotary_speed"]
    swing = period_of(torque, record.step, cuts)
    if swing is None:
        raise InputError("record", record.source, "of a bit that swings, or given with its rig")
    cut = max(cuts, key=lambda where: where.stop - where.start)
    nyquist = 0.5 / record.step
    slow = scipy.signal.butter(2, min(3.0 / swing.value / nyquist, 0.9), output="sos")
    rises = np.gradient(scipy.signal.sosfiltfilt(slow, torque[cut]), record.step)
    stiffness = float(np.quantile(rises, 0.85) / speed[cut].mean())
    if not stiffness > 0.0:
        raise InputError("record", record.source, "of a torque that rises where the bit stands")
    found = []
    for share, faster in ((2.0, 1.2), (0.4, 1.4)):
        rate = 2.0 * math.pi * faster / swing.value
        found.append(unknown_family(stiffness, stiffness / rate**2, share))
    return found


def _floored(prepared: Prepared, record: Record) -> Prepared:
    speed = _SPEED_UNIT * float(np.nanmean(record.values["rotary_speed"]))
    torque = _TORQUE_UNIT * float(np.nanmean(np.abs(record.values["torque"])))
    units = max(prepared.units[0], speed), max(prepared.units[1], torque)
    return replace(prepared, units=units)


def _descended(
    family: Family,
    prepared: Prepared,
    inertia: float,
    lag: float | None,
    step: float,
    begin: FloatArray | None,
    late: float = 0.0,
    rounds: int = _MANY,
) -> Descent:
    return descend(
        family,
        prepared.stretches,
        prepared.units,
        inertia,
        lag=late if lag is None else lag,
        free_lag=lag is None,
        margin=prepared.margin,
        block=max(10, int(20.0 / step)),
        together=max(1, int((_TOGETHER_SINGLE if family.single else _TOGETHER) / step)),
        begin=begin,
        rounds=rounds,
    )


def _with_method(
    found: Descent,
    family: Family,
    record: Record,
    inertia: float,
    lag: float | None,
    wide: Prepared,
) -> Descent:
    """Return a descent with a sharper law, its spread with what a narrower band changes."""
    late = found.value("lag") if lag is None else lag
    carrier = Carrier(family.line(found.values[: len(family.names)].tolist()), inertia, late)
    narrow = _floored(prepare(record, carrier, narrower=0.67), record)
    other = _descended(family, narrow, inertia, lag, record.step, found.values)
    positive = slice(0, len(family.names) + len(LAW))
    moved = other.values - found.values
    moved[positive] = np.log(other.values[positive] / found.values[positive])
    of_law, of_string = _METHOD, _STRING_METHOD
    if family.base is None:
        of_law, of_string = _UNKNOWN_METHOD, _UNKNOWN_STRING
    spread = found.spread + np.outer(moved, moved)
    place = found.names.index("damping")
    apart = None if family.single else damping_apart(record, carrier, found.value("damping"))
    if apart is not None:
        found.values[place] = apart[0]
        spread[place], spread[:, place] = 0.0, 0.0
        spread[place, place] = apart[1] ** 2
    found = with_sharper_law(found, family, wide.stretches, wide.units, inertia, late, wide.margin)
    method = [of_law.get(name, of_string) ** 2 for name in found.names]
    if apart is None:
        fastest = 2.0 * float(np.nanmean(record.values["rotary_speed"]))
        inertia_below = family.effective(found.values.tolist())[1]
        slope = found.value("drop") / (fastest * found.value("damping") * inertia_below)
        method[place] += (_MISSED_SLOPE * slope) ** 2
    return replace(found, spread=spread + np.diag(method))


def _told(
    record: Record,
    end: float,
    found: Descent,
    family: Family,
    prepared: Prepared,
    inertia: float,
    lag: float | None,
    weight: float | None,
) -> RecordFit:
    count = len(family.names)

    def estimate(function: Callable[[FloatArray], float], free: bool = True) -> Estimate:
        value, error = found.told(function)
        error = min(error, _UNKNOWN) if free else _UNKNOWN
        return Estimate(value, value * math.exp(-_TWICE * error), value * math.exp(_TWICE * error))

    def line(values: FloatArray) -> Line:
        return family.line(values[:count].tolist())

    def parameter(name: str) -> Estimate:
        which = found.names.index(name)
        return estimate(lambda v: float(v[which]))

    law = {name: parameter(name) for name in LAW}
    if lag is None:
        error = _TWICE * math.sqrt(max(found.spread[-1, -1], 0.0))
        late = Estimate(found.value("lag"), found.value("lag") - error, found.value("lag") + error)
    else:
        late = Estimate(lag, lag, lag)
    stiffness = estimate(lambda v: family.effective(v.tolist())[0])
    mass = estimate(lambda v: family.effective(v.tolist())[1])
    place = family.names.index("damping")
    inside = 1.02 * family.low[place] < found.values[place] < 0.98 * family.high[place]
    # At a disc damping does just what a slope of the bit's torque does.
    damping = estimate(lambda v: float(v[place]), free=bool(inside and not family.single))
    carrier = Carrier(line(found.values), inertia, late.value)
    first = record.part(0.0, end)
    try:
        rest = record.part(end + record.step, record.duration)
    except InputError:
        rest = None
    reasons = _reasons(found, family, stiffness, mass, damping, law)
    return RecordFit(
        stiffness=stiffness,
        inertia=mass,
        damping=damping,
        **law,
        lag=late,
        factors=None
        if family.lumped is None
        else (stiffness.value / family.lumped[0], mass.value / family.lumped[1]),
        modes=_modes(found, family),
        line=carrier.line,
        drive_inertia=inertia,
        used=(0.0, end),
        kept_back=(end, record.duration),
        weight_on_bit=weight,
        misfit=_misfit(first, carrier, found.law(), prepared, weight),
        misfit_kept_back=_misfit(rest, carrier, found.law(), prepared, weight),
        identifiable=stiffness.known and mass.known and not _at_bound(found, family),
        reasons=reasons,
    )


def _at_bound(found: Descent, family: Family) -> bool:
    return any(
        not 1.02 * low < value < 0.98 * high
        for name, value, low, high in zip(
            family.names, found.values, family.low, family.high, strict=False
        )
        if name != "damping"
    )


def _reasons(
    found: Descent,
    family: Family,
    stiffness: Estimate,
    inertia: Estimate,
    damping: Estimate,
    law: dict[str, Estimate],
) -> tuple[str, ...]:
    told = []
    if _at_bound(found, family):
        told.append("the string ended at a bound: the record does not say what it is")
    if not (stiffness.known and inertia.known):
        told.append("stiffness and inertia change what is seen alike: the bit hardly swings")
    if not damping.known:
        limits = f" closer than from {damping.low:.2g} to {damping.high:.2g} 1/s"
        told.append(
            f"damping cannot be told{limits if damping.seen else ''}: the fall of the bit's torque "
            "changes what is seen alike"
        )
    unknown = [name for name, value in law.items() if not value.known]
    if unknown:
        told.append(f"of the bit's law {', '.join(unknown)} cannot be told at these speeds")
    return tuple(told)


def _modes(found: Descent, family: Family) -> tuple[Peak, ...]:
    made: dict[bytes, list[tuple[float, float]]] = {}

    def modes(values: FloatArray) -> list[tuple[float, float]]:
        key = values.tobytes()
        if key not in made:
            made[key] = family.modes(values[: len(family.names)].tolist())
        return made[key]

    peaks = []
    for i in range(min(_FIRST_MODES, len(modes(found.values)))):
        frequency, off = found.told(lambda v, i=i: modes(v)[i][0])  # type: ignore[misc]
        ratio, about = found.told(lambda v, i=i: modes(v)[i][1])  # type: ignore[misc]
        about = min(about, _UNKNOWN)
        peaks.append(Peak(frequency, _TWICE * off * frequency, ratio, _TWICE * about * ratio))
    return tuple(peaks)


def _misfit(
    record: Record | None,
    carrier: Carrier,
    law: BitLaw,
    prepared: Prepared,
    weight: float | None,
) -> float:
    """Return the mean distance of the bit from a law; NaN where it cannot be carried down."""
    if record is None:
        return math.nan
    try:
        motion = carried(record, carrier, prepare(record, carrier, like=prepared))
    except InputError:
        return math.nan
    known = np.isfinite(motion.speed)
    load = relative_weight(record, weight)
    torque = motion.torque if load is None else motion.torque / load
    off = law.distance(motion.speed[known], torque[known], prepared.units)
    # Far points count as in the fit.
    return math.sqrt(float(8.0 * (np.sqrt(1.0 + (off / 2.0) ** 2) - 1.0).mean()))
