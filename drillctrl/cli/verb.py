"""A verb of the command line, whose messages name options as they are typed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import click

from drillctrl.base.errors import InputError

Command = TypeVar("Command", bound=Callable[..., Any])


def with_options(command: Command, options: Sequence[Callable[[Command], Command]]) -> Command:
    """Add options to a command, shown in their order."""
    for option in reversed(options):
        command = option(command)
    return command


class Verb(click.Command):
    """A command that turns the name of a parameter in a message into that of its option."""

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
