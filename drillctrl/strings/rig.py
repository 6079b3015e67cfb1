"""A rig whose string is known: its lumped numbers follow from the string."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from drillctrl.base.errors import InputError, checked_number
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.rig import Rig
from drillctrl.strings.drill_string import DrillString
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
    drive_inertia : float or None
        Of the top drive, referred to the string, kg m²; None where the speed is imposed.

    Raises
    ------
    InputError
        If a lumped number is not what follows from the string.
    """

    string: DrillString = field(kw_only=True)
    drive_inertia: float | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.drive_inertia is not None:
            checked_number("inertia of the drive", self.drive_inertia, 0.0, 1e9, open_low=True)
        for name, value in lumped_values(self.string).items():
            if abs(getattr(self, name) - value) > 1e-9 * abs(value):
                wanted = f"{value:.10g}, which follows from the string"
                raise InputError(name, getattr(self, name), wanted)

    def hardware(self) -> dict[str, Any]:
        """Return string and drive as parts of a plant."""
        parts: dict[str, Any] = {"string": PipeString(self.string)}
        if self.drive_inertia is not None:
            ratio = self.drive_inertia / self.inertia
            parts["blocks"] = (TopDrive(inertia_ratio=ratio),)
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


def string_rig(
    string: DrillString, *, drive_inertia: float | None = None, **bit_and_rock: Any
) -> StringRig:
    """Return a rig with a real string.

    Parameters
    ----------
    string : DrillString
        The string.
    drive_inertia : float, optional
        Of the top drive, kg m².
    **bit_and_rock
        The attributes of `Rig` that say what bit and rock are.
    """
    values: dict[str, Any] = {**lumped_values(string), **bit_and_rock}
    return StringRig(**values, string=string, drive_inertia=drive_inertia)


def lump(rig: Rig) -> Rig:
    """Return a rig of the paper's kind: one axial and one torsional degree of freedom.

    Parameters
    ----------
    rig : Rig
        A plain rig is returned as it is.
    """
    return Rig(**{name: getattr(rig, name) for name in Rig.__dataclass_fields__})
