"""Gains and their bounds as texts on the command line, in a rig's units where one is given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from drillctrl.base.errors import InputError
from drillctrl.cli.quantity import put_once, read_quantity

if TYPE_CHECKING:
    from drillctrl.delay.structure import FeedbackStructure
    from drillctrl.drilling.plant import Plant
    from drillctrl.drilling.point import OperatingPoint, RigPoint
    from drillctrl.drilling.rig import Rig

# What each entry of (K1, K2) is worth in SI, and its unit.
Scales = Sequence[tuple[float, str]]


def scales_at(
    where: OperatingPoint | RigPoint, structure: str | FeedbackStructure | None
) -> Scales | None:
    """Return the units of gains at a point; None where they are dimensionless."""
    if structure is None:
        return None
    from drillctrl.drilling.case import as_case
    from drillctrl.drilling.point import RigPoint
    from drillctrl.drilling.structures import as_structure

    if not isinstance(where, RigPoint):
        return None
    plant = as_case(where).plant
    assert plant is not None
    return gain_scales(as_structure(structure), plant, where.rig)


def gain_scales(structure: FeedbackStructure, plant: Plant, rig: Rig | None) -> Scales | None:
    """Return the units of gains with a rig; None without one."""
    from drillctrl.drilling.gain_units import rig_gain_units

    return rig_gain_units(structure, plant, rig)


def read_gains(name: str, text: str | None, scales: Scales | None = None) -> list[float] | None:
    """Return a flat list of dimensionless gains from a text.

    Parameters
    ----------
    name : str
        K1 or K2.
    text : str or None
        Such as ``-5.03,-4.91``, or ``-3 kN*m/rad, -50 N*m*s/rad`` with a rig.
    scales : sequence, optional
        Of both matrices.

    Raises
    ------
    InputError
        If it has not that form, or a gain has no unit where a rig is given.
    """
    if text is None:
        return None
    option = f"--{name}"
    if scales is None:
        try:
            return [float(part) for part in text.replace(",", " ").split()]
        except ValueError:
            raise InputError(option, text, "numbers with commas between them") from None
    half = len(scales) // 2
    own = scales[:half] if name == "K1" else scales[half:]
    parts = text.split(",")
    if len(parts) != len(own):
        units = ", ".join(unit for _, unit in own)
        raise InputError(option, text, f"{len(own)} gain(s) with commas between them, in {units}")
    return [_gain(option, part, scale) for part, scale in zip(parts, own, strict=True)]


def read_bounds(
    texts: tuple[str, ...],
    structure: FeedbackStructure | None = None,
    scales: Scales | None = None,
) -> dict[str, tuple[float, float]]:
    """Return dimensionless bounds by gain from texts.

    Parameters
    ----------
    texts : tuple of str
        Such as ``K1=-10:10``, or ``K1_1=-3:3 kN*m/rad`` with a rig.
    structure, scales : optional
        Whose gains, and their units.

    Raises
    ------
    InputError
        If a text has not that form, or a bound has no unit where a rig is given.
    """
    bounds: dict[str, tuple[float, float]] = {}
    for text in texts:
        name, _, interval = text.partition("=")
        low, _, high = (part.strip() for part in interval.partition(":"))
        if scales is not None and structure is not None:
            scale = _scale_of(name.strip(), text, structure, scales)
            _, _, unit = high.partition(" ")
            if unit and " " not in low:
                low = f"{low} {unit}"
            ends = _gain("--bound", low, scale), _gain("--bound", high, scale)
        else:
            try:
                ends = float(low), float(high)
            except ValueError:
                raise InputError("--bound", text, "of the form K1=-10:10") from None
        put_once("--bound", bounds, name.strip(), ends)
    return bounds


def _scale_of(
    name: str, text: str, structure: FeedbackStructure, scales: Scales
) -> tuple[float, str]:
    """Return the unit of the gains that a bound names, which have to have the same."""
    entries = zip(structure.entry_names, scales, structure.free, strict=True)
    meant = {
        entry: scale
        for entry, scale, free in entries
        if free and (entry == name or entry.startswith(f"{name}_"))
    }
    if not meant:
        known = ", ".join(("K1", "K2", *structure.gain_names))
        raise InputError("--bound", text, f"on one of the gains {known}")
    if len(set(meant.values())) > 1:
        units = ", ".join(f"{entry} ({unit})" for entry, (_, unit) in meant.items())
        raise InputError("--bound", text, f"given for each of {units}")
    return next(iter(meant.values()))


def _gain(option: str, text: str, scale: tuple[float, str]) -> float:
    from drillctrl.base.units import Dimension

    factor, unit = scale
    dimension = Dimension(f"a gain in {unit}", unit, f"'{2.0 * factor:.4g} {unit}'")
    return read_quantity(option, text.strip(), dimension, factor) / factor
