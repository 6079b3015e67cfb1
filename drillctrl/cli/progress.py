"""How far the work has come, on standard error."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from drillctrl.base.workers import Progress


@contextlib.contextmanager
def open_stages() -> Iterator[Callable[[str], None] | None]:
    """Yield what says on a terminal what is being worked on, where steps cannot be counted."""
    if not sys.stderr.isatty():
        yield None
        return
    try:
        yield lambda stage: click.echo(f"\r\x1b[K{stage} …", nl=False, err=True)
    finally:
        click.echo("\r\x1b[K", nl=False, err=True)


@contextlib.contextmanager
def open_progress() -> Iterator[Progress | None]:
    """Yield what says on a terminal what is being done; nothing is said into a file."""
    if not sys.stderr.isatty():
        yield None
        return
    since: dict[str, float] = {}

    def show(stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        spent = now - since.setdefault(stage, now)
        # The first was done before the clock ran.
        left = (
            f", {spent / (done - 1) * (total - done):.0f} s left"
            if spent > 1.0 and done > 1
            else ""
        )
        click.echo(f"\r\x1b[K{done}/{total} {stage}{left}", nl=False, err=True)

    try:
        yield show
    finally:
        click.echo("\r\x1b[K", nl=False, err=True)


@contextlib.contextmanager
def open_run_progress(duration: float, runs: int = 1) -> Iterator[Callable[[float], None] | None]:
    """Yield what says which share of one or several runs after each other is done."""
    with open_progress() as show:
        if show is None:
            yield None
            return
        over, last = 0, 0.0

        def hear(reached: float) -> None:
            nonlocal over, last
            over, last = over + (reached < last), reached
            show("% of the motion", round(100.0 * (over + reached / duration) / runs), 100)

        yield hear
