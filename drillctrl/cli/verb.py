"""A verb of the command line, whose messages name options as they are typed."""

from __future__ import annotations

import contextlib
import math
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

import click

from drillctrl.base.errors import InputError, UndecidedError
from drillctrl.cli.output import STYLE, VERBOSE

Command = TypeVar("Command", bound=Callable[..., Any])

# Options by which one point and one loop is chosen.
_OF_THE_LOOP = (
    *("omega0", "delta0", "psi", "eta", "xi", "kappa", "damping", "blades"),
    *("rig", "speed", "rop", "wob", "rock_strength", "structure", "k1", "k2"),
)
# A number and a unit: 1e12 is no 1 of a unit e12.
_TYPED = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(?![eE][-+]?\d+\s*$)([A-Za-z'\"].*?)\s*")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE]\+?\d+)?")
# Numbers of a rig's point → the options that they are typed with.
_OF_THE_RIG = {"rotary_speed": "--speed", "penetration_rate": "--rop", "weight_on_bit": "--wob"}


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


def _verbose_option() -> click.Option:
    """Return what says whether theory is told for a rig."""

    def keep(ctx: click.Context, _: click.Parameter, value: bool) -> None:
        ctx.meta[VERBOSE] = value

    told = "Of a rig: symbols, roots and certificates too."
    return click.Option(["--verbose"], is_flag=True, help=told, expose_value=False, callback=keep)


class Verb(click.Command):
    """A command that turns the name of a parameter in a message into that of its option."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        drawing = [i for i, parameter in enumerate(self.params) if parameter.name == "plot"]
        if drawing:
            self.params.insert(drawing[0] + 1, _style_option())
        names = [parameter.name for parameter in self.params]
        if "rig" in names and "as_json" in names:
            self.params.insert(names.index("as_json"), _verbose_option())

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read what was typed, but for numbers that would be read as infinite."""
        for before, text in zip(["", *args], args, strict=False):
            option, value = text.split("=", 1) if re.match(r"--[\w-]+=", text) else (before, text)
            for piece in re.split(r"[,:;=\s]", value):
                if _NUMBER.fullmatch(piece) and math.isinf(float(piece)):
                    raise InputError(option, value, f"of numbers up to {sys.float_info.max:.2g}")
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        flags = {parameter.name: parameter.opts[0] for parameter in self.params if parameter.name}
        with contextlib.ExitStack() as stack:
            stack.enter_context(_as_typed(ctx, flags))
            for name, flag in (*flags.items(), *_OF_THE_RIG.items()):
                stack.enter_context(naming(flag, name))
            stack.enter_context(_naming_the_loop(ctx, flags))
            return super().invoke(ctx)


@contextlib.contextmanager
def _as_typed(ctx: click.Context, flags: Mapping[str, str]) -> Iterator[None]:
    """Say a number that was typed with a unit, and what is permitted, in that unit."""
    try:
        yield
    except InputError as error:
        named = {flag: ctx.params.get(name) for name, flag in flags.items()}
        typed = named.get(error.parameter)
        parts = _TYPED.fullmatch(typed) if isinstance(typed, str) else None
        if parts is None or not isinstance(error.value, float | int):
            raise
        permitted = _in_units(error.permitted, float(parts[1]), float(error.value), parts[2])
        raise InputError(error.parameter, typed, permitted) from None


def _in_units(permitted: str, number: float, value: float, unit: str) -> str:
    """Return an interval of `interval_text` in the unit in which ``value`` is ``number``."""
    limits = re.search(r"([\[(])(\S+), (\S+)([\])])", permitted)
    if limits is None:
        return permitted
    low, high = float(limits[2]), float(limits[3])
    factor = number / value if value else 1.0
    if not value and not {abs(low), abs(high)} <= {0.0, math.inf}:
        return f"{permitted} in the unit of the model"
    told = re.sub(r"^ \w+", "", permitted[limits.end() :])
    return f"in {limits[1]}{low * factor:.5g}, {high * factor:.5g}{limits[4]} {unit}{told}"


@contextlib.contextmanager
def _naming_the_loop(ctx: click.Context, flags: Mapping[str, str]) -> Iterator[None]:
    """Name the options that a loop was made of where its roots cannot be told apart."""
    try:
        yield
    except UndecidedError as error:
        typed = {
            flags[name]: str(ctx.params[name])
            for name in _OF_THE_LOOP
            if ctx.params.get(name) not in (None, ())
        }
        if error.parameter != "system" or not typed:
            raise
        permitted = error.permitted.replace("one whose", "such that its loop's", 1)
        raise InputError(" ".join(typed), " ".join(typed.values()), permitted) from None


@contextlib.contextmanager
def naming(option: str, *parameters: str) -> Iterator[None]:
    """Name an option in messages about parameters that it stands for."""
    try:
        yield
    except InputError as error:
        if error.parameter not in parameters:
            raise
        raise InputError(option, error.value, error.permitted) from None
