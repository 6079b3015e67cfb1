"""The worst of several operating points as what a design minimises."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

from drillctrl.base.errors import checked_number
from drillctrl.drilling.point import OperatingPoint
from drillctrl.synthesis.objectives import WorstLoop

_SAMPLED = (-1.0, 0.0, 1.0)
_LARGEST = 0.9


@dataclass(frozen=True)
class WorstCase(WorstLoop):
    """The largest spectral abscissa over several operating points.

    Attributes
    ----------
    psi, delta0, omega0 : float
        Relative errors, 0 to 0.9, of the point: all corners of the box they span, the
        middles of its edges and faces, and the point itself are looked at.
    points : tuple of OperatingPoint
        More points.
    """

    psi: float = 0.05
    delta0: float = 0.0
    omega0: float = 0.0
    points: tuple[OperatingPoint, ...] = ()

    def __post_init__(self) -> None:
        for name in ("psi", "delta0", "omega0"):
            checked_number(f"worst-case {name}", getattr(self, name), 0.0, _LARGEST)

    def around(self, point: OperatingPoint) -> tuple[OperatingPoint, ...]:
        """Return all points looked at, the given one first."""
        sizes = {name: getattr(self, name) for name in ("psi", "delta0", "omega0")}
        return (point, *box(point, sizes), *self.points)


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


def box(point: OperatingPoint, sizes: Mapping[str, float]) -> list[OperatingPoint]:
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
