"""The verb ``chart`` of the command line."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from drillctrl.cli import (
    _check_outputs,
    _output_options,
    _point_options,
    _writing,
    read_bounds,
    read_gains,
    read_point,
)
from drillctrl.errors import InputError

if TYPE_CHECKING:
    from drillctrl.charts.optimised import OptimisedChart
    from drillctrl.charts.stability_chart import StabilityChart


def read_axis(option: str, text: str) -> tuple[str, object, object]:
    """Return name and limits from a text such as ``omega0=0.5:25`` or ``rop=0:40 m/h``.

    Raises
    ------
    InputError
        If the text has not that form.
    """
    name, equals, interval = text.partition("=")
    low, colon, high = (part.strip() for part in interval.partition(":"))
    if not (equals and colon and low and high):
        raise InputError(option, text, "of the form omega0=0.5:25 or 'speed=30:200 rpm'")
    unit = " ".join(high.split()[1:])
    if unit and " " not in low:
        low = f"{low} {unit}"
    limits: list[object] = []
    for part in (low, high):
        try:
            limits.append(float(part))
        except ValueError:
            limits.append(part)
    return name.strip(), limits[0], limits[1]


@click.command(name="chart")
@_point_options
@click.option("--x", "x_axis", default="omega0=0.5:25", show_default=True, metavar="NAME=LOW:HIGH")
@click.option("--y", "y_axis", default="delta0=0:15", show_default=True, metavar="NAME=LOW:HIGH")
@click.option("--structure", help="p, case1, pd or case2; without it, the open loop.")
@click.option("--K1", "k1", metavar="GAINS", help="On the outputs, such as -5.03,-4.91.")
@click.option("--K2", "k2", metavar="GAINS", help="On the delayed outputs.")
@click.option("--level", type=float, default=0.0, help="Ask for all roots left of this.")
@click.option("--optimise", is_flag=True, help="Stable where some gains within bounds stabilise.")
@click.option("--bound", multiple=True, metavar="GAIN=LOW:HIGH", help="With --optimise.")
@_output_options
def chart_command(
    x_axis: str,
    y_axis: str,
    structure: str | None,
    k1: str | None,
    k2: str | None,
    level: float,
    optimise: bool,
    bound: tuple[str, ...],
    as_json: bool,
    out: str | None,
    plot: str | None,
    **point: Any,
) -> None:
    """Draw where the rig drills without vibration, over any two parameters.

    \b
    Examples:
      drillctrl chart --x omega0=0:25 --y delta0=0:15 --psi 14 --plot chart.png
      drillctrl chart --x K1_1=-10:10 --y K2_1=-10:10 --structure case1
      drillctrl chart --structure case1 --optimise --json
    """
    _check_outputs(out, plot)
    where = read_point(point)
    x, y = read_axis("--x", x_axis), read_axis("--y", y_axis)
    gains = read_gains("K1", k1), read_gains("K2", k2)
    result: StabilityChart | OptimisedChart
    if optimise:
        from drillctrl.charts.optimised import optimised_chart

        for name, given in (("--K1", k1), ("--K2", k2)):
            if given is not None:
                raise InputError(name, given, "left out with --optimise")
        if level:
            raise InputError("--level", level, "left out with --optimise")
        result = optimised_chart(
            where,
            x,
            y,
            structure or "case1",
            bounds=read_bounds(bound),
            progress=lambda text: click.echo(text, err=True),
        )
    else:
        from drillctrl.charts.stability_chart import chart

        if bound:
            raise InputError("--bound", bound[0], "given with --optimise only")
        result = chart(where, x, y, structure, *gains, level=level)
    _deliver(result, as_json, out, plot)


def _deliver(
    result: StabilityChart | OptimisedChart, as_json: bool, out: str | None, plot: str | None
) -> None:
    text = json.dumps(result.to_dict(), indent=2, allow_nan=False, ensure_ascii=False)
    if out is not None:
        from drillctrl.files import write_text

        _writing("--out", out, lambda: write_text(out, text + "\n"))
    if plot is not None:
        from drillctrl.plotting import save_figure

        figure = result.plot().get_figure(root=True)
        assert figure is not None
        _writing("--plot", plot, lambda: save_figure(figure, plot))
    click.echo(text if as_json else result.summary())
