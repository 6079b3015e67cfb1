"""`drillctrl simulate`: the motion from a start, printed, written and drawn."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError, checked_number
from drillctrl.cli.drive_law import driven_run, meant_structure
from drillctrl.cli.drives import are_drives
from drillctrl.cli.motions import FIGURES, Wanted, deliver_run, deliver_starts
from drillctrl.cli.output import check_figure, check_folder
from drillctrl.cli.point import point_options, read_point, rig_name
from drillctrl.cli.progress import open_run_progress
from drillctrl.cli.roots import NOT_STABILISED
from drillctrl.cli.scenario import (
    controller_options,
    read_controller,
    read_duration,
    read_scenario,
    read_starts,
    read_time,
)
from drillctrl.cli.verb import Verb

if TYPE_CHECKING:
    from drillctrl.simulation.controller import Controller
    from drillctrl.simulation.result import Simulation
    from drillctrl.simulation.starts import StartRun


@click.command(name="simulate", cls=Verb)
@point_options
@controller_options
@click.option("--model", default="nonlinear", show_default=True, help="nonlinear or linear.")
@click.option(
    "--cutting",
    default="multiple",
    show_default=True,
    help="Rock face: multiple (deepest of all passes) or single (the last pass).",
)
@click.option(
    "--backwards",
    default="rest",
    show_default=True,
    help="A bit that turns back: rest (its cutters rest on the rock) or stop (the run ends).",
)
@click.option(
    "--duration",
    metavar="TIME",
    help="Dimensionless, as every TIME (default 200); with a rig '60 s'.",
)
@click.option(
    "--start",
    default="steady",
    show_default=True,
    help="steady (drilling); rest; stick (bit stuck until then); small, kick, back (disturbed).",
)
@click.option(
    "--starts",
    metavar="NAMES",
    help="A run from each: 'all' or some of small,kick,back,rest,stick; the worst is told.",
)
@click.option(
    "--initial",
    help="Perturbation at t = 0 of the bit: x, dx, theta, dtheta (default dx=1,dtheta=1; none from "
    "rest); with a rig 'dx=1 m/h,dtheta=5 rpm'. A string moves with dx and dtheta.",
)
@click.option(
    "--change",
    multiple=True,
    metavar="T=TIME,…",
    help="Of drive or rock: 't=50,omega0=9', 't=50,psi=18,duration=10'; may be repeated.",
)
@click.option("--rtol", type=float, default=1e-8, show_default=True, help="Relative error.")
@click.option("--time-limit", type=float, metavar="SECONDS", help="Stop the run after these.")
@click.option(
    "--every", metavar="TIME", help="Rows of --out at these distances, not at every step."
)
@click.option(
    "--require-stable", is_flag=True, help="Exit with 3 unless it settles or keeps swinging calmly."
)
@click.option("--floquet", is_flag=True, help="Floquet multipliers of the orbit at the end.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option("--out", type=click.Path(), help="Motion: FILE.csv, .npz or .parquet.")
@click.option("--plot", type=click.Path(), help="Draw a figure: FILE.png, .svg, .pdf.")
@click.option(
    "--figure",
    default="motion",
    show_default=True,
    help="motion, phase, axial-phase, linear (against it), face (of the rock, at the end).",
)
def simulate_command(
    model: str,
    cutting: str,
    backwards: str,
    duration: str | None,
    start: str,
    starts: str | None,
    initial: str | None,
    change: tuple[str, ...],
    rtol: float,
    time_limit: float | None,
    every: str | None,
    require_stable: bool,
    floquet: bool,
    as_json: bool,
    out: str | None,
    plot: str | None,
    figure: str,
    **options: Any,
) -> None:
    """Try gains, or none, on the nonlinear drill string: stick, slip and bounce.

    The top drive of a rig is stiff unless a law is named, or constant-torque.

    \b
    Examples:
      drillctrl simulate --omega0 10 --delta0 2.5 --psi 14 --duration 200 --plot motion.png
      drillctrl simulate --delta0 2.5 --structure case1 --K1 -3.82 --K2 3.61 --out motion.csv
      drillctrl simulate --delta0 2.5 --floquet --plot portrait.png --figure phase
      drillctrl simulate --rig table1 --speed "150 rpm" --rop "20 m/h" --duration "30 s"
      drillctrl simulate --rig table1 --speed "80 rpm" --rop "20 m/h" --starts all
      drillctrl simulate --rig vertical-3000 --speed "120 rpm" --rop "5 m/h" \\
          --structure z-torque --measurement-delay "20 ms" --duration "2 s"
    """
    check_folder("--out", out)
    check_figure(plot)
    if figure not in FIGURES:
        raise InputError("--figure", figure, f"one of {', '.join(FIGURES)}")
    where = read_point(options)
    from drillctrl.drilling.point import RigPoint
    from drillctrl.simulation.export import check_export_path, checked_every
    from drillctrl.simulation.run import checked_run, simulate
    from drillctrl.simulation.starts import possible_starts, start_runs

    if out is not None:
        check_export_path(out)
    rig = where.rig if isinstance(where, RigPoint) else None
    groups = where.operating_point() if isinstance(where, RigPoint) else where
    length = read_duration(duration, rig)
    step = None if every is None else checked_every(read_time("--every", every, rig), length)
    wanted = Wanted(out, step, plot, figure, rig_name(options))
    if starts is not None:
        alone = {"--start": start != "steady", "--initial": initial is not None}
        alone |= {"--floquet": floquet, "--figure linear": figure == "linear"}
        for option, given in alone.items():
            if given:
                raise InputError(option, "given", "left out where there is --starts")
    scenario = read_scenario(start, initial, change, groups, rig)
    options["structure"] = meant_structure(where, options["structure"], options)
    place: Any = where
    checked: Any = groups
    controller: Controller | None
    if options["structure"] is not None and are_drives([options["structure"]]):
        place, controller = driven_run(where, options)
        checked = place
    else:
        controller = read_controller(options, where, groups, scenario, length, rig)
    common: dict[str, Any] = {
        "duration": length,
        "cutting": cutting,
        "backwards": backwards,
        "rtol": rtol,
    }
    check = {**common, "scenario": scenario, "controller": controller}
    checked_run(checked, **check, model=model)
    if figure in ("linear", "face") and model == "linear":
        raise InputError("--figure", figure, "motion or phase for the linear model")
    if figure == "linear":
        checked_run(checked, **check, model="linear")
    if time_limit is not None:
        common["time_limit"] = checked_number("time_limit", time_limit, 0.0, open_low=True)
    if starts is None:

        def again(model: str) -> Simulation:
            with open_run_progress(length) as progress:
                return simulate(
                    place, controller, **common, scenario=scenario, model=model, progress=progress
                )

        calm = deliver_run(again, model, wanted, floquet, as_json)
    else:
        names = read_starts(starts, possible_starts(place, model == "linear"))
        common |= {"starts": names, "changes": scenario.changes, "model": model}

        def made() -> Iterator[StartRun]:
            with open_run_progress(length, len(names)) as progress:
                yield from start_runs(place, controller, **common, progress=progress)

        calm = deliver_starts(made(), len(names), wanted, as_json)
    if require_stable and not calm:
        raise click.exceptions.Exit(NOT_STABILISED)
