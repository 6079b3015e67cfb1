"""`drillctrl simulate`."""

from __future__ import annotations

from typing import Any

import click

from drillctrl.cli.gains import read_gains
from drillctrl.cli.output import check_figure, check_folder, json_text, write_figure, writing
from drillctrl.cli.point import point_options, read_point
from drillctrl.errors import InputError


def read_initial(text: str) -> dict[str, float]:
    """Return a perturbation from a text such as ``dx=1,dtheta=1``; empty for none."""
    initial = {}
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        name, _, value = part.partition("=")
        try:
            initial[name.strip()] = float(value)
        except ValueError:
            raise InputError("--initial", text, "of the form dx=1,dtheta=1") from None
    return initial


@click.command(name="simulate")
@point_options
@click.option("--structure", help="p, case1, pd or case2; without it, no control.")
@click.option("--K1", "k1", metavar="GAINS", help="On the outputs, such as -5.03,-4.91.")
@click.option("--K2", "k2", metavar="GAINS", help="On the delayed outputs.")
@click.option("--activation", type=float, default=0.0, help="Time at which control begins.")
@click.option("--model", default="nonlinear", show_default=True, help="nonlinear or linear.")
@click.option(
    "--cutting",
    default="multiple",
    show_default=True,
    help="Rock face: multiple (deepest of all passes) or single (the last pass).",
)
@click.option("--duration", type=float, default=200.0, show_default=True, help="Time units.")
@click.option(
    "--initial",
    default="dx=1,dtheta=1",
    show_default=True,
    help="Perturbation of steady drilling: x, dx, theta, dtheta.",
)
@click.option("--rtol", type=float, default=1e-8, show_default=True, help="Relative error.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option("--out", type=click.Path(), help="Motion: FILE.csv, .npz or .parquet.")
@click.option("--plot", type=click.Path(), help="Draw the motion: FILE.png, .svg, .pdf.")
def simulate_command(
    structure: str | None,
    k1: str | None,
    k2: str | None,
    activation: float,
    model: str,
    cutting: str,
    duration: float,
    initial: str,
    rtol: float,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **point: Any,
) -> None:
    """Try gains, or none, on the nonlinear drill string: stick, slip and bounce.

    \b
    Examples:
      drillctrl simulate --omega0 10 --delta0 2.5 --psi 14 --duration 200 --plot motion.png
      drillctrl simulate --delta0 2.5 --structure case1 --K1 -3.82 --K2 3.61 --out motion.csv
    """
    check_folder("--out", out)
    check_figure(plot)
    where = read_point(point)
    from drillctrl.simulation import Controller, simulate
    from drillctrl.simulation.build import is_compiled
    from drillctrl.simulation.export import check_export_path, export_motion
    from drillctrl.simulation.report import simulation_fields, simulation_summary
    from drillctrl.simulation.run import checked_run

    if out is not None:
        check_export_path(out)
    from drillctrl.operating_point import RigPoint

    rig_point = where if isinstance(where, RigPoint) else None
    groups = where.operating_point() if isinstance(where, RigPoint) else where
    controller = None
    if structure is not None:
        gains = read_gains("K1", k1), read_gains("K2", k2)
        if gains[0] is None:
            raise InputError("--K1", "(missing)", f"given for structure {structure}")
        controller = Controller(structure, gains[0], gains[1], activation=activation)
    elif k1 is not None or k2 is not None:
        raise InputError("--structure", "(missing)", "given together with gains")
    start = read_initial(initial)
    checked_run(groups, duration=duration, initial=start, model=model, cutting=cutting, rtol=rtol)
    if not is_compiled():
        click.echo("drillctrl: compiling the simulator, once, in about 20 s ...", err=True)
    run = simulate(
        groups,
        controller,
        duration=duration,
        initial=start,
        model=model,
        cutting=cutting,
        rtol=rtol,
    )
    if out is not None:
        writing("--out", out, lambda: export_motion(run, out))
    if plot is not None:
        from drillctrl.simulation.plotting import plot_motion

        write_figure(plot, plot_motion(run))
    if as_json:
        click.echo(json_text(simulation_fields(run)))
    else:
        click.echo(simulation_summary(run, rig_point))
