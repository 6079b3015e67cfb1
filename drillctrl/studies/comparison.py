"""Candidates side by side: what was measured of each."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.tableio import csv_text
from drillctrl.base.text import finite_or_none
from drillctrl.designs.result import Analysis, Design
from drillctrl.drilling.case import Case
from drillctrl.drilling.gain_units import gain_texts
from drillctrl.drilling.point import OperatingPoint
from drillctrl.robustness.loop_margins import LoopMargins
from drillctrl.robustness.margins import DelayMargin, ParameterMargin
from drillctrl.robustness.radius import StabilityRadius
from drillctrl.robustness.transfer import frequency_grid, loop_transfer
from drillctrl.studies.comparison_text import (
    cells,
    comparison_text,
    headings,
    legend,
    sentences,
)
from drillctrl.studies.measures import Response

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.charts.chart import StabilityChart


OPEN_LOOP = "none"
# Whether a larger value is the better one.
SORTS = {
    "spectral_abscissa": False,
    "stability_radius": True,
    "delay_margin": True,
    "phase_margin": True,
    "peak_sensitivity": False,
    "max_abs_u": False,
    "max_abs_x": False,
    "settling_time": False,
    "basin": True,
    "stable_area": True,
    "formation_change": True,
}


def _largest_swing(result: Analysis) -> float | None:
    """Return the largest swing that trial runs end in; None where one breaks off."""
    swings = [trial.controlled.swing for trial in result.trials]
    known = [swing for swing in swings if swing is not None]
    return max(known) if known and len(known) == len(swings) else None


def _torsional_growth(result: Analysis) -> float | None:
    """Return the largest growth rate of torsional swings, of a design on the motion."""
    on_motion = result.on_motion if isinstance(result, Design) else None
    return None if on_motion is None else on_motion.growth


@dataclass(frozen=True, eq=False)
class Row:
    """One candidate and its measures; None stands for what does not exist.

    Attributes
    ----------
    label : str
        Its name in the table.
    result : Analysis
        Its gains and linear analysis.
    designed : bool
        Whether the gains were designed here.
    margins : LoopMargins or None
        Of a stable loop with one input.
    stability_radius : StabilityRadius
        Relative to the norms of the plant's matrices.
    delay_margin : DelayMargin or None
        Of a stable loop.
    point_margins : dict or None
        How wrong ψ, δ0 and ω0 may be; of a stable loop with feedback.
    linear, nonlinear : Response or None
        After the disturbance.
    basin : float or None
        Multiple of the disturbance that still settles; see `measures.basin`.
    chart : StabilityChart or None
        Where the same gains are stable.
    area_ratio : float or None
        Stable area over that of the open loop.
    """

    label: str
    result: Analysis
    designed: bool
    margins: LoopMargins | None
    stability_radius: StabilityRadius
    delay_margin: DelayMargin | None
    point_margins: dict[str, ParameterMargin] | None
    linear: Response | None
    nonlinear: Response | None
    basin: float | None
    chart: StabilityChart | None
    area_ratio: float | None

    @property
    def formation_change(self) -> float | None:
        """Smallest relative change of ψ, up or down, that destabilises; linear."""
        margins = self.point_margins
        return None if margins is None else min(margins["psi"].upper, -margins["psi"].lower)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of a row."""
        design, margins, linear, bent = self.result, self.margins, self.linear, self.nonlinear
        alpha = design.spectral_abscissa
        delays = self.delay_margin
        summary = None if bent is None else bent.run.summary
        return {
            "label": self.label,
            "structure": None if design.structure is None else design.structure.name,
            "K1": design.K1.ravel().tolist(),
            "K2": design.K2.ravel().tolist(),
            "designed": self.designed,
            "stable": design.stable,
            "largest_swing": _largest_swing(design),
            "torsional_growth": _torsional_growth(design),
            "spectral_abscissa": alpha,
            "decay_time": -1.0 / alpha if design.stable else None,
            "stability_radius": self.stability_radius.value,
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
            "basin": self.basin,
            "formation_change": self.formation_change,
            "stable_area": None if self.chart is None else self.chart.stable_area,
            "area_ratio": self.area_ratio,
            "recommended": design.recommended,
            "reason": None if design.structure is None else design.reason,
        }


@dataclass(frozen=True, eq=False)
class Comparison:
    """Candidates side by side.

    Attributes
    ----------
    case : Case
        What drills, and where they were compared.
    rows : tuple of Row
        Best first by ``sort``; those without the measure last.
    sort : str
        One of `SORTS`.
    disturbance : mapping
        What the responses follow: a perturbation of steady drilling at t = 0.
    duration : float
        Length of the simulations.
    elapsed_seconds : float
        Wall time.
    """

    case: Case
    rows: tuple[Row, ...]
    sort: str
    disturbance: Mapping[str, float]
    duration: float
    elapsed_seconds: float

    def summary(self) -> str:
        """Return the table and what better costs, for people."""

        pushed = ", ".join(f"{k} = {v:g}" for k, v in self.disturbance.items())
        plain = self.case.told_rig is not None and self.sort == "spectral_abscissa"
        by = "growth" if plain else self.sort
        head = f"At {self._point_text()}; disturbance {pushed}; by {by}"
        rows = [row.to_dict() for row in self.rows]
        return comparison_text(head, rows, self._gain_texts(), self.case)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        point = self._operating_point()
        return {
            "schema": "drillctrl/compare/1",
            "operating_point": {**dataclasses.asdict(point), "delay": point.delay},
            "sort": self.sort,
            "disturbance": dict(self.disturbance),
            "duration": self.duration,
            "rows": [row.to_dict() for row in self.rows],
            "elapsed_seconds": self.elapsed_seconds,
        }

    def to_csv(self) -> str:
        """Return one line a candidate."""
        lines = []
        for row in self.rows:
            fields = row.to_dict()
            delays = fields.pop("delay_margin") or {"shorter": None, "longer": None}
            gains = {name: " ".join(map(repr, fields.pop(name))) for name in ("K1", "K2")}
            lines.append(
                fields | {f"delay_{side}": value for side, value in delays.items()} | gains
            )
        return csv_text(lines[0], (line.values() for line in lines))

    def to_html(self) -> str:
        """Return one page with the table and the figures in it."""
        from drillctrl.studies.compare_page import comparison_page

        rows = [row.to_dict() for row in self.rows]
        designs = [row.result for row in self.rows]
        gains = self._gain_texts()
        return comparison_page(
            self.figures(),
            point=self._point_text(),
            sort=self.sort,
            disturbance=", ".join(f"{k} = {v:g}" for k, v in self.disturbance.items()),
            headings=headings(self.case),
            rows=[(row["label"], row["stable"], cells(row, self.case)) for row in rows],
            legend=legend(self.case),
            sentences=sentences(rows),
            gains=[
                (
                    row["label"],
                    ", ".join(design.structure.outputs),
                    gains[row["label"]]["K1"],
                    gains[row["label"]]["K2"],
                )
                for row, design in zip(rows, designs, strict=True)
                if design.structure is not None
            ],
        )

    def _operating_point(self) -> OperatingPoint:
        return self.case.physics("a comparison")[1]

    def _point_text(self) -> str:
        """Say where the candidates were compared."""
        point = self._operating_point()
        groups = f"ω0 = {point.omega0:.6g}, δ0 = {point.delta0:.6g}, ψ = {point.psi:.6g}"
        return groups if self.case.told_rig is None else self.case.place

    def _gain_texts(self) -> dict[str, dict[str, str]]:
        """Return K1 and K2 by label, in a rig's units where there is one."""
        texts: dict[str, dict[str, str]] = {}
        for row in self.rows:
            found, case = row.result, self.case
            if found.structure is not None:
                texts[row.label] = {
                    name: ", ".join(
                        text
                        for line in gain_texts(
                            found.structure, gains, case.plant, case.told_rig, case.language
                        )
                        for text in line
                    )
                    for name, gains in (("K1", found.K1), ("K2", found.K2))
                }
        return texts

    def figures(self) -> list[tuple[str, Axes]]:
        """Draw charts, motions, Nyquist curves and roots; return each with its title."""
        from drillctrl.studies import compare_figure as figure

        rig = self.case.told_rig
        fed = [row for row in self.rows if row.result.structure is not None]
        looks = figure.looks([row.label for row in fed])
        shown = [row for row in self.rows if row.label in looks]
        stable = [row for row in shown if row.result.stable]
        linear = {row.label: row.linear for row in stable if row.linear is not None}
        bent = {row.label: row.nonlinear for row in stable if row.nonlinear is not None}
        loops = {row.label: _loop(row.result) for row in shown if row.margins is not None}
        roots = {
            row.label: np.array([root.value for root in row.result.loop.dominant_roots])
            for row in self.rows[: figure.SHOWN + 1]
        }
        charted = [*shown[: figure.SHOWN - 1], *(row for row in self.rows if row not in fed)]
        charts = {row.label: row.chart for row in charted if row.chart is not None}
        drawn = [("Stability charts", figure.plot_areas(charts))] if charts else []
        return [
            *drawn,
            (
                "Linear axial motion",
                figure.plot_responses(linear, looks, self.case, "x", model="linear"),
            ),
            ("Axial motion", figure.plot_responses(bent, looks, self.case, "x")),
            ("Control", figure.plot_responses(bent, looks, self.case, "torque")),
            ("Nyquist curves", figure.plot_nyquist(loops, looks)),
            ("Dominant roots", figure.plot_dominant_roots(roots, looks, rig=rig)),
        ]

    def __repr__(self) -> str:
        names = ", ".join(row.label for row in self.rows)
        return f"<Comparison of {names}, by {self.sort}>"


def _loop(design: Analysis) -> ComplexArray:
    """Return L(iω) of a loop with one input, over frequencies that resolve it."""
    assert design.structure is not None
    structure, K1, K2 = design.structure, design.K1, design.K2

    def transfer(omega: FloatArray) -> ComplexArray:
        return np.asarray(loop_transfer(design.plant, structure, K1, K2, omega)[0, 0])

    return transfer(frequency_grid(design.system(), response=transfer))
