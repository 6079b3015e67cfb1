"""A string whose top end is a drive with inertia of its own instead of a fixed speed.

The table speed of the paper's model is imposed. Here the top end turns by φ beside ω0 t,
carries J times the inertia at the bit, and is moved by the drive's torque: what soft-torque
and impedance-matching speed controllers act on.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import casadi as ca

from drillctrl.base.errors import checked_number
from drillctrl.drilling.plant import Plant, dimensionless_plant


@functools.cache
def top_drive_plant(inertia_ratio: float) -> Plant:
    """Return the dimensionless plant with a top drive.

    Parameters
    ----------
    inertia_ratio : float
        J > 0, inertia of the drive, referred to the string, over that at the bit.

    Returns
    -------
    Plant
        States x, dx, theta, dtheta, phi, dphi; inputs axial, torque and ``drive``, the
        perturbation of the drive's torque in units of Kt:
        θ'' gains the term φ, and J φ'' = θ − φ + drive.

    Raises
    ------
    InputError
        If the ratio is not positive.
    """
    ratio = checked_number("inertia_ratio", inertia_ratio, 0.0, 1e6, open_low=True)
    base = dimensionless_plant()
    top, late_top = ca.SX.sym("top", 2), ca.SX.sym("late_top", 2)
    drive = ca.SX.sym("drive")
    theta = base.state[base.state_names.index("theta")]
    twist = theta - top[0]
    bit = ca.vertcat(base.rhs[:-1], base.rhs[-1] + top[0])
    return replace(
        base,
        state=ca.vertcat(base.state, top),
        delayed_state=ca.vertcat(base.delayed_state, late_top),
        inputs=ca.vertcat(base.inputs, drive),
        rhs=ca.vertcat(bit, top[1], (twist + drive) / ratio),
        state_names=(*base.state_names, "phi", "dphi"),
        input_names=(*base.input_names, "drive"),
    )
