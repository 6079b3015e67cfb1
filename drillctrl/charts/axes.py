"""What a chart may be drawn over: groups of the point, numbers of the rig, gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from drillctrl.base import units
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.language import DIMENSIONLESS, SI, Language
from drillctrl.base.units import Dimension
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Case
from drillctrl.drilling.steady import steady_state
from drillctrl.strings.changed import permitted_range, string_of
from drillctrl.strings.rig import StringRig

# Permitted range and symbol of each dimensionless group.
GROUPS = {
    "omega0": (0.0, 1e4, "ω₀"),
    "delta0": (0.0, 1e4, "δ₀"),
    "psi": (0.0, 1e4, "ψ"),
    "eta": (1e-3, 1e3, "η"),
    "xi": (0.0, 1e2, "ξ"),
    "kappa": (0.0, 1e2, "κ"),
    "damping": (0.0, 1e2, "ξ = κ"),
}
# Axis of a rig → what a language has a unit for, what a text has to be, and words.
RIG_AXES: dict[str, tuple[str, Dimension, str]] = {
    "speed": ("angular_rate", units.ROTARY_SPEED, "rotary speed"),
    "rop": ("axial_rate", units.SPEED, "rate of penetration"),
    "wob": ("force", units.FORCE, "weight on bit"),
    "rock_strength": ("stress", units.STRESS, "rock strength"),
}
# Of rigs whose string is known.
STRING_AXES: dict[str, tuple[str, Dimension, str]] = {
    "depth": ("depth", units.LENGTH, "depth"),
    "mud": ("density", units.DENSITY, "mud weight"),
}


@dataclass(frozen=True)
class Axis:
    """One axis of a chart.

    Attributes
    ----------
    name : str
        A group (``"omega0"``), a gain (``"K1_1"``) or a rig number (``"speed"``).
    low, high : float
        Limits, in ``unit``.
    unit : str
        Empty where dimensionless.
    label : str
        Symbol and unit, for figures.
    """

    name: str
    low: float
    high: float
    unit: str
    label: str

    @property
    def span(self) -> float:
        """high − low."""
        return self.high - self.low


def make_axis(
    given: Axis | Sequence[object], structure: FeedbackStructure | None, case: Case
) -> Axis:
    """Check an axis given as (name, low, high).

    Parameters
    ----------
    given : Axis or sequence
        Limits are numbers; for rig axes numbers in the units in which the case is told (rpm,
        m/h, kN, MPa; rpm, ft/h, klbf, ksi), or texts with a unit.
    structure : FeedbackStructure or None
        Whose gains may be axes.
    case : Case
        Its groups and the parameters of its plant's parts may be axes, and numbers of its rig.

    Raises
    ------
    InputError
        If there is no such axis, or the limits are swapped or out of range.
    """
    if isinstance(given, Axis):
        return given
    try:
        name, low, high = given
    except (TypeError, ValueError):
        raise InputError("axis", repr(given), "a name and two limits") from None
    typed = low, high
    gains = structure.gain_names if structure is not None else ()
    rigs = tuple(RIG_AXES) if case.rig_point is not None else ()
    if isinstance(case.rig, StringRig):
        rigs += tuple(STRING_AXES)
    elif name in STRING_AXES:
        string_of(case.rig)
    own = tuple(case.plant.own) if case.plant is not None else ()
    groups = tuple(GROUPS) if case.drills else ()
    known = (*groups, *own, *rigs, *gains)
    if not known:
        case.physics(f"an axis {name}")
    if not isinstance(name, str) or name not in known:
        raise InputError("axis", str(name), f"one of {', '.join(known)}")
    floor, ceiling, unit, label = -1e6, 1e6, "", gain_label(name)
    if name in GROUPS:
        floor, ceiling, label = GROUPS[name]
    elif name in own:
        label = name.replace("_", " ")
    elif name in rigs:
        floor, ceiling = 0.0, 1e6
        language = axis_language(case)
        quantity, dimension, word = {**RIG_AXES, **STRING_AXES}[name]
        unit = language.unit(quantity)
        label = f"{word}, {unit}"
        low, high = (
            _in_unit(name, v, dimension, to_si_factor(name, language)) for v in (low, high)
        )
        if name in STRING_AXES:
            allowed = permitted_range(string_of(case.rig), name)
            floor, ceiling = (value / to_si_factor(name, language) for value in allowed)
        if name == "wob" and case.rig_point is not None:
            # The wear flat carries this much before anything is cut.
            idle = steady_state(replace(case.rig_point, penetration_rate=0.0)).weight_on_bit
            floor = idle / to_si_factor(name, language)
    low = _limit(f"{name} (lower limit", typed[0], low, (floor, ceiling), unit)
    high = _limit(f"{name} (upper limit", typed[1], high, (floor, ceiling), unit)
    if not low < high:
        raise InputError(f"limits of {name}", f"{low:g}:{high:g}", "lower:upper with lower < upper")
    return Axis(name, low, high, unit, label)


def _limit(
    name: str, typed: object, value: object, allowed: tuple[float, float], unit: str
) -> float:
    """Check a limit; what was typed with a unit of its own is refused in that."""
    floor, ceiling = allowed
    if isinstance(typed, str) and isinstance(value, float) and not floor <= value <= ceiling:
        number, _, own = typed.strip().partition(" ")
        if value and own and float(number) != value:
            per = float(number) / value
            wanted = f"in [{floor * per:.5g}, {ceiling * per:.5g}] {own.strip()}"
            raise InputError(f"{name})", typed, wanted)
    return checked_number(f"{name}, {unit})" if unit else f"{name})", value, floor, ceiling)


def _in_unit(name: str, value: object, dimension: Dimension, factor: float) -> object:
    if not isinstance(value, str):
        return value
    return float(f"{units.to_si(name, value, dimension) / factor:.15g}")


def axis_language(case: Case) -> Language:
    """Return the language of a rig's axes, which have units even where results have none."""
    return SI if case.language is DIMENSIONLESS else case.language


def gain_label(name: str) -> str:
    """Return a gain's symbol, such as K₁,₂ for ``K1_2``."""
    digits = str.maketrans("0123456789_", "₀₁₂₃₄₅₆₇₈₉,")
    return name[:1] + name[1:].translate(digits)


def to_si_factor(name: str, language: Language) -> float:
    """Return the SI value of one unit of a rig axis."""
    quantity, _, _ = {**RIG_AXES, **STRING_AXES}[name]
    return 1.0 / language.units[quantity].per_si
