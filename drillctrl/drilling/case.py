"""What is asked for: a plant, and where it drills as far as that is known."""

from __future__ import annotations

from dataclasses import dataclass

from drillctrl.base.errors import InputError
from drillctrl.delay.system import DelaySystem
from drillctrl.drilling.linear import plant_system
from drillctrl.drilling.plant import Plant
from drillctrl.drilling.point import OperatingPoint, RigPoint

Where = OperatingPoint | RigPoint | DelaySystem


@dataclass(frozen=True, eq=False)
class Subject:
    """What is designed for: a plant, and where it drills as far as that is known."""

    plant: DelaySystem
    point: OperatingPoint | None
    rig_point: RigPoint | None
    physics: Plant | None


def subject_of(where: Where, inputs: tuple[str, ...], physics: Plant | None) -> Subject:
    """Return the plant at a point, or the given one.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or DelaySystem
        Where the rig drills; or any linear plant.
    inputs : tuple of str
        Those that are driven.
    physics : Plant or None
        By default `dimensionless_plant`.

    Raises
    ------
    InputError
        If ``where`` is none of these, or physics are given beside a linear plant.
    """
    if isinstance(where, DelaySystem):
        if physics is not None:
            raise InputError("plant", "given", "left out beside a DelaySystem")
        return Subject(where, None, None, None)
    if isinstance(where, RigPoint):
        point, rig_point = where.operating_point(), where
    elif isinstance(where, OperatingPoint):
        point, rig_point = where, None
    else:
        kinds = "an OperatingPoint, a RigPoint or a DelaySystem"
        raise InputError("point", type(where).__name__, kinds)
    return Subject(plant_system(point, inputs, physics), point, rig_point, physics)
