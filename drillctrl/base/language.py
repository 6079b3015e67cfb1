"""The units that people are told results in; what is read may have any unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

from drillctrl.base.errors import InputError

_INCH, _FOOT, _POUND, _POUND_FORCE = 0.0254, 0.3048, 0.45359237, 4.4482216152605
_GALLON = 231.0 * _INCH**3


class Told(NamedTuple):
    """How a quantity is told.

    Attributes
    ----------
    unit : str
        As it is written.
    per_si : float
        How many of it are one SI unit.
    """

    unit: str
    per_si: float


@dataclass(frozen=True)
class Language:
    """In which units results are told.

    Attributes
    ----------
    name : {"si", "field", "dimensionless"}
        As it is asked for.
    units : mapping
        Quantity → how it is told; empty where all is told dimensionless.
    """

    name: str
    units: Mapping[str, Told] = field(repr=False, compare=False)

    def unit(self, quantity: str) -> str:
        """Return the unit of a quantity."""
        return self.units[quantity].unit

    def number(self, quantity: str, value: float) -> float:
        """Return an SI value in the unit of this language."""
        return value * self.units[quantity].per_si

    def text(self, quantity: str, value: float, digits: int = 4) -> str:
        """Return an SI value as a number in few digits with its unit."""
        return f"{short(self.number(quantity, value), digits)} {self.unit(quantity)}".rstrip()

    def gain(self, unit: str) -> Told:
        """Return how a gain in an SI unit such as N·m·s/rad is told."""
        if self is not FIELD:
            return Told(unit, 1.0)
        factor = 1.0
        if unit.startswith("N·m"):
            unit, factor = unit.replace("N·m", "ft·lbf"), 1.0 / (_FOOT * _POUND_FORCE)
        elif unit.startswith("N"):
            unit, factor = unit.replace("N", "lbf", 1), 1.0 / _POUND_FORCE
        if unit.endswith("/m"):
            unit, factor = f"{unit[:-1]}ft", factor * _FOOT
        return Told(unit, factor)


def short(value: float, digits: int) -> str:
    """Return a number in few digits; a large one to the unit, with no power of ten."""
    return f"{value:.0f}" if 10**digits <= abs(value) < 1e9 else f"{value:.{digits}g}"


def _language(name: str, **units: tuple[str, float]) -> Language:
    told = {quantity: Told(*pair) for quantity, pair in units.items()}
    return Language(name, MappingProxyType(told))


_EITHER = {
    "angle": ("rad", 1.0),
    "angular_rate": ("rpm", 30.0 / math.pi),
    "time": ("s", 1.0),
    "number": ("", 1.0),
    "frequency": ("Hz", 1.0),
    "rate": ("1/s", 1.0),
}
SI = _language(
    "si",
    **_EITHER,
    length=("mm", 1e3),
    depth=("m", 1.0),
    axial_rate=("m/h", 3600.0),
    force=("kN", 1e-3),
    torque=("kN·m", 1e-3),
    stress=("MPa", 1e-6),
    impedance=("N·m·s/rad", 1.0),
    drive_impedance=("kN·m·s/rad", 1e-3),
    drive_stiffness=("kN·m/rad", 1e-3),
    torsional_stiffness=("N·m/rad", 1.0),
    axial_stiffness=("kN/m", 1e-3),
    axial_damping=("kN·s/m", 1e-3),
    mass=("t", 1e-3),
    inertia=("kg·m²", 1.0),
    density=("kg/m³", 1.0),
    linear_density=("kg/m", 1.0),
)
FIELD = _language(
    "field",
    **_EITHER,
    length=("in", 1.0 / _INCH),
    depth=("ft", 1.0 / _FOOT),
    axial_rate=("ft/h", 3600.0 / _FOOT),
    force=("klbf", 1e-3 / _POUND_FORCE),
    torque=("kft·lbf", 1e-3 / (_FOOT * _POUND_FORCE)),
    stress=("ksi", 1e-3 * _INCH**2 / _POUND_FORCE),
    impedance=("ft·lbf·s/rad", 1.0 / (_FOOT * _POUND_FORCE)),
    drive_impedance=("kft·lbf·s/rad", 1e-3 / (_FOOT * _POUND_FORCE)),
    drive_stiffness=("kft·lbf/rad", 1e-3 / (_FOOT * _POUND_FORCE)),
    torsional_stiffness=("ft·lbf/rad", 1.0 / (_FOOT * _POUND_FORCE)),
    axial_stiffness=("klbf/ft", 1e-3 * _FOOT / _POUND_FORCE),
    axial_damping=("klbf·s/ft", 1e-3 * _FOOT / _POUND_FORCE),
    mass=("klb", 1e-3 / _POUND),
    inertia=("lb·ft²", 1.0 / (_POUND * _FOOT**2)),
    density=("ppg", _GALLON / _POUND),
    linear_density=("lb/ft", _FOOT / _POUND),
)
DIMENSIONLESS = _language("dimensionless")
LANGUAGES = {language.name: language for language in (SI, FIELD, DIMENSIONLESS)}


def language_named(name: str | None, *, with_rig: bool) -> Language:
    """Return the language asked for; without a name that of what was given.

    Raises
    ------
    InputError
        If there is none of that name, or it has units and no rig gives them a meaning.
    """
    if name is None:
        return SI if with_rig else DIMENSIONLESS
    if name not in LANGUAGES:
        raise InputError("units", name, f"one of {', '.join(LANGUAGES)}")
    found = LANGUAGES[name]
    if found is not DIMENSIONLESS and not with_rig:
        wanted = "dimensionless, or given with --rig: a point without a rig has no units"
        raise InputError("units", name, wanted)
    return found


def told_language(units: str | None) -> Language:
    """Return a language with units, SI without a name.

    Raises
    ------
    InputError
        If there is none of that name, or it has none.
    """
    found = LANGUAGES.get(units or SI.name, DIMENSIONLESS)
    if found is DIMENSIONLESS:
        raise InputError("units", units, "si or field: without a point there is no scale")
    return found
