"""Drives of a rig's string side by side: the part of `drillctrl compare` for top drives."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from drillctrl.base.errors import InputError
from drillctrl.cli.output import (
    check_figure,
    deliver,
    json_text,
    plain,
    write_figure,
    writing,
)
from drillctrl.cli.point import read_point, rig_name

if TYPE_CHECKING:
    from drillctrl.designs.drilling import Drilling
    from drillctrl.strings.drive_table import DriveTable
    from drillctrl.strings.drives import DriveComparison

Command = TypeVar("Command", bound=Callable[..., Any])

ENDINGS = (".csv", ".json")
_ALONE = ("plot", "drop", "decay", "objective", "keep")
_DRILLING = ("objective", "kick", "modes", "keep")
_POINT = ("rig", "speed", "rop", "wob", "rock_strength")
_BEARS = (*_POINT, "trials", "units", "structures", "as_json", "out", *_ALONE)
_TABLE_BEARS = ("rig", "units", "depth", "structure", "require_stable", "as_json", "out", "plot")
_RUNS = ("trials", "workers")
_DESIGN_BEARS = (*_POINT, *_RUNS, "units", "structure", "require_stable", "as_json", "out", "plot")


def drive_options(command: Command) -> Command:
    """Add the options that drives alone take."""
    options = [
        click.option("--plot", type=click.Path(), help="Draw drives: FILE.png, .svg, .pdf."),
        click.option("--drop", help="Drives: torque that falls as the bit turns faster [2 kN*m]."),
        click.option("--decay", help="Drives: speed over which it falls [5 rad/s]."),
        click.option(
            "--objective",
            help="Drives: drilling tunes laws to what the bit does at the point, as in design.",
        ),
        keep_option(),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def keep_option() -> Callable[[Command], Command]:
    """Return the option that says where measurements of the bit are kept."""
    return click.option(
        "--keep",
        type=click.Path(file_okay=False),
        metavar="FOLDER",
        help="Drives, drilling: keep what the bit does here, and take it from here.",
    )


def _drilling(options: Mapping[str, Any], others: str = "") -> Drilling | None:
    """Return the objective of laws of a drive; None for the string alone.

    Raises
    ------
    InputError
        If it is another.
    """
    from drillctrl.designs.drilling import Drilling

    if options["objective"] is None:
        return None
    if options["objective"] != "drilling":
        wanted = f"drilling{others}, or left out"
        raise InputError("--objective", options["objective"], wanted)
    given = {name: options.get(name) for name in ("kick", "modes")}
    known = {name: value for name, value in given.items() if value is not None}
    return Drilling(**{"modes": 4, **known})


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


def _check_options() -> None:
    """Refuse what was typed and does not bear on drives; say so of where the bit drills."""
    context = click.get_current_context()
    for parameter in context.command.params:
        name = parameter.name or ""
        typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if not typed or name in _BEARS:
            continue
        option, value = parameter.opts[0], context.params[name]
        raise InputError(option, value, "left out for drives")


def deliver_drive_design(
    structure: str,
    point: Mapping[str, Any],
    as_json: bool,
    out: str | None,
    plot: str | None,
    trials: bool,
    workers: int,
) -> bool:
    """Find the law of a top drive, print, and write the files asked for.

    Returns
    -------
    bool
        Whether it is stable and not refused.

    Raises
    ------
    InputError
        If an option is missing, wrong, or one that does not bear on drives.
    """
    dynamic = structure.startswith("dynamic-")
    worst = point.get("objective") == "worst-case"
    objective = None if worst else _drilling(point, " or worst-case")
    own = ("objective",) if worst else ("depth_error",) if dynamic else ()
    own = (*own, *(_DRILLING if objective else ()))
    _refuse_others(structure, (*_DESIGN_BEARS, *own))
    if point.get("rig") is None:
        raise InputError("--rig", "(missing)", "given: drives turn a string")
    from drillctrl.designs.drive_design import design_drive
    from drillctrl.strings.files import fitted_errors, load_rig

    drills = any(point.get(name) is not None for name in _POINT[1:])
    box = fitted_errors(point["rig"]) if worst else {}
    if worst and not box:
        wanted = "with a rig fitted to a recording (record --fit), whose uncertainty is the box"
        raise InputError("--objective", "worst-case", wanted)
    where: Any = read_point(dict(point)) if drills else load_rig(point["rig"])
    error = point.get("depth_error")
    found = design_drive(
        where,
        structure,
        length_error=0.2 if error is None else error,
        objective=objective,
        trials=drills and trials,
        workers=workers,
        keep=point.get("keep"),
        box=box,
    )
    units = point.get("units") or "si"
    text = functools.partial(found.summary, units)
    draw = functools.partial(found.plot, rig_name(point), units)
    deliver(found.to_dict(), text, draw, as_json=as_json, out=out, plot=plot)
    return found.stable and found.recommended is not False


def _refuse_others(structure: str, bears: Sequence[str]) -> None:
    """Refuse what was typed and is none of the options that bear on laws of a drive."""
    context = click.get_current_context()
    for parameter in context.command.params:
        name = parameter.name or ""
        typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if typed and name not in bears:
            wanted = f"left out with --structure {structure}, a law of a top drive"
            if name in ("mud", "mud_error"):
                wanted += ": mud bears on weights, not on what turns"
            raise InputError(parameter.opts[0], context.params[name], wanted)


def deliver_drive_table(
    structure: str,
    options: Mapping[str, Any],
    as_json: bool,
    out: str | None,
    plot: str | None,
    units: str | None = None,
) -> bool:
    """Find the law of a top drive at each depth, print, and write the files asked for.

    Returns
    -------
    bool
        Whether all of it is stable with a free bit and recommended.

    Raises
    ------
    InputError
        If an option is missing, wrong, or one that does not bear on drives.
    """
    from drillctrl.cli.drive_file import ENDINGS as SOURCES
    from drillctrl.cli.drive_file import SOURCE_OPTIONS, read_settings, write_drive

    source = out is not None and Path(out).suffix.lower() in SOURCES
    _refuse_others(structure, (*_TABLE_BEARS, *(SOURCE_OPTIONS if source else ())))
    if out is not None and not source and Path(out).suffix.lower() not in ENDINGS:
        known = ", ".join((*ENDINGS, *SOURCES))
        raise InputError("--out", out, f"a file that ends in one of {known} for drives")
    needed = (("rig", "drives turn a string"), ("depth", "such as '1500:4500:7 m'"))
    for name, shown in needed[:1] if source else needed:
        if options.get(name) is None:
            raise InputError(f"--{name}", "(missing)", f"given: {shown}")
    from drillctrl.cli.grid import read_depths
    from drillctrl.strings.changed import string_of
    from drillctrl.strings.drive_table import drive_table
    from drillctrl.strings.files import load_rig

    rig = load_rig(options["rig"])
    settings = read_settings(out, options) if source and out is not None else None
    depth = options.get("depth")
    depths = [string_of(rig).length] if depth is None else read_depths(depth)
    found = drive_table(rig, structure, depths)
    if settings is not None and out is not None:
        write_drive(found, out, settings)
    else:
        _write(found, out)
    if plot is not None:
        write_figure(plot, found.plot(units))
    click.echo(json_text(found.to_dict()) if as_json else plain(found.summary(units)))
    return found.stable and found.harm is None


def _write(
    found: DriveComparison | DriveTable, out: str | None, fields: dict[str, Any] | None = None
) -> None:
    if out is None:
        return
    csv = Path(out).suffix.lower() == ".csv"
    text = found.to_csv() if csv else json_text(fields or found.to_dict()) + "\n"
    from drillctrl.base.files import write_text

    writing("--out", out, lambda: write_text(out, text))


def deliver_drives(
    names: Sequence[str],
    point: Mapping[str, Any],
    given: Mapping[str, Any],
    as_json: bool,
    out: str | None,
    trials: bool,
) -> None:
    """Compare drives, print, and write the files asked for.

    Parameters
    ----------
    names : sequence of str
        Laws.
    point : mapping
        Options that say where the rig drills; drives need ``rig`` alone, and are tried where there
        is more.
    given : mapping
        The options of `drive_options`.
    as_json : bool
        Whether to print JSON.
    out : str or None
        File for the numbers.
    trials : bool
        Whether laws are run where the rig drills.

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
    from drillctrl.base.language import told_language
    from drillctrl.strings.drives import compare_drives, drive_control, machine_of
    from drillctrl.strings.falling import FallingTorque
    from drillctrl.strings.files import load_rig
    from drillctrl.strings.rig import StringRig

    falling = {}
    for name, dimension in (("drop", units.TORQUE), ("decay", units.ROTARY_SPEED)):
        if given[name] is not None:
            falling[name] = units.to_si(f"--{name}", given[name], dimension)
    drills = any(point.get(name) is not None for name in _POINT[1:])
    where: Any = read_point(dict(point)) if drills else None
    rig = where.rig if drills else load_rig(point["rig"])
    objective, bit, best = _drilling(given), None, None
    if objective is None:
        found = compare_drives(rig, names, FallingTorque(**falling))
    elif not drills:
        raise InputError("--objective", objective.name, "used at a point: --speed and --rop")
    else:
        from drillctrl.designs.drive_load import bit_load

        machine_of(rig)
        assert isinstance(rig, StringRig)
        bit = bit_load(where, objective, keep=given["keep"])
        laws = [drive_control(name, rig, bit=bit) for name in names]
        found = compare_drives(rig, laws, FallingTorque(**falling))
    fields, text = found.to_dict(), found.summary(point.get("units") or "si")
    if drills and trials:
        from drillctrl.designs.drive_trials import best_tried, drive_trials, trials_text
        from drillctrl.drilling.case import as_case

        tried = drive_trials(where, found.drives)
        fields["trials"] = [each.to_dict() for each in tried]
        best = best_tried(tried)
        fields["best"] = best.drive.control.name
        # What runs bore out stands first, in place of what the string alone advises.
        _, table = text.split("\n\n", 1)
        text = f"{trials_text(tried, as_case(where).place)}\n\n{table}"
    if bit is not None:
        from drillctrl.designs.drive_motion import drive_motion

        drives = found.drives if best is None else (best.drive, *found.drives)
        motion = drive_motion(where, bit, drives, best)
        fields["on_motion"] = motion.to_dict()
        text += "\n\n" + motion.text(told_language(point.get("units") or "si"))
    _write(found, out, fields)
    if given["plot"] is not None:
        write_figure(given["plot"], found.plot(rig_name(point), point.get("units") or "si"))
    click.echo(json_text(fields) if as_json else plain(text))
