"""Units at the border: text such as ``"120 rpm"`` to an SI number and back.

Everything inside the package is SI or dimensionless; only this module knows units.
pint is loaded at the first use, because most calls are dimensionless.
"""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from drillctrl.base.errors import InputError, checked_number

if TYPE_CHECKING:
    import pint


@dataclass(frozen=True)
class Dimension:
    """A physical dimension that a parameter may have.

    Attributes
    ----------
    name : str
        The field's word for it.
    unit : str
        The SI unit that numbers inside the package are in.
    examples : str
        Two texts that a user may type, for messages.
    angle_required : bool
        Refuse units without an angle: 2 Hz is no rotary speed until someone says whether
        it counts turns or radians.
    """

    name: str
    unit: str
    examples: str
    angle_required: bool = False


ROTARY_SPEED = Dimension("a rotary speed", "rad/s", "'120 rpm' or '12.6 rad/s'", True)
SPEED = Dimension("a speed", "m/s", "'20 m/h' or '65 ft/h'")
FORCE = Dimension("a force", "N", "'100 kN' or '22 klbf'")
TORQUE = Dimension("a torque", "N*m", "'5 kN*m' or '3700 ft*lbf'")
STRESS = Dimension("a stress", "Pa", "'60 MPa' or '8700 psi'")
LENGTH = Dimension("a length", "m", "'108 mm' or '4.25 in'")
MASS = Dimension("a mass", "kg", "'34000 kg' or '75000 lb'")
INERTIA = Dimension("a rotary inertia", "kg*m**2", "'116 kg*m^2' or '2750 lb*ft^2'")
STIFFNESS = Dimension("an axial stiffness", "N/m", "'700 kN/m' or '4000 lbf/in'")
TORSIONAL_STIFFNESS = Dimension(
    "a torsional stiffness", "N*m/rad", "'938 N*m/rad' or '692 ft*lbf/rad'"
)
DAMPING = Dimension("an axial damping", "N*s/m", "'15.6 kN*s/m' or '1070 lbf*s/ft'")
TORSIONAL_DAMPING = Dimension(
    "a torsional damping", "N*m*s/rad", "'32.9 N*m*s/rad' or '24.3 ft*lbf*s/rad'"
)
NUMBER = Dimension("a plain number", "", "'0.6'")
DENSITY = Dimension("a density", "kg/m**3", "'1200 kg/m^3' or '10 ppg'")
LINEAR_DENSITY = Dimension("a weight per length", "kg/m", "'31 kg/m' or '19.5 lb/ft'")
TIME = Dimension("a time", "s", "'0.35 s' or '20 ms'")

# The field's spellings that pint lacks or reads as something else (kNm: nautical miles).
_DEFINITIONS = (
    "Nm = newton * meter",
    "kNm = 1000 * newton * meter",
    "ftlbf = foot * pound_force",
    "RPM = revolution / minute",
    "rev = revolution",
    "hr = hour",
    "ppg = pound / gallon",
)


_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf)"
_UNIT = r"(?:[A-Za-zµμ°²³()·*/ \-]|(?:\^|\*\*)-?[1-4](?![\d*^]))*"


@functools.cache
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(
        preprocessors=[
            lambda text: re.sub(r"\b(k?)(ft|in)[-·\s]*(k?lbf)\b", r"\1\2*\3", text),
            lambda text: text.replace("·", "*"),
        ]
    )
    for line in _DEFINITIONS:
        name = line.split(" =")[0]
        registry._units.pop(name, None)
        registry.define(line)
    return registry


def to_si(parameter: str, value: object, dimension: Dimension) -> float:
    """Convert a text with a unit to a number in the dimension's SI unit.

    Parameters
    ----------
    parameter : str
        Name for the message.
    value : str
        For example ``"120 rpm"``. A bare number is taken only where the dimension is a
        plain number.
    dimension : Dimension
        What the text has to be.

    Returns
    -------
    float
        The value in ``dimension.unit``.

    Raises
    ------
    InputError
        If the text is no quantity, or is one of another dimension.
    """
    permitted = f"{dimension.name}, such as {dimension.examples}"
    if not isinstance(value, str):
        raise InputError(parameter, value, f"{permitted} (a text with its unit)")
    import pint

    number, unit = _split(value)
    try:
        magnitude = float(number)
        registry = _registry()
        root = registry.Quantity(1.0, unit).to_root_units()
        wanted = registry.Quantity(1.0, dimension.unit).to_root_units()
        has_angle, wants_angle = ("radian" in q._units for q in (root, wanted))
        if (has_angle and not wants_angle) or (dimension.angle_required and not has_angle):
            raise ValueError
        si = float(registry.Quantity(magnitude, unit).to(dimension.unit).magnitude)
    except (pint.PintError, AssertionError, AttributeError, TypeError, ValueError):
        raise InputError(parameter, repr(value), permitted) from None
    return checked_number(parameter, si)


def _split(text: str) -> tuple[str, str]:
    """Split a quantity into number and unit; both empty if it has not that form.

    The unit may hold single-digit exponents only, so that no text can make the parser
    evaluate a tower of powers.
    """
    match = re.fullmatch(rf"\s*({_NUMBER})\s*({_UNIT})\s*", text)
    return (match[1], match[2]) if match and len(text) <= 80 else ("", "")


def from_si(value: float, dimension: Dimension, unit: str) -> float:
    """Convert an SI number to another unit, for display.

    Parameters
    ----------
    value : float
        In ``dimension.unit``.
    dimension : Dimension
        What the number is.
    unit : str
        The unit wanted, for example ``"rpm"``.
    """
    quantity = _registry().Quantity(value, dimension.unit)
    return float(quantity.to(unit).magnitude)
