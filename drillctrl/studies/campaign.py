"""`campaign`: does the nonlinear string do what the linear loop promises, and how far off?"""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.checkpoint import Checkpoint
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.files import write_text
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.tableio import csv_text
from drillctrl.base.workers import Progress
from drillctrl.simulation.controller import Controller
from drillctrl.studies.tasks import closed_at, run_tasks
from drillctrl.studies.trial import Trial, try_point
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.grid import Grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DISTURBANCE = {"dx": 1.0, "dtheta": 1.0}


@dataclass(frozen=True, eq=False)
class Campaign:
    """What became of disturbances over a grid of operating points.

    Attributes
    ----------
    grid : Grid
        Operating points; nodes are flattened with the last axis fastest.
    disturbance : mapping
        Perturbation of steady drilling by state name, of size 1.
    sizes : tuple of float, (s,)
        Multiples of it that were tried everywhere.
    spectral_abscissa : array, (q,)
        α of the linear loop with an ideal controller.
    durations : array, (q,)
        Of the runs.
    outcomes : str array, (q, s)
        ``settled``; ``orbit`` (periodic); ``unsettled``; ``stalled`` (the bit stands);
        ``reverse rotation``; ``undecided`` (small motion that decays more slowly than the run
        lasted); ``broken`` (the run could not go on).
    settling_times : array, (q, s)
        NaN where it did not settle; see `settling_time`.
    basin : array, (q, 2)
        The largest size below which all that were tried settled, and the smallest that did
        not; NaN for the second where all did, twice NaN where α ≥ 0 or so slow a decay that
        the runs do not tell.
    """

    grid: Grid
    disturbance: Mapping[str, float]
    sizes: tuple[float, ...]
    spectral_abscissa: FloatArray
    durations: FloatArray
    outcomes: npt.NDArray[np.str_]
    settling_times: FloatArray
    basin: FloatArray

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the entries of a row."""
        sizes = [f"{size:g}" for size in self.sizes]
        return (
            *(*self.grid.names, "spectral_abscissa", "duration"),
            *(f"outcome_{size}" for size in sizes),
            *(f"settling_time_{size}" for size in sizes),
            *("settles_up_to", "first_unsettled"),
        )

    def rows(self) -> list[list[float | str | None]]:
        """Return one row an operating point in the order of `columns`; None for no number."""
        rows: list[list[float | str | None]] = []
        for i, groups in enumerate(self.grid.groups(self.grid.coordinates).tolist()):
            numbers = [*self.settling_times[i].tolist(), *self.basin[i].tolist()]
            rows.append(
                [
                    *groups,
                    *(float(self.spectral_abscissa[i]), float(self.durations[i])),
                    *self.outcomes[i].tolist(),
                    *(None if np.isnan(value) else value for value in numbers),
                ]
            )
        return rows

    def settled_counts(self) -> list[dict[str, float | int]]:
        """Return, for each size, at how many stable and unstable points it settled."""
        stable = self.spectral_abscissa < 0.0
        settled = self.outcomes == "settled"
        undecided = self.outcomes == "undecided"
        return [
            {
                "size": size,
                "stable": int(stable.sum()),
                "stable_settled": int((stable & settled[:, k]).sum()),
                "stable_undecided": int((stable & undecided[:, k]).sum()),
                "unstable": int((~stable).sum()),
                "unstable_settled": int((~stable & settled[:, k]).sum()),
            }
            for k, size in enumerate(self.sizes)
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return JSON types."""
        return {
            "schema": "drillctrl/campaign/1",
            "shape": list(self.grid.shape),
            "axes": {axis.name: list(axis.values) for axis in self.grid.axes},
            "disturbance": dict(self.disturbance),
            "sizes": list(self.sizes),
            "settled": self.settled_counts(),
            "rows": [dict(zip(self.columns, row, strict=True)) for row in self.rows()],
        }

    def summary(self) -> str:
        """Return a text for people."""
        stable = int((self.spectral_abscissa < 0.0).sum())
        kick = ", ".join(f"{name} = {value:g}" for name, value in self.disturbance.items())
        lines = [
            f"Campaign over {len(self.outcomes)} operating points, linear loop stable at {stable}",
            f"  Disturbance   {kick}, times the size",
        ]
        for counts in self.settled_counts():
            undecided = counts["stable_undecided"]
            note = f" ({undecided} undecided)" if undecided else ""
            label = f"Size {counts['size']:g}"
            lines.append(
                f"  {label:<13} settles at {counts['stable_settled']} of "
                f"{counts['stable']} stable points{note}, at {counts['unstable_settled']} of "
                f"{counts['unstable']} unstable ones"
            )
        inside = np.flatnonzero(np.isfinite(self.basin[:, 0]))
        if inside.size:
            low = self.basin[inside, 0]
            worst = inside[low.argmin()]
            point = self.grid.points[worst]
            beyond = int(np.isnan(self.basin[inside, 1]).sum())
            lines.append(
                f"  Basin         sizes up to {low.min():.3g} … {low.max():.3g} settle, median "
                f"{np.median(low):.3g}; least at ω0 = {point.omega0:g}, δ0 = {point.delta0:g}"
            )
            if beyond:
                lines.append(f"                {beyond} points settle from all that was tried")
        return "\n".join(lines)

    def plot(self) -> Figure:
        """Draw outcomes and the basin over the grid; see `plot_campaign`."""
        from drillctrl.studies.campaign_figure import plot_campaign

        return plot_campaign(
            self.grid,
            self.sizes,
            self.outcomes,
            self.spectral_abscissa,
            self.basin,
            self.disturbance,
        )

    def save(self, path: str | Path) -> None:
        """Write the rows as CSV or all of it as JSON, whole or not at all.

        Raises
        ------
        InputError
            If the name does not end in .csv or .json.
        """
        ending = Path(path).suffix.lower()
        if ending == ".json":
            text = json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n"
        elif ending == ".csv":
            kick = ", ".join(f"{name} {value!r}" for name, value in self.disturbance.items())
            told = f"drillctrl campaign, dimensionless; disturbance of size 1: {kick}"
            text = csv_text(self.columns, self.rows(), [told])
        else:
            raise InputError("path", str(path), "a name that ends in .csv or .json")
        write_text(path, text)

    def __repr__(self) -> str:
        size = " × ".join(str(n) for n in self.grid.shape)
        return f"<Campaign: {size} points, sizes {', '.join(f'{s:g}' for s in self.sizes)}>"


@checks_kinds
def campaign(
    grid: Grid,
    controller: Controller | GainTable | None = None,
    *,
    disturbance: Mapping[str, float] = DISTURBANCE,
    sizes: Sequence[float] = (0.01, 1.0),
    largest: float = 10.0,
    sharpness: float = 1.1,
    duration: float | None = None,
    cutting: str = "multiple",
    rtol: float = 1e-6,
    executor: Executor | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Progress | None = None,
) -> Campaign:
    """Simulate disturbances of several sizes over a grid, and measure how large a one settles.

    Parameters
    ----------
    grid : Grid
        From `dimensionless_grid` or `rig_grid`.
    controller : Controller or GainTable, optional
        One controller everywhere, or the gains of a table at each point; without it no control.
    disturbance : mapping
        Perturbation of steady drilling by state name, of size 1, as ``initial`` of `Scenario`.
    sizes : sequence of float
        Rising multiples of it that are tried everywhere.
    largest : float
        Where the linear loop is stable, the edge of the basin is looked for up to this size,
        by doubling and then halving the interval (its ends' ratio, to be exact). Sizes that
        settle beyond the first that does not are not looked for.
    sharpness : float
        Ratio of the two sizes that bracket the edge; infinite not to look for it.
    duration : float, optional
        Of each run. By default twelve decay times of the linear loop, between 60 and 600;
        60 where it is unstable.
    cutting, rtol
        As in `simulate`.
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
    steps = _checked_sizes(sizes)
    kick = {name: checked_number(f"disturbance {name}", v) for name, v in disturbance.items()}
    if not any(kick.values()):
        raise InputError("disturbance", dict(disturbance), "other than zero")
    checked_number("largest", largest, steps[-1], 1e6)
    if sharpness != np.inf:
        checked_number("sharpness", sharpness, 1.001, 10.0)
    if duration is not None:
        checked_number("duration", duration, 1.0, 1e6)
    states = grid.plant.state_names
    for point in grid.points:
        for name in kick:
            if name not in states:
                raise InputError("disturbance", name, f"of {', '.join(states)}")
        if kick.get("dtheta", 0.0) * largest < -point.omega0:
            raise InputError("largest", largest, f"such that θ' ≥ −ω0 = {-point.omega0:g}")
    trials = [
        Trial(
            index, case, closed_at(controller, case)[1], kick, steps, float(largest),
            float(sharpness), duration, cutting, rtol,
        )
        for index, case in enumerate(grid.cases)
    ]  # fmt: skip
    found = run_tasks(try_point, trials, executor, checkpoint, progress)

    def numbers(name: str) -> FloatArray:
        return np.array([entry[name] for entry in found], dtype=float)

    return Campaign(
        grid,
        kick,
        steps,
        numbers("spectral_abscissa"),
        numbers("duration"),
        np.array([entry["outcomes"] for entry in found]),
        numbers("settling_times"),
        numbers("basin"),
    )


def _checked_sizes(sizes: Sequence[float]) -> tuple[float, ...]:
    """Return the sizes, or refuse them."""
    steps = tuple(checked_number("sizes", size, 0.0, 1e6, open_low=True) for size in sizes)
    if not steps or any(b <= a for a, b in itertools.pairwise(steps)):
        raise InputError("sizes", list(steps), "at least one, rising")
    return steps
