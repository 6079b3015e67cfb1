"""`drillctrl analyze`: roots, count and trial runs of given gains, or of none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.bit_law import bit_law_options, read_bit_law
from drillctrl.cli.drive_law import driven_case, meant_structure
from drillctrl.cli.drives import are_drives
from drillctrl.cli.gains import read_gains, scales_at
from drillctrl.cli.output import write_figure
from drillctrl.cli.point import point_options, read_point
from drillctrl.cli.roots import (
    NOT_STABILISED,
    check_outputs,
    deliver_roots,
    root_output_options,
    trials_option,
    wants_trials,
)
from drillctrl.cli.verb import Verb


@click.command(name="analyze", cls=Verb)
@point_options
@click.option(
    "--structure",
    help="p, case1, pd, case2, or of a top drive: stiff (default there), soft-torque, z-torque, "
    "observer-2, dynamic-2 …; without it, the open loop.",
)
@click.option(
    "--K1", "k1", metavar="GAINS", help="On the outputs: -5,-4; with a rig '-3 kN*m/rad'."
)
@click.option("--K2", "k2", metavar="GAINS", help="On the delayed outputs.")
@click.option("--m", type=int, help="Intervals of the semi-discretisation reported.")
@click.option("--order", type=int, default=2, show_default=True, help="Its order: 0, 1 or 2.")
@click.option("--require-stable", is_flag=True, help="Exit with 3 if it is not stable, or refused.")
@bit_law_options
@trials_option("none")
@click.option(
    "--figure",
    default="roots",
    show_default=True,
    help="What --plot draws: roots, or modes (the shapes of a string of pipe).",
)
@root_output_options
def analyze_command(
    structure: str | None,
    k1: str | None,
    k2: str | None,
    m: int | None,
    order: int,
    bit_law: str,
    drop: str | None,
    decay: str | None,
    trials: str,
    require_stable: bool,
    figure: str,
    prove: bool,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **point: Any,
) -> None:
    """Say whether given gains, or none, make a point stable, and by how much.

    The top drive of a rig is stiff unless a law is named, or constant-torque.

    \b
    Examples:
      drillctrl analyze --omega0 10 --delta0 1.75 --psi 14
      drillctrl analyze --structure case1 --K1 -5.17 --K2 5.06 --m 3 --order 0
      drillctrl analyze --rig table1 --speed "150 rpm" --rop "20 m/h" \\
          --structure p --K1 "-2 kN*m/rad"
      drillctrl analyze --rig vertical-3000 --speed "120 rpm" --rop "10 m/h" \\
          --structure soft-torque
    """
    check_outputs(out, plot)
    if figure not in ("roots", "modes"):
        raise InputError("--figure", figure, "roots or modes")
    tried = wants_trials(trials)
    where = read_point(point)
    from drillctrl.designs.design import analyze
    from drillctrl.drilling.case import as_case

    law = read_bit_law(bit_law, drop, decay, where)
    structure = meant_structure(where, structure, {"k1": k1, "k2": k2})
    if structure is not None and are_drives([structure]):
        turned = driven_case(where, structure, (k1, k2), tried, law)
        result = analyze(turned, m=m, order=order)
    else:
        scales = scales_at(where, structure)
        gains = read_gains("K1", k1, scales), read_gains("K2", k2, scales)
        case = as_case(where)
        assert case.plant is not None
        case = as_case(where, replace(case.plant, bit=law))
        result = analyze(case, structure, *gains, m=m, order=order, trials=tried)
    if figure == "modes" and plot is not None:
        from drillctrl.strings.check import check_rig
        from drillctrl.strings.figure import plot_rig

        if result.case.rig is None:
            raise InputError("--figure", figure, "roots without --rig: a string has modes")
        write_figure(plot, plot_rig(check_rig(result.case.rig)))
        plot = None
    deliver_roots(result, prove, as_json, out, plot)
    if require_stable and (not result.stable or result.verdict.refused):
        raise click.exceptions.Exit(NOT_STABILISED)
