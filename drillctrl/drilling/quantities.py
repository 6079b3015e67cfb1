"""What signals measure, and what one dimensionless unit of it is on a rig (Eq. 14)."""

from __future__ import annotations

import math
from typing import NamedTuple

from drillctrl.base.errors import InputError
from drillctrl.base.language import SI, Language
from drillctrl.drilling.rig import Rig

# Quantity → SI unit.
SI_UNITS = {
    "length": "m",
    "axial_rate": "m/s",
    "angle": "rad",
    "angular_rate": "rad/s",
    "force": "N",
    "torque": "N·m",
    "time": "s",
    "number": "1",
}
# Rate of change of each quantity that a coordinate may have.
RATES = {"length": "axial_rate", "angle": "angular_rate"}
# What acts on a coordinate.
EFFORTS = {"length": "force", "angle": "torque"}


class Signal(NamedTuple):
    """A state, an input or an output.

    Attributes
    ----------
    name : str
        In code, on the command line and in files.
    quantity : str
        A key of `SI_UNITS`.
    """

    name: str
    quantity: str


def checked_quantity(name: str, quantity: str) -> str:
    """Return a quantity that is known.

    Raises
    ------
    InputError
        If it is not.
    """
    if quantity not in SI_UNITS:
        raise InputError(f"quantity of {name}", quantity, f"one of {', '.join(SI_UNITS)}")
    return quantity


def si_scale(quantity: str, rig: Rig) -> float:
    """Return the SI value of one dimensionless unit of a quantity."""
    return {
        "length": rig.axial_scale,
        "axial_rate": rig.axial_scale / rig.time_scale,
        "angle": 1.0,
        "angular_rate": 1.0 / rig.time_scale,
        "force": rig.axial_force_scale,
        "torque": rig.torsional_stiffness,
        "time": rig.time_scale,
        "number": 1.0,
    }[quantity]


def told_scale(quantity: str, rig: Rig | None, language: Language = SI) -> tuple[float, str]:
    """Return how many units that are told one dimensionless unit is, and that unit.

    Without a rig they are 1 and an empty text.
    """
    if rig is None or not language.units:
        return 1.0, ""
    unit, factor = language.units[quantity]
    return si_scale(quantity, rig) * factor, unit


def root_scales(rig: Rig | None) -> tuple[tuple[float, str, str], tuple[float, str, str]]:
    """Return factor, name and unit of a root's real part, and of its imaginary part.

    With a rig growth per second and a frequency in Hz.
    """
    if rig is None:
        return (1.0, "growth rate Re s", ""), (1.0, "angular frequency Im s", "")
    rate = 1.0 / rig.time_scale
    return (rate, "growth rate", "1/s"), (rate / (2.0 * math.pi), "frequency", "Hz")


def quotient_unit(effort: str, quantity: str) -> str:
    """Return the SI unit of a gain from one quantity to another, such as N·m·s/rad."""
    numerator, denominator = SI_UNITS[effort], SI_UNITS[quantity]
    if denominator == "1":
        return numerator
    if denominator == numerator:
        return "1"
    base, _, time = denominator.partition("/")
    return f"{numerator}{'·' + time if time else ''}/{base}"


def response_scale(rig: Rig | None, language: Language) -> tuple[float, str]:
    """Return how many units that are told one dimensionless torque per speed is, and that unit."""
    if rig is None:
        return 1.0, ""
    si = si_scale("torque", rig) * rig.time_scale
    return language.number("impedance", si), language.unit("impedance")
