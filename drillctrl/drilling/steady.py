"""Steady drilling of a rig (Eqs. 10-12), and its inverse from the weight on bit."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

from drillctrl.base.errors import InputError, checked_number, interval_text
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.bit_rock import PaperLaw, steady_delay, steady_depth, steady_load
from drillctrl.drilling.coefficients import (
    RIG_PARAMETER_NAMES,
    Coefficients,
    rig_coefficients,
)
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.rig import Rig


@dataclass(frozen=True)
class SteadyState:
    """Drilling without vibration, in SI units.

    Attributes
    ----------
    weight_on_bit : float
        N.
    torque_on_bit : float
        N m.
    depth_of_cut : float
        d0, total over the blades per revolution, m (Eq. 11).
    axial_offset : float
        z0, bit position relative to V0 t, m (Eq. 12).
    angular_offset : float
        φ0, bit angle relative to Ω0 t, rad (Eq. 12).
    delay : float
        Time between two blades at one place, s.
    """

    weight_on_bit: float
    torque_on_bit: float
    depth_of_cut: float
    axial_offset: float
    angular_offset: float
    delay: float


def rig_parameter_values(point: RigPoint) -> dict[str, float]:
    """Return the SI parameters of a rig point by name, as in `RIG_PARAMETER_NAMES`."""
    return {
        name: float(getattr(point if hasattr(point, name) else point.rig, name))
        for name in RIG_PARAMETER_NAMES
    }


def _coefficients(point: RigPoint) -> Coefficients:
    return rig_coefficients(SimpleNamespace(**rig_parameter_values(point)))


@checks_kinds
def steady_state(point: RigPoint) -> SteadyState:
    """Return loads, deformations and depth of cut of steady drilling (Eqs. 10-12)."""
    c = _coefficients(point)
    weight, torque = (float(value) for value in steady_load(PaperLaw(), c, None))
    return SteadyState(
        weight_on_bit=weight,
        torque_on_bit=torque,
        depth_of_cut=float(steady_depth(c)),
        axial_offset=(c.weight - weight - c.axial_damping * c.penetration_rate) / c.axial_stiffness,
        angular_offset=-(torque + c.torsional_damping * c.rotary_speed) / c.torsional_stiffness,
        delay=float(steady_delay(c)),
    )


def weight_on_bit(
    rig: Rig, rotary_speed: npt.ArrayLike, penetration_rate: npt.ArrayLike, strength: npt.ArrayLike
) -> npt.NDArray[np.float64]:
    """Return the steady weight on bit, N, at many speeds, rates and rocks (SI)."""
    values = {
        **rig_parameter_values(RigPoint(rig, 1.0, 0.0)),
        "rotary_speed": np.asarray(rotary_speed, dtype=float),
        "penetration_rate": np.asarray(penetration_rate, dtype=float),
        "rock_strength": np.asarray(strength, dtype=float),
    }
    load = steady_load(PaperLaw(), rig_coefficients(SimpleNamespace(**values)), None)
    return np.asarray(load.weight_on_bit, dtype=float)


@checks_kinds
def rig_point_at_weight_on_bit(rig: Rig, rotary_speed: float, weight_on_bit: float) -> RigPoint:
    """Return the rig point whose steady weight on bit is the given one.

    Parameters
    ----------
    rig : Rig
        Drill string, bit and rock.
    rotary_speed : float
        Ω0, rad/s.
    weight_on_bit : float
        N. The wear flat carries the first part of it; only the rest cuts.

    Raises
    ------
    InputError
        If the weight is below what the wear flat alone carries.
    """

    def load_at(rate: float) -> float:
        return steady_state(RigPoint(rig, rotary_speed, rate)).weight_on_bit

    wanted = checked_number("weight_on_bit", weight_on_bit)
    idle, unit = load_at(0.0), load_at(1.0)
    if wanted < idle:
        limits = interval_text(idle)
        raise InputError("weight_on_bit", wanted, f"{limits} N (the wear flat carries {idle:g} N)")
    return RigPoint(rig, rotary_speed, (wanted - idle) / (unit - idle))
