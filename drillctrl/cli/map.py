"""`drillctrl map`: how hard the bit vibrates over two of the things that a driller sets."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError, checked_integer
from drillctrl.cli.axes import read_counted_axis, with_axes
from drillctrl.cli.drive_law import drive_law, driven_place
from drillctrl.cli.drives import are_drives
from drillctrl.cli.output import (
    check_figure,
    check_folder,
    json_text,
    plain,
    write_figure,
    writing,
)
from drillctrl.cli.point import point_options, read_point, rig_name
from drillctrl.cli.progress import open_progress
from drillctrl.cli.scenario import (
    SURROUNDINGS,
    controller_options,
    read_controller,
    read_duration,
    read_starts,
    read_surroundings,
)
from drillctrl.cli.verb import Verb, naming

if TYPE_CHECKING:
    from drillctrl.base.checkpoint import Checkpoint
    from drillctrl.drilling.point import OperatingPoint, RigPoint
    from drillctrl.simulation.controller import Controller
    from drillctrl.strings.drive_laws import DriveLaws
    from drillctrl.tables.gain_table import GainTable

_RIG_AXES = ("speed=50:180 rpm", "rop=5:50 m/h")
_AXES = ("omega0=4:24", "delta0=0.5:12")
_COUNTS = (15, 12)


@click.command(name="map", cls=Verb)
@point_options
@click.option(
    "--x",
    "x_axis",
    metavar="NAME=LOW:HIGH[:COUNT]",
    help="Such as 'speed=50:180:15 rpm', which is the default with a rig; else omega0=4:24.",
)
@click.option(
    "--y",
    "y_axis",
    metavar="NAME=LOW:HIGH[:COUNT]",
    help="Such as 'rop=5:50:12 m/h', 'wob=5:40 kN', 'rock_strength=20:120 MPa'; delta0=0.5:12.",
)
@click.option(
    "--refine",
    type=int,
    default=1,
    show_default=True,
    metavar="TIMES",
    help="Halve the spacing this often where the outcome changes.",
)
@controller_options
@click.option(
    "--against",
    metavar="WHAT",
    help="In place of no control: a law of the drive, 'pd; K1=-3 kN*m/rad,…', or a table's file.",
)
@click.option(
    "--threshold",
    is_flag=True,
    help="Also where torsion loses its damping on the motion drilled with, under a top drive with "
    "its law: minutes more, of a string 20 s of processor at each of 35 places.",
)
@click.option(
    "--starts",
    default="small,kick,back",
    show_default=True,
    metavar="NAMES",
    help="Each point is judged by the worst: 'all' or some of small,kick,back,rest,stick.",
)
@click.option(
    "--duration",
    metavar="TIME",
    help="Of each run: dimensionless (default 200), with a rig '70 s'.",
)
@click.option("--workers", type=int, help="Processes (default: one for each core).")
@click.option("--scheduler", metavar="ADDRESS", help="A Dask cluster, such as tcp://host:8786.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option("--out", type=click.Path(), help="Write FILE.csv, .json or .nc; resumes when killed.")
@click.option("--plot", type=click.Path(), help="Draw the map: FILE.png, .svg, .pdf.")
@click.option(
    "--show",
    default="outcome,swing",
    show_default=True,
    metavar="NAMES",
    help="Drawn: outcome, swing, stick_fraction, off_rock_fraction, feed, weight_ratio.",
)
@click.option(
    "--difference", is_flag=True, help="Draw beside these what control changes: better, worse."
)
def map_command(
    x_axis: str | None,
    y_axis: str | None,
    refine: int,
    against: str | None,
    threshold: bool,
    starts: str,
    duration: str | None,
    workers: int | None,
    scheduler: str | None,
    as_json: bool,
    out: str | None,
    plot: str | None,
    show: str,
    difference: bool,
    **options: Any,
) -> None:
    """Map stick-slip and bit bounce over what a driller sets, by nonlinear runs.

    Where gains or a law of the top drive are given, the map without control stands beside that
    with them, or that of --against. The line is the edge of stable drilling by linear theory.
    A rig with a top drive is held by a stiff one where nothing else is said.

    \b
    Axes: omega0, delta0, psi, eta, xi, kappa, damping;
    with --rig speed (rpm), rop (m/h), wob (kN), rock_strength (MPa), and of
    a string depth (m) and mud (kg/m^3).

    \b
    Examples:
      drillctrl map --rig table1 --speed "120 rpm" --rop "20 m/h" --refine 0 --plot map.png
      drillctrl map --rig table1 --x "speed=60:160:6 rpm" --y "wob=10:40:5 kN" --refine 0 \\
          --structure pd --K1 "-2 kN*m/rad,-400 N*m*s/rad" --limit "5 kN*m" --out map.csv
      drillctrl map --rig vertical-3000 --x "speed=60:120:2 rpm" --y "rop=5:15:2 m/h" \\
          --refine 0 --starts small --duration "1 s" --structure soft-torque
      drillctrl map --x omega0=4:20:6 --y delta0=0.5:6:5 --psi 14 --refine 0

    With --out a run that was killed goes on where it was when it is started again.
    """
    check_folder("--out", out)
    check_figure(plot)
    if all(options[name] is None for name in ("structure", "table")):
        if difference:
            raise InputError("--difference", "given", "left out where there is no control")
        if against is not None:
            raise InputError("--against", against, "given together with --structure or --table")
    shown = tuple(part.strip() for part in show.split(","))
    if workers is not None:
        checked_integer("workers", workers, 1, 1024)
        if scheduler is not None:
            raise InputError("workers", workers, "left out with --scheduler, which has its own")
    usual = _AXES if options["rig"] is None else _RIG_AXES
    x, across = read_counted_axis("--x", usual[0] if x_axis is None else x_axis, _COUNTS[0])
    y, up = read_counted_axis("--y", usual[1] if y_axis is None else y_axis, _COUNTS[1])
    _check_weight(options, x[0], y[0])
    given = with_axes(options, x, y)
    where = read_point({name: given[name] for name in options})
    from drillctrl.base.checkpoint import Checkpoint
    from drillctrl.base.workers import cores, open_executor
    from drillctrl.drilling.case import as_case
    from drillctrl.drilling.point import RigPoint
    from drillctrl.simulation.starts import possible_starts
    from drillctrl.studies.tasks import closed_at
    from drillctrl.studies.vibration import vibration_map
    from drillctrl.studies.vibration_edge import held_against
    from drillctrl.studies.vibration_figure import check_shown
    from drillctrl.studies.vibration_files import check_map_path

    if out is not None:
        with naming("--out", "path"):
            check_map_path(out)
    with naming("--show", "quantities"):
        check_shown(shown)
    rig = where.rig if isinstance(where, RigPoint) else None
    where, controller, surroundings = _read_controller(options, where)
    other = None if against is None else _read_against(against, options, where)
    case, rig_point = as_case(where), where if isinstance(where, RigPoint) else None
    held = closed_at(controller or held_against(None, case), case, rig_point, surroundings)[0]
    names = read_starts(starts, possible_starts(held))
    length = read_duration(duration, rig)
    with (
        open_executor(workers or cores(), scheduler) as executor,
        nullcontext() if out is None else Checkpoint(f"{out}.checkpoint") as checkpoint,
        open_progress() as progress,
        naming("--x or --y", "counts"),
    ):
        result = vibration_map(
            where,
            x,
            y,
            controller,
            other,
            counts=(across, up),
            refine=refine,
            starts=names,
            duration=length,
            threshold=threshold,
            mark=_is_typed(options, x[0], y[0]),
            surroundings=surroundings,
            executor=executor,
            checkpoint=checkpoint,
            progress=progress,
        )
    if beyond := result.unvouched():
        told = f"the table holds no safe gains for {beyond} of {len(result.nodes)} points"
        click.echo(f"drillctrl: note: {told}", err=True)
    if out is not None:
        path = out
        writing("--out", path, lambda: result.save(path))
    if checkpoint is not None:
        _finish(checkpoint)
    if plot is not None:
        write_figure(plot, result.plot(shown, rig_name(options), difference))
    click.echo(json_text(result.to_dict()) if as_json else plain(result.summary()))


def _check_weight(options: dict[str, Any], *axes: str) -> None:
    """Refuse a weight on bit that is no axis: the feed that gives it differs over the map."""
    if options["wob"] is not None and "wob" not in axes:
        wanted = "an axis (--y 'wob=…'), or --rop instead: over the map the feed is held"
        raise InputError("--wob", options["wob"], wanted)


def _is_typed(options: dict[str, Any], *axes: str) -> bool:
    """Whether the operating point was given by what the axes are over."""
    return all(options.get(name) is not None for name in axes if name != "rock_strength")


def _read_against(
    text: str, options: dict[str, Any], where: OperatingPoint | RigPoint
) -> Controller | GainTable | DriveLaws:
    """Return what the controller is held against: a table's file, or a structure and its gains."""
    asked: dict[str, Any] = {**options, "structure": None, "k1": None, "k2": None, "table": None}
    if Path(text).suffix:
        asked["table"] = text
    else:
        asked["structure"], *gains = (part.strip() for part in text.split(";"))
        for part in gains:
            name, equals, value = part.partition("=")
            if name.strip() not in ("K1", "K2") or not equals:
                wanted = "a structure, with gains as in 'pd; K1=-3 kN*m/rad,-50 N*m*s/rad'"
                raise InputError("--against", text, wanted)
            asked[name.strip().lower()] = value.strip()
    found = _read_controller(asked, where)[1]
    assert found is not None
    return found


def _read_controller(
    options: dict[str, Any], where: OperatingPoint | RigPoint
) -> tuple[
    OperatingPoint | RigPoint, Controller | GainTable | DriveLaws | None, dict[str, Any] | None
]:
    """Return where it drills, what closes the loop, and what surrounds that.

    The drive of a rig under a law of its own has the delay, lag and limit that were typed.
    """
    from drillctrl.drilling.point import RigPoint
    from drillctrl.simulation.scenario import Scenario
    from drillctrl.strings.drive_laws import is_laws_file, load_laws, one_law
    from drillctrl.strings.drives import machine_of

    rig = where.rig if isinstance(where, RigPoint) else None
    groups = where.operating_point() if isinstance(where, RigPoint) else where
    structure, table = options["structure"], options["table"]
    laws = table is not None and structure is None and is_laws_file(table)
    if laws or (table is None and structure is not None and are_drives([structure])):
        where, around = driven_place(where, {**options, "table": None}, structure or table)
        if laws:
            return where, load_laws(table, machine_of(where.rig)), around
        control = drive_law(where, structure, (options["k1"], options["k2"]))
        return where, one_law(control), around
    if table is None:
        return where, read_controller(options, where, groups, Scenario(), 1.0, rig), None
    for name in ("structure", "k1", "k2"):
        if options[name] is not None:
            option = {"k1": "--K1", "k2": "--K2"}.get(name, "--structure")
            raise InputError(option, options[name], "left out where --table gives the gains")
    for name, usual in (("activation", None), ("noise", ""), ("delay", "fixed")):
        if options[name] != usual:
            raise InputError(f"--{name}", options[name], "left out with --table on a map")
    from drillctrl.drilling.case import as_case
    from drillctrl.tables.files import load_table

    surroundings = {name: options[name] for name in SURROUNDINGS}
    loaded = load_table(table, as_case(where).plant)
    return where, loaded, read_surroundings(surroundings, rig)


def _finish(checkpoint: Checkpoint) -> None:
    left = checkpoint.remove()
    if left:
        click.echo(
            f"drillctrl: note: {checkpoint.path} keeps {left} points of another command", err=True
        )
