"""`drillctrl bit`: how a bit answers its speed, and the damping left to its string."""

from __future__ import annotations

import functools
import math
from typing import Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.output import check_figure, check_json, deliver
from drillctrl.cli.point import point_options, read_point, rig_name
from drillctrl.cli.progress import open_progress
from drillctrl.cli.verb import Verb


@click.command(name="bit", cls=Verb)
@point_options
@click.option(
    "--amplitudes",
    metavar="A,…",
    help="Swings of the bit's speed, shares of it, rising in (0, 1); twelve from 0.01 to 0.95 "
    "without it, five of a long string.",
)
@click.option(
    "--frequency",
    "frequencies",
    multiple=True,
    metavar="HZ",
    help="H there, '0.45 Hz' (without a rig ω); may be repeated.",
)
@click.option(
    "--amplitude",
    "amplitude",
    multiple=True,
    type=float,
    help="Swings for --frequency, shares of the speed (default 0.03); may be repeated.",
)
@click.option(
    "--modes",
    type=int,
    default=1,
    show_default=True,
    help="Torsional modes; the last with --along.",
)
@click.option(
    "--most-periods",
    type=int,
    help="Periods of each start that are looked at where the orbit is irregular "
    "(400; with --along and of a long string 40).",
)
@click.option(
    "--imposed",
    is_flag=True,
    help="Impose the rotation whole: no ripple beside the swing.",
)
@click.option("--band", is_flag=True, help="Over frequency instead, at the first amplitude (0.1).")
@click.option(
    "--along",
    type=click.Choice(["speed", "rate"]),
    help="Over rotary speed or rate of penetration instead, half to twice the point's.",
)
@click.option(
    "--keep",
    type=click.Path(file_okay=False),
    metavar="FOLDER",
    help="Keep answers here by what computed them, and take them from here.",
)
@click.option("--workers", type=int, default=1, show_default=True, help="Processes.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option("--out", type=click.Path(), help="Also write the JSON to FILE.json.")
@click.option("--plot", type=click.Path(), help="Draw the damping left: FILE.png, .svg, .pdf.")
def bit_command(
    amplitudes: str | None,
    frequencies: tuple[str, ...],
    amplitude: tuple[float, ...],
    modes: int,
    most_periods: int | None,
    imposed: bool,
    band: bool,
    along: str | None,
    keep: str | None,
    workers: int,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **point: Any,
) -> None:
    """Say how the bit on its axial orbit answers to its speed, and what swing that means.

    The bit is turned at a speed that swings by A of its mean; H is the part of its torque that
    follows. Damping left is the torsional mode's own and Re H: where it rises through zero over A
    the rig swings by that much, where it falls through zero lies the kick that brings it there.

    \b
    Examples:
      drillctrl bit --rig table1 --speed "120 rpm" --rop "20 m/h" --amplitudes 0.03,0.3
      drillctrl bit --rig table1 --speed "120 rpm" --rop "50 m/h" --plot bit.png
      drillctrl bit --rig table1 --speed "120 rpm" --rop "20 m/h" --band --plot band.png
      drillctrl bit --rig table1 --speed "150 rpm" --rop "50 m/h" --along speed
      drillctrl bit --rig table1 --speed "120 rpm" --rop "20 m/h" --frequency "0.45 Hz" --json
    """
    check_json(out)
    check_figure(plot)
    wanted = _read(amplitudes)
    where = read_point(point)
    _tell_of_drive(where)
    if amplitude and amplitudes is not None:
        raise InputError("--amplitude", amplitude[0], "left out with --amplitudes")
    if amplitude:
        wanted = sorted(set(amplitude))
    elif frequencies and wanted is None:
        wanted = [0.03]
    if frequencies and (band or along is not None):
        raise InputError("--frequency", frequencies[0], "left out with --band and --along")
    if band and along is not None:
        raise InputError("--along", along, "left out with --band")
    # What is left to the function that looks has a default of its own there.
    given = {"most_periods": most_periods, "keep": keep}
    patience: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if along is not None:
        if imposed:
            raise InputError("--imposed", "given", "left out with --along")
        _along(where, along, wanted, modes, workers, patience, rig_name(point), as_json, out, plot)
        return
    if band:
        patience = {"most_periods": 400, **patience}
        _band(where, wanted, workers, patience, imposed, as_json, out, plot)
        return
    from drillctrl.drilling.case import as_case
    from drillctrl.motion.report import motion_fields, motion_summary, responses_summary
    from drillctrl.motion.response import FEWEST_PERIODS
    from drillctrl.motion.swing import AMPLITUDES, AMPLITUDES_OF_STRING, drilling_motion
    from drillctrl.studies.vibration_edge import is_long

    asked = [_read_frequency(text, where) for text in frequencies]
    long = is_long(as_case(where))
    if wanted is None:
        wanted = [*(AMPLITUDES_OF_STRING if long else AMPLITUDES)]
    if long:
        # Its orbit is irregular, and more windows of it tell little more.
        patience = {"most_periods": FEWEST_PERIODS, **patience}
        words = f"a minute of processor and more for each of its swings: {len(wanted)}"
        click.echo(f"drillctrl: note: a long string takes {words}", err=True)
    with open_progress() as progress:
        found = drilling_motion(
            where,
            wanted,
            modes=modes,
            workers=workers,
            progress=progress,
            ripple=not imposed,
            **patience,
        )
    text, responses = functools.partial(motion_summary, found), None
    if asked:
        from drillctrl.motion.response import bit_response

        responses = [bit_response(where, omega, a, **patience) for omega in asked for a in wanted]
        text = functools.partial(responses_summary, found, responses)
    draw = functools.partial(found.plot, name=rig_name(point))
    fields = motion_fields(found, responses)
    deliver(fields, text, draw, as_json=as_json, out=out, plot=plot)


def _tell_of_drive(where: Any) -> None:
    """Say of a rig with a top drive what turns its string here."""
    from drillctrl.strings.rig import StringRig

    rig = getattr(where, "rig", None)
    if isinstance(rig, StringRig) and rig.drive is not None:
        told = "its torque is constant here, under no law"
        click.echo(f"drillctrl: note: a top drive turns it: {told}", err=True)
        other = "compare --objective drilling says what laws of it leave of such swings"
        click.echo(f"drillctrl: note: {other}", err=True)


def _band(
    where: Any,
    amplitudes: list[float] | None,
    workers: int,
    patience: dict[str, Any],
    imposed: bool,
    as_json: bool,
    out: str | None,
    plot: str | None,
) -> None:
    """Tell the response over a band of frequencies."""
    from drillctrl.motion.band import bit_band
    from drillctrl.motion.band_report import band_fields, band_summary

    amplitude = 0.1 if not amplitudes else amplitudes[0]
    found = bit_band(where, amplitude, workers=workers, ripple=not imposed, **patience)
    fields = {"schema": "drillctrl/bit-band/1", **band_fields(found)}
    text = functools.partial(band_summary, found)
    deliver(fields, text, found.plot, as_json=as_json, out=out, plot=plot)


def _along(
    where: Any,
    along: str,
    amplitudes: list[float] | None,
    mode: int,
    workers: int,
    patience: dict[str, Any],
    name: str | None,
    as_json: bool,
    out: str | None,
    plot: str | None,
) -> None:
    """Tell the damping left over speed or rate."""
    from drillctrl.motion.along_report import along_fields, along_summary
    from drillctrl.motion.threshold import torsional_threshold

    amplitude = 0.03 if not amplitudes else amplitudes[0]
    found = torsional_threshold(
        where, along, amplitude=amplitude, mode=mode, workers=workers, **patience
    )
    fields = {"schema": "drillctrl/bit-along/1", **along_fields(found)}
    text = functools.partial(along_summary, found)
    draw = functools.partial(found.plot, name=name)
    deliver(fields, text, draw, as_json=as_json, out=out, plot=plot)


def _read_frequency(text: str, where: Any) -> float:
    """Return a dimensionless angular frequency from Hz of a rig, or from a number."""
    from drillctrl.drilling.case import as_case
    from drillctrl.motion.response import FREQUENCIES

    low, high = FREQUENCIES
    rig = as_case(where).rig
    number, _, unit = text.strip().partition(" ")
    per_unit = {"Hz": 2.0 * math.pi, "mHz": 2e-3 * math.pi, "rad/s": 1.0}.get(unit.strip())
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if rig is None:
        if unit or not low <= value <= high:
            wanted = f"a number ω in [{low:g}, {high:g}], or a rig to go with its unit"
            raise InputError("--frequency", text, wanted)
        return value
    if per_unit is None or not low <= value * per_unit * rig.time_scale <= high:
        least, most = (end / (2.0 * math.pi * rig.time_scale) for end in FREQUENCIES)
        between = f"from {least:.3g} to {most:.3g} Hz"
        wanted = f"a frequency with its unit, such as '0.45 Hz' or '2.83 rad/s', {between}"
        raise InputError("--frequency", text, wanted)
    return value * per_unit * rig.time_scale


def _read(amplitudes: str | None) -> list[float] | None:
    """Return the amplitudes that were typed."""
    if amplitudes is None:
        return None
    try:
        return [float(part) for part in amplitudes.split(",")]
    except ValueError:
        raise InputError("--amplitudes", amplitudes, "numbers such as 0.03,0.1,0.3") from None
