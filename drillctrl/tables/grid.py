"""The grid of operating points of a table: dimensionless groups, or what a driller sets."""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
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
DIMENSIONLESS = ("omega0", "delta0", "psi")
FEEDS = ("penetration_rate", "weight_on_bit")
# In the place of rock: what changes the string of a rig.
THIRD = ("rock_strength", *CHANGES)


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
        return FIELD_UNITS.get(self.name, ("", 1.0))

    def text(self, *values: float) -> str:
        """Return a value, or the ends of a range, with name and unit for people."""
        unit, factor = self.field_unit
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


@dataclass(frozen=True)
class Grid:
    """All combinations of a rotary speed, a feed and a rock, or depth or mud of a string.

    Attributes
    ----------
    axes : tuple of three Axis
        Named as `DIMENSIONLESS`, or ``rotary_speed``, one of `FEEDS` and one of `THIRD`, in that
        order; a parameter of the plant's parts may take the place of ψ. The last varies fastest
        among the nodes. Points and gains have the units of the rig whatever the depth.
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

    axes: tuple[Axis, Axis, Axis]
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
        if self.rig is None:
            fitting = tuple((*DIMENSIONLESS[:2], third) for third in ("psi", *self.plant.own))
        if names not in fitting:
            wanted = " or ".join(", ".join(choice) for choice in fitting)
            raise InputError("axes", ", ".join(names), wanted)
        if self.restrings:
            # A value out of range is told before any work is done.
            for value in self.axes[2].values:
                restrung(self.plant, **{names[2]: value})
        if math.prod(self.shape) > MAX_NODES:
            raise InputError("grid", f"{math.prod(self.shape)} nodes", f"at most {MAX_NODES} nodes")

    @property
    def rig(self) -> Rig | None:
        """The rig, of a grid in rig units."""
        return self.reference if isinstance(self.reference, Rig) else None

    @property
    def names(self) -> tuple[str, str, str]:
        """Parameters of the case that the three axes stand for."""
        third = self.axes[2].name
        return ("omega0", "delta0", "psi" if third == "rock_strength" else third)

    @property
    def restrings(self) -> bool:
        """Whether the third axis changes the string."""
        return self.axes[2].name in CHANGES

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of values on each axis."""
        a, b, c = (len(axis.values) for axis in self.axes)
        return a, b, c

    @property
    def coordinates(self) -> FloatArray:
        """Coordinates of all nodes on the axes, (q, 3)."""
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

    def case(self, speed: float, feed: float, rock: float) -> Case:
        """Return what drills at coordinates on the three axes."""
        third, plant = self.names[2], self.plant
        if self.restrings:
            plant = restrung(plant, **{third: rock})
        elif third != "psi":
            plant = plant.with_values(**{third: rock})
        return Case(plant, self.point(speed, feed, rock))

    def point(self, speed: float, feed: float, rock: float) -> OperatingPoint:
        """Return the operating point at coordinates on the three axes."""
        if isinstance(self.reference, OperatingPoint):
            rocks = {"psi": rock} if self.names[2] == "psi" else {}
            return self.reference.with_changes(omega0=speed, delta0=feed, **rocks)
        return self._rig_point(self.reference, speed, feed, rock).operating_point()

    def _rig_point(self, rig: Rig, speed: float, feed: float, rock: float) -> RigPoint:
        placed = rig if self.restrings else rig.with_rock_strength(rock)
        if self.axes[1].name == "weight_on_bit":
            return rig_point_at_weight_on_bit(placed, speed, feed)
        return RigPoint(placed, speed, feed)

    def place_of(self, case: Case) -> tuple[float, float, float]:
        """Return the values of `names` of a case, as `locate` takes them."""
        plant, point = case.physics("a place in a table")
        third = self.names[2]
        if third not in CHANGES:
            return point.omega0, point.delta0, case.parameters[third]
        hung = plant.string
        if not isinstance(hung, PipeString):
            raise InputError("string", type(hung).__name__, f"one of sections: it has a {third}")
        own = hung.string.length if third == "depth" else hung.string.mud_density
        return point.omega0, point.delta0, own

    def groups(self, coordinates: npt.ArrayLike) -> FloatArray:
        """Return `names` at coordinates on the axes in their SI units, (q, 3) → (q, 3)."""
        places = np.atleast_2d(np.asarray(coordinates, dtype=float))
        if self.rig is None:
            return places
        points = [self.point(*row) for row in places.tolist()]
        found = np.array([[p.omega0, p.delta0, p.psi] for p in points]).reshape(-1, 3)
        return np.column_stack([found[:, :2], places[:, 2]]) if self.restrings else found

    def locate(
        self, omega0: npt.ArrayLike, delta0: npt.ArrayLike, psi: npt.ArrayLike
    ) -> FloatArray:
        """Return coordinates on the axes of values of `names`, (q,) each → (q, 3)."""
        arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in
                                       (omega0, delta0, psi)))  # fmt: skip
        groups = np.column_stack([array.ravel() for array in arrays])
        rig = self.rig
        if rig is None:
            return groups
        speed = groups[:, 0] / rig.time_scale
        if self.restrings:
            feed = groups[:, 1] * speed * rig.axial_scale
            if self.axes[1].name == "weight_on_bit":
                feed = weight_on_bit(rig, speed, feed, rig.rock_strength)
            return np.column_stack([speed, feed, groups[:, 2]])
        # ψ is proportional to the strength, the axial scale to its inverse (Eqs. 14, 16).
        unit = RigPoint(rig, 1.0, 0.0).operating_point().psi / rig.rock_strength
        strength = groups[:, 2] / unit
        length = rig.axial_scale * rig.rock_strength / strength
        feed = groups[:, 1] * speed * length
        if self.axes[1].name == "weight_on_bit":
            feed = weight_on_bit(rig, speed, feed, strength)
        return np.column_stack([speed, feed, strength])


@checks_kinds
def dimensionless_grid(
    omega0: Axis | float,
    delta0: Axis | float,
    psi: Axis | float = 14.0,
    reference: Where | None = None,
    *,
    parameter: Axis | None = None,
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
    return Grid((axes[0], axes[1], third), here, plant or paper_plant())


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
    thirds = [_as_axis(which, value) for which, value in given if value is not None]
    varied = [axis for axis in thirds if len(axis.values) > 1]
    if len(varied) > 1:
        wanted = f"one value beside values of {varied[0].name}"
        raise InputError(varied[1].name, list(varied[1].values)[:4], wanted)
    for axis in thirds:
        if axis in varied:
            continue
        if axis.name in CHANGES:
            plant = restrung(plant, **{axis.name: axis.values[0]})
        else:
            rig = rig.with_rock_strength(axis.values[0])
    third = varied[0] if varied else Axis("rock_strength", (rig.rock_strength,))
    return Grid((_as_axis("rotary_speed", rotary_speed), _as_axis(name, feed), third), rig, plant)


def _as_axis(name: str, given: Axis | float) -> Axis:
    return given if isinstance(given, Axis) else Axis(name, (given,))
