"""`drillctrl rig`: what is understood of a rig."""

from __future__ import annotations

import click

from drillctrl.cli.output import (
    check_ending,
    check_figure,
    json_text,
    plain,
    write_figure,
    writing,
)
from drillctrl.cli.verb import Verb


@click.group(name="rig")
def rig_command() -> None:
    """Read rig files.

    \b
    Examples:
      drillctrl rig check vertical-3000
    """


@rig_command.command(name="check", cls=Verb)
@click.argument("source", metavar="FILE|PRESET")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option("--units", metavar="NAME", help="In si (default) or field: ft, in, klbf …")
@click.option("--out", type=click.Path(), help="Write the rig as a file to change: FILE.toml.")
@click.option("--plot", type=click.Path(), help="Draw string and modes: FILE.png, .svg, .pdf.")
def check_command(
    source: str, as_json: bool, units: str | None, out: str | None, plot: str | None
) -> None:
    """Say what is understood of a rig file: string, weights, lumped numbers, modes.

    \b
    Examples:
      drillctrl rig check paper-string
      drillctrl rig check vertical-3000 --plot string.png
      drillctrl rig check vertical-3000 --out my-rig.toml
    """
    check_figure(plot)
    check_ending(out, ".toml")
    from drillctrl.base.language import told_language
    from drillctrl.strings.check import check_rig
    from drillctrl.strings.files import load_rig
    from drillctrl.strings.words import rig_summary

    language = told_language(units)
    rig = load_rig(source)
    found = check_rig(rig)
    if plot is not None:
        from drillctrl.strings.figure import plot_rig

        write_figure(plot, plot_rig(found, language))
    if out is not None:
        from drillctrl.strings.saving import save_rig

        writing("--out", out, lambda: save_rig(rig, out))
    click.echo(json_text(found.to_dict()) if as_json else plain(rig_summary(found, language)))
