"""Measures of a loop as functions of its gains, each with a gradient.

All that concern robustness come from the smallest singular value of Δ on a vertical line;
its singular vectors give the gradient. The line is looked at around the rightmost roots
only: here speed counts, and what is printed of a design is computed again with bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.closing import close_loop, loop_channels, with_channels
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.semidiscretization import SemiDiscretization, semidiscretize
from drillctrl.synthesis.descent import Objective
from drillctrl.synthesis.family import LoopFamily

_ROOTS = 12
_FAN = np.array([-2.0, -1.0, -0.4, 0.0, 0.4, 1.0, 2.0])
_REFINED = 2
_STEP = 1e-7


@dataclass(frozen=True, eq=False)
class _Nearest:
    """Where σ_min(Δ) is smallest on a line: value, place, and singular vectors u, v."""

    value: float
    s: complex
    left: ComplexArray
    right: ComplexArray


def worst_case(families: Sequence[LoopFamily]) -> Objective:
    """Return the largest spectral abscissa over several families of loops, as an objective.

    Parameters
    ----------
    families : sequence of LoopFamily
        The same structure around different plants.
    """

    def objective(gains: FloatArray) -> tuple[float, FloatArray]:
        # Only the worst has to say how it changes.
        return max(families, key=lambda family: family.value(gains)).abscissa(gains)

    return objective


def growth_rate(family: LoopFamily, m: int, order: int) -> Objective:
    """Return ln ρ(D)/Δt of the semi-discretised loop, as an objective.

    Notes
    -----
    With y = (x, S x/z, S x/z², …) an eigenvalue z of D satisfies
    (zI − P − Σ Rk S z⁻ᵏ) x = 0, so its derivative needs only the small matrices of one step.
    """
    system, feedback = family.system, family.feedback

    def scheme(gains: FloatArray) -> SemiDiscretization:
        return semidiscretize(close_loop(system, feedback, *feedback.gains(gains)), m, order)

    def small(now: SemiDiscretization, z: complex) -> ComplexArray:
        terms = [factor @ now.signals * z**-k for k, factor in now.terms]
        return np.asarray(now.P + np.sum(terms, axis=0), dtype=complex)

    def objective(gains: FloatArray) -> tuple[float, FloatArray]:
        here = scheme(gains)
        z = complex(here.multipliers()[0])
        radius = max(abs(z), 1e-300)
        value = float(np.log(radius) / here.step)
        delta = z * np.eye(here.P.shape[0]) - small(here, z)
        u, _, vh = np.linalg.svd(delta)
        y, x = u[:, -1].conj(), vh[-1].conj()
        lags = [k * factor @ here.signals * z ** (-k - 1) for k, factor in here.terms]
        slope = y @ (np.eye(here.P.shape[0]) + np.sum(lags, axis=0)) @ x
        gradient = np.zeros(gains.size)
        for j in range(gains.size):
            step = _STEP * (1.0 + abs(gains[j]))
            moved = small(scheme(gains + step * np.eye(gains.size)[j]), z)
            change = y @ (moved - small(here, z)) @ x / step
            with np.errstate(divide="ignore", invalid="ignore"):
                gradient[j] = float((change / slope / z).real / here.step)
        return value, np.where(np.isfinite(gradient), gradient, 0.0)

    return objective


def plant_weights(family: LoopFamily) -> FloatArray:
    """Return the norms of A0 and of each Ai of the plant, shape (1 + number of delays,)."""
    matrices = (family.system.A0, *family.system.delayed)
    return np.array([np.linalg.norm(matrix, 2) for matrix in matrices])


def _frequencies(family: LoopFamily, gains: FloatArray, line: float) -> FloatArray:
    roots = family.eigenvalues(gains)
    roots = roots[roots.imag >= 0.0][:_ROOTS]
    width = np.abs(roots.real - line)[:, None] + 1e-9
    fan = roots.imag[:, None] + width * _FAN
    return np.unique(np.concatenate([[0.0], np.abs(fan).ravel()]))


def _sigma(family: LoopFamily, gains: FloatArray, line: float, omega: FloatArray) -> FloatArray:
    delta = family.characteristic_matrix(np.asarray(line + 1j * omega), gains)
    return np.asarray(np.linalg.svd(delta, compute_uv=False)[:, -1])


def _nearest(family: LoopFamily, gains: FloatArray, line: float) -> _Nearest:
    """Minimise σ_min(Δ(line + iω)) over ω ≥ 0, near the rightmost roots."""
    omega = _frequencies(family, gains, line)
    where, _ = _lowest(lambda points: _sigma(family, gains, line, points), omega)
    s = complex(line, where)
    u, size, vh = np.linalg.svd(family.characteristic_matrix(np.array([s]), gains)[0])
    return _Nearest(float(size[-1]), s, u[:, -1].conj(), vh[-1].conj())


def _lowest(function: Callable[[FloatArray], FloatArray], omega: FloatArray) -> tuple[float, float]:
    """Refine the lowest samples of a function of the frequency between their neighbours."""
    values = function(omega)
    inner = np.r_[np.inf, values, np.inf]
    dips = np.flatnonzero((inner[1:-1] <= inner[:-2]) & (inner[1:-1] <= inner[2:]))
    dips = np.asarray(dips[np.argsort(values[dips], kind="stable")[:_REFINED]])
    best = float(omega[dips[0]]), float(values[dips[0]])
    for i in dips.tolist():
        low, high = omega[max(i - 1, 0)], omega[min(i + 1, omega.size - 1)]
        found = scipy.optimize.minimize_scalar(
            lambda w: float(function(np.array([w]))[0]),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 1e-9 * (1.0 + high), "maxiter": 40},
        )
        if found.fun < best[1]:
            best = float(found.x), float(found.fun)
    return best


def _slopes(family: LoopFamily, at: _Nearest) -> FloatArray:
    """Return ∂σ_min/∂g at a place: −Re Σ Sij (u bi)(ci(s) v)."""
    seen = family.seen_at(np.array([at.s]))[0]
    entries = -((at.left @ family.drive) * (seen @ at.right)).real
    return np.asarray(entries @ family.spread)


def distance(family: LoopFamily) -> Objective:
    """Return the relative stability radius, continued by −α where the loop is unstable."""
    weight = float(plant_weights(family).sum())

    def objective(gains: FloatArray) -> tuple[float, FloatArray]:
        alpha, slope = family.abscissa(gains)
        if alpha >= 0.0:
            return -alpha / weight, -slope / weight
        at = _nearest(family, gains, 0.0)
        return at.value / weight, _slopes(family, at) / weight

    return objective


def pseudospectral(family: LoopFamily, epsilon: float) -> Objective:
    """Return the ε-pseudospectral abscissa for relative errors of the plant's matrices."""
    weights, delays = plant_weights(family), np.array(family.system.delays)

    def allowed(line: float) -> tuple[float, float]:
        """Return ε Σ wi exp(−line τi) and its derivative."""
        terms = epsilon * weights[1:] * np.exp(-line * delays)
        return epsilon * float(weights[0]) + float(terms.sum()), -float(terms @ delays)

    def objective(gains: FloatArray) -> tuple[float, FloatArray]:
        alpha, gradient = family.abscissa(gains)
        loop = family.loop(gains)
        line = alpha + epsilon * float(weights.sum())
        for attempt in range(8):
            omega = _frequencies(family, gains, line)
            sigma = _sigma(family, gains, line, omega)
            lowest = int(np.argmin(sigma))
            if attempt and sigma[lowest] > allowed(line)[0] * (1.0 - 1e-9):
                break
            frequency = float(omega[lowest])
            for _ in range(40):
                at, turn = _settled(family, gains, line, frequency)
                limit, fall = allowed(line)
                by_s = characteristic.derivative(loop, np.array([at.s]))[0]
                slope = float((at.left @ by_s @ at.right).real) - fall
                if slope <= 0.0:
                    return line, gradient
                gradient = -_slopes(family, at) / slope
                # Left of α the line would pass the root.
                step = max(-(at.value - limit) / slope, 0.9 * (alpha - line))
                line, frequency = line + step, abs(frequency + turn)
                if abs(step) + abs(turn) < 1e-9 * (1.0 + abs(at.s)):
                    break
        return line, gradient

    return objective


def _settled(
    family: LoopFamily, gains: FloatArray, line: float, frequency: float
) -> tuple[_Nearest, float]:
    """Return what is found at a frequency, and a step towards the nearest dip of σ_min."""
    h = 1e-4 * (1.0 + frequency)
    s = np.asarray(line + 1j * (frequency + h * np.array([-1.0, 0.0, 1.0])), dtype=complex)
    u, size, vh = np.linalg.svd(family.characteristic_matrix(s, gains))
    low, here, high = size[:, -1]
    bend = (low - 2.0 * here + high) / h**2
    tilt = (high - low) / (2.0 * h)
    width = 0.1 * (1.0 + frequency)
    turn = float(np.clip(-tilt / bend if bend > 0.0 else -np.sign(tilt) * width, -width, width))
    if frequency == 0.0 and bend >= 0.0:
        turn = 0.0
    return _Nearest(float(here), complex(s[1]), u[1, :, -1].conj(), vh[1, -1].conj()), turn


def inverse_input_gain(family: LoopFamily) -> Objective:
    """Return 1 / max over ω of ‖T(iω)‖, continued by −α where the loop is unstable.

    T = K(s) C Δ⁻¹ B takes a disturbance beside the input to the input that feedback
    demands.
    """
    drive, _ = loop_channels(family.system, family.feedback)
    target = np.linalg.lstsq(drive, family.drive, rcond=None)[0]

    def transfer(s: ComplexArray, gains: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return T and the responses of the fed-back signals, (q, m, m) and (q, c, m)."""
        delta = family.characteristic_matrix(s, gains)
        seen = family.seen_at(s) @ np.linalg.solve(
            delta, np.broadcast_to(drive, (len(s), *drive.shape))
        )
        return np.asarray((target * (family.spread @ gains)) @ seen), np.asarray(seen)

    def objective(gains: FloatArray) -> tuple[float, FloatArray]:
        alpha, slope = family.abscissa(gains)
        if alpha >= 0.0:
            return -alpha, -slope
        omega = _frequencies(family, gains, 0.0)

        def inverse(points: FloatArray) -> FloatArray:
            size = np.linalg.norm(transfer(np.asarray(1j * points), gains)[0], 2, axis=(1, 2))
            return np.asarray(1.0 / np.maximum(size, 1e-9))

        where, value = _lowest(inverse, omega)
        t, seen = (part[0] for part in transfer(np.array([1j * where]), gains))
        p, size, qh = np.linalg.svd(t)
        if size[0] <= 1e-9:
            return value, np.zeros(gains.size)
        # dT = (I + T) dK G, with every entry of K acting from one signal on one input.
        out = p[:, 0].conj() @ (np.eye(t.shape[0]) + t) @ target
        entries = (out * (seen @ qh[0].conj())).real
        return value, -(value**2) * np.asarray(entries @ family.spread)

    return objective


def inverse_norm(family: LoopFamily, inputs: Sequence[str], outputs: Sequence[str]) -> Objective:
    """Return 1 / max over ω of ‖C Δ⁻¹ B‖, continued by −α where the loop is unstable.

    Parameters
    ----------
    family : LoopFamily
        Loops to choose from.
    inputs, outputs : sequence of str
        Between which the gain is taken; all where none are named.
    """
    chosen = with_channels(family.system, inputs, outputs)

    def response(s: ComplexArray, gains: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return Δ⁻¹ B and C Δ⁻¹."""
        inverse = np.linalg.inv(family.characteristic_matrix(s, gains))
        return np.asarray(inverse @ chosen.B), np.asarray(chosen.C @ inverse)

    def objective(gains: FloatArray) -> tuple[float, FloatArray]:
        alpha, slope = family.abscissa(gains)
        if alpha >= 0.0:
            return -alpha, -slope

        def inverse(points: FloatArray) -> FloatArray:
            gain = chosen.C @ response(np.asarray(1j * points), gains)[0]
            return np.asarray(1.0 / np.maximum(np.linalg.norm(gain, 2, axis=(1, 2)), 1e-9))

        where, value = _lowest(inverse, _frequencies(family, gains, 0.0))
        s = np.array([1j * where])
        driven, seen = (part[0] for part in response(s, gains))
        p, size, qh = np.linalg.svd(chosen.C @ driven)
        if size[0] <= 1e-9:
            return value, np.zeros(gains.size)
        entries = (p[:, 0].conj() @ seen @ family.drive) * (
            family.seen_at(s)[0] @ driven @ qh[0].conj()
        )
        return value, -(value**2) * np.asarray(entries.real @ family.spread)

    return objective
