"""`drillctrl compare`: designs of several structures, or drives of a string, side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError
from drillctrl.base.extras import required
from drillctrl.cli.drives import are_drives, deliver_drives, drive_options, refuse_drive_options
from drillctrl.cli.gains import read_bounds, read_gains, scales_at
from drillctrl.cli.output import check_folder, json_text, plain, writing
from drillctrl.cli.point import point_options, read_point
from drillctrl.cli.progress import open_progress
from drillctrl.cli.roots import trials_option, wants_trials
from drillctrl.cli.verb import Verb, naming

if TYPE_CHECKING:
    from drillctrl.drilling.point import OperatingPoint, RigPoint
    from drillctrl.studies.compare import Given
    from drillctrl.studies.comparison import Comparison

ENDINGS = (".html", ".csv", ".json")


@click.command(name="compare", cls=Verb)
@point_options
@click.option(
    "--structures", default="p,case1,pd,case2", show_default=True, help="Presets to design for."
)
@click.option(
    "--given",
    multiple=True,
    metavar="NAME=STRUCTURE:K1:K2",
    help="Gains from elsewhere, such as paper=case2:-5.03,-4.91:-1.67,-0.31; may be repeated.",
)
@click.option("--bound", multiple=True, metavar="GAIN=LOW:HIGH", help="As for design.")
@click.option(
    "--initial",
    help="Disturbance of the bit, with which a string moves (default dx=1,dtheta=1); with a rig "
    "'dx=1 m/h,dtheta=5 rpm'.",
)
@click.option("--duration", metavar="TIME", help="Of simulations (default 200); with a rig '60 s'.")
@click.option("--sort", default="spectral_abscissa", show_default=True, help="Measure to sort by.")
@trials_option("all")
@click.option("--no-charts", is_flag=True, help="Leave out the stable areas.")
@drive_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option("--out", metavar="FILE", help="Write a report: .html, .csv or .json.")
def compare_command(
    structures: str,
    given: tuple[str, ...],
    bound: tuple[str, ...],
    initial: str | None,
    duration: str | None,
    sort: str,
    trials: str,
    no_charts: bool,
    plot: str | None,
    drop: str | None,
    decay: str | None,
    objective: str | None,
    keep: str | None,
    as_json: bool,
    out: str | None,
    **point: Any,
) -> None:
    """Compare feedback structures and given gains at one point on one set of measures.

    Structures of a top drive (stiff, soft-torque, soft-torque-matched, soft-torque-fastest,
    z-torque, z-torque-tuned, observer-1 … observer-3, dynamic-1 … dynamic-4) are compared on
    the string of a rig: reflection, critical slope and threshold speed of each mode, margin of
    the delay; with --speed and --rop they are also run there, beside a stiff drive, and the best
    is named.

    \b
    Examples:
      drillctrl compare --omega0 10 --delta0 12 --structures p,case1,case2 --out report.html
      drillctrl compare --given "paper=case1:-5.17:5.06" --sort stability_radius
      drillctrl compare --rig table1 --speed "150 rpm" --rop "20 m/h"
      drillctrl compare --rig vertical-3000 --structures stiff,soft-torque,dynamic-2
    """
    check_folder("--out", out)
    names = [part.strip() for part in structures.split(",")]
    if not all(names):
        raise InputError("--structures", structures, "names with a comma between them")
    for_drives = {"plot": plot, "drop": drop, "decay": decay, "objective": objective, "keep": keep}
    if are_drives(names):
        deliver_drives(names, point, for_drives, as_json, out, wants_trials(trials))
        return
    refuse_drive_options(for_drives)
    if out is not None and Path(out).suffix.lower() not in ENDINGS:
        raise InputError("--out", out, f"a file that ends in {', '.join(ENDINGS)}")
    if out is not None and Path(out).suffix.lower() == ".html":
        required("matplotlib", "figures")
    tried = wants_trials(trials)
    where = read_point(point)
    candidates = [read_given(text, where) for text in given]
    from drillctrl.cli.scenario import read_disturbance, read_duration
    from drillctrl.drilling.point import RigPoint
    from drillctrl.drilling.structures import preset_structure
    from drillctrl.studies.compare import REGION, compare

    # Its gains are those of all presets.
    every = preset_structure("case2")
    rig = where.rig if isinstance(where, RigPoint) else None
    with open_progress() as progress:
        result = compare(
            where,
            names,
            given=candidates,
            bounds=read_bounds(bound, every, scales_at(where, every)),
            disturbance=read_disturbance(initial, rig),
            duration=read_duration(duration, rig),
            region=None if no_charts else REGION,
            sort=sort,
            trials=tried,
            progress=progress,
        )
    if out is not None:
        _write(result, out)
    click.echo(json_text(result.to_dict()) if as_json else plain(result.summary()))


def read_given(text: str, where: OperatingPoint | RigPoint) -> Given:
    """Return label, structure and gains from a text such as ``paper=case1:-5.17:5.06``.

    Raises
    ------
    InputError
        If the text has not that form.
    """
    label, equals, rest = text.partition("=")
    parts = rest.split(":")
    if not equals or not label.strip() or len(parts) not in (2, 3):
        raise InputError("--given", text, "of the form NAME=STRUCTURE:K1:K2")
    structure = parts[0].strip()
    scales = scales_at(where, structure)
    with naming("--given", "--K1", "--K2"):
        gains = [
            read_gains(name, part, scales)
            for name, part in zip(("K1", "K2"), parts[1:], strict=False)
        ]
    now, past = (*gains, None)[:2]
    assert now is not None
    return label.strip(), structure, now, past


def _write(result: Comparison, out: str) -> None:
    from drillctrl.base.files import write_text

    ending = Path(out).suffix.lower()
    if ending == ".html":
        text = result.to_html()
    elif ending == ".csv":
        text = result.to_csv()
    else:
        text = json_text(result.to_dict()) + "\n"
    writing("--out", out, lambda: write_text(out, text))
