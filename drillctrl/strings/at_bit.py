"""What a bit meets of an exact string: how far it gives way, whatever turns the top end."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.hoist import Hoist
from drillctrl.drilling.plant import Plant
from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_law import DriveLaw
from drillctrl.strings.lump import lumped
from drillctrl.strings.model import PipeString
from drillctrl.strings.slopes import count_growing

# Stands for s = 0, where an integrator has its pole.
_NEARLY_NOTHING = 1e-9


@dataclass(frozen=True)
class StringAtBit:
    """An exact string under its drive, as its bit meets it.

    Attributes
    ----------
    string : DrillString
        The string.
    control : DriveControl or None
        Of its drive; None where the speed is imposed.
    units : DrillString or None
        Whose lumped equivalent makes the units of dimensionless points; None for its own.
    """

    string: DrillString
    control: DriveControl | None = None
    units: DrillString | None = None

    def receptances(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return displacement per force, m/N, and rotation per torque, rad/(N m), (...).

        Parameters
        ----------
        s : complex, (...)
            1/s.
        """
        at = _not_zero(s)
        u, force, _ = self.string.tension.at_bit(at)
        if self.control is None:
            angle, torque, _ = self.string.torsion.at_bit(at)
        else:
            turned, moment = self.top(at)
            matrix, _ = self.string.torsion.scaled_transfer(at)
            angle = matrix[..., 0, 0] * turned + matrix[..., 0, 1] * moment
            torque = matrix[..., 1, 0] * turned + matrix[..., 1, 1] * moment
        return np.asarray(u / force), np.asarray(angle / torque)

    def top(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return angle and torque at the top, N m/rad, of a motion that the drive allows, (...).

        Both over one factor, so that neither has a pole at s = 0.
        """
        assert self.control is not None
        at = _not_zero(s)
        # The drive may have poles where its impedance is infinite: its two ends have none.
        speed, moment = self.control.ends(at)
        return speed, np.asarray(at * moment)

    @functools.cached_property
    def scales(self) -> tuple[FloatArray, float]:
        """SI values of loads per state, (2, 4), and of a unit of time of dimensionless points.

        Of a lumped string; time is √(I/Kt), s.
        """
        unit = self.units or self.string
        axial, torsional = lumped(unit, unit.tension), lumped(unit, unit.torsion)
        time = math.sqrt(torsional.mass / torsional.stiffness)
        efforts = np.array([axial.mass / time**2, torsional.stiffness])
        return np.outer(efforts, [1.0, time, 1.0, time]), time

    @functools.cached_property
    def growing(self) -> int:
        """Roots of string and drive that grow while the bit is free."""
        return 0 if self.control is None else count_growing(self.string.torsion, self.control)


def _not_zero(s: ComplexArray) -> ComplexArray:
    return np.asarray(np.where(s == 0.0, _NEARLY_NOTHING, s))


def fed_by_weight(plant: Plant) -> bool:
    """Whether the upper end hangs on a hook of its own, of which the exact string knows nothing."""
    return any(isinstance(block, Hoist) for block in plant.blocks)


def turns_freely(plant: Plant) -> bool:
    """Whether nothing holds the speed of a plant's top drive."""
    laws = any(isinstance(block, DriveLaw) for block in plant.blocks)
    return not laws and any(isinstance(block, TopDrive) for block in plant.blocks)


def string_at_bit(plant: Plant) -> StringAtBit | None:
    """Return the exact string of a plant; None if the plant is none of pipe under imposed feed.

    Raises
    ------
    InputError
        If nothing holds the speed of its top drive.
    """
    if not isinstance(plant.string, PipeString):
        return None
    laws = [block for block in plant.blocks if isinstance(block, DriveLaw) and block.acts]
    drives = [block for block in plant.blocks if isinstance(block, TopDrive)]
    if drives and not laws:
        wanted = "under a law that holds its speed, such as --structure soft-torque"
        raise InputError("top drive", "free to turn", wanted)
    if fed_by_weight(plant):
        return None
    hung = plant.string
    return _at_bit(hung.string, laws[0].control if laws else None, hung.units)


@functools.lru_cache(maxsize=64)
def _at_bit(string: DrillString, control: DriveControl | None, units: DrillString) -> StringAtBit:
    """Return the same object for equal strings, which keeps what it has counted."""
    return StringAtBit(string, control, units)
