"""What is known of one loop: its abscissa by independent routes, and how sure it is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.multiplicity import Root
from drillctrl.spectrum.roots import known_roots
from drillctrl.spectrum.semidiscretization import semidiscretize

DEFAULT_ORDER = 2
# Roots that are looked at, the rightmost; hundreds would say no more.
_MOST = 24


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


@checks_kinds
def analyze_loop(system: DelaySystem) -> LoopAnalysis:
    """Analyse a delay system by roots and count alone."""
    roots, floor = known_roots(system, _MOST)
    certificate = _certify(system, roots, floor)
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


def _certify(system: DelaySystem, roots: tuple[Root, ...], floor: float) -> Certificate:
    """Count right of a line drawn in the widest gap left of the dominant root."""
    if system.delays:
        # Further left some roots may be known, but not all of them.
        roots = tuple(root for root in roots if root.rightmost > floor)
    # A cluster reaches as far left of its centre as right of it.
    ends = [root.real - max(root.spread, root.error) for root in roots]
    below = [root.rightmost for root in roots[1:]]
    below.append(floor if system.delays else ends[-1] - 1.0)
    gaps = [min(ends[: i + 1]) - lower for i, lower in enumerate(below)]
    widest = int(np.argmax(gaps))
    line = below[widest] + 0.5 * gaps[widest]
    count = count_right_of(system, line)
    found = sum(root.multiplicity * (2 if root.imag > 0 else 1) for root in roots[: widest + 1])
    return Certificate(line, count.count, found, count.height, count.count == found)
