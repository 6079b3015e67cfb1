"""`drillctrl record`: what a rig has recorded, and a string fitted to it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.output import (
    check_figure,
    check_folder,
    json_text,
    plain,
    write_figure,
    write_json,
    writing,
)
from drillctrl.cli.verb import Verb, naming

if TYPE_CHECKING:
    from drillctrl.drilling.rig import Rig
    from drillctrl.records.study import RecordStudy

_ENDINGS = (".json", ".html", ".csv")


@click.command(name="record", cls=Verb)
@click.argument("file", metavar="FILE")
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="WHAT=NAME",
    help="Which column is what, with its unit: 'torque=STOR [kft.lbf]'; may be repeated.",
)
@click.option("--dates", metavar="ORDER", help="03/04/2026 is day-first or month-first.")
@click.option("--rig", help="Whose string it is: a preset or a TOML file.")
@click.option("--torque-of", metavar="WHAT", help="Measured torque: of the drive, or of the pipe.")
@click.option("--drive-inertia", help="Of the top drive, such as '2900 kg*m^2' (the rig's).")
@click.option("--lag", help="By which the torque comes later than the speed, such as '50 ms'.")
@click.option("--from", "begin", metavar="TIME", help="Look from here, such as '60 s'.")
@click.option("--to", "end", metavar="TIME", help="Look up to here.")
@click.option("--no-fit", is_flag=True, help="Fit no string.")
@click.option("--fit", "fitted", type=click.Path(), help="Write the fitted rig: FILE.toml.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option(
    "--out", type=click.Path(), help="FILE.html (a page), .json, or .csv (the bit's motion)."
)
@click.option("--plot", type=click.Path(), help="Draw what it shows: FILE.png, .svg, .pdf.")
def record_command(
    file: str,
    columns: tuple[str, ...],
    dates: str | None,
    rig: str | None,
    torque_of: str | None,
    drive_inertia: str | None,
    lag: str | None,
    begin: str | None,
    end: str | None,
    no_fit: bool,
    fitted: str | None,
    as_json: bool,
    out: str | None,
    plot: str | None,
) -> None:
    """Say what a rig's recording shows, and fit the string to it.

    FILE holds rotary speed and torque at the surface over time, and what else there is: CSV, LAS,
    Parquet or MATLAB. Swing and period, modes, time spent sticking, what the drive returns; with
    --rig, or where the bit sticks, the bit's speed by the string's own transfer functions.

    \b
    Examples:
      drillctrl record example
      drillctrl record example --rig example --to "300 s" --json
    """
    check_folder("--out", out)
    if out is not None and Path(out).suffix.lower() not in _ENDINGS:
        raise InputError("--out", out, f"a file that ends in {', '.join(_ENDINGS)}")
    check_figure(plot)
    check_folder("--fit", fitted)
    if fitted is not None and (rig is None or Path(fitted).suffix.lower() != ".toml" or no_fit):
        raise InputError("--fit", fitted, "a file that ends in .toml, with --rig, not --no-fit")
    if out is not None and Path(out).suffix.lower() == ".html":
        from drillctrl.base.extras import required

        required("matplotlib", "figures")
    study = _study(file, columns, dates, rig, torque_of, drive_inertia, lag, begin, end, no_fit)
    if fitted is not None:
        _write_fit(study, _rig(rig), fitted)
    if out is not None:
        _write(study, out)
    if plot is not None:
        write_figure(plot, study.plot())
    click.echo(json_text(study.to_dict()) if as_json else plain(study.summary()))


def _study(
    file: str,
    columns: tuple[str, ...],
    dates: str | None,
    rig: str | None,
    torque_of: str | None,
    drive_inertia: str | None,
    lag: str | None,
    begin: str | None,
    end: str | None,
    no_fit: bool,
) -> RecordStudy:
    from drillctrl.base import units
    from drillctrl.records.example import example_path
    from drillctrl.records.record import read_record
    from drillctrl.records.study import study_record

    def seconds(option: str, text: str | None) -> float | None:
        return None if text is None else units.to_si(option, text, units.TIME)

    late, first, last = (
        seconds(option, text) for option, text in (("--lag", lag), ("--from", begin), ("--to", end))
    )
    inertia = None
    if drive_inertia is not None:
        inertia = units.to_si("--drive-inertia", drive_inertia, units.INERTIA)
    known = None if rig is None else _rig(rig)
    source = example_path("record") if file == "example" else file
    record = read_record(source, columns, dates=dates)
    if first is not None or last is not None:
        stop = record.duration if last is None else last
        record = record.part(first or 0.0, stop)
    return study_record(
        record, known, torque_of=torque_of, own_inertia=inertia, lag=late, fit=not no_fit
    )


def _rig(source: str | None) -> Rig:
    from drillctrl.records.example import example_path
    from drillctrl.strings.files import load_rig

    return load_rig(example_path("rig") if source == "example" else str(source))


def _write_fit(study: RecordStudy, rig: Rig, fitted: str) -> None:
    from drillctrl.records.fitted_rig import save_fit

    fit = study.fit
    if fit is None:
        raise InputError("--fit", fitted, "left out: no string was fitted, the bit does not swing")
    with naming("--fit", "fit"):
        writing("--fit", fitted, lambda: save_fit(rig, fit, fitted))


def _write(study: RecordStudy, out: str) -> None:
    ending = Path(out).suffix.lower()
    if ending == ".json":
        write_json(out, study.to_dict())
    elif ending == ".csv":
        writing("--out", out, lambda: study.save_bit(out))
    else:
        from drillctrl.base.files import write_text

        page = study.to_html()
        writing("--out", out, lambda: write_text(out, page))
