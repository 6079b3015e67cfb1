"""A drill string, its bit and the rock, in SI units (Table 1 of Liu et al. 2014)."""

from __future__ import annotations

import dataclasses
import difflib
import math
import tomllib
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from drillctrl.base import units
from drillctrl.base.errors import InputError, blamed_on, checked_integer, checked_number
from drillctrl.base.files import check_regular
from drillctrl.base.units import Dimension

STANDARD_GRAVITY = 9.80665
PRESETS = ("table1",)
_MOST_BYTES = 1_000_000


def _parameter(dimension: Dimension, *, zero: bool = False) -> Any:
    return field(metadata={"dimension": dimension, "zero": zero})


@dataclass(frozen=True)
class Rig:
    """Drill string, bit and rock, lumped to one axial and one torsional degree of freedom.

    All values are SI. Those marked (0) may be zero, the rest are positive.

    Attributes
    ----------
    mass : float
        M, axial mass of the string and bottom-hole assembly, kg.
    inertia : float
        I, rotary inertia, kg m².
    axial_stiffness : float
        Ka, N/m.
    torsional_stiffness : float
        Kt, N m/rad.
    axial_damping : float
        Ca, N s/m (0).
    torsional_damping : float
        Ct, N m s/rad (0).
    rock_strength : float
        ε, intrinsic specific energy of the rock, Pa.
    contact_strength : float
        σ, contact strength at the wear flat, Pa (0).
    bit_radius : float
        a, m.
    wearflat_length : float
        l, m (0).
    cutter_inclination : float
        ζ, dimensionless.
    friction_coefficient : float
        μ between rock and bit, dimensionless (0).
    bit_geometry : float
        γ, dimensionless (0).
    submerged_weight : float
        Ws, N (0). It enters the static axial stretch z0 and nothing else.
    blades : int
        n, number of blades.

    Raises
    ------
    InputError
        If a value is not finite or not in its range.
    """

    made_by = "table1()"

    mass: float = _parameter(units.MASS)
    inertia: float = _parameter(units.INERTIA)
    axial_stiffness: float = _parameter(units.STIFFNESS)
    torsional_stiffness: float = _parameter(units.TORSIONAL_STIFFNESS)
    axial_damping: float = _parameter(units.DAMPING, zero=True)
    torsional_damping: float = _parameter(units.TORSIONAL_DAMPING, zero=True)
    rock_strength: float = _parameter(units.STRESS)
    contact_strength: float = _parameter(units.STRESS, zero=True)
    bit_radius: float = _parameter(units.LENGTH)
    wearflat_length: float = _parameter(units.LENGTH, zero=True)
    cutter_inclination: float = _parameter(units.NUMBER)
    friction_coefficient: float = _parameter(units.NUMBER, zero=True)
    bit_geometry: float = _parameter(units.NUMBER, zero=True)
    submerged_weight: float = _parameter(units.FORCE, zero=True)
    blades: int = 4

    def __post_init__(self) -> None:
        checked_integer("blades", self.blades, 1, 100)
        for item in _dimensional_fields():
            value = checked_number(
                item.name,
                getattr(self, item.name),
                0.0,
                1e15,
                open_low=not item.metadata["zero"],
            )
            object.__setattr__(self, item.name, value)

    @property
    def time_scale(self) -> float:
        """Unit of dimensionless time in seconds, sqrt(I/Kt) (Eq. 14)."""
        return math.sqrt(self.inertia / self.torsional_stiffness)

    @property
    def axial_scale(self) -> float:
        """Unit of dimensionless axial displacement in metres, 2Kt/(εa²) (Eq. 14)."""
        return 2.0 * self.torsional_stiffness / (self.rock_strength * self.bit_radius**2)

    @property
    def axial_force_scale(self) -> float:
        """Unit of dimensionless axial force in newtons."""
        return self.mass * self.axial_scale / self.time_scale**2

    def hardware(self) -> dict[str, Any]:
        """Return what the rig says of its plant's parts, by the names that `paper_plant` takes.

        A rig of lumped numbers says nothing: its string is the paper's.
        """
        return {}

    @property
    def depth(self) -> float | None:
        """Length of the string, m; None where that is lumped."""
        return None

    def with_rock_strength(self, rock_strength: float) -> Rig:
        """Return the same rig in another rock (Pa)."""
        return dataclasses.replace(self, rock_strength=rock_strength)


def _dimensional_fields() -> list[dataclasses.Field[Any]]:
    return [item for item in fields(Rig) if "dimension" in item.metadata]


def table1() -> Rig:
    """Return the rig of Table 1 with ε = 60 MPa.

    The table gives no submerged weight; the weight of the lumped mass stands for it, a
    lower bound, because the lumped mass counts a third of the pipes only.
    """
    return Rig(
        mass=3.4e4,
        inertia=116.0,
        axial_stiffness=7.0e5,
        torsional_stiffness=938.0,
        axial_damping=1.56e4,
        torsional_damping=32.9,
        rock_strength=60e6,
        contact_strength=60e6,
        bit_radius=0.108,
        wearflat_length=1.2e-3,
        cutter_inclination=0.6,
        friction_coefficient=0.6,
        bit_geometry=1.0,
        submerged_weight=3.4e4 * STANDARD_GRAVITY,
        blades=4,
    )


def read_toml(source: str | Path, permitted: str) -> dict[str, Any]:
    """Return what a TOML file holds.

    Raises
    ------
    InputError
        If there is no such file, or it is not TOML; the message says what is permitted.
    """
    path = Path(source)
    try:
        check_regular(path, _MOST_BYTES)
        # Some editors begin a file with a mark of its encoding.
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8"
        raise InputError("rig", str(source), f"{permitted} ({reason})") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        why = "nested too deep" if isinstance(error, RecursionError) else str(error)
        raise InputError("rig", str(source), f"a valid TOML file ({why})") from None


def rig_from_mapping(data: dict[str, Any], source: str) -> Rig:
    """Return a rig of lumped numbers from texts with units, by the names of its attributes.

    Raises
    ------
    InputError
        If a key is missing or unknown, or a value is outside its range.
    """
    known = {item.name: item for item in fields(Rig)}
    for key in data:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise InputError(f"key in {source}", key, f"one of {', '.join(known)}{hint}")
    missing = [k for k in known if k not in data and k != "blades"]
    if missing:
        raise InputError(f"{', '.join(missing)} in {source}", "(missing)", "given")
    values: dict[str, Any] = {}
    for key, value in data.items():
        dimension: Dimension | None = known[key].metadata.get("dimension")
        if dimension is None or (dimension is units.NUMBER and not isinstance(value, str)):
            values[key] = value
        else:
            values[key] = units.to_si(f"{key} in {source}", value, dimension)
    with blamed_on(source, {key: (key, value) for key, value in data.items()}):
        return Rig(**values)


def rig_mapping(rig: Rig) -> dict[str, Any]:
    """Return the keys and texts from which `rig_from_mapping` reads a rig without loss."""
    data: dict[str, Any] = {"blades": rig.blades}
    for item in _dimensional_fields():
        value, dimension = getattr(rig, item.name), item.metadata["dimension"]
        data[item.name] = f"{value!r} {dimension.unit}" if dimension.unit else value
    return data
