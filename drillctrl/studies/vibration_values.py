"""What is known over a vibration map, and the table and fields that hold it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.charts.plane import Plane
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.status import Outcome
from drillctrl.strings.drive_laws import DriveLaws
from drillctrl.studies.lattice import Cell, Node, fine_shape
from drillctrl.studies.tasks import Closing
from drillctrl.studies.vibration_point import QUANTITIES
from drillctrl.studies.vibration_threshold import TorsionalField
from drillctrl.tables.gain_table import GainTable


@dataclass(frozen=True, eq=False)
class Severity:
    """How hard the bit vibrates at each point: the worst of all starts.

    Attributes
    ----------
    outcomes : str array, (q,)
        What becomes of the start that ends worst; words as in `Outcome`.
    starts : str array, (q,)
        Which start that is.
    swing : array, (q,)
        Stick-slip index, (max − min)/(2 mean) of the bit's speed. This and what follows is NaN
        where a start ends before it can be measured.
    stick_fraction, off_rock_fraction : array, (q,)
        Share of the time in torsional stick, and off the rock.
    feed : array, (q,)
        Rate of penetration over that of the top end.
    weight_ratio : array, (q,)
        Mean weight on bit over that of steady drilling.
    spectral_abscissa : array, (q,)
        α of the linear loop with an ideal controller; NaN where it could not be told.
    boundary : tuple of array, (k, 2), or None
        Where linear theory has the edge of stable drilling; None where only α is known.
    """

    outcomes: npt.NDArray[np.str_]
    starts: npt.NDArray[np.str_]
    swing: FloatArray
    stick_fraction: FloatArray
    off_rock_fraction: FloatArray
    feed: FloatArray
    weight_ratio: FloatArray
    spectral_abscissa: FloatArray
    boundary: tuple[FloatArray, ...] | None

    def columns(self) -> dict[str, list[Any]]:
        """Return the entries of each point by name; None for no number."""
        numbers = (*QUANTITIES, "spectral_abscissa")
        columns: dict[str, list[Any]] = {"outcome": self.outcomes.tolist()}
        for name in numbers:
            values = getattr(self, name).tolist()
            columns[name] = [value if np.isfinite(value) else None for value in values]
        return {**columns, "start": self.starts.tolist()}

    def counts(self) -> dict[str, int]:
        """Return at how many points each outcome is the worst, from the mildest on."""
        found = self.outcomes.tolist()
        return {str(o): found.count(o) for o in sorted(Outcome, key=lambda o: o.severity)}


@dataclass(frozen=True, eq=False)
class MapValues:
    """What becomes of the bit over two parameters, without control and with it.

    Attributes
    ----------
    plane : Plane
        The two parameters, and all that is fixed.
    counts : (int, int)
        Points along each axis before refinement.
    refine : int
        How often the spacing was halved where the outcome changes.
    starts : tuple of str
        Where the runs begin.
    nodes : tuple of (int, int)
        Places of the points on the finest lattice.
    cells : tuple of Cell
        Squares between them.
    uncontrolled : Severity
        Without control, or with what the controller is held against.
    controlled : Severity or None
        With the controller, if one was given.
    controller, against : Controller, GainTable, DriveLaws or None
        Which.
    threshold : TorsionalField or None
        Where torsion has damping left, if it was asked for.
    marked : (float, float) or None
        The operating point on the axes.
    elapsed_seconds : float
        Wall time.
    """

    plane: Plane
    counts: tuple[int, int]
    refine: int
    starts: tuple[str, ...]
    nodes: tuple[Node, ...]
    cells: tuple[Cell, ...]
    uncontrolled: Severity
    controlled: Severity | None
    controller: Closing
    against: Closing
    threshold: TorsionalField | None
    marked: tuple[float, float] | None
    elapsed_seconds: float

    @property
    def shape(self) -> tuple[int, int]:
        """Of the finest lattice."""
        return fine_shape(self.counts, self.refine)

    @property
    def points(self) -> FloatArray:
        """Values on the axes of all points, in the axes' units, (q, 2)."""
        places = np.array(self.nodes, dtype=float) / (np.array(self.shape) - 1)
        low = np.array([self.plane.x.low, self.plane.y.low])
        return np.asarray(low + places * np.array([self.plane.x.span, self.plane.y.span]))

    @property
    def structure(self) -> str | None:
        """Name of what closes the loop."""
        return closing_name(self.controller)

    @property
    def first(self) -> str:
        """What the first column is called in tables: without control, or against another."""
        return "uncontrolled" if self.against is None else "against"

    def columns(self) -> dict[str, list[Any]]:
        """Return the table by column: axes, what becomes of the bit, and so without control."""
        x, y = self.points.T
        first: dict[str, list[Any]] = {
            self.plane.x.name: x.tolist(),
            self.plane.y.name: y.tolist(),
        }
        free = self.uncontrolled.columns()
        if self.controlled is None:
            return {**first, **free}
        beside = {f"{self.first}_{name}": values for name, values in free.items()}
        return {**first, **self.controlled.columns(), **beside}

    def rows(self) -> list[list[Any]]:
        """Return one row a point, in the order of `columns`."""
        return [list(row) for row in zip(*self.columns().values(), strict=True)]

    def unvouched(self) -> int:
        """Count the points whose gains a table does not vouch for; 0 without a table."""
        if not isinstance(self.controller, GainTable):
            return 0
        grid = self.controller.grid
        places = [grid.place_of(self.plane.case_at(*place)) for place in self.points.tolist()]
        return int((~self.controller.stable_at(*zip(*places, strict=True))).sum())

    def to_dict(self) -> dict[str, Any]:
        """Return JSON types."""
        axes = {
            key: {"name": axis.name, "low": axis.low, "high": axis.high, "unit": axis.unit or None}
            for key, axis in (("x", self.plane.x), ("y", self.plane.y))
        }
        severities = {self.first: self.uncontrolled, "controlled": self.controlled}
        columns = self.columns()
        return {
            "schema": "drillctrl/map/1",
            "operating_point": asdict(self.plane.case.physics("a map")[1]),
            "axes": axes,
            "counts": list(self.counts),
            "refine": self.refine,
            "starts": list(self.starts),
            "marked": None if self.marked is None else list(self.marked),
            "structure": self.structure,
            "against": closing_name(self.against),
            **self._gains(),
            "unvouched": self.unvouched(),
            "outcomes": {k: None if s is None else s.counts() for k, s in severities.items()},
            "boundaries": {k: _boundary(s) for k, s in severities.items()},
            "threshold": None if self.threshold is None else self.threshold.to_dict(),
            "rows": [dict(zip(columns, row, strict=True)) for row in self.rows()],
            "elapsed_seconds": self.elapsed_seconds,
        }

    def _gains(self) -> dict[str, Any]:
        """Return the gains, which a table has many of."""
        if not isinstance(self.controller, Controller):
            return {"K1": None, "K2": None}
        _, K1, K2 = self.controller.gain_sets()
        return {"K1": K1[0].ravel().tolist(), "K2": K2[0].ravel().tolist()}


def closing_name(closing: Closing) -> str | None:
    """Return the name of what closes a loop; None for nothing."""
    if closing is None or isinstance(closing, DriveLaws):
        return None if closing is None else closing.name
    structure = closing.structure if isinstance(closing, GainTable) else closing.feedback
    assert isinstance(structure, FeedbackStructure)
    return structure.name


def _boundary(found: Severity | None) -> list[Any] | None:
    if found is None or found.boundary is None:
        return None
    return [curve.tolist() for curve in found.boundary]
