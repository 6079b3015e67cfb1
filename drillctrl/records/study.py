"""What a recording says: swing, period, modes, time spent sticking, the drive, and the string."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.language import told_language
from drillctrl.base.text import finite_or_none
from drillctrl.drilling.rig import Rig
from drillctrl.records.downhole import (
    Downhole,
    Prepared,
    carried,
    drive_inertia,
    prepare,
)
from drillctrl.records.drive_seen import DriveSeen, drive_seen
from drillctrl.records.families import line_of
from drillctrl.records.findings import Findings, median
from drillctrl.records.fit_values import RecordFit
from drillctrl.records.fitting import fit_record
from drillctrl.records.peaks import Peak, spectral_modes
from drillctrl.records.record import Record
from drillctrl.records.surface import Carrier
from drillctrl.records.swings import (
    Period,
    Windows,
    period_of,
    quiet,
    sticking_share,
    swing_index,
    without_noise,
)
from drillctrl.strings.rig import StringRig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Steps of what is looked at, s: 20 Hz holds all that a string tells.
_STEP = 0.05
_STICKS = 0.02
_MODES_NEED = 120.0
# Up to which share of the sampling rate motion is seen, and how many lines of a swing a fit needs.
_SEEN, _FAST, _LINES = 0.4, 2.0, 4.0


class RecordStudy(Findings):
    """What a recording says.

    Attributes
    ----------
    record : Record
        As it was looked at.
    period : Period or None
        Of the swing; None where none keeps itself up.
    swing : float or None
        Stick-slip index of the bit, the median over windows; None where its speed is not known.
    swing_from : str or None
        ``"bit speed"`` measured, ``"surface"`` carried down.
    severity, torque_severity : Windows or None
        Index of the bit's speed and of the torque in windows of 20 s.
    sticking : float or None
        Share of the time in which the bit stands.
    modes : tuple of Peak
        Torsional modes.
    modes_from : str or None
        ``"fit"`` of a string, or peaks of the torque's ``"spectrum"``.
    bit : Downhole or None
        Carried down.
    string_from : str or None
        Which string carried: ``"fit"`` or ``"rig"``.
    fit : RecordFit or None
        The string that was fitted.
    drive : DriveSeen or None
        What the drive returns.
    measured_error : float or None
        Rms of carried less measured speed of the bit, rad/s, in the band.
    notes : tuple of str
        On the rows, the columns and what could not be told.
    computed : ComputedMap or None
        Runs over speed and weight, of `with_computed_map`.
    """

    def summary(self, units: str | None = None) -> str:
        """Return what there is to say, in lines of a terminal, in ``"si"`` or ``"field"`` units."""
        from drillctrl.records.words import record_summary

        return record_summary(self, told_language(units))

    def plot(self, units: str | None = None) -> Figure:
        """Draw it."""
        from drillctrl.records.overview import draw_study

        return draw_study(self, told_language(units))

    def to_html(self, units: str | None = None) -> str:
        """Return one page that needs nothing else."""
        from drillctrl.records.page import record_page

        return record_page(self, told_language(units))

    def save_bit(self, path: str | Path, units: str | None = None) -> None:
        """Write the bit's speed and torque over time to a CSV file.

        Raises
        ------
        InputError
            If they are not known, or the file does not end in .csv.
        """
        from drillctrl.records.saving import save_bit

        save_bit(self, path, told_language(units))


@checks_kinds
def study_record(
    record: Record,
    rig: Rig | None = None,
    *,
    torque_of: str | None = None,
    own_inertia: float | None = None,
    lag: float | None = None,
    fit: bool = True,
) -> RecordStudy:
    """Say what a recording shows.

    Parameters
    ----------
    record : Record
        Of `read_record`.
    rig : Rig, optional
        Whose string it is. Where the bit sticks it is scaled to fit; without one, a string of
        pipe and a disc is.
    torque_of : {"drive", "pipe"}, optional
        What was measured as torque; by default the drive's where its inertia is known.
    own_inertia : float, optional
        Of the drive, kg m², instead of the rig's.
    lag : float, optional
        By which the torque comes later than the speed, s; by default looked for in a fit, else 0.
    fit : bool
        Fit a string where the bit swings.

    Raises
    ------
    InputError
        If a parameter is not permitted.
    """
    if not isinstance(record, Record):
        raise InputError("record", type(record).__name__, "a Record")
    if rig is not None and not isinstance(rig, Rig):
        raise InputError("rig", type(rig).__name__, "a Rig")
    if lag is not None:
        checked_number("lag", lag, -1.0, 5.0)
    inertia = drive_inertia(record, rig, torque_of, own_inertia)
    record = record.slower(_STEP)
    notes = [*record.notes]
    values = record.values
    if torque_of is None and "torque" in values:
        whose = (
            f"drive's, of {inertia:.4g} kg·m²" if inertia else "pipe's: no drive's inertia is known"
        )
        notes.append(f"the torque was taken for the {whose}")
    name = "torque" if "torque" in values else "bit_speed"
    period = period_of(values[name], record.step, record.segments(name, shortest=10.0))
    surface = {"rotary_speed", "torque"} <= values.keys()
    seen = _SEEN / record.step
    if seen < _FAST:
        notes.append(
            f"at {1.0 / record.step:.3g} Hz nothing faster than {seen:.2g} Hz is seen: no mode, no "
            "wave, and of the bit's speed no more than what is slower"
        )
    if fit and period is not None and seen * period.value < _LINES:
        notes.append(
            f"no string was fitted: that takes {_LINES / _SEEN / period.value:.2g} Hz or more here"
        )
        fit = False
    found: RecordFit | None = None
    carrier: Carrier | None = None
    prepared: Prepared | None = None
    bit: Downhole | None = None
    string_from = None
    if surface and rig is not None:
        carrier, string_from = Carrier(line_of(rig), inertia, lag or 0.0), "rig"
    try:
        if surface and carrier is not None:
            prepared = prepare(record, carrier)
            bit = carried(record, carrier, prepared)
        sticks = bit is not None and sticking_share(bit.speed, bit.speed_error) > _STICKS
        if surface and fit and (period is not None or sticks):
            found = fit_record(record, rig, torque_of=torque_of, own_inertia=own_inertia, lag=lag)
            if found.identifiable:
                carrier, string_from = found.carrier, "fit"
                prepared = prepare(record, carrier)
                bit = carried(record, carrier, prepared)
    except InputError as error:
        notes.append(f"the bit's speed is not known from the surface: needs {error.permitted}")
    if surface and fit and period is None and found is None:
        notes.append("no string was fitted: the bit does not stick and slip")
    severity, swing, sticking, source = _severity(record, bit)
    modes, modes_from = _modes(record, found, period, sticking)
    drive = None
    if surface:
        drive = _drive(record, rig, found, inertia, lag, prepared)
    return RecordStudy(
        record=record,
        period=period,
        swing=swing,
        swing_from=source,
        severity=severity,
        torque_severity=swing_index(values["torque"], record.step) if "torque" in values else None,
        sticking=sticking,
        modes=modes,
        modes_from=modes_from,
        bit=bit,
        string_from=string_from if bit is not None else None,
        fit=found,
        drive=drive,
        measured_error=_measured_error(record, bit),
        notes=tuple(notes),
    )


def _severity(
    record: Record, bit: Downhole | None
) -> tuple[Windows | None, float | None, float | None, str | None]:
    if "bit_speed" in record.values:
        raw = record.values["bit_speed"]
        speed, source = quiet(raw, record.step), "bit speed"
        error = float(np.nanstd(raw - speed))
    elif bit is not None:
        speed, error, source = bit.speed, bit.speed_error, "surface"
    else:
        return None, None, None, None
    severity = swing_index(speed, record.step, least=0.5)
    if source == "surface" and bit is not None:
        severity = without_noise(severity, speed, bit.speed_error, bit.band)
    share = sticking_share(speed, error)
    return severity, median(severity.values), finite_or_none(share), source


def _modes(
    record: Record, found: RecordFit | None, period: Period | None, sticking: float | None
) -> tuple[tuple[Peak, ...], str | None]:
    if found is not None and found.identifiable:
        return found.modes, "fit"
    # Lines of a bit that sticks are no modes.
    slips = period is not None if sticking is None else sticking > _STICKS
    if slips or "torque" not in record.values:
        return (), None
    cuts = record.segments("torque", shortest=_MODES_NEED)
    if not cuts:
        return (), None
    torque = record.values["torque"]
    modes = tuple(spectral_modes([torque[cut] for cut in cuts], record.step))
    return modes, "spectrum" if modes else None


def _drive(
    record: Record,
    rig: Rig | None,
    found: RecordFit | None,
    inertia: float,
    lag: float | None,
    prepared: Prepared | None,
) -> DriveSeen | None:
    from drillctrl.records.downhole import record_spectra

    pipe = None
    if isinstance(rig, StringRig):
        pipe = rig.string.torsion.wave_impedance
    elif found is not None and found.identifiable:
        pipe = found.line.wave_impedance or None
    late = lag or 0.0
    if found is not None and found.identifiable:
        late = found.lag.value
    spectra = prepared.spectra if prepared is not None else record_spectra(record)
    if spectra is None:
        return None
    seen = drive_seen(spectra, inertia, late, pipe)
    return seen if seen.frequency.size else None


def _measured_error(record: Record, bit: Downhole | None) -> float | None:
    """Return by how much carried and measured speed of the bit differ, in the band."""
    if bit is None or "bit_speed" not in record.values:
        return None
    measured = quiet(record.values["bit_speed"], record.step)
    off = bit.speed - measured
    known = np.isfinite(off)
    return float(np.sqrt(np.mean(off[known] ** 2))) if known.any() else None
