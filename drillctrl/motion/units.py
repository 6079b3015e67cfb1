"""Units in which the motion that a rig drills with is told."""

from __future__ import annotations

import math
from typing import NamedTuple

from drillctrl.drilling.case import Case
from drillctrl.drilling.quantities import si_scale


class Units(NamedTuple):
    """What dimensionless units are in those that are told; 1 where there is no rig.

    ``turn`` is what an angular frequency is divided by to be told: in Hz of a rig.
    """

    response: float
    time: float
    weight: float
    torque: float
    turn: float
    response_name: str
    rate_name: str
    weight_name: str = ""
    torque_name: str = ""


def units_of(case: Case) -> Units:
    """Return the units of the fields of a case: SI where there is a rig."""
    if case.rig is None:
        return Units(1.0, 1.0, 1.0, 1.0, 1.0, "", "")
    weight, torque, time = (si_scale(name, case.rig) for name in ("force", "torque", "time"))
    turn = 2.0 * math.pi * time
    return Units(torque * time, time, weight, torque, turn, "N·m·s/rad", "1/s", "N", "N·m")


def told_units(case: Case) -> Units:
    """Return the units in which people are told of a case."""
    language = case.language
    if not language.units:
        return Units(1.0, 1.0, 1.0, 1.0, 1.0, "", "")
    si = units_of(case)
    return si._replace(
        response=language.number("impedance", si.response),
        weight=language.number("force", si.weight),
        torque=language.number("torque", si.torque),
        response_name=language.unit("impedance"),
        weight_name=language.unit("force"),
        torque_name=language.unit("torque"),
    )
