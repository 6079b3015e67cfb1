"""The figures that go with a recording, laid out."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.figure import new_axes, new_figure
from drillctrl.base.language import Language
from drillctrl.records import figure as drawing
from drillctrl.records.downhole import mean_weight, relative_weight
from drillctrl.records.peaks import spectral_density

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from drillctrl.records.findings import Findings

# Of the motion, so much is drawn: some swings can be told apart.
_PERIODS, _LEAST = 8.0, 40.0
_MOST_POINTS = 4000
_LAW = "The bit's torque over its speed"
_AT_MEAN = "The bit's torque over its speed, at the mean weight"


def study_figures(study: Findings, told: Language) -> list[tuple[str, Callable[[Axes], None]]]:
    """Return titles and what draws each figure on Axes, in units as told."""
    found: list[tuple[str, Callable[[Axes], None]]] = []
    record, values = study.record, study.record.values
    near = _excerpt(study)
    time = record.time[near]
    bit = study.bit

    def speeds(ax: Axes) -> None:
        drawing.plot_motion(
            ax,
            time,
            _cut(values.get("rotary_speed"), near),
            None if bit is None else bit.speed[near],
            _cut(values.get("bit_speed"), near),
        )

    found.append(("Speeds in the middle of the record", speeds))
    if "torque" in values:
        torque = values["torque"]
        carried = None if bit is None else bit.torque[near]
        found.append(
            (
                "Torque in the middle of the record",
                lambda ax: drawing.plot_torque(ax, time, torque[near], carried, told),
            )
        )
    severity, name = study.severity, "stick-slip index of the bit"
    if severity is None:
        severity, name = study.torque_severity, "swing index of the torque"
    if severity is not None:
        windows = severity
        found.append(
            (
                "Severity over the record",
                lambda ax: drawing.plot_severity(ax, windows.times, windows.values, name),
            )
        )
    if study.period is not None:
        period = study.period
        found.append(
            (
                "Period of the swing",
                lambda ax: drawing.plot_period(ax, period.times, period.values),
            )
        )
    spectrum = _spectrum(study, told)
    if spectrum is not None:
        found.append(("Spectrum of the torque", spectrum))
    if study.drive is not None:
        seen = study.drive
        found.append(
            (
                "What the drive returns",
                lambda ax: drawing.plot_drive(
                    ax, seen.frequency, np.abs(seen.impedance), seen.reflection, told
                ),
            )
        )
    drilled = _drilled(study, told)
    if drilled is not None:
        computed = "" if study.computed is None else f" (dots), and computed, {study.computed.top}"
        found.append((f"What was drilled{computed}", drilled))
    if bit is not None:
        found.append((_LAW if _reference(study) is None else _AT_MEAN, _law(study, told)))
    return found


def draw_study(study: Findings, told: Language) -> Figure:
    """Draw all figures of a recording on one sheet."""
    figures = study_figures(study, told)
    rows = (len(figures) + 1) // 2
    sheet = new_figure(12.0, 3.2 * rows)
    grid = sheet.subplots(rows, 2, squeeze=False)
    for ax, (title, draw) in zip(grid.ravel(), figures, strict=False):
        draw(ax)
        ax.set_title(title, fontsize="medium")
    for ax in grid.ravel()[len(figures) :]:
        ax.set_axis_off()
    return sheet


def separate_figures(study: Findings, told: Language) -> list[tuple[str, Axes]]:
    """Return titles and figures, each its own."""
    made = []
    for title, draw in study_figures(study, told):
        ax = new_axes(6.4, 3.4)
        draw(ax)
        ax.set_title(title, fontsize="medium")
        made.append((title, ax))
    return made


def _cut(data: FloatArray | None, near: slice) -> FloatArray | None:
    return None if data is None else data[near]


def _excerpt(study: Findings) -> slice:
    record = study.record
    length = _LEAST if study.period is None else max(_LEAST, _PERIODS * study.period.value)
    middle = 0.5 * record.duration
    begin = max(0, int((middle - 0.5 * length) / record.step))
    return slice(begin, begin + max(2, int(length / record.step)))


def _spectrum(study: Findings, told: Language) -> Callable[[Axes], None] | None:
    record = study.record
    if "torque" not in record.values:
        return None
    cuts = record.segments("torque", shortest=60.0)
    if not cuts:
        return None
    pieces = [record.values["torque"][cut] for cut in cuts]
    frequency, density, _ = spectral_density(pieces, record.step)
    modes = [(mode.frequency, mode.error) for mode in study.modes]
    period = None if study.period is None else study.period.value
    return lambda ax: drawing.plot_spectrum(ax, frequency, density, modes, period, told)


def _drilled(study: Findings, told: Language) -> Callable[[Axes], None] | None:
    rows = [row for row in study.drilled() if row["weight_on_bit"] is not None]
    if not rows:
        return None
    speed, weight, swing = (
        np.array([row[name] for row in rows], dtype=float)
        for name in ("speed", "weight_on_bit", "swing")
    )
    runs = study.computed
    below = None if runs is None else (runs.speeds, runs.weights, runs.swing)
    return lambda ax: drawing.plot_drilled(ax, speed, weight, swing, below, told)


def _reference(study: Findings) -> float | None:
    """Return the weight that the law is drawn for, N."""
    fit = study.fit
    return mean_weight(study.record) if fit is None else fit.weight_on_bit


def _law(study: Findings, told: Language) -> Callable[[Axes], None]:
    bit = study.bit
    assert bit is not None
    known = np.flatnonzero(np.isfinite(bit.speed))
    known = known[:: max(1, known.size // _MOST_POINTS)]
    weight = relative_weight(study.record, _reference(study))
    torque = bit.torque if weight is None else bit.torque / weight
    speed, torque = bit.speed[known], torque[known]
    law = None
    if study.fit is not None and study.string_from == "fit":
        over = np.linspace(0.0, max(float(speed.max()), 1.0), 200)
        law = over, study.fit.law.torque(over)
    return lambda ax: drawing.plot_law(ax, speed, torque, law, told)
