"""What a design minimises, and what it must not give up for it: small values that compose."""

from __future__ import annotations

from dataclasses import dataclass

from drillctrl.base.errors import checked_integer, checked_number

_LIMITS = ("decay", "stability_radius", "input_gain", "h_infinity")


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


@dataclass(frozen=True)
class WorstLoop:
    """The largest spectral abscissa over several loops, which the caller supplies."""

    name = "worst-case"


@dataclass(frozen=True)
class HInfinity:
    """The H∞ norm: the largest gain over all frequencies from some inputs to some outputs.

    Attributes
    ----------
    inputs, outputs : tuple of str
        Of the closed loop, by name, those that the structure drives among the inputs; all of
        them where none are named. Outputs of several units add up as numbers: name those of one.
    """

    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    name = "h-infinity"


Objective = Exact | SemiDiscrete | WorstLoop | Robust | HInfinity


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
    h_infinity : float or None
        The H∞ norm must not be more.
    between : HInfinity
        Between which inputs and outputs it is taken.
    """

    decay: float | None = None
    stability_radius: float | None = None
    input_gain: float | None = None
    h_infinity: float | None = None
    between: HInfinity = HInfinity()

    def __post_init__(self) -> None:
        for name in _LIMITS:
            value = getattr(self, name)
            if value is not None:
                checked_number(name, value, 0.0, 1e6, open_low=True)

    def __bool__(self) -> bool:
        return any(getattr(self, name) is not None for name in _LIMITS)


EXACT = Exact()
NO_REQUIREMENTS = Requirements()
