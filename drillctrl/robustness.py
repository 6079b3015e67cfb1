"""How far a stable loop is from instability: matrices, delays and operating point."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.optimize

from drillctrl.delay_system import DelaySystem
from drillctrl.errors import InputError, checked_number
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.characteristic import FloatArray
from drillctrl.spectrum.roots import spectral_abscissa

_GAP = 1e-3


@dataclass(frozen=True)
class StabilityRadius:
    """Smallest relative size of a perturbation of the matrices that destabilises.

    Attributes
    ----------
    value : float
        ε: some δA0, δAi with ‖δA0‖ ≤ w0 ε, ‖δAi‖ ≤ wi ε put a root on the axis; 0 for an
        unstable loop.
    lower_bound : float
        No smaller perturbation does, by a Lipschitz bound over all frequencies; −inf where
        there is no such bound.
    frequency : float
        ω at which the axis is reached.
    """

    value: float
    lower_bound: float
    frequency: float


@dataclass(frozen=True)
class DelayMargin:
    """Delays, as multiples of the present ones, at which the loop loses stability.

    Attributes
    ----------
    shorter, longer : float
        Nearest critical factors below and above 1; 0 and inf where there is none.
    frequency_shorter, frequency_longer : float
        Frequencies of the roots that cross there; NaN where there is none.
    """

    shorter: float
    longer: float
    frequency_shorter: float
    frequency_longer: float


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


def _sigma(system: DelaySystem, s: npt.ArrayLike) -> FloatArray:
    values = np.linalg.svd(characteristic.matrix(system, s), compute_uv=False)
    return np.asarray(values[..., -1])


def _line_minimum(system: DelaySystem, line: float, gap: float) -> tuple[float, float, float]:
    """Return min over ω of σ_min(Δ(line + iω)), a lower bound of it, and where it is.

    σ_min changes by no more than the norm of the change of Δ, which is at most
    1 + Σ τi ‖Ai‖ exp(−line τi) per unit of ω: intervals that cannot hold a lower value than
    the best found are dropped, the others halved. Beyond Σ ‖Ai‖ + best it only grows.
    """
    norms = [float(np.linalg.norm(a, 2)) for a in system.delayed]
    decay = [math.exp(-line * tau) for tau in system.delays]
    slope = 1.0 + sum(
        tau * norm * e for tau, norm, e in zip(system.delays, norms, decay, strict=True)
    )
    total = float(np.linalg.norm(system.A0, 2)) + abs(line)
    total += sum(norm * e for norm, e in zip(norms, decay, strict=True))
    start = float(_sigma(system, np.array([line + 0j]))[0])
    omega = np.linspace(0.0, total + start, 257)
    sigma = _sigma(system, line + 1j * omega)
    left, right = omega[:-1], omega[1:]
    at_left, at_right = sigma[:-1], sigma[1:]
    best, where = float(sigma.min()), float(omega[int(sigma.argmin())])
    lowest = 0.0
    for _ in range(60):
        floor = 0.5 * (at_left + at_right - slope * (right - left))
        alive = floor < best * (1.0 - gap)
        if not alive.any():
            lowest = best * (1.0 - gap)
            break
        if alive.sum() > 200_000:
            lowest = max(0.0, float(floor.min()))
            break
        left, right, at_left, at_right = (v[alive] for v in (left, right, at_left, at_right))
        middle = 0.5 * (left + right)
        at_middle = _sigma(system, line + 1j * middle)
        if at_middle.min() < best:
            best, where = float(at_middle.min()), float(middle[int(at_middle.argmin())])
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
        at_left, at_right = (
            np.concatenate([at_left, at_middle]),
            np.concatenate([at_middle, at_right]),
        )
    width = 1e-2 * (1.0 + where)
    local = scipy.optimize.minimize_scalar(
        lambda w: float(_sigma(system, np.array([line + 1j * w]))[0]),
        bounds=(max(0.0, where - width), where + width),
        method="bounded",
        options={"xatol": 1e-10},
    )
    if local.fun < best:
        best, where = float(local.fun), float(local.x)
    return best, min(lowest, best), where


def stability_radius(
    system: DelaySystem, weights: Sequence[float] | None = None
) -> StabilityRadius:
    """Return the complex stability radius of a loop.

    Parameters
    ----------
    system : DelaySystem
        The loop.
    weights : sequence of float, optional
        w0, w1, … of A0 and each Ai; by default their norms, so that ε is a relative error.

    Notes
    -----
    On the axis the perturbations of all matrices together fill the ball of radius
    ε Σ wi, so ε = min over ω of σ_min(Δ(iω)) / Σ wi (Hinrichsen and Pritchard).
    """
    total = float(_weights(system, weights).sum())
    if spectral_abscissa(system) >= 0.0:
        return StabilityRadius(0.0, 0.0, math.nan)
    value, lowest, where = _line_minimum(system, 0.0, _GAP)
    return StabilityRadius(value / total, lowest / total, where)


def real_stability_radius(system: DelaySystem, points: int = 600) -> StabilityRadius:
    """Return the real stability radius for relative perturbations of A0 alone.

    Real δA0 are fewer than complex ones, so it is no smaller than the complex radius with
    the weights of A0 alone.

    Notes
    -----
    The inner problem is the formula of Qiu, Bernhardsson, Rantzer, Davison, Young and Doyle
    (1995), unimodal in its parameter γ. The frequency is scanned and refined: the value is
    attained, its globality is not guaranteed, so the lower bound is −inf.
    """
    if spectral_abscissa(system) >= 0.0:
        return StabilityRadius(0.0, -math.inf, math.nan)
    norm = float(np.linalg.norm(system.A0, 2))

    def inverse_radius(omega: float) -> float:
        m = np.linalg.inv(characteristic.matrix(system, 1j * omega))

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
    return StabilityRadius(1.0 / best[0] / norm, -math.inf, best[1])


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
    size = checked_number("epsilon", epsilon, 0.0)
    w = _weights(system, weights)
    alpha = spectral_abscissa(system)
    if size == 0.0:
        return alpha

    def excess(line: float) -> float:
        allowed = w[0] + float(w[1:] @ np.exp(-line * np.array(system.delays)))
        return float(_line_minimum(system, line, 1e-2)[0] - size * allowed)

    low, high = alpha, alpha + size * float(w.sum()) + 1e-9
    while excess(high) < 0.0:
        low, high = high, alpha + 2.0 * (high - alpha)
    return float(scipy.optimize.brentq(excess, low + 1e-13, high, xtol=1e-11))


def delay_margin(system: DelaySystem) -> DelayMargin:
    """Return by how much the delay may be wrong before a root reaches the axis.

    Parameters
    ----------
    system : DelaySystem
        A stable loop with exactly one delay.

    Raises
    ------
    InputError
        If the loop has not exactly one delay or is unstable.

    Notes
    -----
    With z = exp(−iωτ) a root on the axis makes both A0 + zA1 and its conjugate singular
    against ±iω, so their Kronecker sum is singular: the quadratic eigenvalue problem
    z²(A1⊗I) + z(A0⊗I + I⊗A0) + I⊗A1 has all critical z on the unit circle (Chen, Gu and
    Nett 1995). No crossing can be stepped over.
    """
    if len(system.delays) != 1:
        raise InputError("delays", system.delays, "exactly one")
    if spectral_abscissa(system) >= 0.0:
        raise InputError("system", "an unstable loop", "stable")
    tau = system.delays[0]
    factors = [(crossing / tau, omega) for crossing, omega in _critical_delays(system)]
    below = max((f for f in factors if f[0] < 1.0), default=(0.0, math.nan))
    above = min((f for f in factors if f[0] > 1.0), default=(math.inf, math.nan))
    return DelayMargin(below[0], above[0], below[1], above[1])


def _critical_delays(system: DelaySystem) -> list[tuple[float, float]]:
    """Return (τ, ω) of the crossings with the smallest positive τ, up to ten times now."""
    a0, a1 = system.A0, system.delayed[0]
    eye = np.eye(system.order)
    size = system.order**2
    m2, m0 = np.kron(a1, eye), np.kron(eye, a1)
    m1 = np.kron(a0, eye) + np.kron(eye, a0)
    zero, one = np.zeros((size, size)), np.eye(size)
    pencil = np.block([[zero, one], [-m0, -m1]]), np.block([[one, zero], [zero, m2]])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        z = scipy.linalg.eigvals(*pencil)
    z = z[np.isfinite(z)]
    candidates = z[np.abs(np.abs(z) - 1.0) < 1e-4]
    found: list[tuple[float, float]] = []
    longest = 10.0 * system.delays[0]
    for value in candidates:
        for s in np.linalg.eigvals(a0 + value * a1):
            if abs(s.real) > 1e-3 * (1.0 + abs(s)) or s.imag < 1e-9:
                continue
            pair = _sharpen_crossing(a0, a1, float(s.imag), float(np.angle(value)))
            if pair is None:
                continue
            omega, angle = pair
            tau = (-angle % (2 * math.pi)) / omega
            while tau < longest:
                if tau > 0.0:
                    found.append((tau, omega))
                tau += 2 * math.pi / omega
    return found


def _sharpen_crossing(
    a0: FloatArray, a1: FloatArray, omega: float, angle: float
) -> tuple[float, float] | None:
    """Solve det(iωI − A0 − exp(iφ)A1) = 0 for real ω, φ from a first guess."""
    eye = np.eye(len(a0))
    for _ in range(40):
        z = np.exp(1j * angle)
        left, sizes, right = np.linalg.svd(1j * omega * eye - a0 - z * a1)
        u, v = left[:, -1].conj(), right[-1].conj()
        # The smallest singular value, as u Δ v, changes by u (∂Δ) v.
        by_omega, by_angle = 1j * (u @ v), -1j * z * (u @ a1 @ v)
        jacobian = np.array([[by_omega.real, by_angle.real], [by_omega.imag, by_angle.imag]])
        if abs(np.linalg.det(jacobian)) < 1e-14:
            return None
        step = np.linalg.solve(jacobian, [-sizes[-1], 0.0])
        omega, angle = omega + float(step[0]), angle + float(step[1])
        if np.abs(step).max() < 1e-13 * (1.0 + abs(omega)):
            return (omega, angle) if omega > 0.0 else None
    return None


def parameter_margin(
    loop_at: Callable[[float], DelaySystem], limit: float = 1.0, points: int = 200
) -> ParameterMargin:
    """Return the relative errors of a parameter between which a loop stays stable.

    Parameters
    ----------
    loop_at : callable
        Returns the loop when the parameter is (1 + e) times its nominal value, e > −1.
    limit : float
        Largest relative increase to look at.
    points : int
        Steps in either direction; each change of sign is bisected to 1e-12.

    Raises
    ------
    InputError
        If the loop is unstable at the nominal value.
    """
    top = checked_number("limit", limit, 0.0, 1e3, open_low=True)

    def alpha(error: float) -> float:
        return spectral_abscissa(loop_at(error))

    if alpha(0.0) >= 0.0:
        raise InputError("loop", "unstable at the nominal value", "stable")

    def first(errors: FloatArray, none: float) -> float:
        last = 0.0
        for error in errors:
            if alpha(float(error)) >= 0.0:
                return float(scipy.optimize.brentq(alpha, last, float(error), xtol=1e-12))
            last = float(error)
        return none

    down = -np.linspace(0.0, 1.0, points + 1)[1:-1]
    up = np.linspace(0.0, top, points + 1)[1:]
    return ParameterMargin(first(down, -1.0), first(up, top), top, max(top, 1.0) / points)


def with_delay_factor(system: DelaySystem, factor: float) -> DelaySystem:
    """Return the system with every delay multiplied by ``factor`` > 0."""
    checked_number("factor", factor, 0.0, open_low=True)
    return replace(system, delays=tuple(tau * factor for tau in system.delays))
