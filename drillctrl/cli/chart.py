"""`drillctrl chart`: where a loop is stable, or some gains make it so, over two parameters."""

from __future__ import annotations

import functools
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.axes import read_axis, with_axes
from drillctrl.cli.drive_law import driven_case, meant_structure
from drillctrl.cli.drives import are_drives
from drillctrl.cli.gains import Scales, read_bounds, read_gains, scales_at
from drillctrl.cli.output import (
    check_figure,
    check_folder,
    check_json,
    deliver,
    writing,
)
from drillctrl.cli.point import point_options, read_point, rig_name
from drillctrl.cli.verb import Verb, naming

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from drillctrl.charts.chart import StabilityChart
    from drillctrl.charts.stabilisable import StabilisableChart
    from drillctrl.charts.volume import StabilityVolume
    from drillctrl.drilling.point import OperatingPoint, RigPoint

MESH_ENDINGS = (".vtk", ".ply", ".stl")


@click.command(name="chart", cls=Verb)
@point_options
@click.option(
    "--x",
    "x_axis",
    metavar="NAME=LOW:HIGH",
    help="Default omega0=0.5:25; with a rig speed, from a quarter to twice its own.",
)
@click.option(
    "--y",
    "y_axis",
    metavar="NAME=LOW:HIGH",
    help="Default delta0=0:15; with a rig rop, up to twice its own.",
)
@click.option(
    "--structure",
    help="p, case1, pd or case2, or of a top drive: stiff (default there), soft-torque, "
    "z-torque, dynamic-2 …; without it, the open loop.",
)
@click.option("--K1", "k1", metavar="GAINS", help="On the outputs, such as -5.03,-4.91.")
@click.option("--K2", "k2", metavar="GAINS", help="On the delayed outputs.")
@click.option(
    "--level", type=float, default=0.0, help="Ask for all roots left of this instead of 0."
)
@click.option(
    "--optimise",
    is_flag=True,
    help="Draw where some gains of --structure within the bounds stabilise.",
)
@click.option(
    "--bound",
    multiple=True,
    metavar="GAIN=LOW:HIGH",
    help="With --optimise: for K1, K2 or one gain such as K1_2; may be repeated.",
)
@click.option("--z", "z_axis", metavar="NAME=LOW:HIGH", help="A third axis: a volume.")
@click.option("--slices", type=int, default=101, show_default=True, help="With --z.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.option(
    "--out",
    metavar="FILE",
    help="Also write that object to a .json file; with --z also the surface: .vtk, .ply, .stl.",
)
@click.option("--plot", metavar="FILE", help="Draw the chart (.png, .svg or .pdf).")
def chart_command(
    x_axis: str | None,
    y_axis: str | None,
    structure: str | None,
    k1: str | None,
    k2: str | None,
    level: float,
    optimise: bool,
    bound: tuple[str, ...],
    z_axis: str | None,
    slices: int,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **point: Any,
) -> None:
    """Draw where the rig drills without vibration, over any two parameters.

    \b
    Axes: omega0, delta0, psi, eta, xi, kappa, damping; gains such as K1_1;
    with --rig also speed (rpm), rop (m/h), wob (kN), rock_strength (MPa), and of
    a string depth (m; pipe added at the top) and mud (kg/m^3).

    \b
    Examples:
      drillctrl chart --x omega0=0:25 --y delta0=0:15 --psi 14 --plot chart.png
      drillctrl chart --x K1_1=-10:10 --y K2_1=-10:10 --structure case1
      drillctrl chart --rig table1 --speed "120 rpm" --rop "20 m/h" \\
          --x "speed=30:300 rpm" --y "rop=0:60 m/h" --structure p --K1 "-2 kN*m/rad"
      drillctrl chart --rig vertical-3000 --structure soft-torque --rop "10 m/h" \\
          --x "depth=1000:4000 m" --y "speed=60:180 rpm"
      drillctrl chart --z psi=0.1:26 --y delta0=0:5 --out volume.vtk
      drillctrl chart --optimise --structure p --x omega0=0:25 --y delta0=0:18
    """
    if z_axis is None or out is None or Path(out).suffix.lower() not in MESH_ENDINGS:
        check_json(out)
    check_folder("--out", out)
    check_figure(plot)
    given_x = None if x_axis is None else read_axis("--x", x_axis)
    given_y = None if y_axis is None else read_axis("--y", y_axis)
    where = read_point(with_axes(point, *(axis for axis in (given_x, given_y) if axis)))
    usual = _usual_axes(where)
    x, y = given_x or usual[0], given_y or usual[1]
    if not (optimise or bound):
        structure = meant_structure(where, structure, {"k1": k1, "k2": k2})
    result: StabilityChart | StabilisableChart | StabilityVolume
    if structure is not None and are_drives([structure]):
        result = _of_drive(where, x, y, structure, (k1, k2), level, optimise or bound, z_axis)
        deliver(result.to_dict(), result.summary, result.plot, as_json=as_json, out=out, plot=plot)
        return
    scales = scales_at(where, structure)
    x, y = _gain_axis("--x", x, structure, scales), _gain_axis("--y", y, structure, scales)
    gains = read_gains("K1", k1, scales), read_gains("K2", k2, scales)
    draw: Callable[[], Figure | Axes] | None = None
    if z_axis is not None:
        if optimise or level or bound:
            raise InputError("--z", z_axis, "left out with --optimise, --bound or --level")
        result = volume = _volume(where, x, y, z_axis, structure, gains, slices)
        if out is not None and Path(out).suffix.lower() in MESH_ENDINGS:
            mesh, out = out, None
            writing("--out", mesh, lambda: volume.save_mesh(mesh))
    elif optimise:
        result = _optimised(where, x, y, structure, gains, level, bound)
    else:
        if bound:
            raise InputError("--bound", bound[0], "given only with --optimise")
        from drillctrl.charts.chart import chart

        result = drawn = chart(where, x, y, structure, *gains, level=level)
        draw = functools.partial(drawn.plot, name=rig_name(point))
    deliver(
        result.to_dict(), result.summary, draw or result.plot, as_json=as_json, out=out, plot=plot
    )


def _usual_axes(
    where: OperatingPoint | RigPoint,
) -> tuple[tuple[str, object, object], tuple[str, object, object]]:
    """Return the axes where none are typed: what a driller sets, or the paper's."""
    from drillctrl.drilling.point import RigPoint

    if not isinstance(where, RigPoint):
        return ("omega0", 0.5, 25.0), ("delta0", 0.0, 15.0)
    rpm, rop = 30.0 / math.pi * where.rotary_speed, 3600.0 * where.penetration_rate
    return ("speed", 0.25 * rpm, 2.0 * rpm), ("rop", 0.0, 2.0 * rop or 30.0)


def _of_drive(
    where: OperatingPoint | RigPoint,
    x: tuple[str, object, object],
    y: tuple[str, object, object],
    structure: str,
    gains: tuple[str | None, str | None],
    level: float,
    optimised: object,
    z_axis: str | None,
) -> StabilityChart:
    """Return the chart of a string that is turned by a drive under a law."""
    from drillctrl.charts.chart import chart
    from drillctrl.drilling.bit_rock import PaperLaw

    if optimised:
        raise InputError("--structure", structure, "one that acts at the bit with --optimise")
    if z_axis is not None:
        raise InputError("--z", z_axis, "left out where a drive turns a string")
    return chart(driven_case(where, structure, gains, False, PaperLaw()), x, y, level=level)


def _gain_axis(
    option: str,
    axis: tuple[str, object, object],
    structure: str | None,
    scales: Scales | None,
) -> tuple[str, object, object]:
    """Return an axis, dimensionless if it is a gain's."""
    name, low, high = axis
    if scales is None or structure is None or not name.startswith(("K1", "K2")):
        return axis
    from drillctrl.drilling.structures import as_structure

    with naming(option, "--bound"):
        text = f"{name}={low}:{high}"
        return name, *read_bounds((text,), as_structure(structure), scales)[name]


def _volume(
    where: OperatingPoint | RigPoint,
    x: tuple[str, object, object],
    y: tuple[str, object, object],
    z_axis: str,
    structure: str | None,
    gains: tuple[list[float] | None, ...],
    slices: int,
) -> StabilityVolume:
    from drillctrl.charts.volume import stability_volume
    from drillctrl.drilling.point import RigPoint

    if isinstance(where, RigPoint):
        raise InputError("--z", z_axis, "given with dimensionless groups, not with --rig")
    z = read_axis("--z", z_axis)
    return stability_volume(where, x, y, z, structure, *gains, slices=slices)


def _optimised(
    where: OperatingPoint | RigPoint,
    x: tuple[str, object, object],
    y: tuple[str, object, object],
    structure: str | None,
    gains: tuple[list[float] | None, ...],
    level: float,
    bound: tuple[str, ...],
) -> StabilisableChart:
    from drillctrl.charts.stabilisable import stabilisable_chart
    from drillctrl.drilling.structures import preset_structure

    for name, given in zip(("--K1", "--K2"), gains, strict=True):
        if given is not None:
            raise InputError(name, str(given), "left out with --optimise")
    if structure is None:
        raise InputError("--structure", "(missing)", "given with --optimise")
    preset = preset_structure(structure)
    chosen = preset.with_bounds(read_bounds(bound, preset, scales_at(where, preset)))
    result = stabilisable_chart(where, x, y, chosen, level=level, progress=_show_progress)
    if sys.stderr.isatty():
        click.echo(err=True)
    return result


def _show_progress(done: int) -> None:
    """Say how far long work is, where a person watches."""
    if sys.stderr.isatty():
        click.echo(f"\rlines done: {done}", nl=False, err=True)
