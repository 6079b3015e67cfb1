"""A table as the source of a controller: its options, what they are checked for, its files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.quantity import read_quantity
from drillctrl.cli.verb import Command, naming, with_options

if TYPE_CHECKING:
    from drillctrl.delay.structure import FeedbackStructure
    from drillctrl.tables.gain_table import GainTable
    from drillctrl.tables.grid import Grid
    from drillctrl.tables.recorded import RecordedMotion

CONTROLLERS = (".c", ".st", ".scl", ".xml", ".fmu")
# What may go with a table that is there already.
_OPTIONS = ("ramp", "outside", "fade", "hold", "watchdog", "rate_limit", "release")
_BLOCKS = (".st", ".scl", ".xml")
CONTROLLER_NAMES = ("period", "limit", "real", "fmi", "motion", *_OPTIONS)
_FILE_OPTIONS = (
    click.option(
        "--period",
        metavar="TIME",
        help="Of a controller (.c …), such as 0.01; '10 ms' with a rig.",
    ),
    click.option(
        "--limit", metavar="TORQUE", help="Its largest |u|, such as 5; '5 kN*m' with a rig."
    ),
    click.option(
        "--ramp", type=int, metavar="SAMPLES", help="Of its switch-on (default: a delay)."
    ),
    click.option(
        "--outside",
        help="Where it vouches for nothing: fade (default) or hold the last good gains.",
    ),
    click.option("--fade", type=int, metavar="SAMPLES", help="Of such a fade (default: a delay)."),
    click.option(
        "--hold", type=int, metavar="SAMPLES", help="Missing in a row before it fades (default 3)."
    ),
    click.option("--watchdog", type=int, metavar="SAMPLES", help="Equal in a row before it fades."),
    click.option("--rate-limit", metavar="RATE", help="Its fastest change: 5, or '50 kN*m/s'."),
    click.option(
        "--release", type=int, metavar="SAMPLES", help="Of its switch-off (default: at once)."
    ),
    click.option("--real", help="Arithmetic of a .c controller: double (default) or float."),
    click.option("--fmi", help="Standard of an .fmu: 3.0 (default) or 2.0."),
    click.option(
        "--motion",
        type=click.Path(),
        metavar="FILE",
        help="Of the test vectors of .st, .scl, .xml: CSV with the outputs, as bench writes.",
    ),
)


def controller_file_options(command: Command) -> Command:
    """Add the options of an exported controller."""
    return with_options(command, _FILE_OPTIONS)


def in_units(controller: dict[str, Any], grid: Grid) -> dict[str, Any]:
    """Return what was typed of a controller in the units of its table."""
    from drillctrl.base import units

    rig = grid.rig
    scales = {
        "period": (units.TIME, None if rig is None else rig.time_scale),
        "limit": (units.TORQUE, None if rig is None else rig.torsional_stiffness),
        "rate_limit": (
            units.TORQUE_RATE,
            None if rig is None else rig.torsional_stiffness / rig.time_scale,
        ),
    }
    read = {
        name: read_quantity(f"--{name.replace('_', '-')}", controller[name], *scale)
        for name, scale in scales.items()
        if controller[name] is not None
    }
    return {**controller, **read}


def check_out(
    out: str | None,
    controller: dict[str, Any],
    grid: Grid,
    structure: FeedbackStructure,
    tried: bool = False,
) -> None:
    """Refuse what could not be written, before any work is done."""
    ending = "" if out is None else Path(out).suffix.lower()
    if ending not in CONTROLLERS:
        for name, value in controller.items():
            if value is not None and not (tried and name in ("period", "limit")):
                raise InputError(name, value, "left out unless --out is a controller's source")
    if out is None:
        return
    if ending not in CONTROLLERS:
        from drillctrl.tables.files import ENDINGS, check_table_path

        if ending not in ENDINGS:
            wanted = f"a file that ends in {', '.join((*ENDINGS, *CONTROLLERS))}"
            raise InputError("--out", out, wanted)
        check_table_path(out)
        return
    from drillctrl.tables.export_c import check_c_header, check_c_name, check_real
    from drillctrl.tables.export_st import check_st_name
    from drillctrl.tables.settings import Options, checked_settings

    for name in ("period", "limit"):
        if controller[name] is None:
            raise InputError(name, "(missing)", f"given for {out}")
    given = {name: controller[name] for name in _OPTIONS if controller[name] is not None}
    for name, goes_with in (("real", (".c",)), ("fmi", (".fmu",)), ("motion", _BLOCKS)):
        if controller[name] is not None and ending not in goes_with:
            wanted = f"left out unless --out ends in {' or '.join(goes_with)}"
            raise InputError(name, controller[name], wanted)
    with naming("--out", "name"):
        (check_st_name if ending in _BLOCKS else check_c_name)(Path(out).stem)
        checked_settings(
            grid,
            structure,
            controller["period"],
            controller["limit"],
            cast(Options, given),
        )
        if ending == ".c":
            check_c_header(Path(out).with_suffix(".h"))
    if controller["motion"] is not None:
        _read_motion(controller, grid, structure)
    if controller["real"] is not None:
        check_real(controller["real"])
    if ending == ".fmu":
        from drillctrl.tables.export_fmu import check_fmu

        check_fmu(Path(out).stem, controller["fmi"] or "3.0")


def _read_motion(
    controller: dict[str, Any], grid: Grid, structure: FeedbackStructure
) -> RecordedMotion:
    from drillctrl.tables.recorded import read_motion

    axes = [axis.name for axis in grid.axes]
    return read_motion(controller["motion"], structure.outputs, axes, controller["period"])


def write_table(result: GainTable, out: str, controller: dict[str, Any]) -> None:
    path = Path(out)
    given = {name: value for name, value in controller.items() if value is not None}
    if path.suffix.lower() in _BLOCKS:
        from drillctrl.tables.export_st import export_st

        if "motion" in given:
            given["motion"] = _read_motion(given, result.grid, result.structure)
        export_st(result, path, **given)
    elif path.suffix.lower() == ".fmu":
        from drillctrl.tables.export_fmu import export_fmu

        export_fmu(result, path, **given)
    elif path.suffix.lower() == ".c":
        from drillctrl.tables.export_c import export_c

        export_c(result, path.parent, path.stem, **given)
    else:
        from drillctrl.tables.files import save_table

        save_table(result, path)
