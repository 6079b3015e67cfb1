"""A string fitted to a recording: effective stiffness and inertia, damping, and the bit's law."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.text import finite_or_none
from drillctrl.drilling.rig import Rig
from drillctrl.records.descent import LAW, Descent, descend
from drillctrl.records.downhole import (
    Prepared,
    carried,
    check_surface,
    drive_inertia,
    prepare,
    relative_weight,
)
from drillctrl.records.families import Family, family_of, unknown_family
from drillctrl.records.law import BitLaw
from drillctrl.records.peaks import Peak
from drillctrl.records.record import Record
from drillctrl.records.surface import Carrier
from drillctrl.records.swings import period_of
from drillctrl.strings.check import TORSIONAL_BAND, string_modes
from drillctrl.strings.line import Line

# Twice the standard error holds the truth in 95 of 100.
_TWICE = 2.0
# What is less well known than this is not known (95 %, relative).
_KNOWN = 0.25
_USED = 0.7
# Errors that no noise explains: edges of the band, a law that is not quite a bit's.
_SPEED_UNIT, _TORQUE_UNIT = 0.005, 0.01
_FIRST_MODES = 3
# Standard errors of the method itself on recordings of known rigs, beside those of noise: of
# logarithms, of the lag in s. A sharp corner of the law meets motion whose band ends.
_METHOD = {"damping": 0.1, "level": 0.04, "drop": 0.07, "decay": 0.08, "lag": 0.015}
_STRING_METHOD = 0.008
# Of a string of which nothing was known, pipe above a rigid disc.
_UNKNOWN_METHOD = {"damping": 0.3, "level": 0.08, "drop": 0.15, "decay": 0.2, "lag": 0.025}
_UNKNOWN_STRING = 0.015
# A misfit that noise does not explain: torque may come later than the first guess.
_POOR, _LATER = 1.2, 0.12


@dataclass(frozen=True)
class Estimate:
    """A number that was fitted.

    Attributes
    ----------
    value : float
        In SI units.
    low, high : float
        Its 95 % interval.
    """

    value: float
    low: float
    high: float

    @property
    def relative(self) -> float:
        """Half the interval over the value."""
        return (self.high - self.low) / (2.0 * self.value) if self.value else math.inf

    @property
    def known(self) -> bool:
        """Whether the record says it to a quarter."""
        return self.relative < _KNOWN

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        return {
            "value": self.value,
            "low": finite_or_none(self.low),
            "high": finite_or_none(self.high),
            "known": self.known,
        }


@dataclass(frozen=True, eq=False)
class RecordFit:
    """A string and a bit's law that were fitted to a recording.

    Attributes
    ----------
    stiffness, inertia : Estimate
        Effective: of the string lumped to one spring and one disc, N m/rad and kg m².
    damping : Estimate
        Viscous, over the inertia, 1/s.
    level, drop, decay : Estimate
        Of the bit's law, N m, N m and rad/s: level + drop · exp(−speed/decay). The level holds
        friction along the string as well.
    lag : Estimate
        By which the torque comes later than the speed, s; its interval may hold 0.
    factors : (float, float) or None
        Stiffness and inertia over those of the rig that was given.
    modes : tuple of Peak
        Of the fitted string, top held, bit free.
    line : Line
        The fitted string in torsion.
    drive_inertia : float
        That was taken from the torque, kg m².
    used, kept_back : (float, float)
        Parts of the record, s: for the fit, and to check it.
    misfit, misfit_kept_back : float
        Mean distance of the bit from its law in both, in units of what noise explains.
    identifiable : bool
        Whether stiffness and inertia are known to a quarter, and so the string.
    reasons : tuple of str
        What the record does not say, and why.
    """

    stiffness: Estimate
    inertia: Estimate
    damping: Estimate
    level: Estimate
    drop: Estimate
    decay: Estimate
    lag: Estimate
    factors: tuple[float, float] | None
    modes: tuple[Peak, ...]
    line: Line
    drive_inertia: float
    used: tuple[float, float]
    kept_back: tuple[float, float]
    misfit: float
    misfit_kept_back: float
    identifiable: bool
    reasons: tuple[str, ...]

    @property
    def law(self) -> BitLaw:
        """The bit's law."""
        return BitLaw(self.level.value, self.drop.value, self.decay.value)

    @property
    def carrier(self) -> Carrier:
        """What carries speed and torque down to the bit."""
        return Carrier(self.line, self.drive_inertia, self.lag.value)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        names = ("stiffness", "inertia", "damping", "level", "drop", "decay", "lag")
        return {
            **{name: getattr(self, name).to_dict() for name in names},
            "factors": None
            if self.factors is None
            else dict(zip(("stiffness", "inertia"), self.factors, strict=True)),
            "modes": [mode._asdict() for mode in self.modes],
            "identifiable": self.identifiable,
            "reasons": list(self.reasons),
            "used": list(self.used),
            "kept_back": list(self.kept_back),
            "misfit": self.misfit,
            "misfit_kept_back": finite_or_none(self.misfit_kept_back),
        }


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
    families = [family_of(rig)] if rig is not None else _unknown(first)
    best: tuple[Descent, Family, Prepared] | None = None
    for family in families:
        prepared = _floored(prepare(first, Carrier(family.line(family.start), inertia)), first)
        found = _descended(family, prepared, inertia, lag, first.step, None)
        if lag is None and found.cost > _POOR:
            later = _descended(family, prepared, inertia, lag, first.step, None, _LATER)
            found = later if later.cost < found.cost else found
        if best is None or found.cost < best[0].cost:
            best = found, family, prepared
    assert best is not None
    found, family, prepared = best
    found = _with_method(found, family, first, inertia, lag)
    return _told(record, end, found, family, prepared, inertia, lag, rig is not None)


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
        begin=begin,
    )


def _with_method(
    found: Descent, family: Family, record: Record, inertia: float, lag: float | None
) -> Descent:
    """Return a descent whose spread holds what a band narrower by a third changes as well."""
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
    method = [of_law.get(name, of_string) ** 2 for name in found.names]
    return replace(found, spread=found.spread + np.outer(moved, moved) + np.diag(method))


def _told(
    record: Record,
    end: float,
    found: Descent,
    family: Family,
    prepared: Prepared,
    inertia: float,
    lag: float | None,
    scaled: bool,
) -> RecordFit:
    count = len(family.names)

    def estimate(function: Callable[[FloatArray], float]) -> Estimate:
        value, error = found.told(function)
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
    damping = parameter("damping")
    carrier = Carrier(line(found.values), inertia, late.value)
    reasons = _reasons(found, family, stiffness, mass, damping, law)
    return RecordFit(
        stiffness=stiffness,
        inertia=mass,
        damping=damping,
        **law,
        lag=late,
        factors=(found.value("stiffness"), found.value("inertia")) if scaled else None,
        modes=_modes(found, line),
        line=carrier.line,
        drive_inertia=inertia,
        used=(0.0, end),
        kept_back=(end, record.duration),
        misfit=math.sqrt(found.cost),
        misfit_kept_back=_kept_back(record, end, carrier, found.law(), prepared),
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
        told.append("damping and the fall of the bit's torque change what is seen alike")
    unknown = [name for name, value in law.items() if not value.known]
    if unknown:
        told.append(f"of the bit's law {', '.join(unknown)} cannot be told at these speeds")
    return tuple(told)


def _modes(found: Descent, line: Callable[[FloatArray], Line]) -> tuple[Peak, ...]:
    made: dict[bytes, list[tuple[float, float]]] = {}

    def modes(values: FloatArray) -> list[tuple[float, float]]:
        key = values.tobytes()
        if key not in made:
            made[key] = [
                (mode.frequency, mode.damping_ratio)
                for mode in string_modes(line(values), "torsional", TORSIONAL_BAND)
            ]
        return made[key]

    peaks = []
    for i in range(min(_FIRST_MODES, len(modes(found.values)))):
        frequency, off = found.told(lambda v, i=i: modes(v)[i][0])  # type: ignore[misc]
        ratio, about = found.told(lambda v, i=i: modes(v)[i][1])  # type: ignore[misc]
        about = min(about, 1e3)
        peaks.append(Peak(frequency, _TWICE * off * frequency, ratio, _TWICE * about * ratio))
    return tuple(peaks)


def _kept_back(
    record: Record, end: float, carrier: Carrier, law: BitLaw, prepared: Prepared
) -> float:
    """Return the mean distance from the law in the part that was not used; NaN without one."""
    try:
        rest = record.part(end + record.step, record.duration)
        motion = carried(rest, carrier, prepare(rest, carrier, like=prepared))
    except InputError:
        return math.nan
    known = np.isfinite(motion.speed)
    weight = relative_weight(rest)
    torque = motion.torque if weight is None else motion.torque / weight
    off = law.distance(motion.speed[known], torque[known], prepared.units)
    # The loss of the fit, so that both can be compared.
    return math.sqrt(float(8.0 * (np.sqrt(1.0 + (off / 2.0) ** 2) - 1.0).mean()))
