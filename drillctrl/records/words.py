"""What a recording says, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.language import Language, Told
from drillctrl.base.text import set_out, wrapped

if TYPE_CHECKING:
    from drillctrl.records.findings import Findings
    from drillctrl.records.fit_values import Estimate, RecordFit
    from drillctrl.records.peaks import Peak

_RPM = 30.0 / np.pi
_FULL = 1.0


def record_summary(study: Findings, told: Language) -> str:
    """Return a summary in units as told: the answer, then what it rests on."""
    rows = [*record_rows(study, told), ("columns", ", ".join(columns_told(study)))]
    parts = [wrapped(verdict(study)), set_out(rows)]
    parts += [wrapped(f"note: {note}", 6) for note in study.notes]
    return "\n".join(parts)


def record_rows(study: Findings, told: Language) -> list[tuple[str, str]]:
    """Return labels and what there is to say of each."""
    rows = [("swing", _swing(study)), ("period", _period(study)), ("modes", _modes(study))]
    if study.bit is not None:
        rows.append(("bit from surface", _bit(study)))
    if study.drive is not None:
        rows.append(("drive", _drive(study, told)))
    if study.fit is not None:
        rows += _fit(study.fit, told)
    if study.computed is not None:
        rows.append(("computed map", _computed(study)))
    record = study.record
    span = f"{record.duration:.0f} s at {1.0 / record.step:.3g} Hz"
    rows.append(("record", f"{span}{'' if record.start is None else f', from {record.start}'}"))
    return rows


def verdict(study: Findings) -> str:
    """Return the first sentence: what the bit does."""
    if study.swing is None:
        if study.period is not None:
            return "The torque swings and keeps it up; the bit's own speed is not known."
        return "No swing keeps itself up; the bit's own speed is not known."
    if study.swing >= _FULL:
        share = study.sticking or 0.0
        return f"The bit sticks and slips: it stands {100.0 * share:.0f} % of the time."
    if study.swing > 0.5:
        return "The bit swings widely and comes close to sticking."
    return "The bit turns without sticking."


def columns_told(study: Findings) -> list[str]:
    """Return what was taken for what."""
    return [
        f"{taken.quantity} = {taken.column}{'' if taken.unit is None else f' in {taken.unit}'}"
        for taken in study.record.taken
    ]


def _swing(study: Findings) -> str:
    torque = None
    if study.torque_severity is not None:
        known = study.torque_severity.values
        known = known[np.isfinite(known)]
        torque = float(np.median(known)) if known.size else None
    of_torque = "" if torque is None else f"; of the torque itself {torque:.2f}"
    if study.swing is None:
        return f"of the bit unknown{of_torque}"
    source = {"surface": "carried down", "bit speed": "as measured"}[study.swing_from or "surface"]
    return f"SSI {study.swing:.2f} (bit speed {source}, windows of 20 s){of_torque}"


def _period(study: Findings) -> str:
    if study.period is None:
        return "none: nothing swings on for several periods"
    drift = study.period.drift
    return f"{study.period.value:.3f} s, drifting by {drift:+.2g} s an hour"


def _modes(study: Findings) -> str:
    if not study.modes:
        return "none can be told"
    source = {"fit": "of the fitted string", "spectrum": "peaks of the torque"}
    told = ", ".join(
        f"{mode.frequency:.4f} ± {mode.error:.4f} Hz" + _damped(mode) for mode in study.modes
    )
    return f"{told}, {source[study.modes_from or 'fit']}"


def _bit(study: Findings) -> str:
    bit = study.bit
    assert bit is not None
    string = {"fit": "the fitted string", "rig": "the rig's string"}[study.string_from or "rig"]
    told = (
        f"{_RPM * np.nanmin(bit.speed):.0f} to {_RPM * np.nanmax(bit.speed):.0f} rpm by {string}, "
        f"right to {bit.band:.2g} Hz and by noise to {_RPM * bit.speed_error:.2g} rpm"
    )
    if study.measured_error is not None:
        told += f"; off the measured one by {_RPM * study.measured_error:.2g} rpm rms"
    return told


def _drive(study: Findings, told: Language) -> str:
    seen = study.drive
    assert seen is not None
    span = f"from {seen.frequency[0]:.2g} to {seen.frequency[-1]:.2g} Hz"
    place = int(np.argmin(np.abs(seen.frequency - _first(study))))
    at = f"{seen.frequency[place]:.2g} Hz"
    reflection = seen.reflection
    size = abs(complex(seen.impedance[place]))
    if reflection is None:
        return f"impedance {told.text('impedance', size, 3)} at {at}, seen {span}"
    return f"returns {reflection[place]:.2f} of a wave at {at}, seen {span}"


def _computed(study: Findings) -> str:
    found = study.computed
    assert found is not None
    sticks = int(np.sum(found.outcomes == "stick-slip"))
    rows = [row for row in study.drilled() if row["weight_on_bit"] is not None]
    off = [
        abs(found.at(float(row["speed"] or 0.0), float(row["weight_on_bit"] or 0.0)) - row["swing"])
        for row in rows
        if row["swing"] is not None
    ]
    near = f"; off what was drilled by {np.nanmedian(off):.2f} in the median" if off else ""
    return f"{sticks} of {found.swing.size} runs from a kick stick and slip, {found.top}{near}"


def _first(study: Findings) -> float:
    if study.modes:
        return study.modes[0].frequency
    return 1.0 / study.period.value if study.period is not None else 0.2


def _fit(fit: RecordFit, told: Language) -> list[tuple[str, str]]:
    rows = [("fit", _fit_verdict(fit))]
    rows.append(("  stiffness", _estimate(fit.stiffness, told.units["torsional_stiffness"])))
    rows.append(("  inertia", _estimate(fit.inertia, told.units["inertia"])))
    rows.append(("  damping", _estimate(fit.damping, told.units["rate"])))
    law = (
        f"{_estimate(fit.level, told.units['torque'])} of a fast bit, "
        f"{_estimate(fit.drop, told.units['torque'])} more of a slow one, "
        f"over {_estimate(fit.decay, told.units['angular_rate'])}"
    )
    rows.append(("  bit's torque", law))
    rows.append(("  torque late by", f"{1e3 * fit.lag.value:.0f} ms"))
    return rows


def _fit_verdict(fit: RecordFit) -> str:
    begin, end = fit.used
    word = "a string was fitted" if fit.identifiable else "no string can be told"
    told = f"{word} from {begin:.0f} to {end:.0f} s"
    if np.isfinite(fit.misfit_kept_back):
        told += (
            f"; off by {fit.misfit:.2g} there and {fit.misfit_kept_back:.2g} in the rest, "
            "in units of noise"
        )
    return "; ".join([told, *fit.reasons])


def _damped(mode: Peak) -> str:
    known = mode.damping_error < mode.damping_ratio
    return f" ({100.0 * mode.damping_ratio:.1f} % damped)" if known else ""


def _estimate(value: Estimate, told: Told) -> str:
    unit, factor = told
    if not value.relative < 2.0:
        return f"unknown ({unit})"
    if not value.known:
        low, high = factor * value.low, factor * value.high
        return f"poorly known, {low:.3g} to {high:.3g} {unit}"
    return f"{factor * value.value:.4g} {unit} ± {100.0 * value.relative:.1f} %"
