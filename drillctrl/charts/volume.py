"""Where a loop is stable over three parameters, as slices that are scanned exactly (Fig. 5)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer
from drillctrl.base.extras import required
from drillctrl.base.files import replacing
from drillctrl.base.kinds import checks_kinds
from drillctrl.charts.axes import Axis, make_axis
from drillctrl.charts.chains import stable_curves
from drillctrl.charts.chart import StabilityChart, chart
from drillctrl.charts.plane import AxisLike, Plane, make_plane
from drillctrl.charts.scan import ScanLine
from drillctrl.charts.scanners import choose_scanner, first_position
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Case, Where, as_case

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.base.workers import Progress


# What a mesh is written as, by the file's ending.
MESH_FORMATS: dict[str, dict[str, Any]] = {
    ".vtk": {"file_format": "vtk42"},
    ".ply": {"file_format": "ply"},
    ".stl": {"file_format": "stl", "binary": True},
}
_EDGE = 1e-6


@dataclass(frozen=True, eq=False)
class StabilityVolume:
    """A stable set over three parameters.

    Attributes
    ----------
    planes : tuple of Plane
        Two parameters each, the third held.
    z : Axis
        The third parameter.
    positions : array, (s,)
        Where it is held.
    lines : tuple of tuple of ScanLine
        Of each slice, at the same places.
    rows : bool
        Whether lines are held at y and scanned along x.
    volume, volume_error : float
        In units of x times y times z, and what half of the lines and half of the slices
        would change, together.
    elapsed_seconds : float
        Wall time.
    """

    planes: tuple[Plane, ...]
    z: Axis
    positions: FloatArray
    lines: tuple[tuple[ScanLine, ...], ...]
    rows: bool
    volume: float
    volume_error: float
    elapsed_seconds: float

    @property
    def areas(self) -> FloatArray:
        """Stable area of each slice."""
        return np.array([_area(lines, 1) for lines in self.lines])

    def slice_at(self, z: float) -> StabilityChart:
        """Draw one cross-section as a chart of its own, with its own accuracy (Figs. 6, 7)."""
        plane = self.planes[0]
        case = _moved(plane.case, self.z.name, z)
        gains = (plane.structure, plane.K1, plane.K2) if plane.structure is not None else ()
        return chart(case, plane.x, plane.y, *gains)

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the boundary as quadrilaterals between neighbouring lines and slices.

        Returns
        -------
        corners : array, (v, 3)
            x, y, z.
        quads : array, (f, 4)
            Places in ``corners``. Between lines with different numbers of stable stretches
            there are none: the surface has gaps as wide as the spacing there.
        """
        corners: list[tuple[float, float, float]] = []
        known: dict[tuple[int, int, int], int] = {}
        stretches = [[line.stable_intervals for line in lines] for lines in self.lines]

        def corner(k: int, j: int, end: int) -> int:
            if (k, j, end) not in known:
                known[k, j, end] = len(corners)
                along = stretches[k][j][end // 2][end % 2]
                held = self.lines[k][j].position
                x, y = (along, held) if self.rows else (held, along)
                corners.append((x, y, float(self.positions[k])))
            return known[k, j, end]

        quads = []
        for k in range(len(self.lines) - 1):
            for j in range(len(self.lines[k]) - 1):
                around = ((k, j), (k, j + 1), (k + 1, j + 1), (k + 1, j))
                counts = {len(stretches[a][b]) for a, b in around}
                if len(counts) == 1:
                    for end in range(2 * counts.pop()):
                        quads.append([corner(a, b, end) for a, b in around])
        return (
            np.array(corners).reshape(-1, 3),
            np.array(quads, dtype=np.int64).reshape(-1, 4),
        )

    def save_mesh(self, path: str | Path) -> None:
        """Write the surface for a viewer, by the file's ending: VTK, PLY or STL.

        Raises
        ------
        InputError
            If the ending is unknown, or meshio is not installed.
        """
        ending = Path(path).suffix.lower()
        if ending not in MESH_FORMATS:
            raise InputError("out", str(path), f"a file that ends in {', '.join(MESH_FORMATS)}")
        meshio = required("meshio", "volumes")
        corners, quads = self.surface()
        # Triangles, which every one of these formats knows.
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        mesh = meshio.Mesh(corners, [("triangle", triangles)])
        with replacing(path) as file:
            mesh.write(file, **MESH_FORMATS[ending])

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        plane = self.planes[0]
        return {
            "schema": "drillctrl/volume/1",
            "axes": {axis.name: [axis.low, axis.high] for axis in (plane.x, plane.y, self.z)},
            "structure": None if plane.structure is None else plane.structure.name,
            "K1": plane.K1.ravel().tolist(),
            "K2": plane.K2.ravel().tolist(),
            "stable_volume": self.volume,
            "volume_error": self.volume_error,
            "slices": [
                {self.z.name: float(z), "stable_area": float(area)}
                for z, area in zip(self.positions, self.areas, strict=True)
            ],
            "elapsed_seconds": self.elapsed_seconds,
        }

    def summary(self) -> str:
        """Return a text for people."""
        plane = self.planes[0]
        axes = " × ".join(f"{a.name} {a.low:g}:{a.high:g}" for a in (plane.x, plane.y, self.z))
        head = "open loop" if plane.structure is None else plane.structure.name
        return (
            f"Stable volume of the {head} over {axes}\n"
            f"  {self.volume:.6g} ± {self.volume_error:.1g} (estimated), "
            f"{len(self.positions)} slices of {len(self.lines[0])} lines"
        )

    def plot(self, ax: Any | None = None) -> Any:
        """Draw the surface; see `drillctrl.charts.volume_figure.plot_volume`."""
        from drillctrl.charts.volume_figure import plot_volume

        title = f"Boundary of the stable set, volume {self.volume:.4g} ± {self.volume_error:.1g}"
        return plot_volume(*self.surface(), self.planes[0], self.z, title, ax)

    def plot_slices(self, count: int = 6, ax: Axes | None = None) -> Axes:
        """Draw the boundaries of some slices over each other (Figs. 6, 7).

        Parameters
        ----------
        count : int
            How many, evenly chosen; the first, which may be empty, left out.
        ax : Axes, optional
            By default new ones.
        """
        from drillctrl.charts.volume_figure import plot_slices

        chosen = np.unique(np.linspace(0, len(self.positions) - 1, count + 1).astype(int)[1:])
        slices = {
            float(self.positions[k]): stable_curves(self.lines[k], rows=self.rows) for k in chosen
        }
        return plot_slices(slices, self.planes[0], self.z, ax)

    def __repr__(self) -> str:
        return f"<StabilityVolume over {self.z.name}: {self.volume:.5g} ± {self.volume_error:.1g}>"


def _moved(case: Case, name: str, value: float) -> Case:
    names = ("xi", "kappa") if name == "damping" else (name,)
    return case.with_changes(**dict.fromkeys(names, float(value)))


def _area(lines: Sequence[ScanLine], stride: int) -> float:
    """Integrate the stable lengths by the trapezoidal rule over every ``stride``-th line."""
    chosen = [*lines[::stride]]
    if chosen[-1] is not lines[-1]:
        chosen.append(lines[-1])
    lengths = [sum(b - a for a, b, *_ in line.stable_intervals) for line in chosen]
    return float(np.trapezoid(lengths, [line.position for line in chosen]))


@checks_kinds
def stability_volume(
    point: Where,
    x: AxisLike = ("omega0", 0.5, 24.0),
    y: AxisLike = ("delta0", 0.0, 5.0),
    z: AxisLike = ("psi", 0.1, 26.0),
    structure: str | FeedbackStructure | None = None,
    K1: npt.ArrayLike | None = None,
    K2: npt.ArrayLike | None = None,
    *,
    slices: int = 101,
    lines: int = 129,
    progress: Progress | None = None,
) -> StabilityVolume:
    """Find where a loop is stable over three of its parameters (Fig. 5).

    Parameters
    ----------
    point : OperatingPoint, RigPoint or Case
        Supplies all parameters that are no axis.
    x, y : (name, low, high)
        As in `chart`.
    z : (name, low, high)
        A group of the point, or a parameter of the plant's parts.
    structure, K1, K2 : optional
        As in `chart`.
    slices, lines : int
        Even grids along z and along the held one of x and y; odd numbers suit the estimate
        of the error. Along the third, crossings are exact.
    progress : callable, optional
        Called with what is being done, slices done and slices in all.

    Raises
    ------
    InputError
        If axes, gains or limits are wrong.
    """
    began = time.perf_counter()
    count = checked_integer("slices", slices, 3, 10_001)
    number = checked_integer("lines", lines, 3, 10_001)
    case = as_case(point)
    case.physics("a volume over parameters")
    # Numbers of the rig would move several groups at once.
    case = replace(case, rig_point=None)
    third = make_axis(z, None, case)
    positions = np.linspace(first_position(third), third.high, count)
    planes, found = [], []
    rows = False
    for done, value in enumerate(positions):
        if progress is not None:
            progress("slices", done, count)
        plane = make_plane(_moved(case, third.name, value), x, y, structure, K1, K2)
        if third.name in (plane.x.name, plane.y.name):
            raise InputError("z", third.name, "another parameter than x and y")
        _, rows, scanner = choose_scanner(plane, 0.0)
        held = plane.y if rows else plane.x
        start = first_position(held)
        # A hair inside the ends, where a boundary may coincide with the edge.
        inset = _EDGE * (held.high - start)
        places = np.linspace(start, held.high, number)
        places[[0, -1]] += [inset, -inset]
        planes.append(plane)
        found.append(tuple(scanner(places)))
    areas = np.array([_area(one, 1) for one in found])
    coarse = np.array([_area(one, 2) for one in found])
    volume = float(np.trapezoid(areas, positions))
    error = abs(float(np.trapezoid(coarse - areas, positions)))
    error += abs(float(np.trapezoid(areas[::2], positions[::2])) - volume) if count % 2 else 0.0
    if progress is not None:
        progress("slices", count, count)
    return StabilityVolume(
        tuple(planes),
        third,
        positions,
        tuple(found),
        rows,
        volume,
        error,
        time.perf_counter() - began,
    )
