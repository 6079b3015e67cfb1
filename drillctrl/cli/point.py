"""Options that say where the rig drills, the same for every verb."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.verb import Command, with_options

if TYPE_CHECKING:
    from drillctrl.drilling.point import OperatingPoint, RigPoint


_DIMENSIONLESS = (
    "omega0",
    "delta0",
    "psi",
    "eta",
    "xi",
    "kappa",
    "damping",
    "blades",
    "lam",
    "beta",
)
_RIG = ("rig", "speed", "rop", "wob", "rock_strength")
_POINT_C = {"omega0": 10.0, "delta0": 1.75, "psi": 14.0}


def point_options(command: Command) -> Command:
    """Add the options that say where the rig drills."""
    options = [
        click.option("--omega0", type=float, help="Rotary speed ω0 (default 10)."),
        click.option("--delta0", type=float, help="Nominal depth of cut δ0 (default 1.75)."),
        click.option("--psi", type=float, help="Cutting coefficient ψ (default 14)."),
        click.option("--eta", type=float, help="Frequency ratio η (default 1.6)."),
        click.option("--xi", type=float, help="Axial damping ratio ξ (default 0.02)."),
        click.option("--kappa", type=float, help="Torsional damping ratio κ (default 0.02)."),
        click.option("--damping", type=float, help="Sets ξ and κ together."),
        click.option("--blades", type=float, help="Number of blades n (default 4)."),
        click.option("--lam", type=float, help="Wear-flat force λ (default 0.7461 ψ)."),
        click.option("--beta", type=float, help="Wear-flat torque β (default 0.2686)."),
        click.option(
            "--rig",
            help="table1, paper-string, vertical-3000, deep-5000, or a TOML file.",
        ),
        click.option("--speed", help="Rotary speed with its unit, such as '120 rpm'."),
        click.option("--rop", help="Rate of penetration with its unit, such as '20 m/h'."),
        click.option("--wob", help="Weight on bit instead of --rop, such as '20 kN'."),
        click.option("--rock-strength", help="Instead of the rig's own, such as '60 MPa'."),
        click.option(
            "--units",
            metavar="NAME",
            help="Results in si (m/h, kN: usual with a rig), field (ft/h, klbf) or dimensionless; "
            "JSON stays in SI or dimensionless but for axes.",
        ),
    ]
    return with_options(command, options)


def read_point(options: dict[str, Any]) -> OperatingPoint | RigPoint:
    """Return the point that the options name.

    Raises
    ------
    InputError
        If dimensionless and rig options are mixed, or one is missing or wrong.
    """
    from drillctrl.base.language import language_named

    groups = {k: options[k] for k in _DIMENSIONLESS if options.get(k) is not None}
    rig = {k: options[k] for k in _RIG if options.get(k) is not None}
    if groups and rig:
        first = next(iter(groups))
        raise InputError(
            f"--{first}",
            groups[first],
            f"left out where --{next(iter(rig)).replace('_', '-')} gives the point in rig units",
        )
    language = language_named(options.get("units"), with_rig=bool(rig))
    if not rig:
        return _operating_point(groups)
    return replace(_rig_point(rig), units=language.name)


def rig_name(options: Mapping[str, Any]) -> str | None:
    """Return what a rig is called in titles: its preset, or its file."""
    return None if options.get("rig") is None else Path(options["rig"]).stem


def _operating_point(groups: dict[str, Any]) -> OperatingPoint:
    from drillctrl.drilling.point import OperatingPoint

    return OperatingPoint(**{**_POINT_C, **with_damping(groups)})


def with_damping(groups: dict[str, Any]) -> dict[str, Any]:
    """Return the groups with ξ and κ in place of the damping that sets both."""
    if "damping" not in groups:
        return groups
    for name in ("xi", "kappa"):
        if name in groups:
            raise InputError(f"--{name}", groups[name], "left out where --damping is given")
    rest = {name: value for name, value in groups.items() if name != "damping"}
    return {**rest, "xi": groups["damping"], "kappa": groups["damping"]}


def _rig_point(given: dict[str, Any]) -> RigPoint:
    from drillctrl.base import units
    from drillctrl.drilling.plausibility import plausibility_notes
    from drillctrl.drilling.point import RigPoint
    from drillctrl.drilling.steady import rig_point_at_weight_on_bit
    from drillctrl.strings.files import load_rig
    from drillctrl.strings.words import wall_note

    for name, permitted in (("rig", "a preset or a TOML file"), ("speed", "such as '120 rpm'")):
        if name not in given:
            raise InputError(f"--{name}", "(missing)", f"given, {permitted}")
    if ("rop" in given) == ("wob" in given):
        shown = given.get("rop", "(missing)")
        raise InputError("--rop", shown, "given, such as '20 m/h', or else --wob, one of the two")
    rig = load_rig(given["rig"])
    if "rock_strength" in given:
        strength = units.to_si("--rock-strength", given["rock_strength"], units.STRESS)
        rig = rig.with_rock_strength(strength)
    speed = units.to_si("--speed", given["speed"], units.ROTARY_SPEED)
    if not speed > 0.0:
        raise InputError("--speed", given["speed"], "above 0: the sense in which the bit cuts")
    if "wob" in given:
        weight = units.to_si("--wob", given["wob"], units.FORCE)
        point = rig_point_at_weight_on_bit(rig, speed, weight)
    else:
        point = RigPoint(rig, speed, units.to_si("--rop", given["rop"], units.SPEED))
    rubs = wall_note(rig)
    for note in (*plausibility_notes(point), *([] if rubs is None else [rubs])):
        click.echo(f"drillctrl: note: {note}", err=True)
    return point
