"""How fast a bounded motion can be: what tells one that grows without end."""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.kernel import data

# Multiples of a rig's own scale of speed that no bounded motion of it reaches.
BEYOND = 20.0
# And of the speed with which a string springs back that the drive alone has wound up, axial
# and torsional: a bit that bounces as it falls behind the feed gets about three times more from
# the rock that turns under it.
_WOUND = (10.0, 3.0)


def rate_scales(point: OperatingPoint, weight: float, torque: float) -> tuple[float, float]:
    """Return the scales of x' and θ' of a bit that is loaded by so much.

    They are the imposed rate and that with which the string springs back when the load is
    gone: twist T/Kt at the frequency of torsion, stretch W/Ka at that of the axial motion.
    """
    axial = point.penetration_rate + weight / point.eta if point.eta > 0.0 else np.inf
    return axial, point.omega0 + torque


def rate_bounds(
    point: OperatingPoint, steady: FloatArray, drive: FloatArray, start: FloatArray
) -> FloatArray:
    """Return `BOUNDS` of a nonlinear run, (4,).

    Parameters
    ----------
    point : OperatingPoint
        Where it starts.
    steady : array, (2,)
        Weight on bit and torque of steady drilling there.
    drive : array, (k, 9)
        As `Scenario.drive` returns it.
    start : array, (n + m,)
        States and inputs at t = 0.

    Notes
    -----
    A string is wound and pressed together by the drive at most, however long the bit
    stands still, so that the bit gains speed by what the drive has moved on since the start.
    """
    stiffness = max(1.0, point.eta)
    strength = drive[:, data.DRIVE_STRENGTH].max()
    more = abs(drive[:, [data.DRIVE_X + 1, data.DRIVE_THETA + 1]]).max(axis=0)
    fastest = np.array([point.penetration_rate, point.omega0]) + more
    scales = np.array(rate_scales(point, *(strength * steady).tolist()))
    size = stiffness * float(abs(start).sum())
    at_first = BEYOND * (scales + more + size)
    return np.column_stack([at_first, np.array(_WOUND) * stiffness * fastest]).ravel()
