"""`drillctrl design`: gains, and what is known of them."""

from __future__ import annotations

from typing import Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.drive_law import designed_structure
from drillctrl.cli.drives import are_drives, deliver_drive_design, keep_option
from drillctrl.cli.gains import read_bounds, scales_at
from drillctrl.cli.objective import (
    objective_options,
    read_objective,
    read_requirements,
    requirement_options,
)
from drillctrl.cli.point import point_options, read_point
from drillctrl.cli.roots import (
    NOT_STABILISED,
    check_outputs,
    deliver_roots,
    root_output_options,
    trials_option,
    wants_trials,
)
from drillctrl.cli.scenario import SURROUNDINGS, read_surroundings, surroundings_options
from drillctrl.cli.verb import Verb


@click.command(name="design", cls=Verb)
@point_options
@click.option(
    "--structure",
    help="p: θ; case1 (default): θ and delayed θ; pd: θ, θ'; case2: θ, θ', both also delayed; of "
    "a top drive: stiff, soft-torque (default there), z-torque, observer-2 by their rules, "
    "z-torque-tuned and dynamic-1 … dynamic-4 optimised.",
)
@click.option(
    "--bound",
    multiple=True,
    metavar="GAIN=LOW:HIGH",
    help="For K1, K2 or one gain such as K1_2; with a rig 'K1=-3:3 kN*m/rad'; repeatable.",
)
@objective_options
@requirement_options
@click.option("--seed", type=int, default=0, show_default=True, help="Of the starting points.")
@click.option(
    "--require-stable",
    is_flag=True,
    help="Exit with 3 if nothing stabilises or is recommended, or a requirement is not met.",
)
@trials_option("all")
@surroundings_options
@click.option("--workers", type=int, default=1, show_default=True, help="Processes (drilling).")
@keep_option()
@root_output_options
def design_command(
    structure: str | None,
    bound: tuple[str, ...],
    seed: int,
    trials: str,
    workers: int,
    require_stable: bool,
    prove: bool,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **options: Any,
) -> None:
    """Find the gains within bounds that make vibrations decay fastest.

    Where none make smooth drilling stable, the gains are those that make torsional swings decay
    on the motion that is drilled with, as far as trial runs bear it out.

    \b
    Examples:
      drillctrl design --rig table1 --speed "150 rpm" --rop "20 m/h" --structure case2
      drillctrl design --omega0 10 --delta0 12 --psi 14 --bound K1=-5:5 --json
      drillctrl design --rig table1 --speed "80 rpm" --rop "30 m/h" --limit "0.9 kN*m"
      drillctrl design --rig vertical-3000 --structure dynamic-2
      drillctrl design --objective worst-case --psi-error 0.2 --min-decay 0.1
    """
    check_outputs(out, plot)
    structure = structure or designed_structure(options["rig"])
    if are_drives([structure]):
        tried = wants_trials(trials)
        stable = deliver_drive_design(structure, options, as_json, out, plot, tried, workers)
        if require_stable and not stable:
            raise click.exceptions.Exit(NOT_STABILISED)
        return
    if (keep := options.pop("keep")) is not None:
        raise InputError("--keep", keep, "left out unless laws of a top drive are designed")
    objective, requirements = read_objective(options), read_requirements(options)
    surroundings = {name: options.pop(name) for name in SURROUNDINGS}
    where = read_point(options)
    from drillctrl.designs.design import design
    from drillctrl.drilling.structures import as_structure

    chosen = as_structure(structure)
    result = design(
        where,
        chosen,
        bounds=read_bounds(bound, chosen, scales_at(where, chosen)),
        objective=objective,
        requirements=requirements,
        seed=seed,
        trials=wants_trials(trials),
        surroundings=read_surroundings(surroundings, getattr(where, "rig", None)),
        workers=workers,
    )
    on_motion = result.on_motion is not None
    deliver_roots(result, prove, as_json, out, plot)
    good = result.recommended is True if on_motion else result.stable
    met = good and result.requirements_met and not result.verdict.refused
    if require_stable and not met:
        raise click.exceptions.Exit(NOT_STABILISED)
