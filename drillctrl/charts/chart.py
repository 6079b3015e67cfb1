"""`chart`: where a family of loops is stable, over any two of its parameters."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.errors import InputError, checked_number
from drillctrl.charts.affine_scan import affine_loops, scan_affine
from drillctrl.charts.axes import Axis, make_axis
from drillctrl.charts.chains import Curve, stable_curves
from drillctrl.charts.counting_scan import scan_counting
from drillctrl.charts.delay_scan import scan_rotary_speed
from drillctrl.charts.plane import Plane, check_plane
from drillctrl.charts.regions import Region, label_regions
from drillctrl.charts.scan import ScanLine, Scanner
from drillctrl.charts.sweep import sweep
from drillctrl.delay.structure import FeedbackStructure, gain_matrices, preset_structure
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.spectrum.characteristic import FloatArray
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.quasipolynomial import from_matrices

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AxisLike = Axis | Sequence[object]
_SHORTEST_DELAY_SHARE = 1e-3


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
        which the characteristic equation is affine; ``"counting"``: roots counted at sample
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
        return count_right_of(self.plane.system(x, y), self.level).count

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        from drillctrl.charts.export import chart_fields

        return chart_fields(self)

    def summary(self) -> str:
        """Return a text for people."""
        from drillctrl.charts.export import chart_summary

        return chart_summary(self)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the chart; see `drillctrl.charts.figure.plot_chart`."""
        from drillctrl.charts.figure import plot_chart

        return plot_chart(self, ax)

    def __repr__(self) -> str:
        x, y = self.plane.x, self.plane.y
        return (
            f"<StabilityChart {x.name} {x.low:g}:{x.high:g} × {y.name} {y.low:g}:{y.high:g}: "
            f"stable area {self.stable_area:.5g} ± {self.area_error:.1g}>"
        )


def make_plane(
    point: OperatingPoint | RigPoint,
    x: AxisLike,
    y: AxisLike,
    structure: str | FeedbackStructure | None,
    K1: npt.ArrayLike | None,
    K2: npt.ArrayLike | None,
) -> Plane:
    """Check what a chart is drawn over.

    Raises
    ------
    InputError
        If axes, structure and gains do not fit together.
    """
    if isinstance(point, RigPoint):
        where, rig_point = point.operating_point(), point
    elif isinstance(point, OperatingPoint):
        where, rig_point = point, None
    else:
        raise InputError("point", type(point).__name__, "an OperatingPoint or a RigPoint")
    chosen = preset_structure(structure) if isinstance(structure, str) else structure
    axes = [make_axis(axis, chosen, rig_point) for axis in (x, y)]
    if chosen is None:
        if K1 is not None or K2 is not None:
            raise InputError("structure", "(missing)", "given together with gains")
        now = past = np.zeros((0, 0))
    else:
        over = {axis.name for axis in axes}
        if K1 is None and not all(n in over for n in chosen.gain_names if n.startswith("K1")):
            raise InputError("K1", "(missing)", f"given for structure {chosen.name}")
        if K2 is None and not all(n in over for n in chosen.gain_names if n.startswith("K2")):
            raise InputError("K2", "(missing)", f"given for structure {chosen.name}")
        none = np.zeros(chosen.K1_lower.shape)
        now, past = gain_matrices(chosen, none if K1 is None else K1, none if K2 is None else K2)
    plane = Plane(where, rig_point, chosen, now, past, *axes)
    check_plane(plane)
    return plane


def _transposed(plane: Plane, rows: bool) -> Any:
    """Return matrices(position, along) for lines held at y (rows) or at x."""
    if rows:
        return lambda position, along: plane.matrices(along, position)
    return plane.matrices


def _is_affine(plane: Plane, held: Axis, scanned: Axis, *, rows: bool) -> bool:
    """Whether the characteristic function is affine in the scanned parameter."""
    if scanned.name in ("omega0", "speed"):
        return False
    matrices = _transposed(plane, rows)
    t = held.low + held.span * np.array([0.31, 0.83])
    tables = []
    for share in (0.0, 0.37, 1.0):
        loops = from_matrices(*matrices(t, np.full(2, scanned.low + share * scanned.span)))
        tables.append(np.pad(loops.coefficients, ((0, 0), (0, 0), (0, 4)))[:, :, :4])
    middle = tables[0] + 0.37 * (tables[2] - tables[0])
    return bool(np.abs(middle - tables[1]).max() <= 1e-9 * np.abs(tables[1]).max())


def choose_scanner(plane: Plane, level: float) -> tuple[str, bool, Scanner]:
    """Return the method, whether its lines are rows, and the scanner."""
    x, y = plane.x, plane.y
    if level == 0.0:
        for scanned, rows in ((x, True), (y, False)):
            if scanned.name == "omega0":
                return "delay", rows, _delay_scanner(plane, scanned, rows=rows)
    for scanned, held, rows in ((y, x, False), (x, y, True)):
        if _is_affine(plane, held, scanned, rows=rows):
            return "affine", rows, _affine_scanner(plane, scanned, level, rows=rows)
    return "counting", False, _counting_scanner(plane, level)


def _delay_scanner(plane: Plane, scanned: Axis, *, rows: bool) -> Scanner:
    matrices = _transposed(plane, rows)
    turn = 2.0 * np.pi / plane.point.blades

    def scan(positions: FloatArray) -> list[ScanLine]:
        loops = from_matrices(*matrices(positions, np.full(positions.size, scanned.high)))
        return scan_rotary_speed(loops, positions, scanned.low, scanned.high, turn)

    return scan


def _affine_scanner(plane: Plane, scanned: Axis, level: float, *, rows: bool) -> Scanner:
    matrices = _transposed(plane, rows)
    low, high = scanned.low, scanned.high

    def scan(positions: FloatArray) -> list[ScanLine]:
        ends = [matrices(positions, np.full(positions.size, end)) for end in (low, high)]
        loops = affine_loops(ends[0], ends[1], low, high, level)
        return scan_affine(loops, positions, low, high, level)

    return scan


def _counting_scanner(plane: Plane, level: float) -> Scanner:
    low, high = first_position(plane.y), plane.y.high

    def scan(positions: FloatArray) -> list[ScanLine]:
        return scan_counting(plane.matrices, positions, low, high, level)

    return scan


def first_position(axis: Axis) -> float:
    """Return where lines may begin: ω0 and the rotary speed exclude zero."""
    if axis.name in ("omega0", "speed") and axis.low == 0.0:
        return _SHORTEST_DELAY_SHARE * axis.high
    if axis.name == "rock_strength" and axis.low == 0.0:
        return 1e-9 * axis.high
    return axis.low


def chart(
    point: OperatingPoint | RigPoint,
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
    point : OperatingPoint or RigPoint
        Supplies all parameters that are no axis.
    x, y : (name, low, high)
        A group (``"omega0"``, ``"delta0"``, ``"psi"``, ``"eta"``, ``"xi"``, ``"kappa"``,
        ``"damping"``), a gain (``"K1_1"``, …), and for a rig ``"speed"`` in rpm, ``"rop"``
        in m/h, ``"rock_strength"`` in MPa. ω0 may begin at 0, which itself is excluded.
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
    result = sweep(scanner, start, held.high, tolerance=tolerance)
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
