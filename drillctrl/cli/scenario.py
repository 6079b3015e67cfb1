"""How a run starts, what changes on the way and what closes the loop, as texts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError, checked_number
from drillctrl.cli.gains import read_gains, scales_at
from drillctrl.cli.quantity import put_once, read_quantity
from drillctrl.cli.verb import Command, with_options

if TYPE_CHECKING:
    from drillctrl.base.units import Dimension
    from drillctrl.drilling.point import OperatingPoint, RigPoint
    from drillctrl.drilling.rig import Rig
    from drillctrl.simulation.controller import Controller
    from drillctrl.simulation.scenario import Scenario

_CHANGE = (
    "such as 't=50,omega0=9,duration=10' (omega0, v0, psi; of a rig: speed, rop, rock-strength)"
)

SURROUNDINGS = ("period", "measurement_delay", "actuator_lag", "limit", "rate_limit")
SURROUNDING_OPTIONS = (
    click.option("--period", metavar="TIME", help="Sample and hold; else continuous."),
    click.option("--measurement-delay", metavar="TIME", help="Age of the measurements."),
    click.option("--actuator-lag", metavar="TIME", help="Time constant of the actuator."),
    click.option(
        "--limit",
        metavar="TORQUE",
        help="Largest |u|: 3, or '5 kN*m' with a rig; a drive's integral does not wind up there.",
    ),
    click.option("--rate-limit", metavar="RATE", help="Fastest change of u: 5, or '50 kN*m/s'."),
)


def surroundings_options(command: Command) -> Command:
    """Add the options that say what surrounds a controller: clock, delays and limits."""
    for option in reversed(SURROUNDING_OPTIONS):
        command = option(command)
    return command


def controller_options(command: Command) -> Command:
    """Add the options that say what closes the loop."""
    options = [
        click.option(
            "--structure",
            help="p, case1, pd, case2, or of a top drive: stiff (default there), soft-torque, "
            "z-torque, dynamic-2 …; without it, no control.",
        ),
        click.option(
            "--K1", "k1", metavar="GAINS", help="On the outputs: -5,-4; with a rig '-3 kN*m/rad'."
        ),
        click.option("--K2", "k2", metavar="GAINS", help="On the delayed outputs."),
        click.option(
            "--table", type=click.Path(), help="Gains from a table that `drillctrl table` wrote."
        ),
        click.option("--activation", metavar="TIME", help="When control begins (default 0)."),
        click.option(
            "--delay", default="fixed", show_default=True,
            help="Delayed outputs: fixed (τ0 ago) or current (τ ago).",
        ),
        *SURROUNDING_OPTIONS,
        click.option(
            "--noise", default="", metavar="NAME=DEVIATION",
            help="On each sample: theta=0.01,dtheta=0.1; with a rig 'dtheta=1 rpm'.",
        ),
        click.option("--seed", type=int, default=0, show_default=True, help="Of the noise."),
    ]  # fmt: skip
    return with_options(command, options)


def read_numbers(option: str, text: str, example: str) -> dict[str, float]:
    """Return numbers by name from a text such as ``dx=1,dtheta=1``; empty for none."""
    numbers: dict[str, float] = {}
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        name, _, value = part.partition("=")
        try:
            number = float(value)
        except ValueError:
            raise InputError(option, text, f"of the form {example}") from None
        put_once(option, numbers, name.strip(), number)
    return numbers


def read_states(option: str, text: str, example: str, rig: Rig | None) -> dict[str, float]:
    """Return dimensionless numbers of states by name; with a rig each may carry its unit.

    Names are those of the bit, ``x``, ``theta`` and their rates, or of a further coordinate
    that begins so, which is of the same kind.
    """
    if rig is None:
        return read_numbers(option, text, example)
    from drillctrl.base import units
    from drillctrl.drilling.quantities import si_scale

    kinds = (
        ("dtheta", "angular_rate", units.ROTARY_SPEED),
        ("theta", "angle", units.ANGLE),
        ("dx", "axial_rate", units.SPEED),
        ("x", "length", units.LENGTH),
    )
    numbers: dict[str, float] = {}
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals:
            raise InputError(option, text, f"of the form {example}")
        for start, quantity, dimension in kinds:
            if name.startswith(start):
                unit = si_scale(quantity, rig)
                typed = read_quantity(f"{option} {name}", value, dimension, unit, noted=True)
                put_once(option, numbers, name, typed / unit)
                break
        else:
            raise InputError(option, text, "of states x, dx, theta, dtheta")
    return numbers


def read_time(option: str, text: str, rig: Rig | None) -> float:
    """Return dimensionless time from a number, which is noted, or of a rig from a time."""
    from drillctrl.base import units

    unit = None if rig is None else rig.time_scale
    return read_quantity(option, text, units.TIME, unit, noted=True) / (unit or 1.0)


def read_disturbance(text: str | None, rig: Rig | None) -> dict[str, float]:
    """Return what steady drilling is disturbed by, as it is usual if nothing was typed."""
    if text is None:
        return {"dx": 1.0, "dtheta": 1.0}
    example = "dx=1,dtheta=1, or with a rig 'dx=1 m/h,dtheta=5 rpm'"
    return read_states("--initial", text, example, rig)


def read_scenario(
    start: str,
    initial: str | None,
    changes: tuple[str, ...],
    point: OperatingPoint,
    rig: Rig | None,
) -> Scenario:
    """Return how a run starts and what changes.

    Raises
    ------
    InputError
        If a text has not the form it should have.
    """
    from drillctrl.simulation.scenario import Scenario
    from drillctrl.simulation.starts import START_NAMES, start_named

    later = tuple(_read_change(text, point, rig) for text in changes)
    if start != "steady" and start not in START_NAMES:
        raise InputError("--start", start, f"steady, {', '.join(START_NAMES)}")
    kick = {} if initial is None and start != "steady" else read_disturbance(initial, rig)
    if start in ("steady", "rest", "stick"):
        return Scenario(start, kick, later)
    if initial is not None:
        raise InputError("--initial", initial, f"left out with --start {start}")
    return start_named(start).scenario(later)


def read_starts(text: str, possible: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of starts: all that are possible, or those between commas."""
    from drillctrl.simulation.starts import START_NAMES

    if text == "all":
        for name in START_NAMES:
            if name not in possible:
                click.echo(f"drillctrl: note: no such start here: {name}", err=True)
        return possible
    names = tuple(part.strip() for part in text.split(","))
    for name in names:
        if name not in START_NAMES or names.count(name) > 1:
            raise InputError("--starts", text, f"all, or some of {','.join(START_NAMES)}")
    return names


def _read_change(text: str, point: OperatingPoint, rig: Rig | None) -> Any:
    from drillctrl.base import units
    from drillctrl.simulation.scenario import Change

    given: dict[str, str] = {}
    for part in text.split(","):
        name, equals, value = part.partition("=")
        if not equals or name.strip() in given:
            raise InputError("--change", text, _CHANGE)
        given[name.strip()] = value.strip()
    if "t" not in given:
        raise InputError("--change", text, _CHANGE)
    arguments = {"time": read_time("--change t", given.pop("t"), rig)}
    in_rig_units: dict[str, tuple[str, Dimension, float]] = {}
    if rig is not None:
        in_rig_units = {
            "speed": ("omega0", units.ROTARY_SPEED, 1.0 / rig.time_scale),
            "rop": ("penetration_rate", units.SPEED, rig.axial_scale / rig.time_scale),
            "rock-strength": ("psi", units.STRESS, rig.rock_strength / point.psi),
        }
    plain = {"omega0": "omega0", "v0": "penetration_rate", "psi": "psi"}
    for name, value in given.items():
        if name == "duration":
            arguments["duration"] = read_time("--change duration", value, rig)
        elif name in in_rig_units:
            field, dimension, unit = in_rig_units[name]
            arguments[field] = units.to_si(f"--change {name}", value, dimension) / unit
        elif name in plain and rig is None:
            arguments[plain[name]] = read_numbers("--change", f"{name}={value}", _CHANGE)[name]
        elif name in plain:
            instead = {"omega0": "speed", "v0": "rop", "psi": "rock-strength"}[name]
            raise InputError("--change", text, f"with {instead} and its unit in place of {name}")
        else:
            raise InputError("--change", text, _CHANGE)
    return Change(**arguments)


def read_surroundings(options: Mapping[str, Any], rig: Rig | None) -> dict[str, float]:
    """Return what `surroundings_options` say, dimensionless.

    Raises
    ------
    InputError
        If a unit is missing or does not fit.
    """
    from drillctrl.base import units

    given: dict[str, float] = {}
    time = 1.0 if rig is None else rig.time_scale
    torque = 1.0 if rig is None else rig.torsional_stiffness
    for name, dimension, unit in (
        ("period", units.TIME, time),
        ("measurement_delay", units.TIME, time),
        ("actuator_lag", units.TIME, time),
        ("limit", units.TORQUE, torque),
        ("rate_limit", units.TORQUE_RATE, torque / time),
    ):
        if options[name] is not None:
            option = f"--{name.replace('_', '-')}"
            known = None if rig is None else unit
            given[name] = read_quantity(option, options[name], dimension, known) / unit
    return given


def read_controller(
    options: Mapping[str, Any],
    where: OperatingPoint | RigPoint,
    point: OperatingPoint,
    scenario: Scenario,
    duration: float,
    rig: Rig | None,
) -> Controller | None:
    """Return what closes the loop, or None where nothing does.

    Raises
    ------
    InputError
        If an option is missing, or one is given that needs another.
    """
    given: dict[str, Any] = {}
    if options["activation"] is not None:
        given["activation"] = read_time("--activation", options["activation"], rig)
    given.update(read_surroundings(options, rig))
    if options["noise"]:
        example = "theta=0.01,dtheta=0.1, or with a rig 'theta=0.01 rad,dtheta=1 rpm'"
        given["noise"] = read_states("--noise", options["noise"], example, rig)
        given["seed"] = options["seed"]
    if options["delay"] != "fixed":
        given["delay"] = options["delay"]
    structure, now, past = (options[name] for name in ("structure", "k1", "k2"))
    if options["table"] is not None:
        for name, value in (("structure", structure), ("K1", now), ("K2", past)):
            if value is not None:
                raise InputError(f"--{name}", value, "left out where --table gives the gains")
        return _from_table(options["table"], where, point, scenario, duration, given)
    if structure is None:
        lonely = {"K1": now, "K2": past, **given}
        for name, value in lonely.items():
            if value is not None:
                needs = f"given together with --{name.replace('_', '-')}"
                raise InputError("--structure", "(missing)", needs)
        return None
    from drillctrl.simulation.controller import Controller

    scales = scales_at(where, structure)
    K1 = read_gains("K1", now, scales)
    if K1 is None:
        raise InputError("--K1", "(missing)", f"given for structure {structure}")
    return Controller(structure, K1, read_gains("K2", past, scales), **given)


def _from_table(
    path: str,
    where: OperatingPoint | RigPoint,
    point: OperatingPoint,
    scenario: Scenario,
    duration: float,
    given: dict[str, Any],
) -> Controller:
    from drillctrl.drilling.case import as_case
    from drillctrl.tables.files import load_table
    from drillctrl.tables.scheduling import places_of, scheduled

    table = load_table(path, as_case(where).plant)
    ends = [change.time + change.duration for change in scenario.changes]
    instants = [0.0, *(end for end in ends if end <= duration)]
    import numpy as np

    places = places_of(table, point, scenario, np.array(instants))
    vouched = table.stable_at(*places.T)
    for stable, time, place in zip(vouched, instants, places.tolist(), strict=True):
        if not stable:
            omega0, delta0, psi = place[:3]
            click.echo(
                f"drillctrl: note: the table does not vouch for ω0 = {omega0:.4g}, "
                f"δ0 = {delta0:.4g}, ψ = {psi:.4g} from t = {time:g}: "
                f"the last gains that it vouches for fade to zero",
                err=True,
            )
    return scheduled(table, point, scenario, duration=duration, outside="fade", **given)


def read_duration(text: str | None, rig: Rig | None, usual: float = 200.0) -> float:
    """Return the dimensionless length of a run, as it is usual if none was typed."""
    length = usual if text is None else read_time("--duration", text, rig)
    return checked_number("duration", length, 0.0, open_low=True)
