"""The grid of operating points of a table: dimensionless groups, or what a driller sets."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds, makes_of_kinds
from drillctrl.base.language import FIELD, SI, Language
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.plant import Plant, paper_plant
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import Rig
from drillctrl.drilling.steady import rig_point_at_weight_on_bit, weight_on_bit
from drillctrl.strings.changed import CHANGES, restrung
from drillctrl.strings.model import PipeString

MAX_NODES = 1_000_000

# What spans a grid, with SI units: in groups, or in rig units with one of two feeds.
AXIS_UNITS = {
    "omega0": "1",
    "delta0": "1",
    "psi": "1",
    "rotary_speed": "rad/s",
    "penetration_rate": "m/s",
    "weight_on_bit": "N",
    "rock_strength": "Pa",
    "depth": "m",
    "mud": "kg/m**3",
}
# What people read: a unit of the field, and how many of it are one SI unit.
FIELD_UNITS = {
    "rotary_speed": ("rpm", 30.0 / math.pi),
    "penetration_rate": ("m/h", 3600.0),
    "weight_on_bit": ("kN", 1e-3),
    "rock_strength": ("MPa", 1e-6),
    "depth": ("m", 1.0),
    "mud": ("sg", 1e-3),
}
_QUANTITIES = {
    "rotary_speed": "angular_rate",
    "penetration_rate": "axial_rate",
    "weight_on_bit": "force",
    "rock_strength": "stress",
    "depth": "depth",
    "mud": "density",
}
# Groups that further axes may go over, and how many axes there may be: a cell has 2^a corners.
FURTHER = ("eta", "xi", "kappa", "beta")
MOST_AXES = 8
DIMENSIONLESS = ("omega0", "delta0", "psi")
FEEDS = ("penetration_rate", "weight_on_bit")
# In the place of rock: what changes the string of a rig.
THIRD = ("rock_strength", *CHANGES)


@makes_of_kinds
@dataclass(frozen=True)
class Axis:
    """Rising values of one quantity.

    Attributes
    ----------
    name : str
        A key of `AXIS_UNITS`, or a parameter of the plant's parts.
    values : tuple of float
        In its SI unit; at least one.

    Raises
    ------
    InputError
        If the values are none, not finite, or do not rise.
    """

    name: str
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and self.name.isidentifier()):
            known = ", ".join(AXIS_UNITS)
            raise InputError("axis", self.name, f"one of {known}, or a parameter of the plant")
        values = tuple(checked_number(self.name, value) for value in self.values)
        if not values or any(b <= a for a, b in itertools.pairwise(values)):
            raise InputError(self.name, list(values)[:4], "at least one value, rising")
        object.__setattr__(self, "values", values)

    @property
    def unit(self) -> str:
        """SI unit, ``"1"`` for a plain number."""
        return AXIS_UNITS.get(self.name, "1")

    @property
    def field_unit(self) -> tuple[str, float]:
        """Unit that a driller reads, empty for a plain number, and how many are one SI unit."""
        return self.told()

    def told(self, language: Language = SI) -> tuple[str, float]:
        """Return `field_unit` in a language; mud in SI is told by its specific gravity."""
        if language is FIELD and self.name in _QUANTITIES:
            return language.units[_QUANTITIES[self.name]]
        return FIELD_UNITS.get(self.name, ("", 1.0))

    def text(self, *values: float, language: Language = SI) -> str:
        """Return a value, or the ends of a range, with name and unit for people."""
        unit, factor = self.told(language)
        numbers = " … ".join(f"{factor * value:.4g}" for value in dict.fromkeys(values))
        return f"{self.name.replace('_', ' ')} {numbers} {unit}".strip()


@checks_kinds
def linear_axis(name: str, low: float, high: float, count: int) -> Axis:
    """Return evenly spaced values, both ends included."""
    for end in (low, high):
        checked_number(name, end)
    if count == 1 and low == high:
        return Axis(name, (low,))
    if not 2 <= count <= MAX_NODES:
        raise InputError(name, count, f"two to {MAX_NODES} values between different ends")
    return Axis(name, tuple(np.linspace(low, high, count).tolist()))


@makes_of_kinds
@dataclass(frozen=True)
class Grid:
    """All combinations of a rotary speed, a feed and a rock, or depth or mud of a string.

    Attributes
    ----------
    axes : tuple of Axis
        The first three named as `DIMENSIONLESS`, or ``rotary_speed``, one of `FEEDS` and one of
        `THIRD`, in that order; a parameter of the plant's parts may take the place of ψ. Further
        ones go over such parameters, over `FURTHER` of a dimensionless grid, over depth and mud
        of a string. The last varies fastest among the nodes. Points and gains have the units of
        the rig whatever the depth.
    reference : OperatingPoint or Rig
        What does not vary: η, ξ, κ and n of a dimensionless grid, the rig of the others.
    plant : Plant
        What drills there; by default the paper's, with the string that the rig may have.

    Raises
    ------
    InputError
        If axes and reference do not fit, or there are more than `MAX_NODES` nodes.
    """

    made_by = "dimensionless_grid makes of a point"

    axes: tuple[Axis, ...]
    reference: OperatingPoint | Rig
    plant: Plant = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.plant is None:
            parts = {} if self.rig is None else self.rig.hardware()
            object.__setattr__(self, "plant", paper_plant(**parts))
        names = tuple(axis.name for axis in self.axes)
        fitting: tuple[tuple[str, ...], ...] = tuple(
            ("rotary_speed", feed, third) for third in THIRD for feed in FEEDS
        )
        of_pipe = self.rig is not None and isinstance(self.plant.string, PipeString)
        further = {*self.plant.own, *(CHANGES if of_pipe else ())}
        if self.rig is None:
            fitting = tuple((*DIMENSIONLESS[:2], third) for third in ("psi", *self.plant.own))
            further |= {*FURTHER}
        if names[:3] not in fitting:
            wanted = " or ".join(", ".join(choice) for choice in fitting)
            raise InputError("axes", ", ".join(names), wanted)
        if len(names) > MOST_AXES:
            raise InputError("axes", ", ".join(names), f"at most {MOST_AXES}")
        for i, name in enumerate(names[3:], 3):
            if name not in further or name in names[:i]:
                known = ", ".join(sorted(further - {*names[:i]})) or "none, of this plant"
                raise InputError("axes", name, f"each once, and of {known}")
        for axis in self.axes:
            if axis.name in CHANGES:
                # A value out of range is told before any work is done.
                for value in axis.values:
                    restrung(self.plant, **{axis.name: value})
        if math.prod(self.shape) > MAX_NODES:
            raise InputError("grid", f"{math.prod(self.shape)} nodes", f"at most {MAX_NODES} nodes")

    @property
    def rig(self) -> Rig | None:
        """The rig, of a grid in rig units."""
        return self.reference if isinstance(self.reference, Rig) else None

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters of the case that the axes stand for."""
        named = (axis.name for axis in self.axes[2:])
        return ("omega0", "delta0", *("psi" if name == "rock_strength" else name for name in named))

    @property
    def restrings(self) -> bool:
        """Whether an axis changes the string."""
        return any(axis.name in CHANGES for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values on each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def coordinates(self) -> FloatArray:
        """Coordinates of all nodes on the axes, (q, a)."""
        mesh = np.meshgrid(*(axis.values for axis in self.axes), indexing="ij")
        return np.column_stack([values.ravel() for values in mesh])

    @functools.cached_property
    def points(self) -> tuple[OperatingPoint, ...]:
        """Operating points of all nodes."""
        return tuple(self.point(*row) for row in self.coordinates.tolist())

    @functools.cached_property
    def cases(self) -> tuple[Case, ...]:
        """What drills at all nodes."""
        return tuple(self.case(*row) for row in self.coordinates.tolist())

    def case(self, *coordinates: float) -> Case:
        """Return what drills at coordinates on the axes."""
        given = dict(zip(self.names[2:], coordinates[2:], strict=True))
        plant = self.plant.with_values(
            **{name: value for name, value in given.items() if name in self.plant.own}
        )
        if self.restrings:
            plant = restrung(
                plant, **{name: value for name, value in given.items() if name in CHANGES}
            )
        return Case(plant, self.point(*coordinates))

    def point(self, *coordinates: float) -> OperatingPoint:
        """Return the operating point at coordinates on the axes."""
        if isinstance(self.reference, OperatingPoint):
            given = dict(zip(self.names, coordinates, strict=True))
            groups = {k: v for k, v in given.items() if k not in self.plant.own}
            return self.reference.with_changes(**groups)
        return self._rig_point(self.reference, *coordinates[:3]).operating_point()

    def _rig_point(self, rig: Rig, speed: float, feed: float, rock: float) -> RigPoint:
        placed = rig.with_rock_strength(rock) if self.axes[2].name == "rock_strength" else rig
        if self.axes[1].name == "weight_on_bit":
            return rig_point_at_weight_on_bit(placed, speed, feed)
        return RigPoint(placed, speed, feed)

    def place_of(self, case: Case) -> tuple[float, ...]:
        """Return the values of `names` of a case, as `locate` takes them."""
        plant, point = case.physics("a place in a table")
        hung = plant.string

        def value(name: str) -> float:
            if name in CHANGES:
                if not isinstance(hung, PipeString):
                    wanted = f"one of sections: it has a {name}"
                    raise InputError("string", type(hung).__name__, wanted)
                return hung.string.length if name == "depth" else hung.string.mud_density
            return float(plant.own[name] if name in plant.own else getattr(point, name))

        return tuple(value(name) for name in self.names)

    def groups(self, coordinates: npt.ArrayLike) -> FloatArray:
        """Return `names` at coordinates on the axes in their SI units, (q, a) → (q, a)."""
        places = np.atleast_2d(np.asarray(coordinates, dtype=float))
        if self.rig is None:
            return places
        points = [self.point(*row) for row in places.tolist()]
        groups = np.array([[p.omega0, p.delta0, p.psi] for p in points]).reshape(-1, 3)
        rocks = groups[:, 2:] if self.names[2] == "psi" else places[:, 2:3]
        return np.column_stack([groups[:, :2], rocks, places[:, 3:]])

    def locate(self, *values: npt.ArrayLike) -> FloatArray:
        """Return coordinates on the axes of values of `names`, (q,) each → (q, a)."""
        if len(values) != len(self.names):
            raise InputError("coordinates", len(values), f"those of {', '.join(self.names)}")
        arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in values))
        groups = np.column_stack([array.ravel() for array in arrays])
        rig = self.rig
        if rig is None:
            return groups
        speed = groups[:, 0] / rig.time_scale
        # ψ is proportional to the strength, the axial scale to its inverse (Eqs. 14, 16).
        unit = RigPoint(rig, 1.0, 0.0).operating_point().psi / rig.rock_strength
        rocks = self.names[2] == "psi"
        strength = groups[:, 2] / unit if rocks else np.full(len(groups), rig.rock_strength)
        length = rig.axial_scale * rig.rock_strength / strength
        feed = groups[:, 1] * speed * length
        if self.axes[1].name == "weight_on_bit":
            feed = weight_on_bit(rig, speed, feed, strength)
        third = strength if rocks else groups[:, 2]
        return np.column_stack([speed, feed, third, groups[:, 3:]])


@checks_kinds
def dimensionless_grid(
    omega0: Axis | float,
    delta0: Axis | float,
    psi: Axis | float = 14.0,
    reference: Where | None = None,
    *,
    parameter: Axis | None = None,
    further: Sequence[Axis] = (),
) -> Grid:
    """Return a grid over dimensionless groups.

    Parameters
    ----------
    omega0, delta0, psi : Axis or float
        A number stands for an axis with one value.
    reference : OperatingPoint or Case, optional
        Supplies the other groups and the plant; by default those of `OperatingPoint`, and the
        paper's.
    parameter : Axis, optional
        Over a parameter of the plant's parts; ψ is then a number.
    further : sequence of Axis
        Over further parameters of the plant's parts, or of eta, xi, kappa and beta.

    Raises
    ------
    InputError
        If an axis is none of the plant's, or ψ is to vary beside another parameter.
    """
    case = None if reference is None else as_case(reference)
    plant = None if case is None else case.physics("a grid")[0]
    axes = [_as_axis(*pair) for pair in zip(DIMENSIONLESS, (omega0, delta0, psi), strict=True)]
    first = [axis.values[0] for axis in axes]
    here = (
        OperatingPoint(first[0], first[1], first[2])
        if case is None or case.point is None
        else case.point
    )
    # The node-dependent groups of the reference say nothing; one grid has one reference.
    here = replace(here.with_changes(psi=first[2]), omega0=first[0], delta0=first[1])
    third = axes[2]
    if parameter is not None:
        if len(third.values) > 1:
            raise InputError("psi", list(third.values)[:4], f"a number beside {parameter.name}")
        third = parameter
    return Grid((axes[0], axes[1], third, *further), here, plant or paper_plant())


@checks_kinds
def rig_grid(
    rig: Rig | RigPoint | Case,
    rotary_speed: Axis | float,
    *,
    penetration_rate: Axis | float | None = None,
    weight_on_bit: Axis | float | None = None,
    rock_strength: Axis | float | None = None,
    depth: Axis | float | None = None,
    mud: Axis | float | None = None,
    further: Sequence[Axis] = (),
) -> Grid:
    """Return a grid in rig units, all SI.

    Parameters
    ----------
    rig : Rig, RigPoint or Case
        Drill string and bit; a case brings its plant.
    rotary_speed : Axis or float
        rad/s.
    penetration_rate, weight_on_bit : Axis or float
        m/s, or N; one of the two.
    rock_strength : Axis or float, optional
        Pa; by default that of the rig.
    depth, mud : Axis or float, optional
        Length of a string of sections, m, and density of its mud, kg/m³; by default the rig's.
    further : sequence of Axis
        Over parameters of the plant's parts.

    Raises
    ------
    InputError
        If both feeds or none is given, more than one of rock, depth and mud varies, or the rig
        has no string to change.
    """
    if (penetration_rate is None) == (weight_on_bit is None):
        raise InputError("penetration_rate", penetration_rate, "given, or else weight_on_bit")
    plant = None
    if not isinstance(rig, Rig):
        case = as_case(rig)
        plant, found = case.physics("a grid")[0], case.rig
        if found is None:
            raise InputError("rig", "a case without a rig", "a Rig, or a Case of a RigPoint")
        rig = found
    name = FEEDS[0] if weight_on_bit is None else FEEDS[1]
    feed = penetration_rate if penetration_rate is not None else weight_on_bit
    assert feed is not None
    plant = plant or paper_plant(**rig.hardware())
    given = zip(THIRD, (rock_strength, depth, mud), strict=True)
    asked = [_as_axis(which, value) for which, value in given if value is not None]
    varied = [axis for axis in asked if len(axis.values) > 1]
    for axis in asked:
        if axis in varied:
            continue
        if axis.name in CHANGES:
            plant = restrung(plant, **{axis.name: axis.values[0]})
        else:
            rig = rig.with_rock_strength(axis.values[0])
    third, *others = varied or [Axis("rock_strength", (rig.rock_strength,))]
    axes = (_as_axis("rotary_speed", rotary_speed), _as_axis(name, feed), third)
    return Grid((*axes, *others, *further), rig, plant)


def _as_axis(name: str, given: Axis | float) -> Axis:
    return given if isinstance(given, Axis) else Axis(name, (given,))
