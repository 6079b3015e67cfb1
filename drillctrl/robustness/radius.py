"""Distance of a stable loop to instability under errors of its matrices and delays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem
from drillctrl.robustness.axis import AxisMinimum, line_minimum, weighted_minimum
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.roots import spectral_abscissa

# Relative distances of the lower bound, over frequencies and over frequencies and delays.
_GAP = 1e-3
_GAP_WITH_DELAYS = 1e-2


@dataclass(frozen=True)
class StabilityRadius:
    """Smallest relative size of a perturbation that destabilises.

    Attributes
    ----------
    value : float
        ε: some δA0, δAi with ‖δA0‖ ≤ w0 ε, ‖δAi‖ ≤ wi ε, and some factor of the delays within
        1 ± wτ ε, put a root on the axis; 0 for an unstable loop.
    lower_bound : float
        No smaller perturbation does, by a Lipschitz bound over all frequencies and factors;
        −inf where there is no such bound.
    frequency : float
        ω at which the axis is reached.
    delay_factor : float
        By what the delays are multiplied there.
    """

    value: float
    lower_bound: float
    frequency: float
    delay_factor: float = 1.0


def _weights(system: DelaySystem, weights: Sequence[float] | None) -> FloatArray:
    matrices = (system.A0, *system.delayed)
    if weights is None:
        return np.array([np.linalg.norm(matrix, 2) for matrix in matrices])
    given = np.asarray(weights, dtype=float)
    if given.shape != (len(matrices),) or not np.isfinite(given).all() or (given < 0).any():
        raise InputError("weights", list(weights), f"{len(matrices)} numbers ≥ 0")
    if not given.any():
        raise InputError("weights", list(weights), "not all zero")
    return given


@checks_kinds
def stability_radius(
    system: DelaySystem, weights: Sequence[float] | None = None, delay_weight: float = 0.0
) -> StabilityRadius:
    """Return the stability radius of a loop for complex errors of its matrices.

    Parameters
    ----------
    system : DelaySystem
        The loop.
    weights : sequence of float, optional
        w0, w1, … of A0 and each Ai; by default their norms, so that ε is a relative error.
    delay_weight : float
        wτ: the delays may be wrong as well, by a common relative error of up to wτ ε.

    Raises
    ------
    InputError
        If a weight is negative or not finite, or all weights of the matrices are zero
        (`delay_margin` answers for the delays alone).

    Notes
    -----
    On the axis the perturbations of all matrices together fill the ball of radius
    ε Σ wi, so ε = min over ω of σ_min(Δ(iω)) / Σ wi (Hinrichsen and Pritchard); with errors
    of the delays it is the minimum over ω and f of the larger of that and abs(f − 1) / wτ.
    """
    total = float(_weights(system, weights).sum())
    turn = checked_number("delay_weight", delay_weight, 0.0)
    if spectral_abscissa(system) >= 0.0:
        return StabilityRadius(0.0, 0.0, math.nan)
    line = line_minimum(system, 0.0, _GAP)
    least = AxisMinimum(line.value / total, line.lower_bound / total, line.frequency)
    if turn > 0.0 and system.delays:
        least = weighted_minimum(system, total, turn, least, _GAP_WITH_DELAYS)
    return StabilityRadius(least.value, least.lower_bound, least.frequency, least.factor)


@checks_kinds
def real_stability_radius(
    system: DelaySystem, weights: Sequence[float] | None = None, points: int = 600
) -> StabilityRadius:
    """Return the stability radius of a loop for real errors of its matrices.

    Parameters
    ----------
    system : DelaySystem
        The loop.
    weights : sequence of float, optional
        w0, w1, … of A0 and each Ai; by default their norms.
    points : int
        Frequencies of the scan that is refined at its best point.

    Notes
    -----
    Errors are measured together: ε = ‖[δA0/w0, δA1/w1, …]‖. Measured one by one, as
    `stability_radius` does, the radius lies between ε/√k and ε for k nonzero weights.
    With M(iω) = [w0 I; w1 exp(−iωτ1) I; …] Δ(iω)⁻¹ it is the formula of Qiu, Bernhardsson,
    Rantzer, Davison, Young and Doyle (1995), whose inner problem is unimodal in γ. The
    frequency is scanned and refined: the value is attained, its globality is not
    guaranteed, so the lower bound is −inf.
    """
    w = _weights(system, weights)
    points = checked_integer("points", points, 2, 100_000)
    if spectral_abscissa(system) >= 0.0:
        return StabilityRadius(0.0, -math.inf, math.nan)
    delays = np.array((0.0, *system.delays))[w > 0.0]
    w = w[w > 0.0]

    def inverse_radius(omega: float) -> float:
        inverse = np.linalg.inv(characteristic.matrix(system, 1j * omega))
        m = np.kron((w * np.exp(-1j * omega * delays))[:, None], inverse)

        def second(log_gamma: float) -> float:
            g = math.exp(log_gamma)
            block = np.block([[m.real, -g * m.imag], [m.imag / g, m.real]])
            return float(np.linalg.svd(block, compute_uv=False)[1])

        if np.abs(m.imag).max() < 1e-14 * np.abs(m.real).max():
            return float(np.linalg.norm(m.real, 2))
        low = scipy.optimize.minimize_scalar(second, bounds=(-12.0, 0.0), method="bounded")
        return float(low.fun)

    reach = characteristic.magnitude_bound(system, 0.0)
    grid = np.concatenate([[0.0], np.geomspace(1e-3 * reach, reach, points)])
    values = np.array([inverse_radius(w) for w in grid])
    top = int(values.argmax())
    low, high = grid[max(top - 1, 0)], grid[min(top + 1, points)]
    fine = scipy.optimize.minimize_scalar(
        lambda w: -inverse_radius(w), bounds=(low, high), method="bounded"
    )
    best = max((float(values[top]), float(grid[top])), (-float(fine.fun), float(fine.x)))
    return StabilityRadius(1.0 / best[0], -math.inf, best[1])


@checks_kinds
def pseudospectral_abscissa(
    system: DelaySystem, epsilon: float, weights: Sequence[float] | None = None
) -> float:
    """Return the largest real part that roots can reach under perturbations of size ε.

    Parameters
    ----------
    system : DelaySystem
        The loop.
    epsilon : float
        Size of the perturbations, ≥ 0.
    weights : sequence of float, optional
        As in `stability_radius`.

    Notes
    -----
    Right of the spectral abscissa the maximum of ‖Δ⁻¹‖ over a vertical line falls from line
    to line, by the maximum principle, and so do the weights: bisection finds the line on
    which σ_min(Δ) first reaches ε Σ wi exp(−Re s τi).
    """
    size = checked_number("epsilon", epsilon, 0.0, 1e100)
    w = _weights(system, weights)
    alpha = spectral_abscissa(system)
    if size == 0.0:
        return alpha

    def excess(line: float) -> float:
        allowed = w[0] + float(w[1:] @ np.exp(-line * np.array(system.delays)))
        return float(line_minimum(system, line, 1e-2).value - size * allowed)

    low, high = alpha, alpha + size * float(w.sum()) + 1e-9
    if excess(low + 1e-13) >= 0.0:
        # Perturbations of this size are lost in rounding.
        return alpha
    while excess(high) < 0.0:
        low, high = high, alpha + 2.0 * (high - alpha)
    return float(scipy.optimize.brentq(excess, low + 1e-13, high, xtol=1e-11))
