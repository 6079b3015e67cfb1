"""`vibration_map`: what becomes of the bit over two of the things that a driller sets."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.checkpoint import Checkpoint
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.workers import Progress
from drillctrl.charts.chart import chart
from drillctrl.charts.plane import AxisLike, Plane, make_plane
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import checked_run
from drillctrl.simulation.starts import possible_starts, start_named
from drillctrl.simulation.status import OUTCOME_NAMED, Outcome
from drillctrl.studies.lattice import Node, explore, fine_shape
from drillctrl.studies.tasks import controller_at, run_tasks
from drillctrl.studies.vibration_files import save_map
from drillctrl.studies.vibration_point import (
    QUANTITIES,
    VibrationTask,
    as_array,
    measure_point,
)
from drillctrl.studies.vibration_text import controller_text, map_summary, place_text
from drillctrl.studies.vibration_values import MapValues, Severity
from drillctrl.tables.gain_table import GainTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STARTS = ("small", "kick", "back")
_MOST_POINTS = 200_000
# Strings of more states have no exact boundary within seconds; α at the points stands for it.
_FEW_STATES = 8


@dataclass(frozen=True, eq=False)
class VibrationMap(MapValues):
    """What becomes of the bit over two parameters; attributes are those of `MapValues`."""

    def summary(self) -> str:
        """Return a text for people."""
        return map_summary(self)

    def plot(
        self,
        quantities: Sequence[str] = ("outcome", "swing"),
        name: str | None = None,
        difference: bool = False,
    ) -> Figure:
        """Draw quantities over the two axes, without and with control side by side.

        Parameters
        ----------
        quantities : sequence of str
            Some of ``"outcome"``, ``"swing"``, ``"stick_fraction"``, ``"off_rock_fraction"``,
            ``"feed"``, ``"weight_ratio"``: a row of pictures each.
        name : str, optional
            Of the rig, for the title.
        difference : bool
            Whether a third column says what control changes.

        Raises
        ------
        InputError
            If there is no such quantity, or no control to make a difference.
        """
        if difference and self.controlled is None:
            raise InputError("difference", "asked for", "left out where there is no control")
        from drillctrl.studies.vibration_figure import Drawn, plot_map

        columns = {"without control": self.uncontrolled}
        if self.controlled is not None:
            columns[controller_text(self)] = self.controlled
        drawn = [
            Drawn(title, {**found.columns(), "boundary": found.boundary})
            for title, found in columns.items()
        ]
        return plot_map(
            self.plane,
            self.shape,
            self.nodes,
            self.cells,
            drawn,
            tuple(quantities),
            difference=difference,
            marked=self.marked,
            title=place_text(self, name),
        )

    def save(self, path: str | Path) -> None:
        """Write rows as CSV, all as JSON, or the lattice as NetCDF, whole or not at all.

        Raises
        ------
        InputError
            If the name does not end in .csv, .json or .nc.
        """
        save_map(self, path)

    def __repr__(self) -> str:
        x, y = self.plane.x.name, self.plane.y.name
        control = "no control" if self.structure is None else self.structure.name
        return f"<VibrationMap: {len(self.nodes)} points over {x} × {y}, {control}>"


@checks_kinds
def vibration_map(
    point: Where,
    x: AxisLike = ("omega0", 4.0, 24.0),
    y: AxisLike = ("delta0", 0.5, 12.0),
    controller: Controller | GainTable | None = None,
    *,
    counts: tuple[int, int] = (15, 12),
    refine: int = 1,
    starts: Sequence[str] = STARTS,
    duration: float = 200.0,
    mark: bool = True,
    surroundings: Mapping[str, Any] | None = None,
    executor: Executor | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Progress | None = None,
) -> VibrationMap:
    """Simulate over two parameters, and tell how hard the bit vibrates at each point.

    Parameters
    ----------
    point : OperatingPoint, RigPoint or Case
        Supplies all that is no axis.
    x, y : (name, low, high)
        As in `chart`: for a rig ``"speed"`` in rpm, ``"rop"`` in m/h, ``"wob"`` in kN,
        ``"rock_strength"`` in MPa; else ``"omega0"``, ``"delta0"``, ``"psi"`` and the other
        groups. Gains are no axes.
    controller : Controller or GainTable, optional
        Whose motion is shown beside that without control: the same gains everywhere, or those
        of a table at each point.
    counts : (int, int)
        Points along each axis to begin with.
    refine : int
        How often their spacing is halved where the outcome changes between smooth drilling,
        swinging, bouncing, and what is worse.
    starts : sequence of str
        Names of starts, as in `simulate_starts`: each point is judged by the worst.
    duration : float
        Of each run, dimensionless.
    mark : bool
        Whether the operating point is marked, where it lies on the map.
    surroundings : mapping, optional
        Further arguments of `Controller` for the gains of a table, such as ``limit``.
    executor : concurrent.futures.Executor, optional
        Works on the points side by side; the result does not depend on it.
    checkpoint : Checkpoint, optional
        Finished points are kept there, and those that it knows are not done again.
    progress : callable, optional
        Called with the name of a stage, points done and points to do.

    Raises
    ------
    InputError
        If an argument is out of range or a name unknown.
    """
    began = time.perf_counter()
    case = as_case(point)
    case.physics("a map")
    plane = make_plane(case, x, y, None, None, None)
    sizes = _checked_counts(counts)
    checked_integer("refine", refine, 0, 6)
    shape = fine_shape(sizes, refine)
    if shape[0] * shape[1] > _MOST_POINTS:
        raise InputError("refine", refine, f"such that there are at most {_MOST_POINTS} points")
    if surroundings and not isinstance(controller, GainTable):
        raise InputError("surroundings", dict(surroundings), "given with a table only")
    names = _checked_starts(starts, case)
    duration = checked_number("duration", duration, 1.0, 1e6)
    cases: dict[Node, Case] = {}
    found: list[dict[Node, dict[str, Any]]] = [{}] if controller is None else [{}, {}]
    steps = np.array([plane.x.span, plane.y.span]) / (np.array(shape) - 1)

    def case_at(node: Node) -> Case:
        if node not in cases:
            value = np.array([plane.x.low, plane.y.low]) + np.array(node) * steps
            cases[node] = plane.case_at(*value.tolist())
        return cases[node]

    # What cannot be simulated at a corner is refused before anything is.
    for node in ((0, 0), (shape[0] - 1, shape[1] - 1)):
        there = case_at(node)
        closing = controller_at(controller, there, surroundings)
        checked_run(there, controller=closing, duration=duration)

    def find(nodes: Sequence[Node]) -> dict[Node, str]:
        tasks: list[VibrationTask] = []
        for node in nodes:
            there = case_at(node)
            closings = [None, controller_at(controller, there, surroundings)][: len(found)]
            for closing in closings:
                tasks.append(VibrationTask(len(tasks), there, closing, names, duration))
        stage = "refine" if found[0] else "simulate"
        entries = run_tasks(measure_point, tasks, executor, checkpoint, progress, stage)
        words = {}
        for k, node in enumerate(nodes):
            own = entries[k * len(found) : (k + 1) * len(found)]
            for known, entry in zip(found, own, strict=True):
                known[node] = entry
            words[node] = "/".join(_class(entry["outcome"]) for entry in own)
        return words

    cells = explore(sizes, refine, find)
    nodes = tuple(sorted(found[0]))
    severities = [
        _severity([known[node] for node in nodes], _edge(plane, closing))
        for known, closing in zip(found, (None, controller), strict=False)
    ]
    return VibrationMap(
        plane,
        sizes,
        refine,
        names,
        nodes,
        cells,
        severities[0],
        severities[1] if controller is not None else None,
        controller,
        _place(plane) if mark else None,
        time.perf_counter() - began,
    )


def _class(outcome: str) -> str:
    """Return what is refined between: beyond stick, irregular motions end now so, now so."""
    found = OUTCOME_NAMED[outcome]
    return outcome if found.severity < Outcome.STICK_SLIP.severity else "sticks"


def _severity(entries: list[dict[str, Any]], boundary: tuple[FloatArray, ...] | None) -> Severity:
    numbers = {name: as_array(entries, name) for name in (*QUANTITIES, "spectral_abscissa")}
    return Severity(
        outcomes=np.array([entry["outcome"] for entry in entries]),
        starts=np.array([entry["start"] for entry in entries]),
        boundary=boundary,
        **numbers,
    )


def _edge(plane: Plane, controller: Controller | GainTable | None) -> tuple[FloatArray, ...] | None:
    """Return the exact boundary of the linear loop with an ideal controller, where there is one."""
    plant, _ = plane.case.physics("a map")
    if isinstance(controller, GainTable) or len(plant.state_names) > _FEW_STATES:
        return None
    gains: tuple[Any, ...] = ()
    if controller is not None:
        _, K1, K2 = controller.gain_sets()
        gains = (controller.feedback, K1[0], K2[0])
    drawn = chart(plane.case, plane.x, plane.y, *gains, tolerance=2e-3)
    return tuple(
        np.vstack([curve.points, curve.points[:1]]) if curve.closed else curve.points
        for curve in drawn.curves
    )


def _place(plane: Plane) -> tuple[float, float] | None:
    """Return where the operating point lies on the map, if it does."""
    try:
        values = [plane.value_of(axis.name) for axis in (plane.x, plane.y)]
    except InputError:
        return None
    inside = all(
        axis.low <= value <= axis.high
        for axis, value in zip((plane.x, plane.y), values, strict=True)
    )
    return (values[0], values[1]) if inside else None


def _checked_counts(counts: tuple[int, int]) -> tuple[int, int]:
    across, up = (checked_integer("counts", count, 2, 2000) for count in counts)
    return across, up


def _checked_starts(starts: Sequence[str], case: Case) -> tuple[str, ...]:
    """Return names of starts, or refuse them."""
    names = tuple(start_named(name).name for name in starts)
    possible = possible_starts(case)
    for name in names:
        if name not in possible or names.count(name) > 1:
            raise InputError("starts", ",".join(names), f"some of {','.join(possible)}, each once")
    if not names:
        raise InputError("starts", "none", f"some of {','.join(possible)}")
    return names
