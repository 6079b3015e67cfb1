"""A comparison as JSON fields and as CSV."""

from __future__ import annotations

import csv
import dataclasses
import io
from typing import TYPE_CHECKING, Any

from drillctrl.designs.fields import finite_or_none
from drillctrl.drilling.point import RigPoint

if TYPE_CHECKING:
    from drillctrl.studies.compare import Comparison, Row

CSV_COLUMNS = (
    "label",
    "structure",
    "designed",
    "stable",
    "spectral_abscissa",
    "decay_time",
    "stability_radius",
    "gain_margin",
    "gain_reduction",
    "phase_margin",
    "peak_sensitivity",
    "max_abs_u",
    "max_abs_x",
    "settling_time",
    "nonlinear_settling_time",
    "nonlinear_max_abs_u",
    "nonlinear_max_abs_x",
    "stick_fraction",
    "period",
    "status",
    "basin",
    "formation_change",
    "stable_area",
    "area_ratio",
)


def row_fields(row: Row) -> dict[str, Any]:
    """Return the fields of a row; what does not exist is None."""
    design, margins, linear, bent = row.design, row.margins, row.linear, row.nonlinear
    alpha = design.spectral_abscissa
    delays = design.delay_margin
    summary = None if bent is None else bent.run.summary
    return {
        "label": row.label,
        "structure": None if design.structure is None else design.structure.name,
        "K1": design.K1.ravel().tolist(),
        "K2": design.K2.ravel().tolist(),
        "designed": row.designed,
        "stable": design.stable,
        "spectral_abscissa": alpha,
        "decay_time": -1.0 / alpha if design.stable else None,
        "stability_radius": design.stability_radius.value,
        "delay_margin": None
        if delays is None
        else {"shorter": delays.shorter, "longer": finite_or_none(delays.longer)},
        "gain_margin": None if margins is None else finite_or_none(margins.gain_up),
        "gain_reduction": None if margins is None else margins.gain_down,
        "phase_margin": None if margins is None else finite_or_none(margins.phase),
        "peak_sensitivity": None if margins is None else margins.sensitivity,
        "max_abs_u": None if linear is None else linear.max_abs_u,
        "max_abs_x": None if linear is None else linear.max_abs_x,
        "settling_time": None if linear is None else linear.settling_time,
        "nonlinear_settling_time": None if bent is None else bent.settling_time,
        "nonlinear_max_abs_u": None if bent is None else bent.max_abs_u,
        "nonlinear_max_abs_x": None if bent is None else bent.max_abs_x,
        "stick_fraction": None if summary is None else summary.stick_fraction,
        "period": None if summary is None else summary.period,
        "status": None if bent is None else bent.run.status,
        "basin": row.basin,
        "formation_change": row.formation_change,
        "stable_area": None if row.chart is None else row.chart.stable_area,
        "area_ratio": row.area_ratio,
    }


def comparison_fields(comparison: Comparison) -> dict[str, Any]:
    """Return the JSON object of the command line."""
    given = comparison.point
    point = given.operating_point() if isinstance(given, RigPoint) else given
    return {
        "schema": "drillctrl/compare/1",
        "operating_point": {**dataclasses.asdict(point), "delay": point.delay},
        "sort": comparison.sort,
        "disturbance": dict(comparison.disturbance),
        "duration": comparison.duration,
        "rows": [row_fields(row) for row in comparison.rows],
        "elapsed_seconds": comparison.elapsed_seconds,
    }


def comparison_csv(comparison: Comparison) -> str:
    """Return a header and one line a candidate, gains last."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*CSV_COLUMNS, "delay_shorter", "delay_longer", "K1", "K2"])
    for row in comparison.rows:
        fields = row_fields(row)
        delays = fields["delay_margin"] or {"shorter": None, "longer": None}
        gains = (" ".join(repr(value) for value in fields[name]) for name in ("K1", "K2"))
        values = [fields[name] for name in CSV_COLUMNS]
        writer.writerow([*values, delays["shorter"], delays["longer"], *gains])
    return text.getvalue()
