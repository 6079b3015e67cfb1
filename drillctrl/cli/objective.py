"""What a design minimises and must fulfil, as options of the command line."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.verb import Command, with_options

if TYPE_CHECKING:
    from drillctrl.synthesis.objectives import Objective, Requirements


# Options that belong to one objective, and the parameter of it that they set.
_ERRORS = {f"{name}_error": name for name in ("psi", "delta0", "omega0", "depth", "mud")}
_BELONGS = {
    "semidiscrete": {"m": "m", "order": "order"},
    "worst-case": _ERRORS,
    "drilling": {**_ERRORS, "kick": "kick", "modes": "modes"},
    "robust": {"epsilon": "epsilon"},
}
_REQUIREMENTS = {
    "min_decay": "decay",
    "min_radius": "stability_radius",
    "max_input_gain": "input_gain",
}


def objective_options(command: Command) -> Command:
    """Add the options that say what is minimised."""
    options = [
        click.option(
            "--objective",
            help="exact: α; drilling: growth of torsional swings on the motion that is drilled "
            "with (laws of a top drive: the bit is shaken least); semidiscrete: ρ(D); worst-case: "
            "largest α when the point is off (by its own errors where a record was fitted, of a "
            "top drive too); robust: largest Re s when the plant's matrices are off. Without it "
            "exact, and drilling where that does not stabilise.",
        ),
        click.option("--m", type=int, help="Intervals (semidiscrete; default 40)."),
        click.option("--order", type=int, help="0, 1 or 2 (semidiscrete; default 0)."),
        click.option(
            "--psi-error", type=float, help="Relative (worst-case: default 0.05; drilling: 0)."
        ),
        click.option("--delta0-error", type=float, help="Relative (worst-case, drilling; 0)."),
        click.option("--omega0-error", type=float, help="Relative (worst-case, drilling; 0)."),
        click.option(
            "--depth-error",
            type=float,
            help="Relative, of the string's length (worst-case, drilling: 0; dynamic-1 …: 0.2).",
        ),
        click.option(
            "--mud-error", type=float, help="Relative, of its density (worst-case, drilling; 0)."
        ),
        click.option("--epsilon", type=float, help="Relative error (robust; default 0.001)."),
        click.option("--kick", type=float, help="Largest swing of the speed (drilling; 0.45)."),
        click.option("--modes", type=int, help="Torsional modes (drilling; 1, of a top drive 4)."),
    ]
    return with_options(command, options)


def requirement_options(command: Command) -> Command:
    """Add the options that say what is required."""
    options = [
        click.option("--min-decay", type=float, help="Require α ≤ −this."),
        click.option("--min-radius", type=float, help="Require this stability radius."),
        click.option(
            "--max-input-gain",
            type=float,
            help="Require at most this peak of control torque per disturbance torque.",
        ),
    ]
    return with_options(command, options)


def read_requirements(options: dict[str, Any]) -> Requirements:
    """Take the options of `requirement_options` out of a mapping."""
    from drillctrl.synthesis.objectives import Requirements

    return Requirements(
        **{parameter: options.pop(option) for option, parameter in _REQUIREMENTS.items()}
    )


def _of_fit(rig: str | None) -> dict[str, float]:
    """Return the errors that a rig fitted to a recording has; none of any other."""
    if rig is None:
        return {}
    from drillctrl.designs.worst_case import fitted_box
    from drillctrl.strings.files import fitted_errors

    errors = fitted_errors(rig)
    if not errors:
        return {}
    sizes = fitted_box(errors)
    told = ", ".join(f"{name} by {100.0 * size:.1f} %" for name, size in sizes.items())
    click.echo(f"drillctrl: note: the box is that of the fitted rig: {told}", err=True)
    return {option: sizes[name] for option, name in _ERRORS.items() if name in sizes}


def read_objective(options: dict[str, Any]) -> Objective | None:
    """Take the options of `objective_options` out of a mapping; None where none was chosen.

    Raises
    ------
    InputError
        If the objective is unknown, or an option belongs to another one.
    """
    from drillctrl.designs.drilling import Drilling
    from drillctrl.designs.worst_case import WorstCase
    from drillctrl.synthesis.objectives import Exact, Robust, SemiDiscrete

    kinds: dict[str, Callable[..., Objective]] = {
        "exact": Exact,
        "drilling": Drilling,
        "semidiscrete": SemiDiscrete,
        "worst-case": WorstCase,
        "robust": Robust,
    }
    name = options.pop("objective")
    if name == "worst-case" and all(options[option] is None for option in _ERRORS):
        options.update(_of_fit(options.get("rig")))
    if name is not None and name not in kinds:
        raise InputError("--objective", name, f"one of {', '.join(kinds)}")
    known = {option for names in _BELONGS.values() for option in names}
    given = {option: value for option in known if (value := options.pop(option)) is not None}
    mine = _BELONGS.get(name, {})
    for option, value in sorted(given.items()):
        if option not in mine:
            owners = [owner for owner, names in _BELONGS.items() if option in names]
            flag = "--" + option.replace("_", "-")
            raise InputError(flag, value, f"left out unless --objective is {' or '.join(owners)}")
    chosen = {mine[option]: value for option, value in given.items()}
    return None if name is None else kinds[name](**chosen)
