"""What a design minimises, and what it must not give up for it: small values that compose."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from drillctrl.base.errors import checked_integer, checked_number
from drillctrl.drilling.point import OperatingPoint

_SAMPLED = (-1.0, 0.0, 1.0)


@dataclass(frozen=True)
class Exact:
    """The spectral abscissa α of the delay system."""

    name = "exact"


@dataclass(frozen=True)
class SemiDiscrete:
    """The growth rate ln ρ(D)/Δt of the semi-discretised loop (Eq. 32).

    Attributes
    ----------
    m : int
        Intervals, 1 to 200.
    order : int
        0 (the paper's), 1 or 2.
    """

    m: int = 40
    order: int = 0
    name = "semidiscrete"

    def __post_init__(self) -> None:
        checked_integer("m", self.m, 1, 200)
        checked_integer("order", self.order, 0, 2)


@dataclass(frozen=True)
class WorstCase:
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
    name = "worst-case"

    def __post_init__(self) -> None:
        for name in ("psi", "delta0", "omega0"):
            checked_number(f"worst-case {name}", getattr(self, name), 0.0, 0.9)

    def around(self, point: OperatingPoint) -> tuple[OperatingPoint, ...]:
        """Return all points looked at, the given one first."""
        sizes = {name: getattr(self, name) for name in ("psi", "delta0", "omega0")}
        moved = {name: size for name, size in sizes.items() if size > 0.0}
        corners = itertools.product(_SAMPLED, repeat=len(moved))
        box = [
            point.with_changes(
                **{
                    name: (1.0 + sign * size) * getattr(point, name)
                    for sign, (name, size) in zip(signs, moved.items(), strict=True)
                }
            )
            for signs in corners
            if any(signs)
        ]
        return (point, *box, *self.points)


@dataclass(frozen=True)
class Robust:
    """The ε-pseudospectral abscissa: the largest real part under perturbations of size ε.

    Attributes
    ----------
    epsilon : float
        Relative size of the perturbations of the plant's matrices, 1e-8 to 1.
    """

    epsilon: float = 1e-3
    name = "robust"

    def __post_init__(self) -> None:
        checked_number("epsilon", self.epsilon, 1e-8, 1.0)


Objective = Exact | SemiDiscrete | WorstCase | Robust


@dataclass(frozen=True)
class Requirements:
    """Constraints of a design beyond the bounds of its gains; None where there is none.

    Attributes
    ----------
    decay : float or None
        The nominal loop must have α ≤ −decay.
    stability_radius : float or None
        Its relative stability radius must not be less.
    input_gain : float or None
        The peak over all frequencies of the gain from a disturbance beside the input to
        the input that feedback demands must not be more: what a disturbance torque of
        amplitude 1 costs in control torque.
    """

    decay: float | None = None
    stability_radius: float | None = None
    input_gain: float | None = None

    def __post_init__(self) -> None:
        for name in ("decay", "stability_radius", "input_gain"):
            value = getattr(self, name)
            if value is not None:
                checked_number(name, value, 0.0, 1e6, open_low=True)

    def __bool__(self) -> bool:
        return any(v is not None for v in (self.decay, self.stability_radius, self.input_gain))


EXACT = Exact()
NO_REQUIREMENTS = Requirements()
