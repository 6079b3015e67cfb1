"""A rig whose string is known: its lumped numbers follow from the string."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, field, fields
from typing import Any

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds, makes_of_kinds
from drillctrl.drilling.block import Block
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.hoist import Hoist
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
class WeightControl:
    """A hook that is fed by its weight; see `Hoist`.

    Attributes
    ----------
    block_mass : float
        Of travelling block, hook and top drive, kg.
    feed_gain : float
        Rate of feed per weight that is missing, m/s/N: the feed is V0 at the weight on bit of
        steady drilling, and nothing where there is V0 over this gain more.

    Raises
    ------
    InputError
        If a value is not positive.
    """

    block_mass: float
    feed_gain: float

    def __post_init__(self) -> None:
        checked_number("block mass", self.block_mass, 0.0, 1e7, open_low=True)
        checked_number("feed gain", self.feed_gain, 0.0, 1.0, open_low=True)


@makes_of_kinds
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
    weight_control : WeightControl or None
        What feeds the string by its weight; None where the feed is imposed.

    Raises
    ------
    InputError
        If a lumped number is not what follows from the string, or there are both ropes that give
        way and a control of the weight.
    """

    made_by = "string_preset('vertical-3000')"

    string: DrillString = field(kw_only=True)
    drive: DriveMachine | None = field(default=None, kw_only=True)
    weight_control: WeightControl | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in lumped_values(self.string).items():
            if abs(getattr(self, name) - value) > 1e-9 * abs(value):
                wanted = f"{value:.10g}, which follows from the string"
                raise InputError(name, getattr(self, name), wanted)
        if self.weight_control is not None and self.string.hoisting_stiffness is not None:
            wanted = "left out under a control of the weight, which is softer than ropes"
            raise InputError("hoisting stiffness", self.string.hoisting_stiffness, wanted)

    @property
    def depth(self) -> float:
        """Length of the string, m."""
        return self.string.length

    def hoist(self) -> tuple[Hoist, ...]:
        """Return what feeds the string, if that is not imposed, as a part of a plant."""
        control = self.weight_control
        if control is None:
            return ()
        damping = self.time_scale / (control.feed_gain * self.mass)
        return (Hoist(hoist_mass=control.block_mass / self.mass, hoist_damping=damping),)

    def hardware(self) -> dict[str, Any]:
        """Return string and drive as parts of a plant.

        The drive's torque lags and is late as the machine says; its measurements are as they
        are, filters being part of a law.
        """
        parts: dict[str, Any] = {"string": PipeString(self.string), "blocks": self.hoist()}
        machine = self.drive
        if machine is not None:
            blocks: list[Block] = [*self.hoist()]
            blocks.append(TopDrive(inertia_ratio=machine.inertia / self.inertia))
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
    string: DrillString,
    *,
    drive: DriveMachine | None = None,
    weight_control: WeightControl | None = None,
    **bit_and_rock: Any,
) -> StringRig:
    """Return a rig with a real string.

    Parameters
    ----------
    string : DrillString
        The string.
    drive : DriveMachine, optional
        The top drive.
    weight_control : WeightControl, optional
        What feeds the string by its weight.
    **bit_and_rock
        The attributes of `Rig` that say what bit and rock are.

    Raises
    ------
    InputError
        If one of these is missing, unknown or out of range.
    """
    values: dict[str, Any] = {**lumped_values(string), **bit_and_rock}
    known = {each.name: each.default is MISSING for each in fields(Rig)}
    for name in (*(name for name, needed in known.items() if needed), *values):
        if name not in values or name not in known:
            told = "given" if name in known else f"of {', '.join(known)}"
            raise InputError(name, values.get(name, "(missing)"), told)
    return StringRig(**values, string=string, drive=drive, weight_control=weight_control)


@checks_kinds
def lump(rig: Rig) -> Rig:
    """Return a rig of the paper's kind: one axial and one torsional degree of freedom.

    Parameters
    ----------
    rig : Rig
        A plain rig is returned as it is.
    """
    return Rig(**{name: getattr(rig, name) for name in Rig.__dataclass_fields__})
