"""A simulated motion in the units of its rig."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.drilling.rig import Rig

if TYPE_CHECKING:
    from drillctrl.drilling.point import OperatingPoint
    from drillctrl.simulation.trace import Motion

# SI units of the columns; what is not here is a yes or no.
SI_UNITS = {
    "times": "s",
    "axial_displacement": "m",
    "penetration_rate": "m/s",
    "angular_displacement": "rad",
    "bit_speed": "rad/s",
    "delay": "s",
    "depth_of_cut": "m",
    "weight_on_bit": "N",
    "torque_on_bit": "N m",
    "axial_force": "N",
    "control_torque": "N m",
}
# What they measure, for other units than these.
QUANTITIES = {
    "times": "time",
    "axial_displacement": "length",
    "penetration_rate": "axial_rate",
    "angular_displacement": "angle",
    "bit_speed": "angular_rate",
    "delay": "time",
    "depth_of_cut": "length",
    "weight_on_bit": "force",
    "torque_on_bit": "torque",
    "axial_force": "force",
    "control_torque": "torque",
}


@dataclass(frozen=True, eq=False)
class RigMotion:
    """The motion of a rig at some instants, in SI units.

    Attributes
    ----------
    times : array
        s.
    axial_displacement : array
        Of the bit from steady drilling, downwards, m.
    penetration_rate : array
        Of the bit, m/s: what the top end imposes at the start, and ẋ.
    angular_displacement : array
        Of the bit from steady drilling, rad.
    bit_speed : array
        Φ', rad/s.
    delay : array
        s.
    depth_of_cut : array
        Of all blades together (Eq. 6), m; negative off the rock.
    weight_on_bit, torque_on_bit : array
        What the rock bears, N and N m.
    axial_force, control_torque : array
        Of the controller, N and N m.
    contact, stuck, held : bool array
        As in `Motion`.
    """

    times: FloatArray
    axial_displacement: FloatArray
    penetration_rate: FloatArray
    angular_displacement: FloatArray
    bit_speed: FloatArray
    delay: FloatArray
    depth_of_cut: FloatArray
    weight_on_bit: FloatArray
    torque_on_bit: FloatArray
    axial_force: FloatArray
    control_torque: FloatArray
    contact: npt.NDArray[np.bool_]
    stuck: npt.NDArray[np.bool_]
    held: npt.NDArray[np.bool_]

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return the arrays by name, times first: the columns of a table."""
        return dict(vars(self))


def in_rig_units(motion: Motion, point: OperatingPoint, rig: Rig) -> RigMotion:
    """Return a motion in SI units (Eq. 14).

    Parameters
    ----------
    motion : Motion
        Of a run that started at ``point``.
    point : OperatingPoint
        That of the rig.
    rig : Rig
        In the rock of the start.
    """
    time, length, force = rig.time_scale, rig.axial_scale, rig.axial_force_scale
    torque = rig.torsional_stiffness
    return RigMotion(
        times=time * motion.times,
        axial_displacement=length * motion.x,
        penetration_rate=length / time * (point.penetration_rate + motion.dx),
        angular_displacement=motion.theta,
        bit_speed=(point.omega0 + motion.dtheta) / time,
        delay=time * motion.delay,
        depth_of_cut=length * motion.depth,
        weight_on_bit=force * motion.weight_on_bit,
        torque_on_bit=torque * motion.torque_on_bit,
        axial_force=force * motion.axial,
        control_torque=torque * motion.torque,
        contact=motion.contact,
        stuck=motion.stuck,
        held=motion.held,
    )
