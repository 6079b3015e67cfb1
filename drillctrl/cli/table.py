"""`drillctrl table`."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from drillctrl.cli.gains import read_bounds
from drillctrl.cli.objective import objective_options, read_objective
from drillctrl.cli.output import check_figure, check_folder, json_text, write_figure, writing
from drillctrl.cli.parallel import open_executor, open_progress
from drillctrl.errors import InputError

if TYPE_CHECKING:
    from drillctrl.tables.grid import Axis, Grid
    from drillctrl.tables.table import GainTable
    from drillctrl.units import Dimension

CONTROLLERS = (".c", ".st")
_GROUPS = ("omega0", "delta0", "psi", "eta", "xi", "kappa", "damping", "blades")
_RIG = ("rig", "speed", "rop", "wob", "rock_strength")


@click.command(name="table")
@click.option("--omega0", metavar="LOW:HIGH:COUNT", help="Rotary speed ω0, or one number.")
@click.option("--delta0", metavar="LOW:HIGH:COUNT", help="Depth of cut δ0, or one number.")
@click.option("--psi", metavar="LOW:HIGH:COUNT", help="Cutting coefficient ψ (default 14).")
@click.option("--eta", type=float, help="Frequency ratio η (default 1.6).")
@click.option("--xi", type=float, help="Axial damping ratio ξ (default 0.02).")
@click.option("--kappa", type=float, help="Torsional damping ratio κ (default 0.02).")
@click.option("--damping", type=float, help="Sets ξ and κ together.")
@click.option("--blades", type=float, help="Number of blades n (default 4).")
@click.option("--rig", help="Preset (table1) or TOML file, instead of the above.")
@click.option("--speed", metavar="'LOW:HIGH:COUNT UNIT'", help="Such as '90:180:10 rpm'.")
@click.option("--rop", metavar="'LOW:HIGH:COUNT UNIT'", help="Such as '5:30:6 m/h'.")
@click.option("--wob", metavar="'LOW:HIGH:COUNT UNIT'", help="Instead of --rop: '20:80:7 kN'.")
@click.option("--rock-strength", metavar="'LOW:HIGH:COUNT UNIT'", help="Such as '40:80:5 MPa'.")
@click.option("--structure", default="case1", show_default=True, help="p, case1, pd or case2.")
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
    "--fallback",
    default="off",
    show_default=True,
    help="Where nothing stabilises: off (no control) or best (best gains found).",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the starting points.")
@click.option("--workers", type=int, default=1, show_default=True, help="Processes.")
@click.option(
    "--scheduler", metavar="ADDRESS", help="Design on a Dask cluster, such as tcp://host:8786."
)
@click.option("--period", type=float, help="Sampling period of a .c or .st controller.")
@click.option("--limit", type=float, help="Largest |u| of a .c or .st controller.")
@click.option("--ramp", type=int, metavar="SAMPLES", help="Of its switch-on (default: a delay).")
@click.option("--real", help="Of a .c controller: double (default) or float.")
@click.option("--require-stable", is_flag=True, help="Exit with 3 if a node is not stable.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option(
    "--out",
    type=click.Path(),
    help="Write FILE.csv, .json, .parquet, .mat, .nc, .c (with .h) or .st.",
)
@click.option("--plot", type=click.Path(), help="Draw gains and α: FILE.png, .svg, .pdf.")
def table_command(
    structure: str,
    bound: tuple[str, ...],
    smooth: float,
    fallback: str,
    seed: int,
    workers: int,
    scheduler: str | None,
    period: float | None,
    limit: float | None,
    require_stable: bool,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **grid: Any,
) -> None:
    """Design gains over a grid of operating points, and check them between the nodes.

    \b
    Examples:
      drillctrl table --omega0 4:24:21 --delta0 0.25:12:16 --psi 14 --out gains.csv
      drillctrl table --rig table1 --speed "140:260:7 rpm" --rop "10:60:6 m/h" --out gains.csv
      drillctrl table --omega0 8:20:5 --delta0 1:7:4 --out gains.c --period 0.01 --limit 5

    
    With --out a run that was killed goes on where it was when it is started again.
    """
    check_folder("--out", out)
    check_figure(plot)
    if not 0.0 <= smooth <= 90.0:
        raise InputError("--smooth", smooth, "a number in [0, 90]")
    if not 1 <= workers <= 1024:
        raise InputError("--workers", workers, "a whole number in [1, 1024]")
    objective, requirements = read_objective(grid)
    if requirements:
        raise InputError("--min-decay, --min-radius, --max-input-gain", "given", "left out here")
    nodes = _read_grid({k: v for k, v in grid.items() if v is not None})
    from drillctrl.checkpoint import Checkpoint
    from drillctrl.tables.files import check_table_path, save_table
    from drillctrl.tables.table import table

    controller = out is not None and Path(out).suffix.lower() in CONTROLLERS
    if out is not None and not controller:
        check_table_path(out)
    _check_controller(out, period, limit, controller)
    with (
        open_executor(workers, scheduler) as executor,
        nullcontext() if out is None else Checkpoint(f"{out}.checkpoint") as checkpoint,
        open_progress() as progress,
    ):
        result = table(
            nodes,
            structure,
            bounds=read_bounds(bound),
            objective=objective,
            give_up=smooth / 100.0,
            fallback=fallback,
            seed=seed,
            executor=executor,
            checkpoint=checkpoint,
            progress=progress,
        )
    if out is not None and controller:
        assert period is not None
        assert limit is not None
        writing("--out", out, lambda: _write_controller(result, out, period, limit))
    elif out is not None:
        writing("--out", out, lambda: save_table(result, out))
    if checkpoint is not None:
        checkpoint.remove()
    if plot is not None:
        write_figure(plot, result.plot())
    click.echo(json_text(result.to_dict()) if as_json else result.summary())
    if require_stable and not result.stable.all():
        raise click.exceptions.Exit(3)


def _check_controller(
    out: str | None, period: float | None, limit: float | None, controller: bool
) -> None:
    for name, value in (("--period", period), ("--limit", limit)):
        if controller and value is None:
            raise InputError(name, "(missing)", f"given for {out}")
        if not controller and value is not None:
            raise InputError(name, value, "left out unless --out ends in .c or .st")


def _write_controller(result: GainTable, out: str, period: float, limit: float) -> None:
    path = Path(out)
    if path.suffix.lower() == ".st":
        from drillctrl.tables.export_st import export_st

        export_st(result, path, period=period, limit=limit)
    else:
        from drillctrl.tables.export_c import export_c

        export_c(result, path.parent, path.stem, period=period, limit=limit)


def _read_grid(given: dict[str, Any]) -> Grid:
    from drillctrl.tables.grid import dimensionless_grid

    groups = {k: given[k] for k in _GROUPS if k in given}
    rig = {k: given[k] for k in _RIG if k in given}
    if groups and rig:
        first = next(iter(groups))
        raise InputError(f"--{first}", groups[first], "left out where a rig is given")
    if rig:
        return _rig_grid(rig)
    for name in ("omega0", "delta0"):
        if name not in groups:
            raise InputError(f"--{name}", "(missing)", "given, such as 4:24:21, or else --rig")
    from drillctrl.operating_point import OperatingPoint

    damping = groups.pop("damping", None)
    if damping is not None:
        for name in ("xi", "kappa"):
            if name in groups:
                raise InputError(f"--{name}", groups[name], "left out where --damping is given")
            groups[name] = damping
    axes = {name: _axis(name, str(groups.pop(name, "14")), None) for name in _GROUPS[:3]}
    corner = {name: axis.values[0] for name, axis in axes.items()}
    return dimensionless_grid(**axes, reference=OperatingPoint(**{**corner, **groups}))


def _rig_grid(given: dict[str, str]) -> Grid:
    from drillctrl import units
    from drillctrl.rig import load_rig
    from drillctrl.tables.grid import rig_grid

    for name in ("rig", "speed"):
        if name not in given:
            raise InputError(f"--{name}", "(missing)", "given, for a grid in rig units")
    if ("rop" in given) == ("wob" in given):
        shown = given.get("rop", "(missing)")
        raise InputError("--rop", shown, "given, such as '5:30:6 m/h', or else --wob")
    further = {
        "rop": ("penetration_rate", units.SPEED),
        "wob": ("weight_on_bit", units.FORCE),
        "rock_strength": ("rock_strength", units.STRESS),
    }
    axes: dict[str, Any] = {
        name: _axis(option, given[option], dimension, name)
        for option, (name, dimension) in further.items()
        if option in given
    }
    speed = _axis("speed", given["speed"], units.ROTARY_SPEED, "rotary_speed")
    return rig_grid(load_rig(given["rig"]), speed, **axes)


def _axis(option: str, text: str, dimension: Dimension | None, name: str | None = None) -> Axis:
    """Read ``LOW:HIGH:COUNT`` or one number, with a unit behind it where there is one."""
    from drillctrl import units
    from drillctrl.tables.grid import linear_axis

    flag = f"--{option.replace('_', '-')}"
    numbers, _, unit = text.strip().partition(" ")
    parts = numbers.split(":")
    example = "4:24:21" if dimension is None else f"such as '60:180:13 {dimension.unit}'"
    try:
        if len(parts) not in (1, 3) or (dimension is None and unit):
            raise ValueError
        count = int(parts[2]) if len(parts) == 3 else 1
        ends = [float(part) for part in (parts[:2] if len(parts) == 3 else parts * 2)]
    except ValueError:
        raise InputError(flag, text, f"LOW:HIGH:COUNT, {example}") from None
    if dimension is not None:
        ends = [units.to_si(flag, f"{end!r} {unit}", dimension) for end in ends]
    return linear_axis(name or option, ends[0], ends[1], count)
