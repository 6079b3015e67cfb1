"""`chart`: where a family of loops is stable, over any two of its parameters."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.errors import checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.charts.chains import Curve, curve_fields, stable_curves
from drillctrl.charts.plane import AxisLike, Plane, make_plane, plane_fields
from drillctrl.charts.plane_text import area_text, axis_range
from drillctrl.charts.regions import Region, label_regions
from drillctrl.charts.scan import ScanLine
from drillctrl.charts.scanners import choose_scanner, first_position
from drillctrl.charts.sweep import FIRST_LINES, sweep
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Where
from drillctrl.drilling.quantities import root_scales

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STRINGS, _NARROWEST = 33, 1e-3


@dataclass(frozen=True, eq=False)
class StabilityChart:
    """Where a loop is stable, over two parameters.

    Attributes
    ----------
    plane : Plane
        The family of loops and its two axes.
    level : float
        σ: a place counts as stable where no root lies right of Re s = σ.
    method : str
        ``"delay"``: crossings in closed form along ω0; ``"affine"``: along a parameter in
        which the characteristic equation is affine; ``"receptance"``: the same from the exact
        receptances of a string of pipe; ``"counting"``: roots counted at sample
        places, crossings by bisection.
    curves : tuple of Curve
        The boundary of the stable set, with the frequency of the crossing root.
    regions : tuple of Region
        Parts with the same number of roots right of the line, the largest first.
    stable_area, area_error : float
        In units of x times y, and an estimated bound of the error, ``undecided_area`` included.
    undecided_area : float
        Of the strip at the lowest rotary speeds in which no line lies.
    lines : tuple of ScanLine
        All lines that were scanned.
    rows : bool
        Whether lines are held at y and scanned along x.
    elapsed_seconds : float
        Wall time.
    """

    plane: Plane
    level: float
    method: str
    curves: tuple[Curve, ...]
    regions: tuple[Region, ...]
    stable_area: float
    area_error: float
    undecided_area: float
    lines: tuple[ScanLine, ...]
    rows: bool
    elapsed_seconds: float

    def unstable_roots(self, x: float, y: float) -> int | None:
        """Count the roots right of the line at one place, by the argument principle.

        None where a root lies too near the line to tell.
        """
        return self.plane.unstable_roots(x, y, self.level)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        return {
            "schema": "drillctrl/chart/1",
            **plane_fields(self.plane),
            "optimised": False,
            "level": self.level,
            "stable_area": self.stable_area,
            "stable_area_error": self.area_error,
            "undecided_area": self.undecided_area,
            "boundaries": [curve.points.tolist() for curve in self.curves],
            "boundary_details": [curve_fields(curve) for curve in self.curves],
            "regions": [dataclasses.asdict(region) for region in self.regions],
            "method": self.method,
            "elapsed_seconds": self.elapsed_seconds,
        }

    def summary(self) -> str:
        """Return a text for people."""
        plane = self.plane
        name = plane.name or "open loop"
        share = self.stable_area / (plane.x.span * plane.y.span)
        what = "Smooth drilling" if plane.case.drills else "The loop"
        lines = [
            f"{what} is stable on {share:.1%} of this chart: {name}",
            *(
                f"  {word:<9} {axis_range(plane, axis)}"
                for word, axis in (("over", plane.x), ("and", plane.y))
            ),
            f"  stable    {area_text(self.stable_area, self.area_error, plane)}",
        ]
        if self.level:
            lines.append(f"  meaning   all roots left of {self.level:g}")
        if self.undecided_area > 0.0:
            lines.append(
                f"  undecided {self.undecided_area:.4g} at the lowest rotary speeds, "
                "within the error"
            )
        frequencies = [curve.omega for curve in self.curves]
        if frequencies:
            factor, _, unit = root_scales(plane.case.told_rig)[1]
            omega = factor * np.concatenate(frequencies)
            lines.append(
                f"  boundary  {len(self.curves)} curve(s), frequencies {omega.min():.3g} "
                f"to {omega.max():.3g} {unit}".rstrip()
            )
        checked = [region for region in self.regions if region.confirmed is not None]
        agree = sum(bool(region.confirmed) for region in checked)
        lines.append(
            f"  checked   a count of roots without knowing them agrees in {agree} of "
            f"{len(checked)} regions"
        )
        return "\n".join(lines)

    def plot(self, ax: Axes | None = None, name: str | None = None) -> Axes:
        """Draw the chart, with the name of the rig in its title; see `plot_chart`."""
        from drillctrl.charts.figure import plot_chart

        return plot_chart(
            self.plane,
            self.lines,
            self.curves,
            self.regions,
            rows=self.rows,
            level=self.level,
            name=name,
            ax=ax,
        )

    def __repr__(self) -> str:
        x, y = self.plane.x, self.plane.y
        return (
            f"<StabilityChart {x.name} {x.low:g}:{x.high:g} × {y.name} {y.low:g}:{y.high:g}: "
            f"stable area {self.stable_area:.5g} ± {self.area_error:.1g}>"
        )


@checks_kinds
def chart(
    point: Where,
    x: AxisLike = ("omega0", 0.5, 25.0),
    y: AxisLike = ("delta0", 0.0, 15.0),
    structure: str | FeedbackStructure | None = None,
    K1: npt.ArrayLike | None = None,
    K2: npt.ArrayLike | None = None,
    *,
    level: float = 0.0,
    tolerance: float = 2e-4,
) -> StabilityChart:
    """Draw where a loop is stable, over two of its parameters.

    Parameters
    ----------
    point : OperatingPoint, RigPoint, DelaySystem or Case
        Supplies all parameters that are no axis; of a DelaySystem gains alone are axes.
    x, y : (name, low, high)
        A group (``"omega0"``, ``"delta0"``, ``"psi"``, ``"eta"``, ``"xi"``, ``"kappa"``,
        ``"damping"``), a gain (``"K1_1"``, …), and for a rig ``"speed"`` in rpm, ``"rop"``
        in m/h, ``"wob"`` in kN, ``"rock_strength"`` in MPa. ω0 may begin at 0, which itself
        is excluded.
    structure : str or FeedbackStructure, optional
        What is fed back; without it, the open loop.
    K1, K2 : array_like, optional
        Gains that are no axis.
    level : float
        σ: ask for all roots left of Re s = σ instead of 0, per unit of dimensionless time.
    tolerance : float
        Wanted relative error of the area.

    Returns
    -------
    StabilityChart
        Its boundaries lie on the exact curves; between scan lines they are straight.

    Raises
    ------
    InputError
        If axes, gains or limits are wrong.
    """
    began = time.perf_counter()
    plane = make_plane(point, x, y, structure, K1, K2)
    checked_number("level", level, -100.0, 100.0)
    checked_number("tolerance", tolerance, 1e-8, 0.1)
    method, rows, scanner = choose_scanner(plane, level)
    held, scanned = (plane.y, plane.x) if rows else (plane.x, plane.y)
    start = first_position(held)
    # Every line at a depth has a string of its own, which costs.
    usual = {"first": FIRST_LINES}
    lines = {"first": _STRINGS, "narrowest": _NARROWEST} if held.name == "depth" else usual
    result = sweep(scanner, start, held.high, tolerance=tolerance, **lines)
    curves = stable_curves(result.lines, rows=rows)
    regions = label_regions(plane, result.lines, level, rows=rows)
    # Nothing is known of the strip that holds no line.
    unseen = (start - held.low) * scanned.span
    if method == "counting":
        unseen += (first_position(scanned) - scanned.low) * held.span
    return StabilityChart(
        plane,
        level,
        method,
        tuple(curves),
        regions,
        result.area,
        result.area_error + unseen,
        unseen,
        result.lines,
        rows,
        time.perf_counter() - began,
    )
