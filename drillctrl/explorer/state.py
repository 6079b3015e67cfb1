"""What one window of the page asks about: JSON from outside, checked, as a case and its gains."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.language import DIMENSIONLESS, Language, told_language
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Case, as_case
from drillctrl.drilling.gain_units import gain_units
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import Rig
from drillctrl.drilling.structures import STRUCTURE_NAMES, preset_structure
from drillctrl.explorer.rig_text import rig_from_text
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.drive_control import law_controller
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_law import driven_plant
from drillctrl.strings.drives import drive_control, given_control
from drillctrl.strings.files import PRESETS, load_rig
from drillctrl.strings.rig import StringRig

# Laws of a top drive that the page offers; those whose gains may be moved come first.
MOVED_LAWS = ("stiff", "soft-torque")
LAWS = (*MOVED_LAWS, "z-torque", "observer-2", "dynamic-2")
GROUPS = ("omega0", "delta0", "psi", "eta", "xi", "kappa")
_LONGEST_NAME = 100


@dataclass(frozen=True, eq=False)
class Asked:
    """What is asked about.

    Attributes
    ----------
    where : OperatingPoint or RigPoint
        Where it drills.
    rig_name : str or None
        The preset, or what the opened file is called.
    structure : FeedbackStructure or None
        What acts at the bit.
    K1, K2 : array, (1, p), or None
        Its gains, dimensionless.
    law : DriveControl or None
        Of the top drive.
    given : mapping
        The numbers as they came: speed, rop, rock_strength and gains in the window's units, or
        the groups.
    """

    where: OperatingPoint | RigPoint
    rig_name: str | None
    structure: FeedbackStructure | None
    K1: FloatArray | None
    K2: FloatArray | None
    law: DriveControl | None
    given: Mapping[str, Any]

    @property
    def rig(self) -> Rig | None:
        """The rig, if there is one."""
        return self.where.rig if isinstance(self.where, RigPoint) else None

    @property
    def language(self) -> Language:
        """In which units the window speaks."""
        return self.where.language if isinstance(self.where, RigPoint) else DIMENSIONLESS

    @property
    def time_scale(self) -> float:
        """Seconds of a unit of time; 1 without a rig."""
        return 1.0 if self.rig is None else self.rig.time_scale

    @property
    def case(self) -> Case:
        """The plant and where it drills; a law of the drive is in the plant."""
        if self.law is None:
            return as_case(self.where)
        assert isinstance(self.rig, StringRig)
        return as_case(self.where, driven_plant(self.rig, self.law))

    @property
    def feedback(self) -> tuple[Any, ...]:
        """Structure and gains at the bit, as `analyze` and `chart` take them; empty for none."""
        return () if self.structure is None else (self.structure, self.K1, self.K2)

    def run(self) -> tuple[Case, Controller | None]:
        """Return what `simulate` takes."""
        if self.law is not None:
            assert isinstance(self.where, RigPoint)
            return law_controller(self.where, self.law)
        if self.structure is None:
            return self.case, None
        assert self.K1 is not None
        return self.case, Controller(self.structure, self.K1, self.K2)


def read_asked(fields: Mapping[str, Any]) -> Asked:
    """Return what a window asks about.

    Parameters
    ----------
    fields : mapping
        ``rig``: None, or ``name`` and ``text`` (None for a preset); ``units``: ``"si"`` or
        ``"field"``, of all that follows; ``speed``, ``rop``, ``rock_strength`` (None for the
        rig's own); without a rig the groups; ``structure`` (None for no control); ``K1``,
        ``K2``: lists; None for those of a law's rule.

    Raises
    ------
    InputError
        If something is missing, of another kind or out of range.
    """
    rig, name = read_rig(fields.get("rig"))
    where, given = _where(rig, fields)
    structure = fields.get("structure")
    kind = "one of the structures that are offered"
    if structure is None:
        if isinstance(rig, StringRig) and rig.drive is not None:
            raise InputError("controller", "none", "a law of the top drive, which nothing holds")
        return Asked(where, name, None, None, None, None, given)
    if not isinstance(structure, str):
        raise InputError("controller", str(type(structure).__name__), kind)
    if structure in LAWS:
        if not isinstance(rig, StringRig) or rig.drive is None:
            raise InputError("controller", structure, "used with a rig that has a top drive")
        law = _law(structure, rig, fields)
        given["structure"], given["K1"] = structure, fields.get("K1")
        return Asked(where, name, None, None, None, law, given)
    if structure not in STRUCTURE_NAMES:
        raise InputError("controller", structure[:_LONGEST_NAME], kind)
    if isinstance(rig, StringRig) and rig.drive is not None:
        wanted = "a law of the top drive, which otherwise nothing holds"
        raise InputError("controller", structure, wanted)
    chosen = preset_structure(structure)
    size = len(chosen.outputs)
    scale = gain_scale(chosen, where)
    delayed = bool(chosen.K2_upper.any())
    now = _numbers("K1", fields.get("K1"), size)
    past = _numbers("K2", fields.get("K2") if delayed else [0.0] * size, size)
    given |= {"structure": structure, "K1": now, "K2": past if delayed else None}
    dimensionless = [np.array([values]) / scale for values in (now, past)]
    return Asked(where, name, chosen, dimensionless[0], dimensionless[1], None, given)


def gain_scale(structure: FeedbackStructure, where: OperatingPoint | RigPoint) -> FloatArray:
    """Return what each unit gain is told as, (1, p); ones without a rig."""
    if not isinstance(where, RigPoint):
        return np.ones((1, len(structure.outputs)))
    plant, _ = as_case(where).physics("gains")
    factors, units = gain_units(structure, plant, where.rig)
    return factors * [[where.language.gain(unit).per_si for unit in row] for row in units]


def read_units(fields: Mapping[str, Any]) -> Language:
    """Return the units that a window speaks.

    Raises
    ------
    InputError
        If there are none of that name.
    """
    return told_language(str(fields.get("units") or "si")[:_LONGEST_NAME])


def read_rig(given: Any) -> tuple[Rig | None, str | None]:
    """Return a rig and its name; None for none.

    Raises
    ------
    InputError
        If there is no such preset, or the text makes no rig.
    """
    if given is None:
        return None, None
    if not isinstance(given, Mapping) or not isinstance(given.get("name"), str):
        raise InputError("rig", "something else", "a name and a text")
    name = given["name"][:_LONGEST_NAME]
    text = given.get("text")
    if text is None:
        # Never a path: the page opens no file of the machine.
        if name not in PRESETS:
            raise InputError("rig", name, f"one of {', '.join(PRESETS)}, or opened as a file")
        return load_rig(name), name
    if not isinstance(text, str):
        raise InputError("rig", "something else", "a text")
    return rig_from_text(text, name), name


def _where(
    rig: Rig | None, fields: Mapping[str, Any]
) -> tuple[OperatingPoint | RigPoint, dict[str, Any]]:
    if rig is None:
        given = {name: fields[name] for name in GROUPS if fields.get(name) is not None}
        for name in ("omega0", "delta0", "psi"):
            if name not in given:
                raise InputError(name, "(missing)", "given where there is no rig")
        return OperatingPoint(**given), given
    language = read_units(fields)
    rate, stress = language.units["axial_rate"], language.units["stress"]
    speed = checked_number("speed (rpm)", fields.get("speed"), 0.0, 1e4, open_low=True)
    rop = checked_number(f"rate of penetration ({rate.unit})", fields.get("rop"), 0.0, 1e4)
    given = {"speed": speed, "rop": rop}
    strength = fields.get("rock_strength")
    if strength is not None:
        given["rock_strength"] = checked_number(
            f"rock strength ({stress.unit})", strength, 0.0, 1e5, open_low=True
        )
        rig = rig.with_rock_strength(given["rock_strength"] / stress.per_si)
    return RigPoint(rig, speed * math.pi / 30.0, rop / rate.per_si, units=language.name), given


@functools.lru_cache(maxsize=64)
def designed_law(name: str, rig: StringRig) -> DriveControl:
    """Return the law of a rule, which takes seconds to design: the same for all its points."""
    return drive_control(name, rig)


def _law(name: str, rig: StringRig, fields: Mapping[str, Any]) -> DriveControl:
    gains = fields.get("K1")
    if gains is None:
        return designed_law(name, rig)
    return given_control(name, rig, *law_gains(_numbers("K1", gains, 2), read_units(fields)))


def law_gains(told: Sequence[float], language: Language) -> tuple[float, float]:
    """Return stiffness and damping of a law in N m/rad and N m s/rad."""
    stiffness, damping = told
    return stiffness / language.gain("N·m/rad").per_si, damping / language.gain("N·m·s/rad").per_si


def _numbers(name: str, given: Any, count: int) -> list[float]:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != count:
        raise InputError(name, "something else", f"a list of {count} numbers")
    return [checked_number(name, value, -1e12, 1e12) for value in given]
