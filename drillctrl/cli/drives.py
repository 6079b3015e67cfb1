"""Drives of a rig's string side by side: the part of `drillctrl compare` for top drives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from drillctrl.base.errors import InputError
from drillctrl.cli.gains import gain_scales, read_gains
from drillctrl.cli.output import check_figure, deliver, json_text, write_figure, writing
from drillctrl.cli.point import read_point
from drillctrl.cli.verb import naming

if TYPE_CHECKING:
    from drillctrl.drilling.bit_rock import BitRock
    from drillctrl.drilling.case import Case
    from drillctrl.drilling.point import OperatingPoint, RigPoint

Command = TypeVar("Command", bound=Callable[..., Any])

ENDINGS = (".csv", ".json")
_ALONE = ("plot", "drop", "decay")
_BEARS = ("rig", "structures", "as_json", "out", *_ALONE)
_POINT = ("rig", "speed", "rop", "wob", "rock_strength")
_DESIGN_BEARS = (*_POINT, "structure", "require_stable", "as_json", "out", "plot")


def drive_options(command: Command) -> Command:
    """Add the options that drives alone take."""
    options = [
        click.option("--plot", type=click.Path(), help="Draw drives: FILE.png, .svg, .pdf."),
        click.option("--drop", help="Drives: torque that falls as the bit turns faster [2 kN*m]."),
        click.option("--decay", help="Drives: speed over which it falls [5 rad/s]."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def are_drives(names: Sequence[str]) -> bool:
    """Whether structures are laws of a top drive.

    Raises
    ------
    InputError
        If some are and some are not.
    """
    from drillctrl.strings.drives import DRIVE_NAMES

    known = [name in DRIVE_NAMES or name.startswith("dynamic-") for name in names]
    if any(known) and not all(known):
        odd = names[known.index(False)]
        raise InputError("--structures", odd, f"among {', '.join(DRIVE_NAMES)}, as the others are")
    return any(known)


def refuse_drive_options(options: Mapping[str, Any]) -> None:
    """Refuse options of drives where structures act at the bit."""
    for name in _ALONE:
        if options[name] is not None:
            wanted = "left out, or given with structures of a top drive such as stiff"
            raise InputError(f"--{name}", options[name], wanted)


def driven_case(
    where: OperatingPoint | RigPoint,
    structure: str,
    gains: tuple[str | None, str | None],
    tried: bool,
    bit: BitRock,
) -> Case:
    """Return the case of a rig that is turned by a drive under a law.

    Parameters
    ----------
    where : RigPoint
        Where it drills.
    structure : str
        The law.
    gains : (str or None, str or None)
        K1 of a PI law on the top's angle and speed, without it its rule's; and K2.
    tried : bool
        Whether trial runs are wanted.
    bit : BitRock
        What the bit meets.

    Raises
    ------
    InputError
        If there is no rig with a top drive, or an option does not fit.
    """
    from drillctrl.drilling.case import as_case
    from drillctrl.drilling.plant import top_drive_plant
    from drillctrl.drilling.point import RigPoint
    from drillctrl.drilling.structures import soft_torque
    from drillctrl.strings.drive_law import driven_plant
    from drillctrl.strings.drives import drive_control, given_control, machine_of
    from drillctrl.strings.rig import StringRig

    k1, k2 = gains
    if not isinstance(where, RigPoint):
        raise InputError("--structure", structure, "used with --rig: it turns a string")
    if k2 is not None:
        raise InputError("--K2", k2, f"left out: {structure} feeds back nothing delayed")
    if tried:
        raise InputError("--trials", "all", "none for structures of a top drive")
    machine_of(where.rig)
    assert isinstance(where.rig, StringRig)
    if k1 is None:
        control = drive_control(structure, where.rig)
    else:
        scales = gain_scales(soft_torque(), top_drive_plant(1.0), where.rig)
        with naming("--K1", "K1"):
            read = read_gains("K1", k1, scales)
            assert read is not None
            assert scales is not None
            si = [gain * scale for gain, (scale, _) in zip(read, scales, strict=False)]
            control = given_control(structure, where.rig, si[0], si[1])
    return as_case(where, driven_plant(where.rig, control, bit))


def _check_options() -> None:
    """Refuse what was typed and does not bear on drives; say so of where the bit drills."""
    context = click.get_current_context()
    for parameter in context.command.params:
        name = parameter.name or ""
        typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if not typed or name in _BEARS:
            continue
        option, value = parameter.opts[0], context.params[name]
        if name not in ("speed", "rop", "wob"):
            raise InputError(option, value, "left out for drives: the string alone decides")
        click.echo(f"drillctrl: note: {option} does not bear on drives", err=True)


def deliver_drive_design(
    structure: str,
    point: Mapping[str, Any],
    as_json: bool,
    out: str | None,
    plot: str | None,
) -> bool:
    """Find the law of a top drive, print, and write the files asked for.

    Returns
    -------
    bool
        Whether it is stable: with a free bit, and at the point if there is one.

    Raises
    ------
    InputError
        If an option is missing, wrong, or one that does not bear on drives.
    """
    context = click.get_current_context()
    for parameter in context.command.params:
        name = parameter.name or ""
        typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if typed and name not in _DESIGN_BEARS:
            wanted = f"left out with --structure {structure}, a law of a top drive"
            raise InputError(parameter.opts[0], context.params[name], wanted)
    if point.get("rig") is None:
        raise InputError("--rig", "(missing)", "given: drives turn a string")
    from drillctrl.designs.drive_design import design_drive
    from drillctrl.strings.files import load_rig

    drills = any(point.get(name) is not None for name in _POINT[1:])
    where: Any = read_point(dict(point)) if drills else load_rig(point["rig"])
    found = design_drive(where, structure)
    deliver(found.to_dict(), found.summary, found.plot, as_json=as_json, out=out, plot=plot)
    return found.stable


def deliver_drives(
    names: Sequence[str],
    point: Mapping[str, Any],
    given: Mapping[str, Any],
    as_json: bool,
    out: str | None,
) -> None:
    """Compare drives, print, and write the files asked for.

    Parameters
    ----------
    names : sequence of str
        Laws.
    point : mapping
        Options that say where the rig drills; drives need ``rig`` alone.
    given : mapping
        ``plot``, ``drop`` and ``decay``.
    as_json : bool
        Whether to print JSON.
    out : str or None
        File for the numbers.

    Raises
    ------
    InputError
        If an option is missing, wrong, or one that does not bear on drives.
    """
    check_figure(given["plot"])
    if out is not None and Path(out).suffix.lower() not in ENDINGS:
        raise InputError("--out", out, f"a file that ends in {' or '.join(ENDINGS)} for drives")
    _check_options()
    if point.get("rig") is None:
        raise InputError("--rig", "(missing)", "given: drives turn a string")
    from drillctrl.base import units
    from drillctrl.strings.drives import compare_drives
    from drillctrl.strings.falling import FallingTorque
    from drillctrl.strings.files import load_rig

    falling = {}
    for name, dimension in (("drop", units.TORQUE), ("decay", units.ROTARY_SPEED)):
        if given[name] is not None:
            falling[name] = units.to_si(f"--{name}", given[name], dimension)
    found = compare_drives(load_rig(point["rig"]), names, FallingTorque(**falling))
    if out is not None:
        csv = Path(out).suffix.lower() == ".csv"
        text = found.to_csv() if csv else json_text(found.to_dict()) + "\n"
        from drillctrl.base.files import write_text

        writing("--out", out, lambda: write_text(out, text))
    if given["plot"] is not None:
        write_figure(given["plot"], found.plot())
    click.echo(json_text(found.to_dict()) if as_json else found.summary())
