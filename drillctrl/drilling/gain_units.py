"""Gains in the units of a rig."""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.rig import Rig


def gain_units(structure: FeedbackStructure, rig_point: RigPoint) -> tuple[FloatArray, list[str]]:
    """Return the SI value of each unit gain of one row, and its unit.

    A torque is counted in Kt per rad, a rate in radians per time unit; an axial force in
    the rig's axial force unit.
    """
    rig = rig_point.rig
    factors, names = [], []
    for output in structure.outputs:
        rate, axial = output.startswith("d"), output.endswith("x")
        scale = rig.torsional_stiffness * (rig.time_scale if rate else 1.0)
        factors.append(scale / (rig.axial_scale if axial else 1.0))
        names.append(f"N·m{'·s' if rate else ''}/{'m' if axial else 'rad'}")
    return np.array(factors), names


def rig_gain_units(structure: FeedbackStructure, rig: Rig | None) -> list[tuple[float, str]] | None:
    """Return factor and SI unit of each entry of (K1, K2); None without rig units for them."""
    if rig is None or structure.inputs != ("torque",):
        return None
    if not set(structure.outputs) <= {"theta", "dtheta"}:
        return None
    # θ is in radians already; θ' is per unit of time, u in units of Kt.
    known = {
        "theta": (rig.torsional_stiffness, "N*m/rad"),
        "dtheta": (rig.torsional_stiffness * rig.time_scale, "N*m*s/rad"),
    }
    return [known[output] for output in structure.outputs] * 2
