"""What is known of a design's optimality: locally by first-order conditions, globally by count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.optimize

from drillctrl.base.arrays import FloatArray
from drillctrl.synthesis.conditions import conditions
from drillctrl.synthesis.family import ActiveRoot, LoopFamily
from drillctrl.synthesis.search import Search


@dataclass(frozen=True)
class OptimalityCertificate:
    """Evidence that no better gains lie within the bounds.

    Attributes
    ----------
    method : str
        ``"active-root conditions"``: t is stationary under the conditions that keep the
        active roots where they are. ``"Clarke subdifferential"``: the shortest convex
        combination of gradients of the active simple roots.
    stationarity : float
        Length of the shortest such vector, normals of active bounds included; 0 at a
        stationary point.
    active_roots : tuple of ActiveRoot
        Roots that share the spectral abscissa.
    active_bounds : tuple of str
        Gains that lie on a bound.
    basins : int
        Distinct ends of the descents.
    hits : int
        Descents that ended at the value of the design.
    next_best : float or None
        Abscissa of the second-best basin.
    """

    method: str
    stationarity: float
    active_roots: tuple[ActiveRoot, ...]
    active_bounds: tuple[str, ...]
    basins: int
    hits: int
    next_best: float | None


def certify_optimality(
    family: LoopFamily, gains: FloatArray, search: Search
) -> OptimalityCertificate:
    """Return the certificate of the best basin of a search.

    Parameters
    ----------
    family : LoopFamily
        Loops that were searched.
    gains : array, (k,)
        The design; it may differ from the best basin by rounding.
    search : Search
        Result of the search.
    """
    lower, upper = family.feedback.lower, family.feedback.upper
    low, high = gains <= lower, gains >= upper
    # An outward normal may balance a gradient that would leave the box.
    normals = [-np.eye(gains.size)[j] for j in np.flatnonzero(low)]
    normals += [np.eye(gains.size)[j] for j in np.flatnonzero(high)]
    roots = search.best.roots
    if roots:
        method = "active-root conditions"
        stationarity = _lagrange(family, gains, search.best.value, roots, normals)
    else:
        method = "Clarke subdifferential"
        gradients, roots = family.active_gradients(gains)
        # Of gains in the units of narrow bounds.
        stationarity = shortest_combination(gradients * np.minimum(upper - lower, 1.0), normals)
    names = family.feedback.gain_names
    return OptimalityCertificate(
        method,
        stationarity,
        tuple(roots),
        tuple(name for name, bound in zip(names, low | high, strict=True) if bound),
        len(search.basins),
        search.hits,
        search.basins[1].value if len(search.basins) > 1 else None,
    )


def shortest_combination(gradients: FloatArray, normals: list[FloatArray]) -> float:
    """Return the length of the shortest Σ λi gi + Σ νj nj with λ, ν ≥ 0 and Σ λ = 1."""
    if gradients.shape[1] == 0:
        return 0.0
    columns = np.column_stack([*gradients, *normals])
    weights = np.concatenate([np.ones(len(gradients)), np.zeros(len(normals))])
    # A heavy last row makes the weights of the gradients sum to one.
    heavy = 1e4 * (1.0 + float(np.abs(columns).max()))
    matrix = np.vstack([columns, heavy * weights])
    target = np.zeros(matrix.shape[0])
    target[-1] = heavy
    solution, _ = scipy.optimize.nnls(matrix, target)
    return float(np.linalg.norm(columns @ solution))


def _lagrange(
    family: LoopFamily,
    gains: FloatArray,
    abscissa: float,
    roots: tuple[ActiveRoot, ...],
    normals: list[FloatArray],
) -> float:
    """Return the smallest violation of the first-order conditions over all multipliers."""
    task = conditions(family, gains, abscissa, roots)
    jacobian = task.values(task.start)[1] * task.units
    jacobian = jacobian / np.linalg.norm(jacobian, axis=1, keepdims=True)
    size = jacobian.shape[1]
    padded = [np.concatenate([n, np.zeros(size - gains.size)]) for n in normals]
    # Multipliers of equations have either sign, those of bounds one.
    matrix = np.column_stack([*jacobian, *(-jacobian), *padded])
    target = np.zeros(size)
    target[gains.size] = -1.0
    _, residual = scipy.optimize.nnls(matrix, target, maxiter=50 * matrix.shape[1])
    return float(residual)
