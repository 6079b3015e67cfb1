"""The edge of linear theory on a vibration map, and what holds its first column."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.charts.axes import axis_language, to_si_factor
from drillctrl.charts.chart import StabilityChart, chart
from drillctrl.charts.plane import Plane
from drillctrl.drilling.case import Case, as_case
from drillctrl.strings.at_bit import turns_freely
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_law import driven_plant
from drillctrl.strings.drive_laws import DriveLaws, one_law
from drillctrl.strings.drives import drive_control, machine_of
from drillctrl.strings.rig import StringRig
from drillctrl.studies.tasks import Closing
from drillctrl.studies.vibration_point import FEW_STATES
from drillctrl.tables.gain_table import GainTable

# Of the edge of linear theory, a share of the axes: a string takes seconds a line.
_EDGE, _EDGE_OF_STRING = 2e-3, 1e-2


def as_closing(given: Any) -> Closing:
    """Return what closes a loop; a law of a drive as one that is the same at all depths."""
    return one_law(given) if isinstance(given, DriveControl) else given


def held_against(closing: Closing, case: Case) -> Closing:
    """Return what holds the first column: of a rig with a top drive a stiff one by itself."""
    rig = case.rig
    if closing is not None or not isinstance(rig, StringRig) or rig.drive is None:
        return closing
    plant, _ = case.physics("a map")
    return one_law(drive_control("stiff", rig)) if turns_freely(plant) else None


def is_long(case: Case) -> bool:
    """Whether roots and answers of a string take seconds a point."""
    return len(case.physics("a map")[0].state_names) > FEW_STATES


def linear_edge(plane: Plane, controller: Closing) -> tuple[FloatArray, ...] | None:
    """Return the exact boundary of the linear loop with an ideal controller, where there is one."""
    if isinstance(controller, DriveLaws):
        return _edge_of_laws(plane, controller)
    if isinstance(controller, GainTable) or is_long(plane.case):
        return None
    gains: tuple[Any, ...] = ()
    if controller is not None:
        _, K1, K2 = controller.gain_sets()
        gains = (controller.feedback, K1[0], K2[0])
    return _curves(chart(plane.case, plane.x, plane.y, *gains, tolerance=_EDGE))


def _edge_of_laws(plane: Plane, laws: DriveLaws) -> tuple[FloatArray, ...]:
    """Return the boundary under each law, as far as that is the nearest."""
    where, rig = plane.rig_point, plane.case.rig
    if where is None:
        raise InputError("structure", laws.name, "used with a rig: it turns a string")
    machine_of(rig or where.rig)
    assert isinstance(rig, StringRig)
    plant, _ = plane.case.physics("a map")
    deep = [axis for axis in (plane.x, plane.y) if axis.name == "depth"]
    if deep:
        metre = to_si_factor("depth", axis_language(plane.case))
        spans = laws.reach(deep[0].low * metre, deep[0].high * metre)
    else:
        metre, spans = 1.0, [(0.0, 0.0, laws.at(rig.string.length))]
    curves: list[FloatArray] = []
    for low, high, control in spans:
        x, y = (
            replace(axis, low=low / metre, high=high / metre) if axis.name == "depth" else axis
            for axis in (plane.x, plane.y)
        )
        case = as_case(where, driven_plant(rig, control, plant.bit))
        curves += _curves(chart(case, x, y, tolerance=_EDGE_OF_STRING))
    return tuple(curves)


def _curves(drawn: StabilityChart) -> tuple[FloatArray, ...]:
    return tuple(
        np.vstack([curve.points, curve.points[:1]]) if curve.closed else curve.points
        for curve in drawn.curves
    )


def marked_place(plane: Plane) -> tuple[float, float] | None:
    """Return where the operating point lies on the map, if it does."""
    try:
        values = [plane.value_of(axis.name) for axis in (plane.x, plane.y)]
    except InputError:
        return None
    inside = all(
        axis.low <= value <= axis.high
        for axis, value in zip((plane.x, plane.y), values, strict=True)
    )
    return (values[0], values[1]) if inside else None
