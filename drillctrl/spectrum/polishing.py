"""Approximate roots driven to the characteristic equation, all at once (Aberth's iteration)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray
from drillctrl.delay.reduced import reduced
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic

EPSILON = float(np.finfo(float).eps)
# An iteration that comes to rest with steps larger than this has found a multiple root, or
# nothing: at a root Δ is singular to so much.
_ROUGH_STEP, _SINGULAR = 1e-7, 1e-12
# Relative steps about a root of high multiplicity, at most.
_ABOUT = 0.05
# States from which on the matrix is left to the end, and iterations before it at most.
_MANY, _QUICK = 30, 12


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
    if start.size == 1:
        value, converged = _polish_one(system, complex(start[0]))
        return np.array([value]), np.array([converged])
    s = np.where(start.imag > 0, start, start.real + 0j)
    done = np.zeros(s.shape, dtype=bool)
    last = np.full(s.shape, np.inf)
    # Of many states few numbers tell most digits, and the matrix itself the last ones.
    loops = reduced(system) if system.order >= _MANY else None
    for tried in range(1, 25 if loops is None else 25 + _QUICK):
        # What runs away is no number in the end, and does not converge.
        with np.errstate(divide="ignore", invalid="ignore"):
            if loops is None:
                newton = 1.0 / characteristic.log_derivative(system, s)
            else:
                ratio = loops.evaluate(s[None])[2][0]
                newton = np.where(np.isfinite(ratio), 1.0 / ratio, 0.0)
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
        last = size
        # The iteration squares the error relative to the distance of the next root.
        square = size**2 <= EPSILON * scale * np.abs(gap).min(axis=1)
        done |= stalled | square | (size <= 4 * EPSILON * scale)
        if loops is not None and (done.all() or tried == _QUICK):
            loops, done, last = None, np.zeros_like(done), np.full(s.shape, np.inf)
        elif done.all():
            break
    scale = 1.0 + np.abs(s)
    # Members of a multiple root may still move about it: where Δ is singular they are it.
    still = ~done & (last < _ABOUT * scale)
    # Two that have met hold each other where they are, root or not.
    met = np.abs(gap).min(axis=1) < _ROUGH_STEP * scale
    rough = np.flatnonzero(still | (done & (met | (last > _ROUGH_STEP * scale))))
    if rough.size:
        done[rough] = are_roots(system, s[rough])
    return s, done


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
