"""Sharpen a design on its active roots.

At a minimum of the spectral abscissa several roots share the largest real part, and often
they coincide. There the abscissa is not even Lipschitz, but the conditions "det Δ vanishes
at t + iω together with its first k − 1 derivatives" are analytic in the gains. So the
abscissa t is minimised subject to these conditions and to the bounds, which converges to
rounding where a descent on the abscissa itself crawls.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
import scipy.optimize

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.synthesis.conditions import Conditions, conditions
from drillctrl.synthesis.family import ActiveRoot, LoopFamily

_NEWTON_STEPS = 15
_SEQUENTIAL_STEPS = 15
_CONVERGED = 1e-10
# Relative descent of t from which a configuration is given up.
_DEEPEST = 0.5
# Relative distance at which a gain counts as lying on its bound.
_ON_BOUND = 1e-6
# Relative change in one step beyond which Newton's step is shortened.
_LARGEST_STEP = 0.3


@dataclass(frozen=True, eq=False)
class ActiveDesign:
    """Result of `sharpen`.

    Attributes
    ----------
    gains : array, (k,)
        Within the bounds.
    abscissa : float
        Real part t of the active roots.
    roots : tuple of ActiveRoot
        The configuration.
    residual : float
        Largest violation of the scaled conditions.
    evaluations : int
        Evaluations of the conditions.
    """

    gains: FloatArray
    abscissa: float
    roots: tuple[ActiveRoot, ...]
    residual: float
    evaluations: int


def hypotheses(values: ComplexArray, gains: int, width: float) -> list[tuple[ActiveRoot, ...]]:
    """Return configurations of active roots that eigenvalues near an optimum suggest.

    Parameters
    ----------
    values : array
        Eigenvalues, rightmost first.
    gains : int
        Number of gains: no more than gains + 1 conditions beyond the frequencies can hold.
    width : float
        How far from each other values may be to stand for one multiple root.
    """
    top = values[0].real
    upper = [complex(s) for s in values if s.imag >= 0 and s.real > top - width]
    # A pair as close to the real axis as that may become a real root, or stay a pair.
    configurations = [_configuration(upper, gains, width, axis) for axis in (width, 0.3 * width)]
    return [found for found in dict.fromkeys(configurations) if found]


def _configuration(
    upper: list[complex], gains: int, width: float, axis: float
) -> tuple[ActiveRoot, ...]:
    """Group values within ``width`` of each other; pairs within ``axis`` of the axis are real."""
    groups: list[list[complex]] = []
    for s in upper:
        near_axis = abs(s.imag) < axis
        home = next(
            (
                g
                for g in groups
                if min(abs(s - z) for z in g) < width
                and near_axis == any(abs(z.imag) < axis for z in g)
            ),
            None,
        )
        members = [s, s.conjugate()] if near_axis and s.imag > 0.0 else [s]
        if home is None:
            groups.append(members)
        else:
            home.extend(members)
    found: list[ActiveRoot] = []
    budget = gains + 1
    for group in groups:
        omega = float(np.mean([z.imag for z in group]))
        real = abs(omega) < 1e-9 or any(abs(z.imag) < axis for z in group)
        root = ActiveRoot(0.0 if real else omega, len(group))
        cost = root.equations - (0 if real else 1)
        if cost > budget:
            limited = budget if real else (budget + 1) // 2
            if limited >= 1:
                found.append(ActiveRoot(root.omega, limited))
            break
        found.append(root)
        budget -= cost
        if budget == 0:
            break
    return tuple(found)


def sharpen(
    family: LoopFamily,
    gains: FloatArray,
    abscissa: float,
    roots: tuple[ActiveRoot, ...],
) -> ActiveDesign:
    """Minimise t subject to the conditions of a configuration of active roots.

    Parameters
    ----------
    family : LoopFamily
        Loops to choose from.
    gains : array, (k,)
        Where to start.
    abscissa : float
        First guess of t.
    roots : tuple of ActiveRoot
        The configuration.

    Notes
    -----
    Newton's method on the conditions for a minimum, with gains that reach a bound held
    there, and from further away sequential quadratic programming. As many conditions as
    unknowns leave nothing to minimise: they are solved, or found to fail within the bounds.
    """
    task = conditions(family, gains, abscissa, roots)
    u, used = _newton(task)
    if u is None and task.start.size > task.values(task.start)[0].size:
        nearer, more = _sequential(task)
        u, again = _newton(replace(task, start=nearer))
        used += more + again
        u = nearer if u is None else u
    if u is None:
        return ActiveDesign(gains, abscissa, roots, np.inf, used)
    k = gains.size
    residual = float(np.abs(task.values(u)[0]).max())
    return ActiveDesign(u[:k], float(u[k]), task.located(u), residual, used + 1)


def _newton(task: Conditions) -> tuple[FloatArray | None, int]:
    """Return a point that meets the second-order conditions for a minimum, and the cost.

    Each step solves the conditions and, in the directions that keep them, goes down the
    curvature of t; directions of negative curvature are followed by its modulus.
    """
    k, u = task.gains, task.start.copy()
    lower, upper = task.family.feedback.lower, task.family.feedback.upper
    lowest = u[k] - _DEEPEST * (1.0 + abs(u[k]))
    near = _ON_BOUND * (upper - lower)
    scale = task.units
    held = np.zeros(u.size, dtype=bool)
    for bound in (lower, upper):
        on_bound = np.abs(u[:k] - bound) <= near
        u[:k] = np.where(on_bound, bound, u[:k])
        held[:k] |= on_bound
    for used in range(1, 1 + _NEWTON_STEPS):
        value, jacobian = task.values(u)
        jacobian = jacobian * scale
        if not (np.isfinite(value).all() and np.isfinite(jacobian).all()):
            # Determinants of many states overflow far from where the search began.
            return None, used
        free = ~held
        rows = value.size
        if rows > free.sum():
            return None, used
        q, r = np.linalg.qr(jacobian[:, free].T, mode="complete")
        r = r[:rows]
        if np.abs(np.diag(r)).min() < 1e-13 * np.abs(r).max():
            return None, used
        gradient = np.zeros(u.size)
        gradient[k] = 1.0
        along, basis = q[:, :rows], q[:, rows:]
        multipliers = scipy.linalg.solve_triangular(r, -along.T @ gradient[free])
        change = along @ scipy.linalg.solve_triangular(r, -value, trans=1)
        least = 0.0
        if basis.shape[1]:
            hessian = (task.curvature(u, multipliers) * np.outer(scale, scale))[np.ix_(free, free)]
            curvatures, vectors = np.linalg.eigh(basis.T @ hessian @ basis)
            least = float(curvatures[0])
            slope = vectors.T @ basis.T @ (gradient[free] + hessian @ change)
            floor = 1e-8 * max(1.0, float(np.abs(curvatures).max()))
            change = change - basis @ vectors @ (slope / np.maximum(np.abs(curvatures), floor))
        size = float(np.abs(change / (1.0 + np.abs((u / scale)[free]))).max())
        if not np.isfinite(size):
            return None, used
        step = np.zeros(u.size)
        step[free] = scale[free] * change * min(1.0, _LARGEST_STEP / max(size, _LARGEST_STEP))
        # A step ends where the first gain meets its bound, which then holds it.
        room = np.where(step[:k] > 0.0, upper - u[:k], lower - u[:k])
        ratios = np.full(k, np.inf)
        np.divide(room, step[:k], out=ratios, where=step[:k] != 0.0)
        first = float(ratios.min(initial=np.inf))
        stopped = ratios <= min(first, 1.0)
        u = u + min(first, 1.0) * step
        u[:k] = np.where(stopped, np.where(step[:k] > 0.0, upper, lower), u[:k])
        if (u[k + 1 :] <= 0.0).any() or u[k] < lowest:
            return None, used
        if stopped.any():
            held[:k] |= stopped
        elif size < _CONVERGED:
            # Gains on a bound must want to leave it outwards.
            pull = (multipliers @ jacobian)[:k] * np.where(u[:k] <= lower, 1.0, -1.0)
            released = held[:k] & (pull < -_CONVERGED)
            if not released.any():
                return (u if least > -_CONVERGED else None), used
            held[:k] &= ~released
    return None, used


def _sequential(task: Conditions) -> tuple[FloatArray, int]:
    """Return a point nearer to a minimum by sequential quadratic programming, and the cost."""
    k = task.gains
    feedback = task.family.feedback
    count = [0]
    latest: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def values(u: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = u.tobytes()
        if key not in latest:
            count[0] += 1
            latest.clear()
            latest[key] = task.values(u)
        return latest[key]

    gradient = np.zeros(task.start.size)
    gradient[k] = 1.0
    paired = task.start.size - k - 1
    # Far below, other roots than those of the configuration are rightmost.
    lowest = task.start[k] - _DEEPEST * (1.0 + abs(task.start[k]))
    scale = task.units
    ends = zip(feedback.lower / scale[:k], feedback.upper / scale[:k], strict=True)
    bounds = [*ends, (lowest, None)]
    result = scipy.optimize.minimize(
        lambda u: float(u[k]),
        task.start / scale,
        jac=lambda u: gradient,
        bounds=[*bounds, *[(1e-9, None)] * paired],
        constraints={
            "type": "eq",
            "fun": lambda u: values(scale * u)[0],
            "jac": lambda u: values(scale * u)[1] * scale,
        },
        method="SLSQP",
        options={"maxiter": _SEQUENTIAL_STEPS, "ftol": 1e-13},
    )
    u = scale * np.asarray(result.x)
    u[:k] = np.clip(u[:k], feedback.lower, feedback.upper)
    return u, count[0]
