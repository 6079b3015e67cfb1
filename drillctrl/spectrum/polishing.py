"""Approximate roots driven to the characteristic equation, all at once (Aberth's iteration)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic

EPSILON = float(np.finfo(float).eps)
# An iteration that comes to rest with steps larger than this has found a multiple root, or
# nothing: at a root Δ is singular to so much.
_ROUGH_STEP, _SINGULAR = 1e-7, 1e-12
# How many roots of a system of many states are sharpened at last, and by how much at most.
_SHARPENED, _ROUNDED = 8, 1e-9
# Relative steps about a root of high multiplicity, at most.
_ABOUT = 0.05
# Radius of a circle about it, over 1/τ, at most.
_CIRCLED = 0.3
_CIRCLE = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)


def polish(system: DelaySystem, start: ComplexArray) -> tuple[ComplexArray, npt.NDArray[np.bool_]]:
    """Drive approximate roots to the characteristic equation, all at once.

    Parameters
    ----------
    system : DelaySystem
        Any.
    start : array, (q,)
        Approximations with imag ≥ 0. Their conjugates take part implicitly.

    Returns
    -------
    roots : array, (q,)
        Improved values.
    converged : bool array, (q,)
        Whether the last correction was at the level of rounding.
    """
    if not start.size:
        return start, np.zeros(0, dtype=bool)
    if start.size == 1:
        value, converged = _polish_one(system, complex(start[0]))
        return np.array([value]), np.array([converged])
    s = np.where(start.imag > 0, start, start.real + 0j)
    done = np.zeros(s.shape, dtype=bool)
    last = np.full(s.shape, np.inf)
    for _ in range(24):
        # What runs away is no number in the end, and does not converge.
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = 1.0 / characteristic.log_derivative(system, s)
        everyone = np.concatenate([s, s[s.imag > 0].conj()]) if s.imag.any() else s
        gap = s[:, None] - everyone
        gap[gap == 0] = np.inf
        with np.errstate(divide="ignore", invalid="ignore"):
            step = newton / (1.0 - newton * (1.0 / gap).sum(axis=1))
        step.imag[s.imag == 0] = 0.0
        step[done] = 0.0
        size, scale = np.abs(step), 1.0 + np.abs(s)
        # Once corrections no longer shrink, what remains is noise of the evaluation.
        stalled = (size >= last) & (size < 1e-3 * scale)
        step[stalled] = 0.0
        if (size > 0.3 * scale).any():
            with np.errstate(over="ignore", invalid="ignore"):
                step *= np.minimum(1.0, 0.3 * scale / np.maximum(size, 1e-300))
        s = s - step
        s.imag = np.abs(s.imag)
        # What is done keeps its last correction, by which it is judged below.
        last = np.where(done, last, size)
        # The iteration squares the error relative to the distance of the next root.
        square = size**2 <= EPSILON * scale * np.abs(gap).min(axis=1)
        done |= stalled | square | (size <= 4 * EPSILON * scale)
        if done.all():
            break
    scale = 1.0 + np.abs(s)
    # Members of a multiple root may still move about it: where Δ is singular they are it.
    still = ~done & (last < _ABOUT * scale)
    # Two that have met hold each other where they are, root or not.
    met = np.abs(gap).min(axis=1) < _ROUGH_STEP * scale
    rough = np.flatnonzero(still | (done & (met | (last > _ROUGH_STEP * scale))))
    if rough.size:
        done[rough] = are_roots(system, s[rough])
        rough = rough[done[rough]]
        done[rough] = _are_beside_roots(system, s[rough])
    return _sharpened(system, s, done), done


def _sharpened(system: DelaySystem, s: ComplexArray, done: npt.NDArray[np.bool_]) -> ComplexArray:
    """Return roots of a system of many states with a last step by Δ itself, the rightmost."""
    if not characteristic.is_thin(system):
        return s
    some = np.flatnonzero(done)
    some = some[np.argsort(-s.real[some])][:_SHARPENED]
    with np.errstate(divide="ignore", invalid="ignore"):
        step = 1.0 / characteristic.trace_ratio(
            *characteristic.matrix_and_derivative(system, s[some])
        )
    # Next to another root the step is that of a multiple one: as good as it was.
    small = np.abs(step) < _ROUNDED * (1.0 + np.abs(s[some]))
    s[some] -= np.where(small, step, 0.0)
    s.imag = np.where(s.imag < 0.0, 0.0, s.imag)
    return s


def _are_beside_roots(system: DelaySystem, s: ComplexArray) -> npt.NDArray[np.bool_]:
    """Whether circles about places have roots inside.

    Where exp(−sτ) is huge Δ may be singular to rounding, and no root anywhere near.
    """
    scale = 1.0 + np.abs(s)
    widest = _CIRCLED / system.max_delay if system.delays else np.inf
    ring = np.minimum(_ABOUT * scale, widest)[:, None] * _CIRCLE
    slope = characteristic.log_derivative(system, (s[:, None] + ring).ravel())
    return np.asarray((slope.reshape(ring.shape) * ring).mean(axis=1).real > 0.5)


def are_roots(system: DelaySystem, s: ComplexArray) -> npt.NDArray[np.bool_]:
    """Whether Δ is singular to rounding: of a multiple root more cannot be told."""
    rest = characteristic.smallest_singular(system, s)
    return np.asarray(rest <= _SINGULAR * characteristic.weight(system, s))


def _polish_one(system: DelaySystem, s: complex) -> tuple[complex, bool]:
    """Do for a single root what `polish` does for many, at half the cost."""
    last = math.inf
    for _ in range(24):
        newton = 1.0 / characteristic.log_derivative_at(system, s)
        step = newton / (1.0 - newton / (2j * s.imag)) if s.imag else complex(newton.real)
        size, scale = abs(step), 1.0 + abs(s)
        if size >= last and size < 1e-3 * scale:
            return s, size <= _ROUGH_STEP * scale or bool(are_roots(system, np.array([s]))[0])
        s -= step * min(1.0, 0.3 * scale / max(size, 1e-300))
        s = complex(s.real, abs(s.imag))
        last = size
        if size**2 <= EPSILON * scale * min(2.0 * s.imag or scale, scale):
            return s, True
    return s, False
