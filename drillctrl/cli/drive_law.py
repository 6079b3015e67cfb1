"""The law that turns a rig's string, from options: for `analyze` and `simulate`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from drillctrl.base.errors import InputError
from drillctrl.cli.gains import gain_scales, read_gains
from drillctrl.cli.verb import naming

if TYPE_CHECKING:
    from drillctrl.drilling.bit_rock import BitRock
    from drillctrl.drilling.case import Case
    from drillctrl.drilling.point import OperatingPoint, RigPoint
    from drillctrl.simulation.controller import Controller
    from drillctrl.strings.drive_control import DriveControl
    from drillctrl.strings.rig import StringRig

# Options of a controller that a law of a drive does not take, as they are when left out.
_NOT_DRIVEN = {
    "table": None,
    "activation": None,
    "delay": "fixed",
    "rate_limit": None,
    "noise": "",
}


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
    from drillctrl.strings.drive_law import driven_plant

    if tried:
        raise InputError("--trials", "all", "none for structures of a top drive")
    rig, control = _law_at(where, structure, gains)
    return as_case(where, driven_plant(rig, control, bit))


def _law_at(
    where: OperatingPoint | RigPoint, structure: str, gains: tuple[str | None, str | None]
) -> tuple[StringRig, DriveControl]:
    """Return the rig of a point, and the law of its top drive."""
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
        return where.rig, drive_control(structure, where.rig)
    scales = gain_scales(soft_torque(), top_drive_plant(1.0), where.rig)
    with naming("--K1", "K1"):
        read = read_gains("K1", k1, scales)
        assert read is not None
        assert scales is not None
        si = [gain * scale for gain, (scale, _) in zip(read, scales, strict=False)]
        return where.rig, given_control(structure, where.rig, si[0], si[1])


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
    from drillctrl.base import units
    from drillctrl.drilling.point import RigPoint
    from drillctrl.simulation.drive_control import law_controller

    structure = options["structure"]
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
    if changed and isinstance(where, RigPoint):
        from drillctrl.strings.drives import machine_of

        machine = replace(machine_of(where.rig), **changed)
        where = replace(where, rig=replace(where.rig, drive=machine))  # type: ignore[call-arg]
    _, control = _law_at(where, structure, (options["k1"], options["k2"]))
    assert isinstance(where, RigPoint)
    period = options["period"]
    seconds = None if period is None else units.to_si("--period", period, units.TIME)
    return law_controller(where, control, period=seconds)
