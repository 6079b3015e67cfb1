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
from drillctrl.charts.plane import AxisLike, make_plane
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import checked_run
from drillctrl.simulation.starts import possible_starts, start_named
from drillctrl.simulation.status import OUTCOME_NAMED, Outcome
from drillctrl.strings.changed import string_of
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_laws import DriveLaws
from drillctrl.studies.lattice import Node, explore, fine_shape
from drillctrl.studies.tasks import closed_at, run_tasks
from drillctrl.studies.vibration_edge import (
    as_closing,
    held_against,
    is_long,
    linear_edge,
    marked_place,
)
from drillctrl.studies.vibration_files import save_map
from drillctrl.studies.vibration_point import (
    QUANTITIES,
    VibrationTask,
    as_array,
    measure_point,
)
from drillctrl.studies.vibration_text import closing_text, map_summary, place_text
from drillctrl.studies.vibration_threshold import torsional_field, without_drive
from drillctrl.studies.vibration_values import MapValues, Severity
from drillctrl.tables.gain_table import GainTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STARTS = ("small", "kick", "back")
_MOST_POINTS = 200_000
_ABOVE_ZERO = ("omega0", "delta0", "speed", "rop", "wob")


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

        columns = [(closing_text(self, self.against), self.uncontrolled)]
        if self.controlled is not None:
            columns.append((closing_text(self, self.controller), self.controlled))
        drawn = [
            Drawn(title, {**each.columns(), "boundary": each.boundary}) for title, each in columns
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
            threshold=self.threshold,
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
        control = self.structure or "no control"
        return f"<VibrationMap: {len(self.nodes)} points over {x} × {y}, {control}>"


@checks_kinds
def vibration_map(
    point: Where,
    x: AxisLike = ("omega0", 4.0, 24.0),
    y: AxisLike = ("delta0", 0.5, 12.0),
    controller: Controller | GainTable | DriveControl | DriveLaws | None = None,
    against: Controller | GainTable | DriveControl | DriveLaws | None = None,
    *,
    counts: tuple[int, int] = (15, 12),
    refine: int = 1,
    starts: Sequence[str] = STARTS,
    duration: float = 200.0,
    threshold: bool = False,
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
        ``"rock_strength"`` in MPa, of a string ``"depth"`` in m and ``"mud"``; else
        ``"omega0"``, ``"delta0"``, ``"psi"`` and the other groups. Gains are no axes.
    controller : Controller, GainTable, DriveControl or DriveLaws, optional
        Whose motion is shown beside that without control: the same gains or law of the top
        drive everywhere, or those of a table at each point.
    against : Controller, GainTable, DriveControl or DriveLaws, optional
        In place of no control. Of a rig with a top drive it is a stiff one where nothing is
        given, for nothing else holds its speed.
    counts : (int, int)
        Points along each axis to begin with.
    refine : int
        How often their spacing is halved where the outcome changes between smooth drilling,
        swinging, bouncing, and what is worse.
    starts : sequence of str
        Names of starts, as in `simulate_starts`: each point is judged by the worst.
    duration : float
        Of each run, dimensionless.
    threshold : bool
        Whether to look as well where torsion has damping left on the axial orbit that is drilled
        with; see `torsional_threshold`. Of a string under a top drive it is that of its laws.
    mark : bool
        Whether the operating point is marked, where it lies on the map.
    surroundings : mapping, optional
        Further arguments of `Controller` for the gains of a table, such as ``limit``, or of
        `law_controller` for a law.
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
    for which, axis in (("x axis", plane.x), ("y axis", plane.y)):
        if axis.low <= 0.0 and axis.name in _ABOVE_ZERO:
            typed = f"{axis.name} from {axis.low:g} {axis.unit}".rstrip()
            raise InputError(
                which, typed, "from above 0: a bit that neither turns nor cuts is not run"
            )
    law, other = as_closing(controller), held_against(as_closing(against), case)
    if surroundings and not isinstance(law, GainTable | DriveLaws):
        raise InputError("surroundings", dict(surroundings), "given with a table or a law only")
    duration = checked_number("duration", duration, 1.0, 1e6)
    cases: dict[Node, list[tuple[Case, Controller | None]]] = {}
    columns = (other,) if law is None else (other, law)
    found: list[dict[Node, dict[str, Any]]] = [{} for _ in columns]
    edges = [linear_edge(plane, closing) for closing in columns]
    steps = np.array([plane.x.span, plane.y.span]) / (np.array(shape) - 1)

    def closed(x: float, y: float) -> list[tuple[Case, Controller | None]]:
        there, where = plane.case_at(x, y), plane.rig_point_at(x, y)
        # What surrounds one column holds for another of its kind.
        return [
            closed_at(each, there, where, surroundings if type(each) is type(law) else None)
            for each in columns
        ]

    def closed_node(node: Node) -> list[tuple[Case, Controller | None]]:
        if node not in cases:
            value = np.array([plane.x.low, plane.y.low]) + np.array(node) * steps
            cases[node] = closed(*value.tolist())
        return cases[node]

    names = _checked_starts(starts, closed_node((0, 0))[-1][0])
    # What cannot be simulated at a corner is refused before anything is.
    for node in ((0, 0), (shape[0] - 1, shape[1] - 1)):
        for there, closing in closed_node(node):
            checked_run(there, controller=closing, duration=duration)

    def find(nodes: Sequence[Node]) -> dict[Node, str]:
        tasks: list[VibrationTask] = []
        for node in nodes:
            for (there, closing), edge in zip(closed_node(node), edges, strict=True):
                # α of a long string takes seconds, and says no more than the edge.
                alone = edge is None or not is_long(case)
                tasks.append(VibrationTask(len(tasks), there, closing, names, duration, alone))
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
        _severity([known[node] for node in nodes], edge)
        for known, edge in zip(found, edges, strict=True)
    ]
    field = None
    if threshold:

        def torsion(x: float, y: float) -> Any:
            where = plane.rig_point_at(x, y)
            if where is not None and all(isinstance(each, DriveLaws) for each in columns):
                depth = string_of(where.rig).length
                laws = [each.at(depth) for each in columns if isinstance(each, DriveLaws)]
                return without_drive(where, case.physics("a map")[0].bit), tuple(laws)
            pairs = closed(x, y)
            return pairs[0][0], tuple(closing for _, closing in pairs)

        field = torsional_field(plane, sizes, torsion, executor, checkpoint, progress)
    return VibrationMap(
        plane,
        sizes,
        refine,
        names,
        nodes,
        cells,
        severities[0],
        severities[1] if law is not None else None,
        law,
        other,
        field,
        marked_place(plane) if mark else None,
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
