"""A vibration map in words for people."""

from __future__ import annotations

import math

from drillctrl.base.text import set_out, wrapped
from drillctrl.charts.axes import Axis
from drillctrl.charts.plane_text import held_text
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.gain_units import control_text
from drillctrl.simulation.starts import start_named
from drillctrl.simulation.status import OUTCOME_NAMED
from drillctrl.strings.drive_laws import DriveLaws
from drillctrl.studies.tasks import Closing
from drillctrl.studies.vibration_figure import OUTCOMES
from drillctrl.studies.vibration_values import MapValues, Severity, closing_name
from drillctrl.tables.gain_table import GainTable


def place_text(found: MapValues, name: str | None = None) -> str:
    """Say which rig, rock and starts a map is of; what is an axis is left out."""
    held = held_text(found.plane)
    parts = [text for text in (name, held) if text]
    worst = f"worst of the starts {', '.join(found.starts)}"
    if len(found.starts) == 1:
        worst = f"after {start_named(found.starts[0]).text}"
    return f"{', '.join(parts)}; {worst}"


def closing_text(found: MapValues, closing: Closing) -> str:
    """Say what closes the loop, its gains in the rig's units."""
    if closing is None:
        return "without control"
    if isinstance(closing, DriveLaws):
        more = f", {len(closing.depths)} laws by depth" if len(closing.depths) > 1 else ""
        return f"{closing.name} drive{more}"
    if isinstance(closing, GainTable):
        return f"{closing.structure.name}, gains of a table"
    _, K1, K2 = closing.gain_sets()
    case = found.plane.case
    plant, _ = case.physics("a map")
    assert isinstance(closing.feedback, FeedbackStructure)
    return control_text(closing.feedback, K1[0], K2[0], plant, case.told_rig, case.language)


def map_summary(found: MapValues) -> str:
    """Return a text for people, in lines of at most 80 columns."""
    axes = " and ".join(_range(axis) for axis in (found.plane.x, found.plane.y))
    lines = [("Over", axes), ("Points", _points(found)), ("Held", place_text(found))]
    for label, closing, severity in (
        ("Without" if found.against is None else "Against", found.against, found.uncontrolled),
        ("With", found.controller, found.controlled),
    ):
        if severity is not None:
            told = [_counts(severity), _worst(severity)]
            if closing is not None:
                told.insert(0, closing_text(found, closing))
            alone = found.controlled is None and closing is not None
            lines.append(("Held by" if alone else label, told[0]))
            lines += [("", text) for text in told[1:]]
    if found.marked is not None:
        lines.append(("Marked", _at_mark(found)))
    return f"{wrapped(_verdict(found))}\n{set_out(lines)}"


def _range(axis: Axis) -> str:
    unit = f" {axis.unit}" if axis.unit else ""
    return f"{_word(axis)} {axis.low:.4g} to {axis.high:.4g}{unit}"


def _word(axis: Axis) -> str:
    """Return what an axis is called: of a rig in words."""
    return axis.label.partition(",")[0] if axis.unit else axis.name.replace("_", " ")


def _points(found: MapValues) -> str:
    a, b = found.counts
    more = len(found.nodes) - a * b
    dense = f" and {more} where the outcome changes" if more else ""
    return f"{a} × {b}{dense}, computed in {found.elapsed_seconds:.0f} s"


def _calm(severity: Severity) -> int:
    return sum(OUTCOME_NAMED[word].calm for word in severity.outcomes.tolist())


def _verdict(found: MapValues) -> str:
    """Say the first thing that a driller asks."""
    total = len(found.nodes)
    free = _calm(found.uncontrolled)
    text = f"The bit keeps turning, cutting and up with its feed at {free} of {total} points"
    if found.controlled is None:
        return text
    calm = _calm(found.controlled)
    if found.against is None:
        return f"{text}, with control at {calm}"
    return f"{text} under {_name(found.against)}, under {_name(found.controller)} at {calm}"


def _name(closing: Closing) -> str:
    return str(closing_name(closing))


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
    names = [_word(axis) for axis in (found.plane.x, found.plane.y)]
    where = ", ".join(
        f"{name} {value:.4g}{unit}"
        for name, value, unit in zip(names, places[nearest].tolist(), units, strict=True)
    )
    text = OUTCOMES[OUTCOME_NAMED[str(found.uncontrolled.outcomes[nearest])]][0]
    if found.controlled is not None:
        text += (
            f", {'with control' if found.against is None else 'under ' + _name(found.controller)}"
            f" {OUTCOMES[OUTCOME_NAMED[str(found.controlled.outcomes[nearest])]][0]}"
        )
    return f"nearest at {where}: {text}"
