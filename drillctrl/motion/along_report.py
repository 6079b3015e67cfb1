"""What is told of a torsional mode over rotary speed or rate of penetration."""

from __future__ import annotations

import math
import statistics
from typing import Any

from drillctrl.base.text import finite_or_none
from drillctrl.motion.threshold import ModeAlong
from drillctrl.motion.units import told_units, units_of
from drillctrl.motion.words import unknown_text


def along_fields(found: ModeAlong) -> dict[str, Any]:
    """Return the JSON fields of a mode over speed or rate; in SI where there is a rig."""
    units, own = units_of(found.case), found.own_value
    return {
        "along": found.along,
        "unit": _along_unit(found),
        "mode": found.number,
        "points": [
            {
                "value": float(value),
                "amplitude": each.amplitude,
                # Where H is not known, neither is this.
                "damping_left": finite_or_none(float(left) * units.response)
                if math.isfinite(each.error)
                else None,
                "growth_rate": finite_or_none(each.root.real / units.time),
                "growth_rate_error": finite_or_none(each.error / units.time),
                "sign": each.sign,
            }
            for value, left, each in zip(found.values, found.damping_left, found.at, strict=True)
        ],
        "thresholds": [
            {
                "decays": each.decays,
                "value": each.factor * own,
                "low": each.low * own,
                "high": each.high * own,
            }
            for each in found.thresholds
        ],
    }


def _along_unit(found: ModeAlong) -> str:
    if found.case.rig is None:
        return ""
    return "rpm" if found.along == "speed" else "m/h"


def along_summary(found: ModeAlong) -> str:
    """Return what is told on a terminal of a mode over speed or rate, the answer first."""
    units, (factor, unit) = told_units(found.case), found.told
    rig = bool(units.rate_name)
    name = unit or {"speed": "ω0", "rate": "V0"}[found.along]
    held = {"speed": "the rate of penetration held", "rate": "the rotary speed held"}[found.along]
    amplitude = statistics.median(each.amplitude for each in found.at)
    size = f"±{100.0 * amplitude:.2g} %" if rig else f"{amplitude:.2g}"
    mode = f"Torsional mode {found.number}" if not rig or found.number > 1 else "The string"
    # Short names of units: the table has one column for each.
    left = f"damping left{f', {units.response_name}' if rig else ''}"
    growth = f"growth{', 1/s' if rig else ''}"
    lines = [
        *_thresholds_told(found),
        "",
        f"{mode} at a swing of {size}, {held}",
        f"{name:>9} {left:>27} {growth:>12} {'±':>8}",
    ]
    rows = zip(factor * found.values, found.damping_left, found.at, strict=True)
    for value, damping, each in rows:
        if not math.isfinite(each.error):
            lines.append(f"{value:9.4g} {unknown_text(each.response)}")
            continue
        growth = f"{each.root.real / units.time:12.4f} {each.error / units.time:8.2g}"
        lines.append(f"{value:9.4g} {damping * units.response:27.4g} {growth}")
    return "\n".join(lines)


def _thresholds_told(found: ModeAlong) -> list[str]:
    factor, unit = found.told
    own = found.own_value * factor
    told = []
    for threshold in found.thresholds:
        between = f"between {threshold.low * own:.4g} and {threshold.high * own:.4g}"
        told.append(f"Decays {threshold.decays} {threshold.factor * own:.4g} {unit} ({between}).")
    if not told:
        sure = {each.sign for each in found.at} - {0}
        verb = "Decays" if sure == {-1} else "Grows"
        told.append(f"{verb} wherever it is sure." if sure else "It is sure nowhere.")
    unsure = [
        value for value, each in zip(factor * found.values, found.at, strict=True) if not each.sign
    ]
    if unsure:
        listed = ", ".join(f"{value:.4g}" for value in unsure)
        told.append(f"Not sure at {listed} {unit}: the simulator must decide there.")
    return told
