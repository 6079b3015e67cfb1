"""What `design` and `analyze` share: the loop's roots, printed, written and drawn."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.output import check_figure, check_json, deliver
from drillctrl.cli.point import rig_name
from drillctrl.cli.progress import open_stages
from drillctrl.cli.verb import Command, with_options

if TYPE_CHECKING:
    from drillctrl.designs.result import Analysis


NOT_STABILISED = 3


def root_output_options(command: Command) -> Command:
    """Add the options that say where results go."""
    options = [
        click.option("--prove", is_flag=True, help="Prove the root count in ball arithmetic."),
        click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead."),
        click.option("--out", type=click.Path(), help="Also write the JSON to FILE.json."),
        click.option("--plot", type=click.Path(), help="Draw the roots: FILE.png, .svg, .pdf."),
    ]
    return with_options(command, options)


def trials_option(default: str) -> Callable[[Command], Command]:
    """Return what adds the option that says whether gains are tried."""
    return click.option(
        "--trials",
        default=default,
        show_default=True,
        help="Try the gains on the nonlinear motion beside no control: all starts, or none.",
    )


def wants_trials(given: str) -> bool:
    """Return whether gains are to be tried.

    Raises
    ------
    InputError
        If the option says neither.
    """
    if given not in ("all", "none"):
        raise InputError("--trials", given, "all or none")
    return given == "all"


def check_outputs(out: str | None, plot: str | None) -> None:
    """Refuse bad file names before any work is done."""
    check_json(out)
    check_figure(plot)


def deliver_roots(
    result: Analysis, prove: bool, as_json: bool, out: str | None, plot: str | None
) -> None:
    """Print all that is said of the result, and write the files asked for."""
    from drillctrl.designs.report import report

    with open_stages() as tell:
        told = report(result, tell)
    proof = result.prove() if prove else None
    fields = told.to_dict()
    if proof is not None:
        fields["certificate"]["proof"] = dataclasses.asdict(proof)
    draw = functools.partial(result.plot, name=rig_name(click.get_current_context().params))
    deliver(fields, told.summary, draw, as_json=as_json, out=out, plot=plot)
    if proof is not None and not as_json:
        counted = "undecided" if proof.count is None else f"{proof.count} root(s)"
        click.echo(
            f"Proved: {counted} right of {proof.line:.6g}, "
            f"{proof.segments} segments in {proof.precision}-bit balls"
        )
