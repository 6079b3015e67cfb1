"""Gains in a rig's units: from what the outputs measure and the inputs do."""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.plant import Plant
from drillctrl.drilling.quantities import quotient_unit, si_scale
from drillctrl.drilling.rig import Rig


def gain_units(
    structure: FeedbackStructure, plant: Plant, rig: Rig
) -> tuple[FloatArray, list[list[str]]]:
    """Return the SI value of each unit gain, (m, p), and its unit, by rows.

    Parameters
    ----------
    structure : FeedbackStructure
        Whose outputs and inputs are meant.
    plant : Plant
        Knows what they measure and do.
    rig : Rig
        Whose units.
    """
    factors, names = [], []
    for driven in structure.inputs:
        effort = plant.quantity(driven)
        outputs = [plant.quantity(output) for output in structure.outputs]
        factors.append([si_scale(effort, rig) / si_scale(output, rig) for output in outputs])
        names.append([quotient_unit(effort, output) for output in outputs])
    return np.array(factors), names


def rig_gain_units(
    structure: FeedbackStructure, plant: Plant, rig: Rig | None
) -> list[tuple[float, str]] | None:
    """Return factor and SI unit of each entry of (K1, K2), flat; None without a rig."""
    if rig is None:
        return None
    factors, names = gain_units(structure, plant, rig)
    flat = zip(factors.ravel().tolist(), [n for row in names for n in row], strict=True)
    return [(factor, name.replace("·", "*")) for factor, name in flat] * 2
