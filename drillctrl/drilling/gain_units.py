"""Gains in a rig's units: from what the outputs measure and the inputs do."""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.language import SI, Language
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.plant import Plant
from drillctrl.drilling.quantities import quotient_unit, si_scale
from drillctrl.drilling.rig import Rig

# Units that take a k before them.
_WITH_K = ("N", "ft", "lbf")


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


def told_gain(
    structure: FeedbackStructure, name: str, plant: Plant, rig: Rig, language: Language, most: float
) -> tuple[float, str]:
    """Return what one of a gain is told as, and the unit, for numbers up to ``most``."""
    units = rig_gain_units(structure, plant, rig)
    assert units is not None
    factor, unit = units[structure.entry_names.index(name)]
    unit, per = language.gain(unit.replace("*", "·"))
    factor *= per
    if unit.startswith(_WITH_K) and most * factor >= 1e3:
        return factor / 1e3, f"k{unit}"
    return factor, "" if unit == "1" else unit


def gain_texts(
    structure: FeedbackStructure,
    gains: FloatArray,
    plant: Plant | None,
    rig: Rig | None,
    language: Language = SI,
) -> list[list[str]]:
    """Return K1 or K2, (m, p), in few digits, with a rig in its units, by rows."""
    if rig is None or plant is None:
        return [[f"{gain:.3g}" for gain in row] for row in gains.tolist()]
    factors, names = gain_units(structure, plant, rig)
    values = (gains * factors).tolist()
    return [
        [_with_unit(value, *language.gain(unit)) for value, unit in zip(row, units, strict=True)]
        for row, units in zip(values, names, strict=True)
    ]


def _with_unit(value: float, unit: str, factor: float) -> str:
    """Return a number in few digits, a large one with a k before the unit."""
    value *= factor
    if unit.startswith(_WITH_K) and abs(value) >= 1e3:
        return f"{value / 1e3:.3g} k{unit}"
    if unit == "1":
        return f"{value:.3g}"
    return f"{value:.3g} {unit}"


def control_text(
    structure: FeedbackStructure,
    K1: FloatArray,
    K2: FloatArray,
    plant: Plant,
    rig: Rig | None,
    language: Language = SI,
) -> str:
    """Return a structure and its gains on one line, such as p: K1 = -2 kN·m/rad."""
    parts = []
    for label, gains in (("K1", K1), ("K2", K2)):
        if gains.any():
            texts = [
                text for row in gain_texts(structure, gains, plant, rig, language) for text in row
            ]
            parts.append(f"{label} = {', '.join(texts)}")
    return f"{structure.name}: {'; '.join(parts)}" if parts else structure.name
