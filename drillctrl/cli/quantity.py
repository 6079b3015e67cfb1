"""Numbers on the command line that carry a unit where a rig is given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError

if TYPE_CHECKING:
    from drillctrl.base.units import Dimension


def read_quantity(
    option: str, text: str, dimension: Dimension, unit: float | None, *, noted: bool = False
) -> float:
    """Return a number: SI where a rig's unit is known, else dimensionless.

    Parameters
    ----------
    option, text : str
        What was typed, and where.
    dimension : Dimension
        What it has to be.
    unit : float or None
        SI value of one dimensionless unit; None without a rig.
    noted : bool
        Whether a bare number with a rig is dimensionless, with a note of what it is in SI.

    Raises
    ------
    InputError
        If there is a unit without a rig, or none with one: a bare number could be meant in
        SI or dimensionless. Zero is zero in both, and an angle is the same.
    """
    from drillctrl.base import units

    try:
        bare = float(text)
    except ValueError:
        if unit is None:
            wanted = "a dimensionless number, or a rig to go with its unit"
            raise InputError(option, text, wanted) from None
        return units.to_si(option, text, dimension)
    if unit is None or unit == 1.0 or bare == 0.0:
        return bare
    if noted:
        told = f"{option} = {text} is dimensionless, {bare * unit:.6g} {dimension.unit}"
        click.echo(f"drillctrl: note: {told}", err=True)
        return bare * unit
    both = f"'{text} {dimension.unit}', or '{bare * unit:.6g} {dimension.unit}'"
    raise InputError(option, text, f"given with its unit: {both} for the dimensionless {text}")


def put_once(option: str, into: dict[str, Any], name: str, value: Any) -> None:
    """Keep a value by its name, which may be typed once.

    Raises
    ------
    InputError
        If it has been typed before: neither value is the one that is meant.
    """
    if name in into:
        raise InputError(option, name, "given once: it is there twice")
    into[name] = value
