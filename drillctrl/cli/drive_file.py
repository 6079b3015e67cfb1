"""Laws of a top drive as source for its controller: options of `drillctrl table`, and files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.output import writing
from drillctrl.cli.verb import naming

if TYPE_CHECKING:
    from drillctrl.strings.drive_table import DriveTable

ENDINGS = (".c", ".st", ".scl", ".xml", ".fmu")
# How a file is written, beside what the law is.
_WRITTEN = ("fmi", "real")
_COUNTS = ("ramp", "fade", "hold", "watchdog", "release")
SOURCE_OPTIONS = ("period", "limit", "rate_limit", "fmi", "real", *_COUNTS)


def read_settings(out: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return what was typed of a drive's controller, SI, before any law is designed.

    Raises
    ------
    InputError
        If it is out of range, or a file could not be written under the name.
    """
    from drillctrl.base import units
    from drillctrl.tables.export_c import check_real
    from drillctrl.tables.export_drive import check_drive_path

    fmi = options["fmi"]
    if fmi is not None and Path(out).suffix.lower() != ".fmu":
        raise InputError("--fmi", fmi, "left out unless --out ends in .fmu")
    with naming("--out", "name", "out"):
        check_drive_path(out, fmi or "3.0")
    real = options["real"] or "double"
    if real != "double" and Path(out).suffix.lower() != ".c":
        raise InputError("--real", real, "left out unless --out ends in .c")
    with naming("--real", "real"):
        check_real(real)
    if options["period"] is None:
        raise InputError("--period", "(missing)", f"given for {out}, such as '10 ms'")
    dimensions = (
        ("period", units.TIME), ("limit", units.TORQUE), ("rate_limit", units.TORQUE_RATE)
    )  # fmt: skip
    given = {
        name: units.to_si(f"--{name.replace('_', '-')}", options[name], dimension)
        for name, dimension in dimensions
        if options[name] is not None
    }
    given |= {name: options[name] for name in _COUNTS if options[name] is not None}
    return {**given, "fmi": fmi or "3.0", "real": real}


def write_drive(found: DriveTable, out: str, settings: Mapping[str, Any]) -> None:
    """Write the source of a drive's controller.

    Raises
    ------
    InputError
        If a law does harm to its string, cannot be sampled so, or the file not be written.
    """
    from drillctrl.strings.drive_sampled import sampled_drive
    from drillctrl.strings.drive_sampled_loop import sampled_slopes
    from drillctrl.tables.export_drive import export_drive

    if found.harm is not None:
        wanted = f"a law that does no harm before it is exported: at {found.harm}"
        raise InputError("--structure", found.structure, wanted)
    given = {name: value for name, value in settings.items() if name not in _WRITTEN}
    controls = [drive.control for drive in found.drives]
    law = sampled_drive(controls, depths=found.depths, **given)
    with naming("--period", "period"):
        stands = sampled_slopes(law, found.rig)
    verdict = f"sampled every {1e3 * law.period:g} ms the string stands {min(stands):.4g} N·m·s"
    click.echo(f"drillctrl: {verdict}", err=True)

    def write() -> None:
        export_drive(law, out, verdict=verdict, **{name: settings[name] for name in _WRITTEN})

    with naming("--real", "real"):
        writing("--out", out, write)
