"""By how much the delays or one parameter may be wrong before a loop loses stability."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
import scipy.optimize

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem
from drillctrl.robustness.axis import crossings
from drillctrl.spectrum.critical import critical_points
from drillctrl.spectrum.roots import spectral_abscissa

LONGEST_DELAYS = 10.0
_AT_ONCE = 50


@dataclass(frozen=True)
class DelayMargin:
    """Delays, as multiples of the present ones, at which the loop loses stability.

    Attributes
    ----------
    shorter, longer : float
        Nearest critical factors below and above 1; 0 and inf where there is none.
    frequency_shorter, frequency_longer : float
        Frequencies of the roots that cross there; NaN where there is none.
    limit : float
        Factors up to this were looked at.
    """

    shorter: float
    longer: float
    frequency_shorter: float
    frequency_longer: float
    limit: float = math.inf


@dataclass(frozen=True)
class ParameterMargin:
    """Relative errors of one parameter between which the loop stays stable.

    Attributes
    ----------
    lower, upper : float
        Nearest relative changes that destabilise; −1 or ``limit`` if none does before.
    limit : float
        Largest relative increase looked at.
    resolution : float
        An unstable window narrower than this (relative) may have been stepped over.
    """

    lower: float
    upper: float
    limit: float
    resolution: float


@checks_kinds
def delay_margin(system: DelaySystem) -> DelayMargin:
    """Return by how much the delays may be wrong before a root reaches the axis.

    Parameters
    ----------
    system : DelaySystem
        A stable loop with delays; several are multiplied by a common factor.

    Raises
    ------
    InputError
        If the loop has no delay or is unstable.
    ArithmeticError
        If crossings of the axis cannot be told apart.

    Notes
    -----
    With one delay all frequencies at which some delay puts a root on the axis come from one
    eigenvalue problem or a sweep of the phase (`drillctrl.spectrum.critical`). With several
    delays, boxes of frequency and factor that a Lipschitz bound clears of roots are removed, up to
    ten times the delays. No crossing is stepped over.
    """
    if not system.delays:
        raise InputError("delays", system.delays, "at least one")
    if spectral_abscissa(system) >= 0.0:
        raise InputError("system", "an unstable loop", "stable")
    if len(system.delays) == 1:
        limit, factors = math.inf, list(_nearest_factors(system))
    else:
        limit = LONGEST_DELAYS
        factors = crossings(system, 0.0, 1.0) + crossings(system, 1.0, limit)
    below = max((f for f in factors if f[0] < 1.0), default=(0.0, math.nan))
    above = min((f for f in factors if f[0] > 1.0), default=(math.inf, math.nan))
    return DelayMargin(below[0], above[0], below[1], above[1], limit)


def _nearest_factors(system: DelaySystem) -> Iterator[tuple[float, float]]:
    """Yield (f, ω): for every critical pair of ω and angle the nearest delays of either side."""
    system = system.balanced
    (left, right), tau = system.factors[0], system.delays[0]
    _, frequencies, phases, _ = critical_points(system.A0[None], left[None], right[None])
    for omega, phase in zip(frequencies.tolist(), phases.tolist(), strict=True):
        turn = 2.0 * math.pi / (omega * tau)
        first = phase / (omega * tau)
        below = first + turn * math.floor((1.0 - first) / turn)
        yield from ((factor, omega) for factor in (below, below + turn) if factor > 0.0)


@checks_kinds
def parameter_margin(
    loop_at: Callable[[float], DelaySystem],
    limit: float = 1.0,
    points: int = 200,
    abscissas: Callable[[FloatArray], FloatArray] | None = None,
) -> ParameterMargin:
    """Return the relative errors of a parameter between which a loop stays stable.

    Parameters
    ----------
    loop_at : callable
        Returns the loop when the parameter is (1 + e) times its nominal value, e > −1.
    limit : float
        Largest relative increase to look at.
    points : int
        Steps in either direction; each change of sign is bisected to 1e-12, and wherever α
        has a maximum among the steps it is sought between them.
    abscissas : callable, optional
        α of the loops at many errors at once, where there is a faster way to it.

    Raises
    ------
    InputError
        If the loop is unstable at the nominal value.
    """
    top = checked_number("limit", limit, 0.0, 1e3, open_low=True)

    def alpha(error: float) -> float:
        return spectral_abscissa(loop_at(error))

    def one_by_one(errors: FloatArray) -> FloatArray:
        return np.array([alpha(error) for error in errors.tolist()])

    if alpha(0.0) >= 0.0:
        raise InputError("loop", "unstable at the nominal value", "stable")
    several = abscissas or one_by_one
    points = checked_integer("points", points, 1, 100_000)
    down = -np.linspace(0.0, 1.0, points + 1)[:-1]
    up = np.linspace(0.0, top, points + 1)
    lower, upper = (_first_unstable(alpha, several, errors) for errors in (down, up))
    return ParameterMargin(
        -1.0 if lower is None else lower,
        top if upper is None else upper,
        top,
        max(top, 1.0) / points,
    )


def _first_unstable(
    alpha: Callable[[float], float],
    several: Callable[[FloatArray], FloatArray],
    errors: FloatArray,
) -> float | None:
    """Return the error nearest to the first at which α reaches 0; None if it does not."""
    values: list[float] = []
    for index, error in enumerate(errors):
        if index >= len(values):
            # A loop that is lost soon needs no look at what lies far off.
            values += several(errors[index : index + _AT_ONCE]).tolist()
        if index == 0:
            continue
        stable, unstable = float(errors[index - 1]), float(error)
        if index > 1 and values[index - 1] >= max(values[index - 2], values[index]):
            before = float(errors[index - 2])
            ends = sorted((before, unstable))
            peak = scipy.optimize.minimize_scalar(
                lambda e: -alpha(float(e)), bounds=(ends[0], ends[1]), method="bounded"
            )
            if peak.fun <= 0.0:
                return float(scipy.optimize.brentq(alpha, before, float(peak.x), xtol=1e-12))
        if values[index] >= 0.0:
            return float(scipy.optimize.brentq(alpha, stable, unstable, xtol=1e-12))
    return None


def with_delay_factor(system: DelaySystem, factor: float) -> DelaySystem:
    """Return the system with every delay multiplied by ``factor`` > 0."""
    checked_number("factor", factor, 0.0, open_low=True)

    def longer(delays: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(factor * tau for tau in delays)

    return replace(
        system,
        delays=longer(system.delays),
        input_delays=longer(system.input_delays),
        output_delays=longer(system.output_delays),
        feedback_delay=factor * system.feedback_delay,
    )
