"""A rig whose string is known: its lumped numbers follow from the string."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.block import Block
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.rig import Rig
from drillctrl.drilling.sensors import Lagging, LateInput
from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.lump import lumped
from drillctrl.strings.model import PipeString

_LUMPED = (
    "mass",
    "inertia",
    "axial_stiffness",
    "torsional_stiffness",
    "axial_damping",
    "torsional_damping",
    "submerged_weight",
)


@dataclass(frozen=True)
class StringRig(Rig):
    """A rig with a real string; make it with `string_rig`.

    Its lumped numbers give the units of dimensionless points and what `lump` returns; the
    plant itself is the string.

    Attributes
    ----------
    string : DrillString
        What hangs between top end and bit.
    drive : DriveMachine or None
        The top drive; None where the speed is imposed.

    Raises
    ------
    InputError
        If a lumped number is not what follows from the string.
    """

    made_by = "string_preset('vertical-3000')"

    string: DrillString = field(kw_only=True)
    drive: DriveMachine | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in lumped_values(self.string).items():
            if abs(getattr(self, name) - value) > 1e-9 * abs(value):
                wanted = f"{value:.10g}, which follows from the string"
                raise InputError(name, getattr(self, name), wanted)

    def hardware(self) -> dict[str, Any]:
        """Return string and drive as parts of a plant.

        The drive's torque lags and is late as the machine says; its measurements are as they
        are, filters being part of a law.
        """
        parts: dict[str, Any] = {"string": PipeString(self.string)}
        machine = self.drive
        if machine is not None:
            blocks: list[Block] = [TopDrive(inertia_ratio=machine.inertia / self.inertia)]
            if machine.lag:
                blocks.append(Lagging("drive", machine.lag / self.time_scale))
            if machine.delay:
                blocks.append(LateInput("drive", machine.delay / self.time_scale))
            parts["blocks"] = tuple(blocks)
        return parts


def lumped_values(string: DrillString) -> dict[str, float]:
    """Return the numbers of a `Rig` that follow from its string, SI."""
    axial, torsional = lumped(string, string.tension), lumped(string, string.torsion)
    values = (
        axial.mass,
        torsional.mass,
        axial.stiffness,
        torsional.stiffness,
        axial.damping,
        torsional.damping,
        string.submerged_weight,
    )
    return dict(zip(_LUMPED, values, strict=True))


@checks_kinds
def string_rig(
    string: DrillString, *, drive: DriveMachine | None = None, **bit_and_rock: Any
) -> StringRig:
    """Return a rig with a real string.

    Parameters
    ----------
    string : DrillString
        The string.
    drive : DriveMachine, optional
        The top drive.
    **bit_and_rock
        The attributes of `Rig` that say what bit and rock are.
    """
    values: dict[str, Any] = {**lumped_values(string), **bit_and_rock}
    return StringRig(**values, string=string, drive=drive)


@checks_kinds
def lump(rig: Rig) -> Rig:
    """Return a rig of the paper's kind: one axial and one torsional degree of freedom.

    Parameters
    ----------
    rig : Rig
        A plain rig is returned as it is.
    """
    return Rig(**{name: getattr(rig, name) for name in Rig.__dataclass_fields__})
