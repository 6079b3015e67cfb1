"""`drillctrl record`: what a rig has recorded, and a string fitted to it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError, checked_integer
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


@dataclass(frozen=True)
class _Asked:
    """A recording and how it is looked at, as typed."""

    file: str
    columns: tuple[str, ...]
    dates: str | None
    rig: str | None
    torque_of: str | None
    drive_inertia: str | None
    lag: str | None
    begin: str | None
    end: str | None
    no_fit: bool


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
@click.option(
    "--map", "grid", metavar="COUNTxCOUNT", help="Simulate over speed and weight too: '5x4'."
)
@click.option("--structure", help="With --map: law of the top drive (its speed held).")
@click.option("--workers", type=int, default=1, help="With --map: processes.")
@click.option("--fit", "fitted", type=click.Path(), help="Write the fitted rig: FILE.toml.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option(
    "--out", type=click.Path(), help="FILE.html (a page), .json, or .csv (the bit's motion)."
)
@click.option("--plot", type=click.Path(), help="Draw what it shows: FILE.png, .svg, .pdf.")
@click.option("--units", metavar="NAME", help="In si (default) or field: ft·lbf, klbf …")
def record_command(
    file: str,
    fitted: str | None,
    grid: str | None,
    structure: str | None,
    workers: int,
    as_json: bool,
    out: str | None,
    plot: str | None,
    units: str | None,
    **options: Any,
) -> None:
    """Say what a rig's recording shows, and fit the string to it.

    FILE holds rotary speed and torque at the surface over time, and what else there is: CSV, LAS,
    Parquet or MATLAB. Swing and period, modes, time spent sticking, what the drive returns; with
    --rig, or where the bit sticks, the bit's speed by the string's own transfer functions.

    \b
    Examples:
      drillctrl record example
      drillctrl record example --rig example --to "300 s" --json

    --map takes seconds for a run: the fitted string and law of the bit over the speeds and weights
    that were drilled with, beside what was drilled. It needs weight on bit, and --rig.
    """
    from drillctrl.base.language import told_language

    told_language(units)
    check_folder("--out", out)
    if out is not None and Path(out).suffix.lower() not in _ENDINGS:
        raise InputError("--out", out, f"a file that ends in {', '.join(_ENDINGS)}")
    check_figure(plot)
    check_folder("--fit", fitted)
    asked = _Asked(file, **options)
    if fitted is not None and (
        asked.rig is None or Path(fitted).suffix.lower() != ".toml" or asked.no_fit
    ):
        raise InputError("--fit", fitted, "a file that ends in .toml, with --rig, not --no-fit")
    if out is not None and Path(out).suffix.lower() == ".html":
        from drillctrl.base.extras import required

        required("matplotlib", "figures")
    counts = _counts(grid, asked.rig, structure)
    study = _study(asked)
    if counts is not None:
        study = _mapped(study, _rig(asked.rig), counts, structure, workers)
    if fitted is not None:
        _write_fit(study, _rig(asked.rig), fitted)
    if out is not None:
        _write(study, out, units)
    if plot is not None:
        write_figure(plot, study.plot(units))
    click.echo(json_text(study.to_dict()) if as_json else plain(study.summary(units)))


def _study(asked: _Asked) -> RecordStudy:
    from drillctrl.base import units
    from drillctrl.records.example import example_path
    from drillctrl.records.record import read_record
    from drillctrl.records.study import study_record

    def si(option: str, text: str | None, dimension: units.Dimension) -> float | None:
        return None if text is None else units.to_si(option, text, dimension)

    late, first, last = (
        si(option, text, units.TIME)
        for option, text in (("--lag", asked.lag), ("--from", asked.begin), ("--to", asked.end))
    )
    inertia = si("--drive-inertia", asked.drive_inertia, units.INERTIA)
    known = None if asked.rig is None else _rig(asked.rig)
    source = example_path("record") if asked.file == "example" else asked.file
    record = read_record(source, asked.columns, dates=asked.dates)
    if first is not None or last is not None:
        record = record.part(first or 0.0, record.duration if last is None else last)
    return study_record(
        record,
        known,
        torque_of=asked.torque_of,
        own_inertia=inertia,
        lag=late,
        fit=not asked.no_fit,
    )


def _counts(grid: str | None, rig: str | None, structure: str | None) -> tuple[int, int] | None:
    if grid is None:
        if structure is not None:
            raise InputError("--structure", structure, "left out, or given with --map")
        return None
    parts = grid.lower().split("x")
    if len(parts) != 2 or not all(p.isdecimal() and 2 <= int(p) <= 40 for p in parts):
        raise InputError("--map", grid, "such as 5x4: 2 to 40 speeds and weights")
    if rig is None:
        raise InputError("--map", grid, "given with --rig: what is simulated")
    return int(parts[0]), int(parts[1])


def _mapped(
    study: RecordStudy, rig: Rig, counts: tuple[int, int], structure: str | None, workers: int
) -> RecordStudy:
    from drillctrl.base.workers import open_executor
    from drillctrl.cli.progress import open_progress
    from drillctrl.records.computed import with_computed_map

    checked_integer("--workers", workers, 1, 1024)
    with (
        open_executor(workers, None) as executor,
        open_progress() as progress,
        naming("--map", "counts", "weight_on_bit"),
    ):
        return with_computed_map(
            study, rig, counts, structure=structure, executor=executor, progress=progress
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


def _write(study: RecordStudy, out: str, units: str | None) -> None:
    ending = Path(out).suffix.lower()
    if ending == ".json":
        write_json(out, study.to_dict())
    elif ending == ".csv":
        writing("--out", out, lambda: study.save_bit(out, units))
    else:
        from drillctrl.base.files import write_text

        page = study.to_html(units)
        writing("--out", out, lambda: write_text(out, page))
