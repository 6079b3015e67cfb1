"""The bit–rock law of a verb as options."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.quantity import read_quantity

if TYPE_CHECKING:
    from drillctrl.drilling.bit_rock import BitRock
    from drillctrl.drilling.point import OperatingPoint, RigPoint

Command = TypeVar("Command", bound=Callable[..., Any])

LAWS = ("none", "paper", "stribeck")


def bit_law_options(command: Command) -> Command:
    """Add the options that say what the bit meets."""
    options = [
        click.option(
            "--bit-law", default="paper", show_default=True,
            help="none (a free bit), paper, or stribeck (torque falls as the bit turns faster).",
        ),
        click.option("--drop", help="Of stribeck: torque that falls, such as '2 kN*m'."),
        click.option("--decay", help="Of stribeck: speed over which it falls, such as '48 rpm'."),
    ]  # fmt: skip
    for option in reversed(options):
        command = option(command)
    return command


def read_bit_law(
    name: str, drop: str | None, decay: str | None, where: OperatingPoint | RigPoint
) -> BitRock:
    """Return the law that the options name.

    Raises
    ------
    InputError
        If there is no such law, or an option does not go with it.
    """
    if name not in LAWS:
        raise InputError("--bit-law", name, f"one of {', '.join(LAWS)}")
    for option, value in (("--drop", drop), ("--decay", decay)):
        if value is not None and name != "stribeck":
            raise InputError(option, value, "given with --bit-law stribeck")
    from drillctrl.base import units
    from drillctrl.drilling.bit_rock import PaperLaw
    from drillctrl.drilling.friction import FreeBit, Stribeck
    from drillctrl.drilling.point import RigPoint
    from drillctrl.strings.falling import FallingTorque

    if name != "stribeck":
        return FreeBit() if name == "none" else PaperLaw()
    torque, time, values = None, None, dict(Stribeck.parameters)
    if isinstance(where, RigPoint):
        torque, time = where.rig.torsional_stiffness, where.rig.time_scale
        usual = FallingTorque()
        values = {"drop": usual.drop / torque, "decay": usual.decay * time}
    if drop is not None:
        values["drop"] = read_quantity("--drop", drop, units.TORQUE, torque) / (torque or 1.0)
    if decay is not None:
        speed = None if time is None else 1.0 / time
        values["decay"] = read_quantity("--decay", decay, units.ROTARY_SPEED, speed) * (time or 1.0)
    for option, key, given in (("--drop", "drop", drop), ("--decay", "decay", decay)):
        if not values[key] > 0.0:
            raise InputError(option, given, "above 0")
    return Stribeck(**values)
