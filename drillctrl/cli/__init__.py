"""The command line: one verb for each thing that the package does, each in its module."""

from __future__ import annotations

import contextlib
import io
import logging
import sys
import warnings
from typing import TextIO

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.analyze import analyze_command
from drillctrl.cli.bench import bench_command
from drillctrl.cli.bit import bit_command
from drillctrl.cli.chart import chart_command
from drillctrl.cli.compare import compare_command
from drillctrl.cli.design import design_command
from drillctrl.cli.explore import explore_command
from drillctrl.cli.map import map_command
from drillctrl.cli.record import record_command
from drillctrl.cli.report import report_command
from drillctrl.cli.reproduce import reproduce_command
from drillctrl.cli.rig import rig_command
from drillctrl.cli.simulate import simulate_command
from drillctrl.cli.table import table_command

BAD_INPUT = 2


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="drillctrl")
def cli() -> None:
    """Design bounded delayed feedback that keeps a rotary drill string from vibrating.

    Where the rig drills is given by dimensionless groups (--omega0 --delta0 --psi) or by a
    rig (--rig --speed --rop). With neither, it is ω0 = 10, δ0 = 1.75, ψ = 14.
    """


for _command in (
    design_command,
    analyze_command,
    chart_command,
    map_command,
    compare_command,
    simulate_command,
    bit_command,
    table_command,
    record_command,
    bench_command,
    report_command,
    reproduce_command,
    rig_command,
    explore_command,
):
    cli.add_command(_command)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its status."""
    for stream in (sys.stdout, sys.stderr):
        _make_writable(stream)
    logger = logging.getLogger("drillctrl")
    logger.handlers, logger.propagate = [_Told()], False
    logger.setLevel(logging.INFO)
    try:
        with warnings.catch_warnings():
            # NumPy remarks on overflow; whether a number can be believed is told otherwise.
            warnings.simplefilter("ignore", RuntimeWarning)
            status = cli.main(arguments, prog_name="drillctrl", standalone_mode=False)
        sys.stdout.flush()
    except InputError as error:
        _fail(str(error))
    except click.UsageError as error:
        _fail(" ".join(error.format_message().split()))
    except click.exceptions.Abort:
        click.echo("drillctrl: interrupted", err=True)
        sys.exit(130)
    except OSError as error:
        # Nothing else is left to a caller: files are written with messages of their own.
        with contextlib.suppress(OSError):
            sys.stdout.close()
        # Whoever stops reading, as `head` does, has had enough.
        if not isinstance(error, BrokenPipeError):
            _fail(f"standard output = {error.strerror}: must be something that can be written to")
        sys.exit(1)
    sys.exit(status if isinstance(status, int) else 0)


class _Told(logging.Handler):
    """Tells on standard error what takes long."""

    def emit(self, record: logging.LogRecord) -> None:
        click.echo(f"drillctrl: {record.getMessage()}", err=True)


def _make_writable(stream: TextIO) -> None:
    """Let a stream take every character, whatever encoding it was opened with.

    A file or a pipe gets UTF-8 where its own encoding has no Greek; a terminal of that kind shows
    escapes, for another encoding would be garbled.
    """
    if not isinstance(stream, io.TextIOWrapper):
        return
    try:
        "αω → ·²".encode(stream.encoding)
    except (UnicodeEncodeError, LookupError):
        if stream.isatty():
            stream.reconfigure(errors="backslashreplace")
        else:
            stream.reconfigure(encoding="utf-8")


def _fail(message: str) -> None:
    click.echo(f"drillctrl: {message}", err=True)
    sys.exit(BAD_INPUT)
