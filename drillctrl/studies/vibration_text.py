"""A vibration map in words for people."""

from __future__ import annotations

import math

from drillctrl.base.text import set_out, wrapped
from drillctrl.charts.axes import Axis
from drillctrl.drilling.gain_units import gain_units
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.status import OUTCOME_NAMED
from drillctrl.studies.vibration_figure import OUTCOMES
from drillctrl.studies.vibration_values import MapValues, Severity

_HELD = {"speed": "{:.4g} rpm", "rop": "{:.4g} m/h", "rock_strength": "rock of {:.4g} MPa"}
_SYMBOLS = {"omega0": "ω0 = {:.4g}", "delta0": "δ0 = {:.4g}", "psi": "ψ = {:.4g}"}


def place_text(found: MapValues, name: str | None = None) -> str:
    """Say which rig, rock and starts a map is of; what is an axis is left out."""
    plane = found.plane
    over = {plane.x.name, plane.y.name}
    held = _SYMBOLS if plane.rig_point is None else _HELD
    if "wob" in over:
        over |= {"rop"}
    parts = [form.format(plane.value_of(key)) for key, form in held.items() if key not in over]
    head = [name] if name else []
    return f"{', '.join([*head, *parts])}; worst of the starts {', '.join(found.starts)}"


def controller_text(found: MapValues) -> str:
    """Say what closes the loop, its gains in the rig's units."""
    structure, controller = found.structure, found.controller
    if structure is None:
        return "without control"
    if not isinstance(controller, Controller):
        return f"{structure.name}, gains of a table"
    _, now, past = controller.gain_sets()
    plant, _ = found.plane.case.physics("a map")
    rig = found.plane.case.rig
    parts = []
    for label, gains in (("K1", now[0]), ("K2", past[0])):
        if not gains.any():
            continue
        texts = [f"{gain:.3g}" for gain in gains.ravel().tolist()]
        if rig is not None:
            factors, units = gain_units(structure, plant, rig)
            flat = [unit for row in units for unit in row]
            texts = [
                _with_unit(gain * factor, unit)
                for gain, factor, unit in zip(
                    gains.ravel().tolist(), factors.ravel().tolist(), flat, strict=True
                )
            ]
        parts.append(f"{label} = {', '.join(texts)}")
    return f"{structure.name}: {'; '.join(parts)}"


def _with_unit(value: float, unit: str) -> str:
    """Return a gain with few digits, large ones with a k before the newton."""
    if unit.startswith("N") and abs(value) >= 1e3:
        return f"{value / 1e3:.3g} k{unit}"
    return f"{value:.3g} {unit}"


def map_summary(found: MapValues) -> str:
    """Return a text for people, in lines of at most 80 columns."""
    axes = " and ".join(_range(axis) for axis in (found.plane.x, found.plane.y))
    lines = [("Over", axes), ("Points", _points(found)), ("Held", place_text(found))]
    if found.controlled is not None:
        lines.append(("Control", controller_text(found)))
    both = [("Without", found.uncontrolled), ("With", found.controlled)]
    for label, severity in both:
        if severity is not None:
            lines.append((label, _counts(severity)))
            lines.append(("", _worst(severity)))
    if found.marked is not None:
        lines.append(("Marked", _at_mark(found)))
    return f"{wrapped(_verdict(found))}\n{set_out(lines)}"


def _range(axis: Axis) -> str:
    unit = f" {axis.unit}" if axis.unit else ""
    return f"{axis.name.replace('_', ' ')} {axis.low:g} to {axis.high:g}{unit}"


def _points(found: MapValues) -> str:
    a, b = found.counts
    more = len(found.nodes) - a * b
    dense = f" and {more} where the outcome changes" if more else ""
    return f"{a} × {b}{dense}, {found.elapsed_seconds:.0f} s"


def _calm(severity: Severity) -> int:
    return sum(OUTCOME_NAMED[word].calm for word in severity.outcomes.tolist())


def _verdict(found: MapValues) -> str:
    """Say the first thing that a driller asks."""
    total = len(found.nodes)
    free = _calm(found.uncontrolled)
    text = f"The bit keeps turning, cutting and up with its feed at {free} of {total} points"
    if found.controlled is None:
        return text
    return f"{text}, with control at {_calm(found.controlled)}"


def _counts(severity: Severity) -> str:
    told = [f"{OUTCOMES[OUTCOME_NAMED[word]][0]} {n}" for word, n in severity.counts().items() if n]
    return ", ".join(told)


def _worst(severity: Severity) -> str:
    known = [value for value in severity.swing.tolist() if math.isfinite(value)]
    if not known:
        return "no swing could be measured"
    return f"swing of the bit's speed up to {max(known):.2f}"


def _at_mark(found: MapValues) -> str:
    """Say what becomes of the bit at the point nearest the operating point."""
    assert found.marked is not None
    places = found.points
    spans = [found.plane.x.span, found.plane.y.span]
    distance = ((places - list(found.marked)) / spans) ** 2
    nearest = int(distance.sum(axis=1).argmin())
    units = [f" {axis.unit}" if axis.unit else "" for axis in (found.plane.x, found.plane.y)]
    names = [axis.name.replace("_", " ") for axis in (found.plane.x, found.plane.y)]
    where = ", ".join(
        f"{name} {value:.4g}{unit}"
        for name, value, unit in zip(names, places[nearest].tolist(), units, strict=True)
    )
    text = OUTCOMES[OUTCOME_NAMED[str(found.uncontrolled.outcomes[nearest])]][0]
    if found.controlled is not None:
        text += (
            f", with control {OUTCOMES[OUTCOME_NAMED[str(found.controlled.outcomes[nearest])]][0]}"
        )
    return f"nearest at {where}: {text}"
