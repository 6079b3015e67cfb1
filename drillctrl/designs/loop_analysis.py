"""What is known of one loop: its abscissa by independent routes, and how sure it is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drillctrl.delay.structure import FeedbackStructure, close_loop
from drillctrl.delay.system import DelaySystem, plant_system
from drillctrl.drilling.plant import Plant
from drillctrl.drilling.point import OperatingPoint
from drillctrl.robustness.margins import with_delay_factor
from drillctrl.spectrum.characteristic import FloatArray
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.roots import Root, dominant_roots, spectral_abscissa
from drillctrl.spectrum.semidiscretization import semidiscretize

DEFAULT_ORDER = 2


@dataclass(frozen=True)
class SpectralRadius:
    """ρ(D) of the semi-discretised loop.

    Attributes
    ----------
    value : float
        ρ(D).
    m, order : int
        Intervals and order of the scheme.
    growth_rate : float
        ln ρ(D)/Δt, to be compared with the spectral abscissa.
    """

    value: float
    m: int
    order: int
    growth_rate: float


@dataclass(frozen=True)
class Certificate:
    """Agreement of the roots found with a count that knows nothing of them.

    Attributes
    ----------
    line : float
        Re s of the line, drawn left of the dominant root.
    counted : int or None
        Roots right of it by the argument principle; None if undecided.
    found : int
        Roots right of it among those computed.
    height : float
        The line was followed up to this |Im s|.
    agrees : bool
        Whether both numbers are the same.
    """

    line: float
    counted: int | None
    found: int
    height: float
    agrees: bool


@dataclass(frozen=True)
class LoopAnalysis:
    """Spectrum of one loop.

    Attributes
    ----------
    spectral_abscissa : float
        α, per unit of time of the system.
    abscissa_error : float
        How far rounding of the coefficients may have moved it.
    stable : bool
        Whether α lies left of zero by more than the error, and the count agrees.
    dominant_roots : tuple of Root
        Those whose real part is within the error, or 1e-6 relative, of α.
    certificate : Certificate
        The count's view.
    """

    spectral_abscissa: float
    abscissa_error: float
    stable: bool
    dominant_roots: tuple[Root, ...]
    certificate: Certificate

    @property
    def settling_time(self) -> float:
        """Time in which exp(αt) falls to 2 %; infinite for an unstable loop."""
        return math.log(50.0) / -self.spectral_abscissa if self.stable else math.inf


def discretised_radius(
    system: DelaySystem, m: int | None = None, order: int = DEFAULT_ORDER
) -> SpectralRadius | None:
    """Return the semi-discretisation's view of a loop; None without delay.

    Parameters
    ----------
    system : DelaySystem
        Any.
    m, order : int, optional
        See `semidiscretize`.
    """
    if not system.delays:
        return None
    scheme = semidiscretize(system, m, order)
    return SpectralRadius(scheme.spectral_radius, scheme.m, scheme.order, scheme.growth_rate)


def analyze_loop(system: DelaySystem) -> LoopAnalysis:
    """Analyse a delay system by roots and count alone."""
    roots = dominant_roots(system)
    certificate = _certify(system, roots)
    top = roots[0]
    error = top.error + 1e-15 * abs(top.rightmost)
    limit = top.rightmost - max(error, 1e-6 * (1.0 + abs(top.rightmost)))
    return LoopAnalysis(
        spectral_abscissa=top.rightmost,
        abscissa_error=error,
        stable=top.rightmost + error < 0.0 and certificate.agrees and top.converged,
        dominant_roots=tuple(root for root in roots if root.rightmost >= limit),
        certificate=certificate,
    )


def _certify(system: DelaySystem, roots: tuple[Root, ...]) -> Certificate:
    """Count right of a line drawn in the widest gap left of the dominant root."""
    floor = roots[0].rightmost - 1.0
    if system.delays:
        floor = roots[0].rightmost - 1.0 / system.max_delay
        # Further left some roots may be known, but not all of them.
        roots = tuple(root for root in roots if root.rightmost > floor)
    # A cluster reaches as far left of its centre as right of it.
    ends = [root.real - max(root.spread, root.error) for root in roots]
    below = [root.rightmost for root in roots[1:]]
    below.append(floor if system.delays else min(floor, ends[-1] - 1.0))
    gaps = [min(ends[: i + 1]) - lower for i, lower in enumerate(below)]
    widest = int(np.argmax(gaps))
    line = below[widest] + 0.5 * gaps[widest]
    count = count_right_of(system, line)
    found = sum(root.multiplicity * (2 if root.imag > 0 else 1) for root in roots[: widest + 1])
    return Certificate(line, count.count, found, count.height, count.count == found)


@dataclass(frozen=True)
class Fragility:
    """Spectral abscissa when something is not as designed.

    Attributes
    ----------
    rounded_gains : float
        With the gains rounded to three significant digits.
    psi_low, psi_high : float or None
        With ψ 5 % lower or higher; None where the plant has no operating point.
    delay_low, delay_high : float or None
        With all delays 2 % shorter or longer; None without delays.
    """

    rounded_gains: float
    psi_low: float | None
    psi_high: float | None
    delay_low: float | None
    delay_high: float | None

    @property
    def worst(self) -> float:
        """The largest of them."""
        values = (self.psi_low, self.psi_high, self.delay_low, self.delay_high)
        return max(self.rounded_gains, *(value for value in values if value is not None))


def round_to_digits(values: FloatArray, digits: int) -> FloatArray:
    """Round every value to a number of significant digits."""
    rounded = [float(f"{value:.{digits - 1}e}") for value in values.ravel()]
    return np.array(rounded).reshape(values.shape)


def fragility(
    plant: DelaySystem,
    perturbed: Mapping[str, DelaySystem],
    feedback: FeedbackStructure,
    K1: FloatArray,
    K2: FloatArray,
) -> Fragility:
    """Return the abscissa of a loop under small changes of gains, rock and delay.

    Parameters
    ----------
    plant : DelaySystem
        As designed for.
    perturbed : mapping
        What `perturbed_plants` returns.
    feedback, K1, K2 : FeedbackStructure and arrays
        The feedback.
    """
    values = {
        name: spectral_abscissa(close_loop(other, feedback, K1, K2))
        for name, other in perturbed.items()
    }
    rounded = close_loop(plant, feedback, round_to_digits(K1, 3), round_to_digits(K2, 3))
    names = ("psi_low", "psi_high", "delay_low", "delay_high")
    return Fragility(spectral_abscissa(rounded), *(values.get(name) for name in names))


def perturbed_plants(
    plant: DelaySystem,
    point: OperatingPoint | None = None,
    physics: Plant | None = None,
) -> dict[str, DelaySystem]:
    """Return plants by the names of `Fragility`'s fields, as far as they exist.

    Parameters
    ----------
    plant : DelaySystem
        The plant as assumed.
    point : OperatingPoint, optional
        Where it drills; without it, ψ cannot change.
    physics : Plant, optional
        The plant's equations; by default `dimensionless_plant`.
    """
    changed = {}
    if point is not None:
        for name, factor in (("psi_low", 0.95), ("psi_high", 1.05)):
            rock = point.with_changes(psi=factor * point.psi)
            changed[name] = plant_system(rock, plant.input_names, physics)
    if plant.delays:
        changed["delay_low"] = with_delay_factor(plant, 0.98)
        changed["delay_high"] = with_delay_factor(plant, 1.02)
    return changed
