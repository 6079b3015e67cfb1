"""What `simulate` prints, writes and draws, also of runs that were interrupted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from drillctrl.cli.output import json_text, plain, write_figure, writing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from drillctrl.simulation.result import Simulation
    from drillctrl.simulation.starts import StartRun

FIGURES = ("motion", "phase", "axial-phase", "linear", "face")
_INTERRUPTED = 130


@dataclass(frozen=True)
class Wanted:
    """Files that are asked for.

    Attributes
    ----------
    out : str or None
        For the motion.
    every : float or None
        Time between its rows; None for the integrator's steps.
    plot : str or None
        For the figure.
    figure : str
        One of `FIGURES`.
    rig : str or None
        Its name, for titles.
    """

    out: str | None
    every: float | None
    plot: str | None
    figure: str
    rig: str | None = None

    def write(self, run: Simulation, again: Callable[[str], Simulation] | None) -> None:
        """Write motion and figure; ``again`` makes the run of another model."""
        from drillctrl.simulation.export import export_motion

        if self.out is not None:
            out = self.out
            writing("--out", out, lambda: export_motion(run, out, self.every))
        if self.plot is not None:
            write_figure(self.plot, _drawn(self.figure, run, again, self.rig))

    @property
    def files(self) -> str:
        """Where what was reached is kept."""
        names = [name for name in (self.out, self.plot) if name is not None]
        return " and ".join(names) if names else "the summary alone"


def deliver_run(
    again: Callable[[str], Simulation], model: str, wanted: Wanted, floquet: bool, as_json: bool
) -> bool:
    """Simulate, write and print; return whether the outcome is calm.

    An interrupted run is written and printed as far as it went, and ends the command.
    """
    from drillctrl.simulation.outcome import figures
    from drillctrl.simulation.report import simulation_fields, simulation_summary
    from drillctrl.simulation.run import Interrupted

    multipliers = None
    interrupted = False
    try:
        run = again(model)
    except Interrupted as stop:
        run, interrupted = stop.simulation, True
        _tell(run, wanted)
    if floquet and not interrupted:
        from drillctrl.simulation.floquet import floquet as multipliers_of

        multipliers = multipliers_of(run)
    wanted.write(run, None if interrupted else again)
    if as_json:
        click.echo(json_text(simulation_fields(run, multipliers)))
    else:
        click.echo(plain(simulation_summary(run, multipliers)))
    if interrupted:
        raise click.exceptions.Exit(_INTERRUPTED)
    return figures(run).outcome.calm


def deliver_starts(made: Iterator[StartRun], count: int, wanted: Wanted, as_json: bool) -> bool:
    """Simulate from each start, write the worst, print all; return whether all are calm.

    After an interrupt what is done is written and printed.
    """
    from drillctrl.simulation.report import (
        simulation_fields,
        simulation_summary,
        starts_summary,
    )
    from drillctrl.simulation.starts import StartSet

    runs: list[StartRun] = []
    interrupted = False
    try:
        runs.extend(made)
    except KeyboardInterrupt:
        interrupted = True
        if not runs:
            raise
        done = f"{len(runs)} of {count} starts are done"
        click.echo(f"drillctrl: interrupted: {done}; kept in {wanted.files}", err=True)
    found = StartSet(tuple(runs))
    worst = found.worst.simulation
    wanted.write(worst, None)
    if as_json:
        click.echo(json_text({**simulation_fields(worst), **found.to_dict()}))
    else:
        click.echo(plain(f"{starts_summary(found)}\n\n{simulation_summary(worst)}"))
    if interrupted:
        raise click.exceptions.Exit(_INTERRUPTED)
    return found.calm


def _tell(run: Simulation, wanted: Wanted) -> None:
    end = float(run.times[-1])
    reached = f"t = {end:g} of {run.duration:g} reached, {run.steps} steps"
    click.echo(f"drillctrl: interrupted: {reached}; kept in {wanted.files}", err=True)


def _drawn(
    figure: str, run: Simulation, again: Callable[[str], Simulation] | None, rig: str | None
) -> Figure:
    from drillctrl.simulation.figure import (
        plot_against_linear,
        plot_phase_portrait,
        plot_rock_face,
    )

    if figure == "motion" or (figure == "linear" and again is None):
        return run.plot(rig)
    title = run.title(rig)
    if figure == "linear":
        assert again is not None
        ax = plot_against_linear(run, again("linear"), title=title)
    elif figure == "face":
        ax = plot_rock_face(run, title=title)
    else:
        plane = "torsion" if figure == "phase" else "axial"
        ax = plot_phase_portrait(run, plane, since=0.75 * float(run.times[-1]), title=title)
    drawn = ax.get_figure(root=True)
    assert drawn is not None
    return drawn
