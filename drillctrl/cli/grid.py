"""Options that say over which operating points a table goes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.point import with_damping
from drillctrl.cli.verb import Command, naming, with_options

if TYPE_CHECKING:
    from drillctrl.base.units import Dimension
    from drillctrl.tables.grid import Axis, Grid


_GROUPS = ("omega0", "delta0", "psi", "eta", "xi", "kappa", "damping", "blades")
_RIG = ("rig", "speed", "rop", "wob", "rock_strength", "depth", "mud")
_SPAN = "LOW:HIGH:COUNT"


def grid_options(command: Command) -> Command:
    """Add the options that say over which operating points a table goes."""
    with_unit = f"'{_SPAN} UNIT'"
    options = [
        click.option("--omega0", metavar=_SPAN, help="Rotary speed ω0, or one number."),
        click.option("--delta0", metavar=_SPAN, help="Depth of cut δ0, or one number."),
        click.option("--psi", metavar=_SPAN, help="Cutting coefficient ψ (default 14)."),
        click.option("--eta", type=float, help="Frequency ratio η (default 1.6)."),
        click.option("--xi", type=float, help="Axial damping ratio ξ (default 0.02)."),
        click.option("--kappa", type=float, help="Torsional damping ratio κ (default 0.02)."),
        click.option("--damping", type=float, help="Sets ξ and κ together."),
        click.option("--blades", type=float, help="Number of blades n (default 4)."),
        click.option("--rig", help="Preset (table1) or TOML file, instead of the above."),
        click.option("--units", metavar="NAME", help="Results of a rig in si or field units."),
        click.option("--speed", metavar=with_unit, help="Such as '90:180:10 rpm'."),
        click.option("--rop", metavar=with_unit, help="Such as '5:30:6 m/h'."),
        click.option("--wob", metavar=with_unit, help="Instead of --rop: '20:80:7 kN'."),
        click.option("--rock-strength", metavar=with_unit, help="Such as '40:80:5 MPa'."),
        click.option(
            "--axis",
            "further",
            multiple=True,
            metavar=f"NAME={_SPAN}",
            help="A further axis, such as kappa=0.01:0.05:3; may be repeated.",
        ),
        click.option(
            "--depth", metavar=with_unit, help="Length of a real string: '1500:4500:7 m'."
        ),
        click.option("--mud", metavar=with_unit, help="Its mud, such as '9:13:3 ppg'."),
    ]
    return with_options(command, options)  # fmt: skip


def checked_units(options: dict[str, Any], read: bool) -> str | None:
    """Return in which units a table is told, taken off the options.

    Raises
    ------
    InputError
        If there are none of that name, or nothing has units.
    """
    from drillctrl.base.language import told_language

    units: str | None = options.pop("units")
    if units is not None:
        if not read and options.get("rig") is None:
            raise InputError("--units", units, "left out without --rig")
        with naming("--units", "units"):
            told_language(units)
    return units


def read_grid(options: dict[str, Any]) -> Grid:
    """Return the grid that the options name.

    Raises
    ------
    InputError
        If dimensionless and rig options are mixed, or one is missing or wrong.
    """
    from drillctrl.tables.grid import dimensionless_grid

    given = {name: value for name, value in options.items() if value is not None}
    further = _further(options.get("further") or ())
    for name in ("depth", "mud"):
        if name in given and "rig" not in given:
            raise InputError(f"--{name}", given[name], "left out without the --rig of a string")
    groups = {k: given[k] for k in _GROUPS if k in given}
    rig = {k: given[k] for k in _RIG if k in given}
    if groups and rig:
        first = next(iter(groups))
        raise InputError(f"--{first}", groups[first], "left out where a rig is given")
    if rig:
        return _rig_grid(rig, further)
    for name in ("omega0", "delta0"):
        if name not in groups:
            raise InputError(f"--{name}", "(missing)", "given, such as 4:24:21, or else --rig")
    from drillctrl.drilling.point import OperatingPoint

    groups = with_damping(groups)
    axes = {name: _axis(name, str(groups.pop(name, "14")), None) for name in _GROUPS[:3]}
    corner = {name: axis.values[0] for name, axis in axes.items()}
    reference = OperatingPoint(**{**corner, **groups})
    return dimensionless_grid(**axes, reference=reference, further=further)


def _further(texts: Sequence[str]) -> list[Axis]:
    axes = []
    for text in texts:
        name, equals, span = text.partition("=")
        if not equals:
            raise InputError("--axis", text, f"NAME={_SPAN}, such as kappa=0.01:0.05:3")
        with naming("--axis", "axis", name.strip()):
            axes.append(_axis("axis", span, None, name.strip()))
    return axes


def _rig_grid(given: dict[str, str], extra: Sequence[Axis]) -> Grid:
    from drillctrl.base import units
    from drillctrl.drilling.plausibility import plausibility_notes
    from drillctrl.strings.files import load_rig
    from drillctrl.strings.words import wall_note
    from drillctrl.tables.grid import rig_grid

    for name in ("rig", "speed"):
        if name not in given:
            raise InputError(f"--{name}", "(missing)", "given, for a grid in rig units")
    if "rop" in given and "wob" in given:
        raise InputError("--wob", given["wob"], "left out where --rop is given")
    if "rop" not in given and "wob" not in given:
        raise InputError("--rop", "(missing)", "given, such as '5:30:6 m/h', or else --wob")
    further = {
        "rop": ("penetration_rate", units.SPEED),
        "wob": ("weight_on_bit", units.FORCE),
        "rock_strength": ("rock_strength", units.STRESS),
        "depth": ("depth", units.LENGTH),
        "mud": ("mud", units.DENSITY),
    }
    axes: dict[str, Any] = {
        name: _axis(option, given[option], dimension, name)
        for option, (name, dimension) in further.items()
        if option in given
    }
    speed = _axis("speed", given["speed"], units.ROTARY_SPEED, "rotary_speed")
    loaded = load_rig(given["rig"])
    grid = rig_grid(loaded, speed, **axes, further=extra)
    points = [case.rig_point for case in grid.cases]
    notes = dict.fromkeys(n for p in points if p is not None for n in plausibility_notes(p))
    if (rubs := wall_note(loaded)) is not None:
        click.echo(f"drillctrl: note: {rubs}", err=True)
    for note in list(notes)[:3]:
        click.echo(f"drillctrl: note: {note}", err=True)
    return grid


def read_depths(text: str) -> tuple[float, ...]:
    """Return depths, m, from a text such as ``1500:4500:7 m``."""
    from drillctrl.base import units

    return _axis("depth", text, units.LENGTH).values


def _axis(option: str, text: str, dimension: Dimension | None, name: str | None = None) -> Axis:
    """Read ``LOW:HIGH:COUNT`` or one number, with a unit behind it where there is one."""
    from drillctrl.base import units
    from drillctrl.tables.grid import linear_axis

    flag = f"--{option.replace('_', '-')}"
    numbers, _, unit = text.strip().partition(" ")
    parts = numbers.split(":")
    example = "4:24:21" if dimension is None else f"such as '60:180:13 {dimension.unit}'"
    try:
        if len(parts) not in (1, 3) or (dimension is None and unit):
            raise ValueError
        count = int(parts[2]) if len(parts) == 3 else 1
        ends = [float(part) for part in (parts[:2] if len(parts) == 3 else parts * 2)]
    except ValueError:
        raise InputError(flag, text, f"{_SPAN}, {example}") from None
    if dimension is not None:
        ends = [units.to_si(flag, f"{end!r} {unit}", dimension) for end in ends]
        if min(ends) < 0.0 or (min(ends) == 0.0 and option != "rop"):
            raise InputError(flag, text, "of positive values")
    return linear_axis(name or option, ends[0], ends[1], count)
