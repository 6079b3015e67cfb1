"""σ_min(Δ) along vertical lines and over a range of delays, with bounds between the samples.

Away from the centre c of an interval or box Δ = Δ(c)(I + E), so that σ_min(Δ) is at least
σ_min(Δ(c))(1 − ‖E‖), and Δ is regular where ‖E‖ < 1. Pieces that hold nothing of interest by
this bound are dropped and the rest halved until it has shrunk to points: nothing is stepped
over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy.optimize

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic

_MOST_PIECES = 200_000
# A search ends, with what it has, after so many pieces of a system with four states; pieces of
# one with n states cost (n/4)³ as much.
_MOST_WORK = 4_000_000
_MERGE = 1e-6


@dataclass(frozen=True)
class AxisMinimum:
    """Smallest value found, a bound that nothing lies below, and where it was found.

    Attributes
    ----------
    value, lower_bound : float
        What was attained, and what nothing is below.
    frequency : float
        ω of it.
    factor : float
        Of the delays.
    """

    value: float
    lower_bound: float
    frequency: float
    factor: float = 1.0


@dataclass(frozen=True, eq=False)
class _Boxes:
    """Boxes of frequency × delay factor: centres and half widths, each of shape (N,)."""

    omega: FloatArray
    factor: FloatArray
    half_omega: FloatArray
    half_factor: FloatArray

    @classmethod
    def grid(cls, top: float, low: float, high: float, columns: int = 128, rows: int = 1) -> _Boxes:
        """Return columns × rows boxes that cover [0, top] × [low, high]."""
        omega = (np.arange(columns) + 0.5) * top / columns
        factor = low + (np.arange(rows) + 0.5) * (high - low) / rows
        one, other = (v.ravel() for v in np.meshgrid(omega, factor, indexing="ij"))
        half = 0.5 * top / columns, 0.5 * (high - low) / rows
        return cls(one, other, np.full(one.size, half[0]), np.full(one.size, half[1]))

    def take(self, index: npt.NDArray[np.bool_]) -> _Boxes:
        return _Boxes(
            self.omega[index], self.factor[index], self.half_omega[index], self.half_factor[index]
        )

    def halved(self, along_omega: npt.NDArray[np.bool_]) -> _Boxes:
        """Return twice as many boxes, each halved in one direction."""
        h = np.where(along_omega, 0.5 * self.half_omega, self.half_omega)
        k = np.where(along_omega, self.half_factor, 0.5 * self.half_factor)
        step = np.where(along_omega, h, 0.0), np.where(along_omega, 0.0, k)
        return _Boxes(
            np.concatenate([self.omega - step[0], self.omega + step[0]]),
            np.concatenate([self.factor - step[1], self.factor + step[1]]),
            np.concatenate([h, h]),
            np.concatenate([k, k]),
        )


def size_bound(matrices: ComplexArray) -> FloatArray:
    """Return a bound of the spectral norm of each matrix: Frobenius'."""
    return np.asarray(np.linalg.norm(matrices, axis=(-2, -1)))


@dataclass(frozen=True, eq=False)
class _Line:
    """Δ(line + iω) of a system whose delays are multiplied by f, on boxes of ω and f."""

    system: DelaySystem
    line: float

    def matrices(self, omega: FloatArray, factor: FloatArray) -> ComplexArray:
        """Return Δ for every ω and f, shape (N, n, n)."""
        delta, _ = self._parts(omega, factor)
        return delta

    def _parts(
        self, omega: FloatArray, factor: FloatArray
    ) -> tuple[ComplexArray, list[ComplexArray]]:
        s = (self.line + 1j * omega)[:, None, None]
        delta = s * np.eye(self.system.order) - self.system.A0
        terms = []
        for delay, delayed in zip(self.system.delays, self.system.delayed, strict=True):
            term = np.exp(-delay * s * factor[:, None, None]) * delayed
            delta = delta - term
            terms.append(term)
        return np.asarray(delta), terms

    def sigma(self, omega: FloatArray, factor: FloatArray) -> FloatArray:
        """Return σ_min for every ω and f, shape (N,)."""
        values = np.linalg.svd(self.matrices(omega, factor), compute_uv=False)
        return np.asarray(values[:, -1])

    def bounds(self, boxes: _Boxes) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return σ_min at the centres, and how much of ‖E‖ each direction brings, all (N,).

        With φ the change of the phase ωτf, exp(−iφ) − 1 + iφ is at most φ²/2 in modulus. f
        varies on the axis only.
        """
        omega, f, h, k = boxes.omega, boxes.factor, boxes.half_omega, boxes.half_factor
        delta, terms = self._parts(omega, f)
        values = np.linalg.svd(delta, compute_uv=False)[:, -1]
        eye = np.broadcast_to(np.eye(self.system.order), delta.shape)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            inverse: ComplexArray = np.linalg.inv(
                np.where((values > 0.0)[:, None, None], delta, eye).astype(complex)
            )
        by_omega, by_factor, curved = inverse, np.zeros_like(inverse), np.zeros_like(h)
        for delay, term in zip(self.system.delays, terms, strict=True):
            change = inverse @ term
            by_omega = by_omega + (delay * f)[:, None, None] * change
            by_factor = by_factor + (delay * omega)[:, None, None] * change
            phase = delay * (f * h + omega * k + h * k)
            curved += size_bound(change) * (0.5 * phase**2 + delay * h * k)
        curved = np.where(values > 0.0, curved, np.inf)
        one, other = h * size_bound(by_omega), k * size_bound(by_factor)
        part = one / np.maximum(one + other, 1e-300)
        first, second = one + part * curved, other + (1.0 - part) * curved
        return np.asarray(values), np.asarray(first), np.asarray(second)


def _search(
    line: _Line, boxes: _Boxes, weight: float, delay_weight: float, best: AxisMinimum, gap: float
) -> AxisMinimum:
    """Minimise max(σ_min/weight, |f − 1|/delay_weight) over boxes by bounding and halving."""
    lowest, work = 0.0, _MOST_WORK * (4.0 / max(line.system.order, 4)) ** 3
    for _ in range(80):
        sigma, by_omega, by_factor = line.bounds(boxes)
        away = np.abs(boxes.factor - 1.0)
        values = np.maximum(sigma / weight, away / delay_weight)
        least = int(values.argmin())
        if values[least] < best.value:
            where = float(boxes.omega[least]), float(boxes.factor[least])
            best = AxisMinimum(float(values[least]), 0.0, *where)
        floor = np.maximum(
            sigma / weight * (1.0 - by_omega - by_factor),
            (away - boxes.half_factor) / delay_weight,
        )
        alive = floor < best.value * (1.0 - gap)
        if not alive.any():
            lowest = best.value * (1.0 - gap)
            break
        work -= alive.size
        if alive.sum() > _MOST_PIECES or 2 * alive.sum() > work:
            lowest = max(0.0, float(floor.min()))
            break
        boxes = boxes.take(alive).halved(by_omega[alive] >= by_factor[alive])
    return replace(best, lower_bound=lowest)


def _polished(line: _Line, weight: float, delay_weight: float, found: AxisMinimum) -> AxisMinimum:
    """Return the local minimum next to what was found."""

    def value(x: FloatArray) -> float:
        factor = x[1:] if len(x) > 1 else np.ones(1)
        away = abs(float(factor[0]) - 1.0)
        return max(float(line.sigma(x[:1], factor)[0]) / weight, away / delay_weight)

    start = [found.frequency, found.factor] if math.isfinite(delay_weight) else [found.frequency]
    local = scipy.optimize.minimize(
        value, start, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-14}
    )
    factor = float(local.x[1]) if len(start) > 1 else 1.0
    if local.fun < found.value and factor > 0.0:
        found = replace(
            found, value=float(local.fun), frequency=abs(float(local.x[0])), factor=factor
        )
    return replace(found, lower_bound=min(found.lower_bound, found.value))


def line_minimum(system: DelaySystem, line: float, gap: float) -> AxisMinimum:
    """Return min over ω of σ_min(Δ(line + iω)) with a lower bound within ``gap``, relative."""
    on_line = _Line(system, line)
    start = float(on_line.sigma(np.zeros(1), np.ones(1))[0])
    # Beyond Σ ‖Ai‖ plus the best value σ_min only grows.
    total = float(np.linalg.norm(system.A0, 2)) + abs(line)
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        total += float(np.linalg.norm(delayed, 2)) * math.exp(-line * delay)
    boxes = _Boxes.grid(total + start, 1.0, 1.0)
    found = _search(on_line, boxes, 1.0, math.inf, AxisMinimum(start, 0.0, 0.0), gap)
    return _polished(on_line, 1.0, math.inf, found)


def weighted_minimum(
    system: DelaySystem, weight: float, delay_weight: float, start: AxisMinimum, gap: float
) -> AxisMinimum:
    """Return min over ω and f of max(σ_min(Δ(iω))/weight, |f − 1|/delay_weight).

    Parameters
    ----------
    system : DelaySystem
        The loop; all its delays are multiplied by f > 0.
    weight, delay_weight : float
        Both > 0.
    start : AxisMinimum
        The same with f = 1.
    gap : float
        Relative distance of the lower bound.
    """
    axis = _Line(system, 0.0)
    widest = delay_weight * start.value
    norms = sum(float(np.linalg.norm(a, 2)) for a in (system.A0, *system.delayed))
    top = norms + start.value * weight
    boxes = _Boxes.grid(top, max(0.0, 1.0 - widest), 1.0 + widest, rows=4)
    found = _search(axis, boxes, weight, delay_weight, start, gap)
    return _polished(axis, weight, delay_weight, found)


def crossings(system: DelaySystem, low: float, high: float) -> list[tuple[float, float]]:
    """Return (f, ω) wherever a root is on the axis with all delays multiplied by f.

    Parameters
    ----------
    system : DelaySystem
        A loop without a root at zero.
    low, high : float
        Range of f; crossings closer together than 1e-6 count as one.

    Raises
    ------
    ArithmeticError
        If the loop is too near instability over the whole range to tell crossings apart.
    """
    system = system.rescaled()
    axis = _Line(system, 0.0)
    boxes = _Boxes.grid(characteristic.magnitude_bound(system, 0.0), low, high, rows=16)
    found: list[tuple[float, float]] = []
    for _ in range(200):
        _, by_omega, by_factor = axis.bounds(boxes)
        kept = by_omega + by_factor >= 1.0
        for f, omega in found:
            near = np.abs(boxes.factor - f) + boxes.half_factor < _MERGE * max(f, 1.0)
            kept &= ~(near & (np.abs(boxes.omega - omega) + boxes.half_omega < _MERGE))
        if not kept.any():
            return sorted(found)
        if kept.sum() > _MOST_PIECES:
            break
        boxes = boxes.take(kept)
        if len(boxes.omega) < 2000 and boxes.half_factor.max() < 1e-2:
            for index in range(0, len(boxes.omega), max(1, len(boxes.omega) // 32)):
                guess = float(boxes.omega[index]), float(boxes.factor[index])
                sharp = sharpen_crossing(system, *guess)
                if sharp is not None and all(
                    abs(sharp[0] - f) + abs(sharp[1] - w) > _MERGE for f, w in found
                ):
                    found.append(sharp)
        boxes = boxes.halved(by_omega[kept] >= by_factor[kept])
    raise ArithmeticError("crossings of the axis could not be told apart")


def sharpen_crossing(
    system: DelaySystem, omega: float, factor: float
) -> tuple[float, float] | None:
    """Solve det Δ(iω) = 0 for real ω and delay factor from a first guess; return (f, ω)."""
    axis = _Line(system, 0.0)
    for _ in range(40):
        delta = axis.matrices(np.array([omega]), np.array([factor]))[0]
        left, sizes, right = np.linalg.svd(delta)
        u, v = left[:, -1].conj(), right[-1].conj()
        # The smallest singular value, as u Δ v, changes by u (∂Δ) v.
        by_omega, by_factor = 1j * (u @ v), 0j
        for delay, delayed in zip(system.delays, system.delayed, strict=True):
            turned = 1j * delay * np.exp(-1j * delay * omega * factor) * (u @ delayed @ v)
            by_omega += factor * turned
            by_factor += omega * turned
        jacobian = np.array([[by_omega.real, by_factor.real], [by_omega.imag, by_factor.imag]])
        if abs(np.linalg.det(jacobian)) < 1e-14:
            return None
        step = np.linalg.solve(jacobian, [-sizes[-1], 0.0])
        omega, factor = omega + float(step[0]), factor + float(step[1])
        if np.abs(step).max() < 1e-12 * (1.0 + abs(omega)):
            return (factor, omega) if omega > 0.0 and factor > 0.0 else None
    return None
