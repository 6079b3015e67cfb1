"""What a chart goes over, what is the same all over it, and its areas, in words."""

from __future__ import annotations

import math

from drillctrl.charts.axes import RIG_AXES, Axis
from drillctrl.charts.plane import Plane
from drillctrl.drilling.gain_units import told_gain

_HELD_OF_RIG = {"speed": "{:.4g} {}", "rop": "{:.4g} {}", "rock_strength": "rock of {:.4g} {}"}
_HELD = {
    "omega0": "ω0 = {:.4g}",
    "delta0": "δ0 = {:.4g}",
    "psi": "ψ = {:.4g}",
    "xi": "ξ = {:.3g}",
    "kappa": "κ = {:.3g}",
}
# What an axis moves beside itself.
_MOVES = {
    "wob": {"rop"},
    "damping": {"xi", "kappa"},
    "omega0": {"speed", "rop"},
    "delta0": {"rop"},
    "psi": {"rock_strength"},
    "speed": {"omega0", "delta0"},
    "rop": {"delta0"},
    "rock_strength": {"psi", "delta0"},
}


def held_text(plane: Plane) -> str:
    """Say what is the same everywhere: in the rig's units where there is one."""
    if plane.point is None:
        return ""
    over = {plane.x.name, plane.y.name}
    over = over.union(*(_MOVES.get(name, set()) for name in over))
    language = plane.case.language
    forms = _HELD_OF_RIG if language.units else _HELD
    told = []
    for name, form in forms.items():
        if name not in over:
            unit = language.unit(RIG_AXES[name][0]) if language.units else ""
            told.append(form.format(plane.value_of(name), unit))
    return ", ".join(told)


def told_axis(plane: Plane, axis: Axis) -> tuple[float, str]:
    """Return what one of an axis is told as, and the unit: gains of a rig have one of its own."""
    structure, plant, told = plane.structure, plane.case.plant, plane.case.told_point
    if structure is None or plant is None or told is None or axis.name not in structure.gain_names:
        return 1.0, axis.unit
    most = max(abs(axis.low), abs(axis.high))
    return told_gain(structure, axis.name, plant, told.rig, told.language, most)


def axis_range(plane: Plane, axis: Axis) -> str:
    """Say what an axis goes over."""
    factor, unit = told_axis(plane, axis)
    ends = f"[{factor * axis.low:.6g}, {factor * axis.high:.6g}]"
    return f"{axis.label} in {ends}" + (f" {unit}" if unit != axis.unit else "")


def area_text(area: float, error: float, plane: Plane) -> str:
    """Return an area with its error and its share of the chart."""
    share = area / (plane.x.span * plane.y.span)
    for axis in (plane.x, plane.y):
        factor, _ = told_axis(plane, axis)
        area, error = area * factor, error * factor
    digits = max(0, min(6, -math.floor(math.log10(max(error, 1e-12)))))
    return f"{area:.{digits}f} ± {error:.1g} ({share:.1%} of the chart)"
