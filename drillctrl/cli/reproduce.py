"""`drillctrl reproduce`: the paper's figures and numbers, beside ours."""

from __future__ import annotations

import sys
import textwrap

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.verb import Verb


@click.command(name="reproduce", cls=Verb)
@click.argument("figures", nargs=-1, metavar="[FIG…|all]")
@click.option(
    "--out",
    default="reproduction",
    show_default=True,
    metavar="DIR",
    help="Folder, made if needed.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the agreement table as JSON.")
def reproduce_command(figures: tuple[str, ...], out: str, as_json: bool) -> None:
    """Draw the paper's figures again and put its numbers beside ours.

    \b
    Parts: fig4 to fig9, fig11 to fig15, equations, campaign; all of them without a name.

    \b
    Examples:
      drillctrl reproduce all --out paper
      drillctrl reproduce fig8 fig14
    """
    from drillctrl.base.text import WIDTH
    from drillctrl.paper.agreement import AGREES
    from drillctrl.paper.agreement import as_json as rows_as_json
    from drillctrl.paper.reproduce import reproduce

    def show(name: str, done: int, total: int) -> None:
        click.echo(f"{done}/{total} {name}", err=True)

    if not out.strip():
        raise InputError("--out", out, "a folder")
    rows = reproduce(figures or ("all",), out, show if sys.stderr.isatty() else None)
    if as_json:
        click.echo(rows_as_json(rows), nl=False)
        return
    agreed = sum(row.verdict == AGREES for row in rows)
    click.echo(f"{agreed} of {len(rows)} statements agree; figures and agreement.md in {out}")
    for row in rows:
        click.echo(f"{row.where}: {row.what}")
        click.echo(f"    paper {row.published}; ours {row.ours}: {row.verdict}")
        click.echo(textwrap.indent("\n".join(textwrap.wrap(row.why, WIDTH - 4)), "    "))
