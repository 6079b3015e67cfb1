"""What is understood of a rig: length, weights, impedance, lumped numbers, modes."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.rig import STANDARD_GRAVITY, Rig
from drillctrl.strings.elements import elements, free_modes
from drillctrl.strings.line import Line
from drillctrl.strings.rig import StringRig, lump

# Modes are told up to these frequencies in hertz, and the first of each kind anyway.
TORSIONAL_BAND, AXIAL_BAND = 5.0, 10.0
_ELEMENT_LENGTH = 5.0
_MOST_MODES = 60


@dataclass(frozen=True, eq=False)
class Mode:
    """A mode of a string whose top end is held and whose bit is free.

    Attributes
    ----------
    kind : {"torsional", "axial"}
        Of which motion.
    number : int
        1 for the first of its kind.
    frequency : float
        Undamped, Hz.
    damping_ratio : float
        Share of critical.
    places, shape : array, (k,)
        Metres below the top end, and the amplitude there over that of the bit.
    """

    kind: str
    number: int
    frequency: float
    damping_ratio: float
    places: FloatArray
    shape: FloatArray

    @property
    def name(self) -> str:
        """Such as ``"2nd torsional"``."""
        endings = {1: "st", 2: "nd", 3: "rd"}
        teen = self.number % 100 in (11, 12, 13)
        return f"{self.number}{'th' if teen else endings.get(self.number % 10, 'th')} {self.kind}"


@dataclass(frozen=True, eq=False)
class RigCheck:
    """What is understood of a rig.

    Attributes
    ----------
    rig : Rig
        As it was read.
    length, weight_in_air, buoyed_weight, impedance : float or None
        m, N, N, and N m s of the uppermost pipe in torsion; None of a rig that is lumped.
    torsional, axial : tuple of Mode
        By frequency.
    """

    rig: Rig
    length: float | None
    weight_in_air: float | None
    buoyed_weight: float | None
    impedance: float | None
    torsional: tuple[Mode, ...]
    axial: tuple[Mode, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        lumped = lump(self.rig)
        names = ("mass", "inertia", "axial_stiffness", "torsional_stiffness")
        return {
            "schema": "drillctrl/rig-check/1",
            "length": self.length,
            "weight_in_air": self.weight_in_air,
            "buoyed_weight": self.buoyed_weight,
            "impedance": self.impedance,
            "lumped": {
                **{name: getattr(lumped, name) for name in names},
                "axial_damping": lumped.axial_damping,
                "torsional_damping": lumped.torsional_damping,
            },
            "modes": {
                kind: [
                    {"frequency": mode.frequency, "damping_ratio": mode.damping_ratio}
                    for mode in modes
                ]
                for kind, modes in (("torsional", self.torsional), ("axial", self.axial))
            },
            "sections": [_section_fields(section) for section in _sections(self.rig)],
            "drive": _drive_fields(self.rig),
            "wall_torque": self.rig.string.wall_torque if isinstance(self.rig, StringRig) else 0.0,
        }


def _drive_fields(rig: Rig) -> dict[str, Any] | None:
    drive = rig.drive if isinstance(rig, StringRig) else None
    return None if drive is None else asdict(drive)


def _section_fields(section: Any) -> dict[str, Any]:
    fields = asdict(section)
    material = fields.pop("material")
    return {**fields, "mass_per_metre": section.mass_per_metre, **material}


def _sections(rig: Rig) -> tuple[Any, ...]:
    return rig.string.sections if isinstance(rig, StringRig) else ()


@checks_kinds
def check_rig(rig: Rig) -> RigCheck:
    """Return what is understood of a rig.

    Parameters
    ----------
    rig : Rig
        Lumped, or with a string.

    Returns
    -------
    RigCheck
        Modes are of finite elements no longer than 5 m.
    """
    if not isinstance(rig, StringRig):
        return RigCheck(
            rig,
            None,
            None,
            None,
            None,
            (_single("torsional", rig.torsional_stiffness, rig.inertia, rig.torsional_damping),),
            (_single("axial", rig.axial_stiffness, rig.mass, rig.axial_damping),),
        )
    string = rig.string
    ropes = len(string.tension.stretches) - len(string.sections)
    return RigCheck(
        rig,
        string.length,
        string.mass * STANDARD_GRAVITY,
        string.submerged_weight,
        string.torsion.wave_impedance,
        string_modes(string.torsion, "torsional", TORSIONAL_BAND),
        string_modes(string.tension, "axial", AXIAL_BAND, above=1.0 if ropes else 0.0),
    )


def _single(kind: str, stiffness: float, mass: float, damping: float) -> Mode:
    rate = math.sqrt(stiffness / mass)
    ratio = damping / (2.0 * math.sqrt(stiffness * mass))
    ends = np.array([0.0, 1.0])
    return Mode(kind, 1, rate / (2.0 * math.pi), ratio, ends, ends)


def string_modes(line: Line, kind: str, highest: float, *, above: float = 0.0) -> tuple[Mode, ...]:
    """Return the modes of a line, its top end held and its bit free.

    Parameters
    ----------
    line : Line
        Of torsion or of tension.
    kind : {"torsional", "axial"}
        Which.
    highest : float
        Hz; the first mode is returned wherever it lies.
    above : float
        Metres of the line that are no pipe but ropes.
    """
    chain = elements(line, _ELEMENT_LENGTH)
    count = min(_MOST_MODES, chain.diagonal.shape[1] - 2)
    modes = free_modes(chain, count)
    places = line.length - above - chain.height
    shapes = np.vstack([modes.shapes, np.zeros((1, modes.shapes.shape[1]))])
    losses = (shapes * chain.product(1, shapes)).sum(axis=0)
    masses = (shapes * chain.product(0, shapes)).sum(axis=0)
    found = []
    for j, frequency in enumerate(modes.frequencies.tolist()):
        if j and frequency > highest:
            break
        ratio = float(losses[j] / masses[j]) / (4.0 * math.pi * frequency)
        shape = shapes[:, j] / shapes[0, j]
        found.append(Mode(kind, j + 1, frequency, ratio, places, shape))
    return tuple(found)
