"""`drillctrl bench`: the string behind a socket, for a drive's software."""

from __future__ import annotations

import ipaddress
import math
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.output import (
    check_figure,
    check_folder,
    json_text,
    plain,
    write_figure,
    writing,
)
from drillctrl.cli.point import point_options, read_point
from drillctrl.cli.scenario import (
    SURROUNDING_OPTIONS,
    read_duration,
    read_scenario,
    read_surroundings,
)
from drillctrl.cli.verb import Command, Verb, naming, with_options

if TYPE_CHECKING:
    from drillctrl.drilling.plant import Plant
    from drillctrl.hardware.client import Law
    from drillctrl.hardware.result import BenchRun
    from drillctrl.hardware.wire import Address
    from drillctrl.tables.gain_table import GainTable

_USUAL_PERIOD = {False: "0.05", True: "10 ms"}
# What says where and how the string runs, which a replay has no use for.
_NOT_REPLAYED = (
    *("period", "duration", "outputs", "inputs", "start", "initial", "change", "plot"),
    *("rig", "speed", "rop", "omega0", "delta0", "psi"),
)


def _options(command: Command) -> Command:
    options = [
        click.option(
            "--period", metavar="TIME", help="Between samples (default 0.05; with a rig 10 ms)."
        ),
        *SURROUNDING_OPTIONS[1:],
        click.option("--outputs", metavar="NAMES", help="Measured, such as theta,dtheta."),
        click.option("--inputs", metavar="NAMES", help="Driven, such as torque."),
        click.option(
            "--duration", metavar="TIME", help="Dimensionless (default 200); with a rig '60 s'."
        ),
        click.option("--start", default="steady", show_default=True, help="As for simulate."),
        click.option("--initial", help="As for simulate."),
        click.option("--change", multiple=True, metavar="T=TIME,…", help="As for simulate."),
        click.option(
            "--speedup",
            help="Times real time (without a rig units of time per second; default 1), or max: "
            "lock-step, as usual for --replay.",
        ),
        click.option("--host", default="127.0.0.1", show_default=True, help="Where to listen."),
        click.option("--port", type=int, default=47808, show_default=True, help="0: a free one."),
        click.option("--wait", default="60 s", show_default=True, help="For the controller."),
        click.option(
            "--patience", default="5 s", show_default=True, help="For an answer in lock-step."
        ),
        click.option(
            "--table", "answer", type=click.Path(), metavar="FILE",
            help="Answer with the controller exported of this table, over the same socket.",
        ),
        click.option(
            "--replay", "recorded", type=click.Path(), metavar="FILE",
            help="Send a recording's samples instead, and compare the answers.",
        ),
        click.option("--rtol", type=float, default=1e-8, show_default=True, help="As simulate."),
        click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead."),
        click.option("--out", type=click.Path(), help="Record to FILE.csv."),
        click.option("--plot", type=click.Path(), help="Draw the motion: FILE.png, .svg, .pdf."),
    ]  # fmt: skip
    return with_options(command, options)


@click.command(name="bench", cls=Verb)
@point_options
@_options
@click.pass_context
def bench_command(
    ctx: click.Context,
    /,
    answer: str | None,
    recorded: str | None,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **options: Any,
) -> None:
    """Run the string behind a socket, in real time, so that a drive's software closes the loop.

    \b
    Examples:
      drillctrl table --omega0 9:11:2 --delta0 2:3:2 --trials none --out answer.csv
      drillctrl bench --delta0 2.5 --duration 20 --speedup max --limit 5 \\
          --table answer.csv --out run.csv
      drillctrl bench --replay run.csv --limit 5 --table answer.csv

    Without --table it waits for a controller at its address: UDP on this machine alone, a datagram
    a sample, laid out as the guide says. Ctrl-C ends it with a report.
    """
    check_folder("--out", out)
    check_figure(plot)
    if out is not None and not out.lower().endswith(".csv"):
        raise InputError("--out", out, "a file that ends in .csv")
    line = _read_line(options, recorded is not None)
    if recorded is not None:
        for name in _NOT_REPLAYED:
            if ctx.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
                value = plot if name == "plot" else options[name]
                wanted = "left out where --replay gives the motion"
                raise InputError(f"--{name}", value, wanted)
        run = _replayed(recorded, answer, options, line)
    else:
        run = _benched(answer, options, line)
    if out is not None:
        writing("--out", out, lambda: run.recording.save(out))
    if plot is not None:
        write_figure(plot, run.plot())
    click.echo(json_text(run.to_dict()) if as_json else plain(run.summary()))


def _benched(answer: str | None, options: dict[str, Any], line: dict[str, Any]) -> BenchRun:
    """Run the string."""
    where = read_point(options)
    from drillctrl.drilling.point import RigPoint
    from drillctrl.hardware.bench import bench, bench_case, checked_signals

    rig = where.rig if isinstance(where, RigPoint) else None
    groups = where.operating_point() if isinstance(where, RigPoint) else where
    if options["period"] is None:
        options["period"] = _USUAL_PERIOD[rig is not None]
    length = read_duration(options["duration"], rig)
    scenario = read_scenario(options["start"], options["initial"], options["change"], groups, rig)
    around: dict[str, Any] = read_surroundings(options, rig)
    names = {
        what: None if options[what] is None else tuple(options[what].split(","))
        for what in ("outputs", "inputs")
    }
    case, _ = bench_case(where)
    table = _read_table(answer, case.plant)
    if table is not None:
        names["outputs"] = names["outputs"] or table.structure.outputs
        names["inputs"] = names["inputs"] or table.structure.inputs
        _check_signals(table, *checked_signals(case, names["outputs"], names["inputs"]))
    units = (1.0, 1.0) if rig is None else (rig.time_scale, rig.torsional_stiffness)
    law = _law(table, around["period"] * units[0], around.get("limit"), units[1])
    outputs, inputs = checked_signals(case, names["outputs"], names["inputs"])
    return bench(
        where,
        duration=length,
        outputs=outputs,
        inputs=inputs,
        scenario=scenario,
        rtol=options["rtol"],
        **around,
        **line,
        listening=_listening(law, len(outputs), len(inputs)),
    )


def _replayed(
    recorded: str, answer: str | None, options: dict[str, Any], line: dict[str, Any]
) -> BenchRun:
    """Replay a recording."""
    from drillctrl.base import units
    from drillctrl.hardware.bench import replay
    from drillctrl.hardware.recording import load_recording

    with naming("--replay", "replay"):
        found = load_recording(recorded)
    table = _read_table(answer)
    law = None
    if table is not None:
        _check_signals(table, found.outputs, found.inputs)
        rig = table.grid.rig
        told = "dimensionless" if rig is None else "SI"
        if told != found.units:
            raise InputError("--table", f"of {told} gains", f"for a recording in {found.units}")
        limit = options["limit"]
        if limit is not None:
            from drillctrl.cli.quantity import read_quantity

            unit = None if rig is None else rig.torsional_stiffness
            limit = read_quantity("--limit", limit, units.TORQUE, unit)
        law = _law(table, found.period, limit, 1.0)
    listening = _listening(law, len(found.outputs), len(found.inputs))
    return replay(found, **line, listening=listening)


def _read_line(options: dict[str, Any], replayed: bool) -> dict[str, Any]:
    """Return where to listen, how fast, and for how long."""
    from drillctrl.base import units

    text = options["speedup"] or ("max" if replayed else "1")
    speedup = math.inf
    if text != "max":
        try:
            speedup = float(text)
        except ValueError:
            raise InputError("--speedup", text, "a positive number, or max") from None
        if not 0.0 < speedup < math.inf:
            raise InputError("--speedup", text, "a positive number, or max")
    line = {"speedup": speedup, "host": options["host"], "port": options["port"]}
    for name in ("wait", "patience"):
        line[name] = units.to_si(f"--{name}", options[name], units.TIME)
    return line


def _read_table(path: str | None, plant: Plant | None = None) -> GainTable | None:
    if path is None:
        return None
    from drillctrl.tables.files import load_table

    with naming("--table", "table"):
        return load_table(path, plant)


def _check_signals(table: GainTable, outputs: tuple[str, ...], inputs: tuple[str, ...]) -> None:
    if (table.structure.outputs, table.structure.inputs) != (outputs, inputs):
        wanted = f"one that feeds {', '.join(outputs)} back to {', '.join(inputs)}"
        raise InputError("--table", table.structure.name, wanted)


def _law(table: GainTable | None, period: float, limit: float | None, unit: float) -> Law | None:
    """Return what answers, if it is to be here; the limit is in so many units of the table."""
    if table is None:
        return None
    from drillctrl.hardware.client import table_law

    if limit is None:
        raise InputError("--limit", "(missing)", "given with --table")
    with naming("--table", "table"):
        return table_law(table, period, limit * unit)


def _listening(law: Law | None, outputs: int, inputs: int) -> Callable[[Address], None]:
    """Return what says where the bench listens, and sets an answering controller going."""

    def told(address: Address) -> None:
        host, port = address
        click.echo(f"drillctrl: note: listening on {host}:{port} (UDP)", err=True)
        if not ipaddress.ip_address(host).is_loopback:
            click.echo("drillctrl: note: other machines can answer too", err=True)
        if law is not None:
            from drillctrl.hardware.client import answer_bench

            threading.Thread(
                target=answer_bench,
                args=(address, law),
                kwargs={"outputs": outputs, "inputs": inputs},
                daemon=True,
            ).start()

    return told
