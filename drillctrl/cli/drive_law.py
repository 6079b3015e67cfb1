"""The law that turns a rig's string, from options: for `analyze` and `simulate`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError
from drillctrl.cli.gains import gain_scales, read_gains
from drillctrl.cli.verb import naming

if TYPE_CHECKING:
    from drillctrl.drilling.bit_rock import BitRock
    from drillctrl.drilling.case import Case
    from drillctrl.drilling.point import OperatingPoint, RigPoint
    from drillctrl.simulation.controller import Controller
    from drillctrl.strings.drive_control import DriveControl

# Options of a controller that a law of a drive does not take, as they are when left out.
_NOT_DRIVEN = {
    "table": None,
    "activation": None,
    "delay": "fixed",
    "rate_limit": None,
    "noise": "",
}


def meant_structure(
    where: OperatingPoint | RigPoint, structure: str | None, options: Mapping[str, Any]
) -> str | None:
    """Return the structure that is meant: the top drive of a rig is stiff where none was typed.

    It is said that it is. None where nothing closes the loop: without a top drive, with torque
    that was asked to be constant, or where another option asks for a structure.

    Raises
    ------
    InputError
        If there is no top drive whose torque could be constant.
    """
    from drillctrl.drilling.drive import CONSTANT_TORQUE
    from drillctrl.drilling.point import RigPoint
    from drillctrl.strings.drives import machine_of
    from drillctrl.strings.rig import StringRig

    rig = where.rig if isinstance(where, RigPoint) else None
    if structure == CONSTANT_TORQUE:
        if rig is None:
            raise InputError("--structure", structure, "used with --rig: it turns a string")
        machine_of(rig)
        return None
    unasked = {"k1": None, "k2": None, **_NOT_DRIVEN}
    typed = any(options.get(name, usual) != usual for name, usual in unasked.items())
    if structure is not None or typed or not isinstance(rig, StringRig) or rig.drive is None:
        return structure
    instead = f"--structure {CONSTANT_TORQUE} leaves its torque as it is"
    click.echo(f"drillctrl: note: the top drive is stiff, as no law was given; {instead}", err=True)
    return "stiff"


def designed_structure(rig: str | None) -> str:
    """Return the structure that is designed where none was typed; of a top drive it is said."""
    from drillctrl.strings.files import load_rig
    from drillctrl.strings.rig import StringRig

    known = None if rig is None else load_rig(rig)
    if not isinstance(known, StringRig) or known.drive is None:
        return "case1"
    told = "soft torque is designed, as no law was given; compare holds laws against each other"
    click.echo(f"drillctrl: note: {told}", err=True)
    return "soft-torque"


def driven_case(
    where: OperatingPoint | RigPoint,
    structure: str,
    gains: tuple[str | None, str | None],
    tried: bool,
    bit: BitRock,
) -> Case:
    """Return the case of a rig that is turned by a drive under a law.

    Parameters
    ----------
    where : RigPoint
        Where it drills.
    structure : str
        The law.
    gains : (str or None, str or None)
        K1 of a PI law on the top's angle and speed, without it its rule's; and K2.
    tried : bool
        Whether trial runs are wanted.
    bit : BitRock
        What the bit meets.

    Raises
    ------
    InputError
        If there is no rig with a top drive, or an option does not fit.
    """
    from drillctrl.drilling.case import as_case
    from drillctrl.drilling.point import RigPoint
    from drillctrl.strings.drive_law import driven_plant
    from drillctrl.strings.rig import StringRig

    if tried:
        raise InputError("--trials", "all", "none for structures of a top drive")
    control = drive_law(where, structure, gains)
    assert isinstance(where, RigPoint)
    assert isinstance(where.rig, StringRig)
    return as_case(where, driven_plant(where.rig, control, bit))


def drive_law(
    where: OperatingPoint | RigPoint, structure: str, gains: tuple[str | None, str | None]
) -> DriveControl:
    """Return a law of the top drive of a rig: that of its rule, or with the gains typed.

    Raises
    ------
    InputError
        If there is no rig with a top drive, or an option does not fit.
    """
    from drillctrl.drilling.plant import top_drive_plant
    from drillctrl.drilling.point import RigPoint
    from drillctrl.drilling.structures import soft_torque
    from drillctrl.strings.drives import drive_control, given_control, machine_of
    from drillctrl.strings.rig import StringRig

    k1, k2 = gains
    if not isinstance(where, RigPoint):
        raise InputError("--structure", structure, "used with --rig: it turns a string")
    if k2 is not None:
        raise InputError("--K2", k2, f"left out: {structure} feeds back nothing delayed")
    machine_of(where.rig)
    assert isinstance(where.rig, StringRig)
    if k1 is None:
        return drive_control(structure, where.rig)
    scales = gain_scales(soft_torque(), top_drive_plant(1.0), where.rig)
    with naming("--K1", "K1"):
        read = read_gains("K1", k1, scales)
        assert read is not None
        assert scales is not None
        si = [gain * scale for gain, (scale, _) in zip(read, scales, strict=False)]
        return given_control(structure, where.rig, si[0], si[1])


def driven_run(
    where: OperatingPoint | RigPoint, options: Mapping[str, Any]
) -> tuple[Case, Controller]:
    """Return plant and controller of a run whose string is turned by a drive under a law.

    Parameters
    ----------
    where : RigPoint
        Where it drills.
    options : mapping
        Those of `controller_options`. Delay, lag and torque limit take the place of the rig's.

    Raises
    ------
    InputError
        If there is no rig with a top drive, or an option does not fit.
    """
    from drillctrl.simulation.drive_control import law_controller

    structure = options["structure"]
    where, around = driven_place(where, options, structure)
    control = drive_law(where, structure, (options["k1"], options["k2"]))
    return law_controller(where, control, **around)


def driven_place(
    where: OperatingPoint | RigPoint, options: Mapping[str, Any], structure: str
) -> tuple[RigPoint, dict[str, Any]]:
    """Return where a rig drills whose drive is as was typed, and the clock of its law.

    Raises
    ------
    InputError
        If there is no rig with a top drive, or an option does not fit.
    """
    from drillctrl.base import units
    from drillctrl.drilling.point import RigPoint
    from drillctrl.strings.drives import machine_of

    if not isinstance(where, RigPoint):
        raise InputError("--structure", structure, "used with --rig: it turns a string")
    for name, usual in _NOT_DRIVEN.items():
        if options[name] != usual:
            wanted = f"left out with --structure {structure}, a law of a top drive"
            raise InputError(f"--{name.replace('_', '-')}", options[name], wanted)
    changed: dict[str, Any] = {
        field: units.to_si(f"--{name.replace('_', '-')}", options[name], dimension)
        for name, field, dimension in (
            ("measurement_delay", "delay", units.TIME),
            ("actuator_lag", "lag", units.TIME),
            ("limit", "torque_limit", units.TORQUE),
        )
        if options[name] is not None
    }
    if changed:
        machine = replace(machine_of(where.rig), **changed)
        where = replace(where, rig=replace(where.rig, drive=machine))  # type: ignore[call-arg]
    period = options["period"]
    seconds = None if period is None else units.to_si("--period", period, units.TIME)
    return where, {} if seconds is None else {"period": seconds}
