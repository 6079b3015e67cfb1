"""`drillctrl report`: two pages that say how a rig drills, and how it should."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from typing import Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.output import check_folder, json_text, plain, writing
from drillctrl.cli.point import point_options, read_point, rig_name
from drillctrl.cli.progress import open_progress, open_stages
from drillctrl.cli.verb import Verb, naming


@click.command(name="report", cls=Verb)
@point_options
@click.option(
    "--structure",
    help="With a top drive soft-torque (default), stiff, z-torque, dynamic-2 …; else pd "
    "(default), p, case1 or case2, a torque at the bit.",
)
@click.option("--no-map", is_flag=True, help="Leave out the map, which takes longest.")
@click.option(
    "--date",
    default=None,
    help="Printed on it: any text, or today; else that of SOURCE_DATE_EPOCH, else none.",
)
@click.option("--workers", type=int, default=2, show_default=True, help="Processes.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object (SI) instead.")
@click.option("--out", type=click.Path(), required=True, help="Write FILE.html.")
def report_command(
    structure: str | None,
    no_map: bool,
    date: str | None,
    workers: int,
    as_json: bool,
    out: str,
    **point: Any,
) -> None:
    """Write a report of a rig: one HTML file that prints to two pages.

    It says what to do, in the words of those who do it: string and modes, what the bit does around
    the point without control and with it, settings, runs over time, what was checked and what
    is not known. The same input gives the same file.

    \b
    Examples:
      drillctrl report --rig table1 --speed "150 rpm" --rop "20 m/h" --no-map \\
          --date today --out report.html
      drillctrl report --rig table1 --speed "150 rpm" --rop "65 ft/h" --structure p --no-map \\
          --units field --date 2026-11-29 --out report.html

    Without --no-map it takes up to a minute, of long strings two.
    """
    check_folder("--out", out)
    from drillctrl.base.errors import checked_integer
    from drillctrl.base.extras import required
    from drillctrl.base.workers import open_executor
    from drillctrl.drilling.point import RigPoint
    from drillctrl.studies.rig_report import check_report_path, rig_report

    with naming("--out", "path"):
        check_report_path(out)
    required("matplotlib", "figures")
    checked_integer("workers", workers, 1, 1024)
    where = read_point(point)
    if not isinstance(where, RigPoint):
        raise InputError("--rig", "(missing)", "given: a report is for the people on a rig")
    with (
        open_executor(workers, None) as executor,
        open_progress() as progress,
        open_stages() as stage,
    ):
        found = rig_report(
            where,
            structure,
            name=rig_name(point) or "",
            date=_date(date),
            mapped=not no_map,
            executor=executor,
            progress=progress,
            stage=stage,
        )
    writing("--out", out, lambda: found.save(out))
    click.echo(json_text(found.to_dict()) if as_json else plain(found.summary()))


def _date(given: str | None) -> str:
    """Return the date of a report: as given, or of a build that is to be repeated."""
    if given is not None:
        # Whoever types it wants another page tomorrow.
        return datetime.now().astimezone().date().isoformat() if given == "today" else given
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not epoch.isdecimal():
        return ""
    try:
        return datetime.fromtimestamp(int(epoch), UTC).date().isoformat()
    except (OverflowError, OSError, ValueError):
        raise InputError("SOURCE_DATE_EPOCH", epoch, "seconds since 1970, of a date") from None
