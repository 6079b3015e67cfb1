"""A verb of the command line, whose messages name options as they are typed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.output import STYLE

Command = TypeVar("Command", bound=Callable[..., Any])


def with_options(command: Command, options: Sequence[Callable[[Command], Command]]) -> Command:
    """Add options to a command, shown in their order."""
    for option in reversed(options):
        command = option(command)
    return command


def _style_option() -> click.Option:
    """Return what says how figures look; the command itself has no use for it."""

    def keep(ctx: click.Context, _: click.Parameter, value: str) -> None:
        ctx.meta[STYLE] = value

    told = "Of --plot: screen, or journal (88 or 180 mm wide, 7 points). FILE.csv has its data."
    return click.Option(
        ["--style"], default="screen", show_default=True, help=told, expose_value=False,
        callback=keep,
    )  # fmt: skip


class Verb(click.Command):
    """A command that turns the name of a parameter in a message into that of its option."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        drawing = [i for i, parameter in enumerate(self.params) if parameter.name == "plot"]
        if drawing:
            self.params.insert(drawing[0] + 1, _style_option())

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        flags = {parameter.name: parameter.opts[0] for parameter in self.params if parameter.name}
        with contextlib.ExitStack() as stack:
            for name, flag in flags.items():
                stack.enter_context(naming(flag, name))
            return super().invoke(ctx)


@contextlib.contextmanager
def naming(option: str, *parameters: str) -> Iterator[None]:
    """Name an option in messages about parameters that it stands for."""
    try:
        yield
    except InputError as error:
        if error.parameter not in parameters:
            raise
        raise InputError(option, error.value, error.permitted) from None
