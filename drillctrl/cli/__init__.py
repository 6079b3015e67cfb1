"""The command line: one verb for each thing that the package does, each in its module."""

from __future__ import annotations

import contextlib
import io
import logging
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from types import FrameType
from typing import NoReturn, TextIO

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
INTERRUPTED = 130


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
    if sys.stderr is None:
        # Whoever has closed it wants to hear nothing.
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if sys.stdout is None:
        _fail(f"standard output = (closed): {_WRITABLE}")
    for stream in (sys.stdout, sys.stderr):
        _make_writable(stream)
    logger = logging.getLogger("drillctrl")
    logger.handlers, logger.propagate = [_Told()], False
    logger.setLevel(logging.INFO)
    try:
        with warnings.catch_warnings(), _hearing():
            # NumPy remarks on overflow; whether a number can be believed is told otherwise.
            warnings.simplefilter("ignore", RuntimeWarning)
            status = cli.main(arguments, prog_name="drillctrl", standalone_mode=False)
            sys.stdout.flush()
    except InputError as error:
        _fail(str(error))
    except click.UsageError as error:
        _fail(" ".join(error.format_message().split()))
    except (click.exceptions.Abort, KeyboardInterrupt):
        _fail("interrupted", INTERRUPTED)
    except OSError as error:
        if error.filename is not None:
            _fail(f"{error.filename}: must be a file that can be written ({error.strerror})")
        # Nothing else is left to a caller: files are written with messages of their own.
        with contextlib.suppress(OSError):
            sys.stdout.close()
        # Whoever stops reading, as `head` does, has had enough.
        if not isinstance(error, BrokenPipeError):
            _fail(f"standard output = {error.strerror}: {_WRITABLE}")
        sys.exit(1)
    sys.exit(status if isinstance(status, int) else 0)


_WRITABLE = "must be something that can be written to"


@contextlib.contextmanager
def _hearing() -> Iterator[None]:
    """Let whatever an interrupt breaks off end as one.

    Compiled code that hears it may make another exception of it.
    """
    heard = False

    def hear(sign: int, frame: FrameType | None) -> NoReturn:
        nonlocal heard
        heard = True
        signal.default_int_handler(sign, frame)

    usual = signal.getsignal(signal.SIGINT)
    ours = usual is signal.default_int_handler
    if ours and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, hear)
    try:
        yield
    except (InputError, click.ClickException, OSError):
        raise
    except Exception:
        if heard:
            raise KeyboardInterrupt from None
        raise
    finally:
        if signal.getsignal(signal.SIGINT) is hear:
            signal.signal(signal.SIGINT, usual)


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


def _fail(message: str, status: int = BAD_INPUT) -> NoReturn:
    # Where nobody can be told, the status tells.
    with contextlib.suppress(OSError):
        click.echo(f"drillctrl: {message}", err=True)
    sys.exit(status)
