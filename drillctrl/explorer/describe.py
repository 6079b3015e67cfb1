"""What the page offers of a rig: its controllers and their gains, what is wrong with its file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from drillctrl.base.errors import InputError
from drillctrl.base.language import FIELD, Language
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import as_case
from drillctrl.drilling.gain_units import rig_gain_units
from drillctrl.drilling.plausibility import plausibility_notes
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import Rig
from drillctrl.drilling.structures import STRUCTURE_NAMES, preset_structure
from drillctrl.explorer.rig_text import LONGEST, complaints
from drillctrl.explorer.state import (
    LAWS,
    MOVED_LAWS,
    designed_law,
    read_asked,
    read_rig,
    read_units,
)
from drillctrl.explorer.views import Options, Tell, stability
from drillctrl.strings.check import check_rig
from drillctrl.strings.files import PRESETS
from drillctrl.strings.rig import StringRig

_LABELS = {"theta": "angle", "dtheta": "speed"}
# How far a gain of a drive's law may be moved, over that of its rule.
_REACH = 4.0
_MOST_RIGS = 8
# What the page tells by itself.
_QUANTITIES = ("axial_rate", "stress", "depth", "force", "impedance", "length")


def describe(fields: Mapping[str, Any], options: Options, tell: Tell) -> dict[str, Any]:
    """Return the controllers of a rig and their gains in its units, or what is wrong with it."""
    given = fields.get("rig")
    if isinstance(given, Mapping) and isinstance(given.get("text"), str):
        text = given["text"]
        if len(text) > LONGEST:
            raise InputError("rig", f"{len(text)} characters", f"at most {LONGEST}")
        wrong = complaints(text, str(given.get("name"))[:100])
        if wrong:
            return {"complaints": [{"line": c.line, "text": c.text} for c in wrong]}
    rig, name = read_rig(given)
    language = read_units(fields)
    told = language.units
    notes: tuple[str, ...] = ()
    if rig is not None and isinstance(fields.get("speed"), int | float):
        speed, rop = float(fields["speed"]), float(fields.get("rop") or 0.0)
        if speed > 0.0 and math.isfinite(speed + rop):
            rate = rop / told["axial_rate"].per_si
            notes = plausibility_notes(RigPoint(rig, speed * math.pi / 30.0, rate))
    return {
        "complaints": [],
        "name": name,
        "lumped": not isinstance(rig, StringRig),
        "drive": isinstance(rig, StringRig) and rig.drive is not None,
        "units": {quantity: told[quantity] for quantity in _QUANTITIES},
        "rock_strength": None if rig is None else language.number("stress", rig.rock_strength),
        "time_scale": 1.0 if rig is None else rig.time_scale,
        "structures": _structures(rig, language),
        "presets": PRESETS,
        "notes": notes,
    }


def _structures(rig: Rig | None, language: Language) -> list[dict[str, Any]]:
    """Return each controller that fits, with its gains."""
    if isinstance(rig, StringRig) and rig.drive is not None:
        return [_law(name, rig, language) for name in LAWS]
    free: dict[str, Any] = {"name": None, "label": "no control", "gains": []}
    return [free, *(_at_bit(preset_structure(name), rig, language) for name in STRUCTURE_NAMES)]


def _at_bit(structure: FeedbackStructure, rig: Rig | None, language: Language) -> dict[str, Any]:
    point: Any = OperatingPoint(10.0, 1.75, 14.0)
    if rig is not None:
        # Units do not depend on where it drills.
        point = RigPoint(rig, 4.0 * math.pi, 0.005)
    plant, _ = as_case(point).physics("gains")
    count = len(structure.outputs)
    scales = rig_gain_units(structure, plant, rig) or [(1.0, "")] * (2 * count)
    lower, upper = structure.lower, structure.upper
    gains, position = [], 0
    for k, is_free in enumerate(structure.free):
        if not is_free:
            continue
        scale, unit = scales[k]
        told = language.gain(unit.replace("*", "·"))
        output = structure.outputs[k % count]
        delayed = k >= count
        gains.append({
            "name": structure.gain_names[position],
            "matrix": "K2" if delayed else "K1",
            "index": k % count,
            "label": f"Torque per {'delayed ' if delayed else ''}{_LABELS[output]}",
            "unit": told.unit,
            "per": told.per_si,
            "low": float(lower[position]) * scale * told.per_si,
            "high": float(upper[position]) * scale * told.per_si,
            "value": 0.0,
        })  # fmt: skip
        position += 1
    return {"name": structure.name, "label": structure.name, "gains": gains, "at_bit": True}


def _law(name: str, rig: StringRig, language: Language) -> dict[str, Any]:
    gains = []
    if name in MOVED_LAWS:
        law = designed_law(name, rig).speed
        proportional, integral = law.numerator[-2:]
        for k, (label, value, unit) in enumerate((
            ("Torque per angle, −Ki", -integral, "N·m/rad"),
            ("Torque per speed, −Kp", -proportional, "N·m·s/rad"),
        )):  # fmt: skip
            told = language.gain(unit)
            value *= told.per_si
            gains.append({
                "name": f"K1_{k + 1}", "matrix": "K1", "index": k, "label": label,
                "unit": told.unit, "per": told.per_si, "low": _REACH * value, "high": 0.0,
                "value": value,
            })  # fmt: skip
    return {"name": name, "label": name.replace("-", " "), "gains": gains, "at_bit": False}


def strings(fields: Mapping[str, Any], options: Options, tell: Tell) -> dict[str, Any]:
    """Return several rigs side by side: what each is, its modes, where it drills stably."""
    rigs = options.get("rigs")
    if not isinstance(rigs, list) or not 1 <= len(rigs) <= _MOST_RIGS:
        raise InputError("rigs", "something else", f"a list of 1 to {_MOST_RIGS}")
    rows = []
    for done, given in enumerate(rigs):
        rig, name = read_rig(given)
        if rig is None or name is None:
            raise InputError("rig", "none", "given")
        tell(done, len(rigs), name)
        checked = check_rig(rig)
        driven = isinstance(rig, StringRig) and rig.drive is not None
        state = {**fields, "rig": given, "structure": "soft-torque" if driven else None,
                 "K1": None, "rock_strength": None}  # fmt: skip
        row = {"name": name, "controller": state["structure"] or "no control", **checked.to_dict()}
        if options.get("boundary"):
            asked = read_asked(state)
            row["chart"] = stability(asked, options, tell)
        rows.append(row)
    names = [row["name"] for row in rows]
    units = " --units field" if read_units(fields) is FIELD else ""
    lines = [f"print(check_rig(load_rig({name!r})).to_dict())" for name in names]
    return {
        "rows": rows,
        "command": "\n".join(f"drillctrl rig check {name!r}{units}" for name in names),
        "python": "\n".join(["from drillctrl import check_rig, load_rig", "", *lines]) + "\n",
    }
