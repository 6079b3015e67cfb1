"""`drillctrl table`: gains over a grid of points, to files and as source for a controller."""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.cli.controller_file import (
    CONTROLLER_NAMES,
    check_out,
    controller_file_options,
    in_units,
    write_table,
)
from drillctrl.cli.drives import are_drives, deliver_drive_table
from drillctrl.cli.gains import gain_scales, read_bounds
from drillctrl.cli.grid import checked_units, grid_options, read_grid
from drillctrl.cli.objective import objective_options, read_objective
from drillctrl.cli.output import (
    check_figure,
    check_folder,
    json_text,
    plain,
    write_figure,
    writing,
)
from drillctrl.cli.progress import open_progress
from drillctrl.cli.roots import trials_option, wants_trials
from drillctrl.cli.verb import Verb, naming

if TYPE_CHECKING:
    from drillctrl.base.checkpoint import Checkpoint
    from drillctrl.tables.gain_table import GainTable
    from drillctrl.tables.grid import Grid

_WITH_FROM = (*CONTROLLER_NAMES, "source", "require_stable", "as_json", "out", "plot")


@click.command(name="table", cls=Verb)
@grid_options
@click.option(
    "--structure",
    default="case1",
    show_default=True,
    help="p, case1, pd or case2; or a law of a top drive, over --depth.",
)
@objective_options
@click.option("--bound", multiple=True, metavar="GAIN=LOW:HIGH", help="As for design.")
@click.option(
    "--smooth",
    type=float,
    default=0.0,
    metavar="PERCENT",
    help="Smoothest table that gives up at most this share of the best decay rate.",
)
@click.option(
    "--refine",
    type=int,
    default=0,
    metavar="TIMES",
    help="Halve the spacing this often where cells fail beside stable nodes.",
)
@click.option(
    "--fallback",
    default="off",
    show_default=True,
    help="Where nothing stabilises: off (no control) or best (best gains found).",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the starting points.")
@trials_option("all")
@click.option("--workers", type=int, help="Processes (default 1).")
@click.option(
    "--scheduler", metavar="ADDRESS", help="Design on a Dask cluster, such as tcp://host:8786."
)
@click.option(
    "--from", "source", type=click.Path(), metavar="FILE", help="A saved table instead of a design."
)
@controller_file_options
@click.option(
    "--require-stable", is_flag=True, help="Exit with 3 if a node is not stable or refused."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option(
    "--out",
    type=click.Path(),
    help="Write FILE.csv, .json, .parquet, .mat, .nc, .c (with .h), .st, .scl, .xml or .fmu.",
)
@click.option("--plot", type=click.Path(), help="Draw gains and α: FILE.png, .svg, .pdf.")
@click.pass_context
def table_command(
    ctx: click.Context,
    /,
    source: str | None,
    require_stable: bool,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **options: Any,
) -> None:
    """Design gains over a grid of operating points, and check them between the nodes.

    \b
    Examples:
      drillctrl table --omega0 4:24:11 --delta0 1:12:6 --psi 14 --out gains.csv
      drillctrl table --rig table1 --speed "140:260:7 rpm" --rop "10:60:6 m/h" --out gains.csv
      drillctrl table --omega0 8:20:5 --delta0 1:7:4 --out gains.c --period 0.01 --limit 5
      drillctrl table --rig table1 --speed "110:120:2 rpm" --rop "50 m/h" --structure pd \\
          --objective drilling --kick 0.1 --limit "0.9 kN*m"
      drillctrl table --rig vertical-3000 --structure soft-torque --depth "2000:3000:3 m"
      drillctrl table --rig vertical-3000 --structure soft-torque --out drive.c \\
          --period "10 ms" --limit "40 kN*m"

    With --out a run that was killed goes on where it was when it is started again.
    """
    check_folder("--out", out)
    check_figure(plot)
    units = checked_units(options, source is not None)
    structure = str(options["structure"])
    if source is None and are_drives([structure]):
        if (
            not deliver_drive_table(structure, options, as_json, out, plot, units)
            and require_stable
        ):
            raise click.exceptions.Exit(3)
        return
    controller = {name: options.pop(name) for name in CONTROLLER_NAMES}
    if source is not None:
        _refuse_design(ctx)
        from drillctrl.tables.files import load_table

        with naming("--from", "table"):
            result = load_table(source)
        controller = in_units(controller, result.grid)
        check_out(out, controller, result.grid, result.structure)
        checkpoint = None
    else:
        result, checkpoint, controller = _design(options, out, plot, controller)
    if out is not None:
        writing("--out", out, lambda: write_table(result, out, controller))
    if checkpoint is not None:
        _finish(checkpoint)
    if plot is not None:
        write_figure(plot, result.plot(units))
    click.echo(json_text(result.to_dict()) if as_json else plain(result.summary(units)))
    if require_stable and not result.sound.all():
        raise click.exceptions.Exit(3)


def _refuse_design(ctx: click.Context) -> None:
    """Refuse options that say what to design where a table is there already."""
    for parameter in ctx.command.params:
        name = str(parameter.name)
        typed = ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if typed and name not in _WITH_FROM:
            wanted = "left out where --from gives the table"
            raise InputError(parameter.opts[0], ctx.params[name], wanted)


def _design(
    options: dict[str, Any], out: str | None, plot: str | None, controller: dict[str, Any]
) -> tuple[GainTable, Checkpoint | None, dict[str, Any]]:
    """Return the table that the options ask for, where its designs are kept, and its units."""
    from drillctrl.base.checkpoint import Checkpoint
    from drillctrl.base.workers import open_executor
    from drillctrl.drilling.structures import preset_structure
    from drillctrl.synthesis.objectives import Exact
    from drillctrl.tables.table import table

    workers, scheduler = options["workers"], options["scheduler"]
    if workers is not None:
        checked_integer("workers", workers, 1, 1024)
        if scheduler is not None:
            raise InputError("workers", workers, "left out with --scheduler, which has its own")
    smooth = checked_number("smooth", options["smooth"], 0.0, 90.0)
    trials = wants_trials(options["trials"])
    objective = read_objective(options) or Exact()
    if smooth and not isinstance(objective, Exact):
        raise InputError("smooth", smooth, f"0 with --objective {objective.name}")
    with naming("--axis", "axes"):
        grid = read_grid(options)
    if plot is not None and len(grid.axes) > 3:
        raise InputError("--plot", plot, "left out with more than three axes")
    structure = preset_structure(options["structure"])
    scales = gain_scales(structure, grid.plant, grid.rig)
    structure = structure.with_bounds(read_bounds(options["bound"], structure, scales))
    controller = in_units(controller, grid)
    check_out(out, controller, grid, structure, trials)
    with (
        open_executor(workers or 1, scheduler) as executor,
        nullcontext() if out is None else Checkpoint(f"{out}.checkpoint") as checkpoint,
        open_progress() as progress,
    ):
        result = table(
            grid,
            structure,
            objective=objective,
            give_up=smooth / 100.0,
            refine=options["refine"],
            fallback=options["fallback"],
            seed=options["seed"],
            trials=trials,
            surroundings=_surroundings(controller, grid),
            executor=executor,
            checkpoint=checkpoint,
            progress=progress,
        )
    return result, checkpoint, controller


def _surroundings(controller: dict[str, Any], grid: Grid) -> dict[str, float]:
    """Return clock and limit of the controller in trial runs, dimensionless."""
    rig = grid.rig
    unit = {
        "period": 1.0 if rig is None else rig.time_scale,
        "limit": 1.0 if rig is None else rig.torsional_stiffness,
    }
    return {
        name: float(controller[name]) / unit[name] for name in unit if controller[name] is not None
    }


def _finish(checkpoint: Checkpoint) -> None:
    left = checkpoint.remove()
    if left:
        click.echo(
            f"drillctrl: note: {checkpoint.path} keeps {left} designs of another command", err=True
        )
