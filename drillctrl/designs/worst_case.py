"""The worst of several operating points and strings as what a design minimises."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

from drillctrl.base.errors import checked_number
from drillctrl.drilling.case import Case
from drillctrl.drilling.point import OperatingPoint
from drillctrl.strings.changed import restrung
from drillctrl.strings.model import PipeString
from drillctrl.synthesis.objectives import WorstLoop

_SAMPLED = (-1.0, 0.0, 1.0)
_POINT, _STRING = ("psi", "delta0", "omega0"), ("depth", "mud")
_LARGEST = 0.9


@dataclass(frozen=True)
class WorstCase(WorstLoop):
    """The largest spectral abscissa over several operating points and strings.

    Attributes
    ----------
    psi, delta0, omega0 : float
        Relative errors, 0 to 0.9, of the point: all corners of the box they span, the
        middles of its edges and faces, and the point itself are looked at.
    points : tuple of OperatingPoint
        More points.
    depth, mud : float
        Relative errors of a real string's length and of its mud's density, which widen the box.
    """

    psi: float = 0.05
    delta0: float = 0.0
    omega0: float = 0.0
    points: tuple[OperatingPoint, ...] = ()
    depth: float = 0.0
    mud: float = 0.0

    def __post_init__(self) -> None:
        for name in (*_POINT, *_STRING):
            checked_number(f"worst-case {name}", getattr(self, name), 0.0, _LARGEST)

    def around(self, case: Case) -> tuple[Case, ...]:
        """Return all cases looked at, the given one first."""
        return (*cases_in_box(self, case), *(case.at(other) for other in self.points))


def errors_of(objective: object) -> dict[str, float]:
    """Return the relative errors that an objective allows for, by name."""
    return {name: getattr(objective, name) for name in (*_POINT, *_STRING)}


def cases_in_box(objective: WorstLoop, case: Case) -> tuple[Case, ...]:
    """Return a case and those at corners, middles of edges and of faces of a box about it.

    Parameters
    ----------
    objective : WorstLoop
        With relative errors of the point and of the string.
    case : Case
        In the middle.

    Raises
    ------
    InputError
        If the case has no physics, or no string to be longer or shorter.
    """
    _, point = case.physics(f"objective {objective.name}")
    sizes = errors_of(objective)
    points = [point, *_box(point, {name: sizes[name] for name in _POINT})]
    found = [case, *(case.at(other) for other in points[1:])]
    for name in _STRING:
        found += [
            _restrung(there, name, sign * sizes[name])
            for sign in (-1.0, 1.0)
            for there in found
            if sizes[name]
        ]
    return tuple(found)


def _restrung(case: Case, name: str, error: float) -> Case:
    plant, point = case.physics("another string")
    hung = plant.string
    own = 0.0
    if isinstance(hung, PipeString):
        own = hung.string.length if name == "depth" else hung.string.mud_density
    # The rig behind the point hangs on the string as it was.
    return Case(restrung(plant, **{name: own * (1.0 + error)}), point)


def fitted_box(errors: Mapping[str, float]) -> dict[str, float]:
    """Return relative errors of the groups that those of a fitted string's numbers make.

    Parameters
    ----------
    errors : mapping
        Of ``stiffness`` and ``inertia``, relative: ψ follows I/Kt, δ0 1/Kt and ω0 √(I/Kt).
    """
    stiffness, inertia = errors.get("stiffness", 0.0), errors.get("inertia", 0.0)
    sizes = {
        "psi": stiffness + inertia,
        "delta0": stiffness,
        "omega0": 0.5 * (stiffness + inertia),
    }
    return {name: min(size, _LARGEST) for name, size in sizes.items()}


def _box(point: OperatingPoint, sizes: Mapping[str, float]) -> list[OperatingPoint]:
    """Return corners, middles of edges and of faces of a box of relative sizes about a point."""
    moved = {name: size for name, size in sizes.items() if size > 0.0}
    return [
        point.with_changes(
            **{
                name: (1.0 + sign * size) * getattr(point, name)
                for sign, (name, size) in zip(signs, moved.items(), strict=True)
            }
        )
        for signs in itertools.product(_SAMPLED, repeat=len(moved))
        if any(signs)
    ]
