"""Sharpen a design on its active roots.

At a minimum of the spectral abscissa several roots share the largest real part, and often
they coincide. There the abscissa is not even Lipschitz, but the conditions "det Δ vanishes
at t + iω together with its first k − 1 derivatives" are analytic in the gains. So the
abscissa t is minimised subject to these conditions and to the bounds, which converges to
rounding where a descent on the abscissa itself crawls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.optimize

from drillctrl.optimisation.family import ActiveRoot, LoopFamily
from drillctrl.spectrum.characteristic import ComplexArray, FloatArray


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
    upper = [s for s in values if s.imag >= 0 and s.real > top - width]
    groups: list[list[complex]] = []
    for s in upper:
        # A pair close to the real axis is about to become a real root of multiplicity two.
        members = [complex(s)] if s.imag == 0 else [complex(s), complex(s).conjugate()]
        near_axis = abs(s.imag) < width
        home = next(
            (
                g
                for g in groups
                if min(abs(s - z) for z in g) < width
                and (near_axis == any(abs(z.imag) < width for z in g))
            ),
            None,
        )
        if not near_axis:
            members = [complex(s)]
        if home is None:
            groups.append(members)
        else:
            home.extend(members)
    found: list[ActiveRoot] = []
    budget = gains + 1
    for group in groups:
        omega = float(np.mean([z.imag for z in group]))
        real = abs(omega) < 1e-9 or any(abs(z.imag) < width for z in group)
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
    return [tuple(found)] if found else []


def sharpen(
    family: LoopFamily,
    gains: FloatArray,
    abscissa: float,
    roots: tuple[ActiveRoot, ...],
    most: int = 30,
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
    most : int
        Iterations permitted.

    Notes
    -----
    The conditions are the Taylor coefficients of det Δ about each root; their derivatives by
    the gains and by the place are exact.
    """
    k = gains.size
    count = [0]
    lower, upper = family.feedback.lower, family.feedback.upper
    free = [i for i, root in enumerate(roots) if root.omega != 0.0]
    start = np.concatenate([gains, [abscissa], [roots[i].omega for i in free]])
    scale = _scales(family, gains, abscissa, roots)
    latest: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def conditions(u: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = u.tobytes()
        if key not in latest:
            count[0] += 1
            latest.clear()
            latest[key] = _conditions(family, u, k, roots, free, scale)
        return latest[key]

    gradient = np.zeros(start.size)
    gradient[k] = 1.0
    bounds = [*zip(lower, upper, strict=True), (None, None), *[(1e-9, None)] * len(free)]
    result = scipy.optimize.minimize(
        lambda u: float(u[k]),
        start,
        jac=lambda u: gradient,
        bounds=bounds,
        constraints={
            "type": "eq",
            "fun": lambda u: conditions(u)[0],
            "jac": lambda u: conditions(u)[1],
        },
        method="SLSQP",
        options={"maxiter": most, "ftol": 1e-13},
    )
    u = result.x
    u[:k] = np.clip(u[:k], lower, upper)
    found = list(roots)
    for i, index in enumerate(free):
        found[index] = ActiveRoot(float(u[k + 1 + i]), roots[index].multiplicity)
    return ActiveDesign(
        u[:k],
        float(u[k]),
        tuple(found),
        float(np.abs(conditions(u)[0]).max()),
        count[0],
    )


def active_jacobian(
    family: LoopFamily, gains: FloatArray, abscissa: float, roots: tuple[ActiveRoot, ...]
) -> FloatArray:
    """Return the Jacobian of the conditions with respect to (gains, t, frequencies)."""
    free = [i for i, root in enumerate(roots) if root.omega != 0.0]
    u = np.concatenate([gains, [abscissa], [roots[i].omega for i in free]])
    scale = _scales(family, gains, abscissa, roots)
    return _conditions(family, u, gains.size, roots, free, scale)[1]


def _radius(s: complex) -> float:
    return 0.1 * (1.0 + abs(s))


def _taylor(
    family: LoopFamily, gains: FloatArray, s: complex, terms: int
) -> tuple[ComplexArray, ComplexArray]:
    """Return the scaled Taylor coefficients of det Δ at s and their gain derivatives.

    Coefficient l is multiplied by the l-th power of a length of the size of s. Shapes
    (terms,) and (terms, k).
    """
    values, slopes = family.taylor(np.array([s]), gains, terms)
    scale = _radius(s) ** np.arange(terms)
    return values[0] * scale, slopes[0] * scale[:, None]


def _scales(
    family: LoopFamily, gains: FloatArray, abscissa: float, roots: tuple[ActiveRoot, ...]
) -> list[float]:
    return [
        float(np.abs(_taylor(family, gains, complex(abscissa, root.omega), 6)[0]).max())
        for root in roots
    ]


def _conditions(
    family: LoopFamily,
    u: FloatArray,
    k: int,
    roots: tuple[ActiveRoot, ...],
    free: list[int],
    scale: list[float],
) -> tuple[FloatArray, FloatArray]:
    """Return the real conditions and their Jacobian with respect to (gains, t, ω)."""
    values: list[FloatArray] = []
    rows: list[FloatArray] = []
    for i, root in enumerate(roots):
        omega = u[k + 1 + free.index(i)] if i in free else 0.0
        s = complex(u[k], omega)
        m = root.multiplicity
        taylor, slopes = _taylor(family, u[:k], s, m + 1)
        radius = _radius(s)
        # d/ds of the l-th coefficient is l + 1 times the next one.
        by_s = np.arange(1, m + 1) * taylor[1 : m + 1] / radius
        block = np.zeros((m, u.size), dtype=complex)
        block[:, :k] = slopes[:m]
        block[:, k] = by_s
        if i in free:
            block[:, k + 1 + free.index(i)] = 1j * by_s
        value, block = taylor[:m] / scale[i], block / scale[i]
        values.append(value.real)
        rows.append(block.real)
        if i in free:
            values.append(value.imag)
            rows.append(block.imag)
    return np.concatenate(values), np.vstack(rows)
