"""`drillctrl simulate`."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.output import check_figure, check_folder, json_text, write_figure, writing
from drillctrl.cli.point import point_options, read_point
from drillctrl.cli.scenario import (
    controller_options,
    read_controller,
    read_duration,
    read_scenario,
)
from drillctrl.cli.verb import Verb

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from drillctrl.simulation.result import Simulation

FIGURES = ("motion", "phase", "axial-phase", "linear", "face")


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
    "--duration",
    metavar="TIME",
    default="200",
    show_default=True,
    help="Dimensionless, as every TIME; with a rig also '60 s'.",
)
@click.option("--start", default="steady", show_default=True, help="steady (drilling) or rest.")
@click.option(
    "--initial",
    help="Perturbation at t = 0: x, dx, theta, dtheta (default dx=1,dtheta=1; none from rest).",
)
@click.option(
    "--change",
    multiple=True,
    metavar="T=TIME,…",
    help="Of drive or rock: 't=50,omega0=9', 't=50,psi=18,duration=10'; may be repeated.",
)
@click.option("--rtol", type=float, default=1e-8, show_default=True, help="Relative error.")
@click.option("--time-limit", type=float, metavar="SECONDS", help="Stop the run after these.")
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
    duration: str,
    start: str,
    initial: str | None,
    change: tuple[str, ...],
    rtol: float,
    time_limit: float | None,
    floquet: bool,
    as_json: bool,
    out: str | None,
    plot: str | None,
    figure: str,
    **options: Any,
) -> None:
    """Try gains, or none, on the nonlinear drill string: stick, slip and bounce.

    \b
    Examples:
      drillctrl simulate --omega0 10 --delta0 2.5 --psi 14 --duration 200 --plot motion.png
      drillctrl simulate --delta0 2.5 --structure case1 --K1 -3.82 --K2 3.61 --out motion.csv
      drillctrl simulate --delta0 2.5 --floquet --plot portrait.png --figure phase
      drillctrl simulate --rig table1 --speed "150 rpm" --rop "20 m/h" --duration "30 s"
    """
    check_folder("--out", out)
    check_figure(plot)
    if figure not in FIGURES:
        raise InputError("--figure", figure, f"one of {', '.join(FIGURES)}")
    if start not in ("steady", "rest"):
        raise InputError("--start", start, "steady or rest")
    where = read_point(options)
    from drillctrl.drilling.case import as_case
    from drillctrl.drilling.point import RigPoint
    from drillctrl.simulation.compile import is_compiled
    from drillctrl.simulation.export import check_export_path, export_motion
    from drillctrl.simulation.report import simulation_fields, simulation_summary
    from drillctrl.simulation.run import checked_run, simulate
    from drillctrl.simulation.structure import structure_of

    if out is not None:
        check_export_path(out)
    rig = where.rig if isinstance(where, RigPoint) else None
    groups = where.operating_point() if isinstance(where, RigPoint) else where
    length = read_duration(duration, rig)
    kick = initial if initial is not None else "" if start == "rest" else "dx=1,dtheta=1"
    scenario = read_scenario(start, kick, change, groups, rig)
    controller = read_controller(options, where, groups, scenario, length, rig)
    common: dict[str, Any] = {
        "scenario": scenario,
        "duration": length,
        "cutting": cutting,
        "rtol": rtol,
    }
    checked_run(groups, **common, controller=controller, model=model)
    if figure in ("linear", "face") and model == "linear":
        raise InputError("--figure", figure, "motion or phase for the linear model")
    if figure == "linear":
        checked_run(groups, **common, model="linear")
    if not is_compiled(structure_of(as_case(groups)).physics):
        click.echo("drillctrl: compiling the simulator, once, in about 20 s ...", err=True)

    def again(model: str) -> Simulation:
        stop = math.inf if time_limit is None else time_limit
        return simulate(where, controller, **common, model=model, time_limit=stop)

    run = again(model)
    multipliers = None
    if floquet:
        from drillctrl.simulation.floquet import floquet as multipliers_of

        multipliers = multipliers_of(run)
    if out is not None:
        writing("--out", out, lambda: export_motion(run, out))
    if plot is not None:
        write_figure(plot, _drawn(figure, run, again))
    if as_json:
        click.echo(json_text(simulation_fields(run, multipliers)))
    else:
        click.echo(simulation_summary(run, multipliers))


def _drawn(figure: str, run: Simulation, again: Callable[[str], Simulation]) -> Figure | Axes:
    from drillctrl.simulation.figure import (
        plot_against_linear,
        plot_phase_portrait,
        plot_rock_face,
    )

    if figure == "motion":
        return run.plot()
    if figure == "linear":
        ax = plot_against_linear(run, again("linear"))
    elif figure == "face":
        ax = plot_rock_face(run)
    else:
        plane = "torsion" if figure == "phase" else "axial"
        ax = plot_phase_portrait(run, plane, since=0.75 * float(run.times[-1]))
    return ax
