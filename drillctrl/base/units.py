"""Units at the border: text such as ``"120 rpm"`` to an SI number and back.

Everything inside the package is SI or dimensionless; only this module knows units.
pint is loaded at the first use, because most calls are dimensionless.
"""

from __future__ import annotations

import functools
import math
import re
import tokenize
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
TORQUE_RATE = Dimension("a rate of torque", "N*m/s", "'50 kN*m/s'")
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
ANGLE = Dimension("an angle", "rad", "'0.1 rad' or '5 deg'")
NUMBER = Dimension("a plain number", "", "'0.6'")
DENSITY = Dimension("a density", "kg/m**3", "'1200 kg/m^3' or '10 ppg'")
LINEAR_DENSITY = Dimension("a weight per length", "kg/m", "'31 kg/m' or '19.5 lb/ft'")
SIDE_FORCE = Dimension("a force per length", "N/m", "'200 N/m' or '14 lbf/ft'")
RATE = Dimension("a rate", "1/s", "'0.1 1/s'")
FEED_GAIN = Dimension("a feed per force", "m/s/N", "'0.2 m/h/kN'")
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
    "pcf = pound / foot ** 3",
    "sg = 1000 * kilogram / meter ** 3",
    "ppf = pound / foot",
    "fph = foot / hour",
    "fpm = foot / minute",
)
# The units that are typed most, in the dimension's own: pint takes a second to load.
_TYPED_MOST = {
    NUMBER: {"": 1.0},
    ROTARY_SPEED: {"rad/s": 1.0, "rpm": math.pi / 30.0},
    SPEED: {"m/s": 1.0, "m/h": 1.0 / 3600.0, "ft/h": 0.3048 / 3600.0},
    FORCE: {"N": 1.0, "kN": 1e3, "klbf": 4448.2216152605},
    TORQUE: {"N*m": 1.0, "kN*m": 1e3},
    STRESS: {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
    LENGTH: {"m": 1.0, "mm": 1e-3, "in": 0.0254, "ft": 0.3048},
    MASS: {"kg": 1.0},
    INERTIA: {"kg*m**2": 1.0, "kg*m^2": 1.0},
    STIFFNESS: {"N/m": 1.0, "kN/m": 1e3},
    TORSIONAL_STIFFNESS: {"N*m/rad": 1.0},
    TORSIONAL_DAMPING: {"N*m*s/rad": 1.0},
    DENSITY: {"kg/m**3": 1.0, "kg/m^3": 1.0, "ppg": 0.45359237 / 0.003785411784},
    LINEAR_DENSITY: {"kg/m": 1.0, "lb/ft": 0.45359237 / 0.3048},
    SIDE_FORCE: {"N/m": 1.0},
    RATE: {"1/s": 1.0},
    TIME: {"s": 1.0, "ms": 1e-3},
}
# What is a weight on every rig floor and a mass in pint.
_AS_FORCE = {
    "t": "metric_ton_force",
    "te": "metric_ton_force",
    "tonne": "metric_ton_force",
    "tonnes": "metric_ton_force",
    "kg": "kgf",
    "lb": "lbf",
    "lbs": "lbf",
    "klb": "klbf",
    "klbs": "klbf",
    "klbsf": "klbf",
    "ftlb": "ft*lbf",
    "ftlbs": "ft*lbf",
}
# What two people in drilling read as two different things.
_TWO_READINGS = {
    "ton": "'tonne' (1000 kg) or 'short_ton' (907.185 kg)",
    "tons": "'tonne' (1000 kg) or 'short_ton' (907.185 kg)",
    "mph": "'m/h' or 'mile/h'",
    "Mlb": "'klb' (a thousand) or '1000 klb' (a million)",
    "Mlbs": "'klb' (a thousand) or '1000 klb' (a million)",
    "Mlbf": "'klbf' (a thousand) or '1000 klbf' (a million)",
}
# Turns a minute, as they stand on motors and in European data sheets.
_TURNS_A_MINUTE = ("1/min", "/min", "min^-1", "min⁻¹", "r/min")

# What pint raises beside its own errors for a text that is no unit.
_UNREADABLE = (AssertionError, AttributeError, TypeError, ValueError, tokenize.TokenError)

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf)"
_FRACTION = r"(?:(?P<whole>\d{1,4})[ -])?(?P<over>\d{1,3})/(?P<under>\d{1,3})(?=[ \"'a-z])"
_POWER = r"(?<=[A-Za-z])[2-4](?![\w^*.])|(?:\^|\*\*)-?[1-4](?![\d*^])"
_UNIT = rf"(?:[A-Za-zµμ°²³()·*/ _.\-]|{_POWER})*|[\"']|1/(?:min|s)|min⁻¹"


@functools.cache
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry()
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
        If the text is no quantity, is one of another dimension, or has two readings.
    """
    permitted = f"{dimension.name}, such as {dimension.examples}"
    if not isinstance(value, str):
        raise InputError(parameter, value, f"{permitted} (a text with its unit)")
    number, written = _split(value, dimension)
    known = _TYPED_MOST.get(dimension, {}).get(written.strip()) if number else None
    if known is not None:
        return checked_number(parameter, float(number) * known)
    for word in re.findall(r"[A-Za-z_]+", written):
        if word in _TWO_READINGS:
            raise InputError(parameter, repr(value), f"one of two things: {_TWO_READINGS[word]}")
    import pint

    si = None
    for unit in _readings(written, dimension):
        try:
            si = _converted(float(number), unit, dimension)
            break
        except (pint.PintError, *_UNREADABLE):
            continue
    if si is None:
        raise InputError(parameter, repr(value), permitted)
    return checked_number(parameter, si)


def _converted(magnitude: float, unit: str, dimension: Dimension) -> float:
    registry = _registry()
    root = registry.Quantity(1.0, unit).to_root_units()
    wanted = registry.Quantity(1.0, dimension.unit).to_root_units()
    has_angle, wants_angle = ("radian" in q._units for q in (root, wanted))
    if (has_angle and not wants_angle) or (dimension.angle_required and not has_angle):
        raise ValueError
    return float(registry.Quantity(magnitude, unit).to(dimension.unit).magnitude)


def _readings(written: str, dimension: Dimension) -> tuple[str, ...]:
    """Return a unit in pint's language, as it stands and then as it is meant on a rig."""
    unit = written.strip()
    if dimension == LENGTH and unit in ('"', "'"):
        return ("in" if unit == '"' else "ft",)
    if dimension == ROTARY_SPEED and unit in _TURNS_A_MINUTE:
        return ("rpm",)
    # kN.m, ft-lb, kN·m.
    unit = re.sub(r"(?<=[A-Za-z])\s*[-.·]\s*(?=[A-Za-z])", "*", unit).replace("·", "*")
    # kg/m3, N/mm2.
    unit = re.sub(r"(?<=[A-Za-z])([2-4])\b", r"^\1", unit)
    unit = re.sub(r"\b(k?)(ft|in)(k?lbf)\b", r"\1\2*\3", unit)
    if dimension in (MASS, DENSITY, LINEAR_DENSITY, INERTIA):
        return (unit,)
    return unit, re.sub(r"[A-Za-z_]+", lambda m: _AS_FORCE.get(m[0], m[0]), unit)


def _split(text: str, dimension: Dimension) -> tuple[str, str]:
    """Split a quantity into number and unit; both empty if it has not that form.

    The unit may hold single-digit exponents only, so that no text can make the parser
    evaluate a tower of powers.
    """
    text = text.strip() if len(text) <= 80 else ""
    # 12 1/4 in, as bits and pipes are called.
    fraction = re.match(_FRACTION, text) if dimension == LENGTH else None
    if fraction and int(fraction["under"]):
        part = int(fraction["over"]) / int(fraction["under"])
        text = f"{int(fraction['whole'] or 0) + part!r}{text[fraction.end() :]}"
    match = re.fullmatch(rf"({_NUMBER})\s*({_UNIT})", text)
    return (match[1], match[2]) if match else ("", "")


def known_unit(text: str) -> bool:
    """Return whether a text is a unit of something, as rigs and pint spell it."""
    import pint

    if not text or len(text) > 40 or not re.fullmatch(_UNIT, text):
        return False
    for unit in (*_readings(text, NUMBER), *_readings(text, ROTARY_SPEED)):
        try:
            _registry().Quantity(1.0, unit)
        except (pint.PintError, *_UNREADABLE):
            continue
        return True
    return text in _TWO_READINGS


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
