"""Characteristic roots: collocation finds them, the characteristic equation sharpens them.

Collocation supplies a starting value for every root right of a line; Aberth's simultaneous
iteration drives all of them to the characteristic equation without two of them meeting in
one root; contour moments give the centre of a cluster to rounding even though its members
are known to the k-th root of rounding only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.delay_system import DelaySystem
from drillctrl.errors import InputError, checked_number
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.characteristic import ComplexArray, FloatArray
from drillctrl.spectrum.pseudospectral import MAX_DEGREE, approximate_roots, degree_for

BoolArray = npt.NDArray[np.bool_]
EPSILON = float(np.finfo(float).eps)
# Roots that a relative change of the coefficients this small makes coincide are reported
# as one multiple root: gains are rarely known to more digits.
MULTIPLICITY_TOLERANCE = 1e-8
# Below this the split of a cluster is rounding and says nothing about the system.
ROUNDING_TOLERANCE = 32 * EPSILON
_CIRCLE = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)
_CLOSE = 0.2


@dataclass(frozen=True)
class Root:
    """A characteristic root with imag ≥ 0; its conjugate is implied.

    Attributes
    ----------
    real, imag : float
        The root, or the centre of the cluster that it stands for.
    multiplicity : int
        Number of roots in the cluster.
    spread : float
        Largest distance of a member from the centre; 0 for a simple root.
    rightmost : float
        Largest real part of a member, the centre's where the spread is rounding.
    residual : float
        Smallest relative change of the coefficients that makes the value an exact root.
    condition : float
        κ: a small relative change ε of the coefficients moves the root by up to about
        (κ ε)^(1/multiplicity).
    converged : bool
        Whether the iteration on the characteristic equation converged.
    """

    real: float
    imag: float
    multiplicity: int
    spread: float
    rightmost: float
    residual: float
    condition: float
    converged: bool

    @property
    def value(self) -> complex:
        """The root as a complex number."""
        return complex(self.real, self.imag)

    @property
    def error(self) -> float:
        """How far rounding may have moved ``rightmost``."""
        reach = (self.condition * ROUNDING_TOLERANCE) ** (1.0 / self.multiplicity)
        return float(reach)


def polish(system: DelaySystem, start: ComplexArray) -> tuple[ComplexArray, BoolArray]:
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
    s = np.where(start.imag > 0, start, start.real + 0j)
    scale = 1.0 + np.abs(s)
    last = np.full(s.shape, np.inf)
    active = np.ones(s.shape, dtype=bool)
    done = np.zeros(s.shape, dtype=bool)
    for _ in range(20):
        newton = 1.0 / characteristic.log_derivative(system, s[active])
        everyone = np.concatenate([s, s[s.imag > 0].conj()])
        gap = s[active, None] - everyone[None, :]
        with np.errstate(divide="ignore", invalid="ignore"):
            pull = np.where(gap == 0, 0, 1.0 / gap).sum(axis=1)
            step = newton / (1.0 - newton * pull)
        step = np.where(np.isfinite(step), step, newton)
        step = step * np.minimum(1.0, 0.3 * scale[active] / np.maximum(np.abs(step), 1e-300))
        real = s[active].imag == 0
        step = np.where(real, step.real, step)
        size = np.abs(step)
        # Once corrections no longer shrink, what remains is noise of the evaluation.
        stalled = (size >= last[active]) & (size < 1e-3 * scale[active])
        moved = s.copy()
        moved[active] = np.where(stalled, s[active], s[active] - step)
        moved = np.where(moved.imag < 0, moved.conj(), moved)
        s = moved
        finished = (size <= 4 * EPSILON * scale[active]) | stalled
        last[active] = size
        index = np.flatnonzero(active)
        done[index[finished]] = True
        active[index[finished]] = False
        if not active.any():
            break
    return s, done


def _gather(system: DelaySystem, line: float, values: ComplexArray, degree: int) -> _Polished:
    """Return polished roots right of a line, raising the degree until all converge.

    Parameters
    ----------
    system : DelaySystem
        Any.
    line : float
        Roots right of it are wanted; a few that turn out left of it may come along.
    values : array
        Eigenvalues of the collocation of degree ``degree``.
    degree : int
        At least the degree that resolves the line, or 0 to have it chosen.
    """
    needed = degree_for(system, line)
    reach = characteristic.magnitude_bound(system, line - 0.02)
    # The rule has a reserve; a line only slightly further left does not use it up.
    if degree < needed - 2:
        degree = needed
        values = approximate_roots(system, degree)
    while True:
        # Starting values of a k-fold root are off by the k-th root of the error.
        size = np.abs(values)
        wanted = (values.imag >= 0) & (values.real >= line - 0.02 * (1.0 + size))
        # No root lies beyond the bound: what the collocation has there is its own.
        start = values[wanted & (size <= 1.1 * reach)]
        s, done = polish(system, start)
        strayed = np.abs(s - start) > 0.1 * (1.0 + np.abs(start))
        if (done & ~strayed).all() or degree > MAX_DEGREE // 2:
            order = np.argsort(-s.real, kind="stable")
            return s[order], done[order]
        degree *= 2
        values = approximate_roots(system, degree)


_Polished = tuple[ComplexArray, BoolArray]


def spectral_abscissa(system: DelaySystem) -> float:
    """Return the largest real part of the characteristic roots.

    Notes
    -----
    Where roots coincide to rounding the value is the real part of their centre; see
    `dominant_roots` for the spread.
    """
    degree = degree_for(system)
    values = approximate_roots(system, degree)
    s, done = _gather(system, float(values[0].real), values, degree)
    if s.size == 1 and (s[0].imag == 0 or s[0].imag > _CLOSE):
        return float(s[0].real)
    return max(root.rightmost for root in _resolve(system, s, done))


def characteristic_roots(system: DelaySystem, right_of: float) -> tuple[Root, ...]:
    """Return all characteristic roots with real part ≥ ``right_of``, rightmost first.

    Parameters
    ----------
    system : DelaySystem
        Any number of delays, inputs and outputs.
    right_of : float
        The line.

    Returns
    -------
    tuple of Root
        Roots with imag ≥ 0, multiple ones once.

    Raises
    ------
    InputError
        If ``right_of`` is not finite, or lies so far left that the roots right of it are
        too many to resolve.
    """
    line = checked_number("right_of", right_of)
    reach = characteristic.magnitude_bound(system, line) * system.max_delay
    if 0.55 * reach + 5 > MAX_DEGREE:
        raise InputError("right_of", line, "further right: too many roots to resolve")
    s, done = _gather(system, line, np.zeros(0, dtype=complex), 0)
    return tuple(root for root in _resolve(system, s, done) if root.rightmost >= line)


def dominant_roots(system: DelaySystem) -> tuple[Root, ...]:
    """Return the rightmost characteristic roots with imag ≥ 0, rightmost first.

    Those within 1/τ of the spectral abscissa are given, with τ the largest delay, and all
    of them where there is no delay.
    """
    degree = degree_for(system)
    values = approximate_roots(system, degree)
    depth = 1.0 / system.max_delay if system.delays else math.inf
    line = max(float(values[0].real) - depth, -1e300)
    return _resolve(system, *_gather(system, line, values, degree))


def _resolve(system: DelaySystem, s: ComplexArray, done: BoolArray) -> tuple[Root, ...]:
    """Merge clusters and attach residual and condition."""
    left = list(range(s.size))
    roots: list[Root] = []
    while left:
        first = left[0]
        cluster = _cluster(system, s, first, left)
        if cluster is None:
            members, root = [first], _simple_root(system, s, first, bool(done[first]))
        else:
            members, root = cluster
        roots.append(root)
        left = [i for i in left if i not in members]
    return tuple(sorted(roots, key=lambda root: (-root.rightmost, root.imag)))


def _weight(system: DelaySystem, s: ComplexArray) -> FloatArray:
    """S(s) = ‖A0‖ + Σ ‖Ai‖ |exp(−sτi)|, what relative changes are measured against."""
    total = np.full(s.shape, float(np.linalg.norm(system.A0, 2)))
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        total += np.linalg.norm(delayed, 2) * np.exp(np.minimum(-s.real * delay, 300.0))
    return np.asarray(np.maximum(total, 1e-300))


def _smallest_singular(system: DelaySystem, s: ComplexArray) -> FloatArray:
    values = np.linalg.svd(characteristic.matrix(system, s), compute_uv=False)
    return np.asarray(values[..., -1])


def _simple_root(system: DelaySystem, s: ComplexArray, index: int, converged: bool) -> Root:
    value = s[index]
    others = np.concatenate([np.delete(s, index), s[s.imag > 0].conj()])
    gap = float(np.abs(others - value).min()) if others.size else 1.0
    radius = min(0.1 * gap, 1e-4 * (1.0 + abs(value))) + 1e-12
    ring = value + radius * _CIRCLE[::8]
    weight = float(_weight(system, np.array([value]))[0])
    condition = weight * radius / float(_smallest_singular(system, ring).min())
    residual = float(_smallest_singular(system, np.array([value]))[0]) / weight
    return Root(
        float(value.real),
        float(value.imag),
        1,
        0.0,
        float(value.real),
        residual,
        condition,
        converged,
    )


def _cluster(
    system: DelaySystem, s: ComplexArray, first: int, left: list[int]
) -> tuple[list[int], Root] | None:
    """Return the largest cluster about root ``first`` that is one multiple root, if any."""
    mirrored = [(i, s[i]) for i in left] + [(i, s[i].conjugate()) for i in left if s[i].imag > 0]
    mirrored.sort(key=lambda item: abs(item[1] - s[first]))
    values = np.array([value for _, value in mirrored])
    near = int((np.abs(values - s[first]) < _CLOSE * (1.0 + abs(s[first]))).sum())
    for size in range(near, 1, -1):
        members = values[:size]
        centre = complex(members.mean())
        if abs(centre.imag) < 1e-9 * (1.0 + abs(centre)):
            centre = complex(centre.real, 0.0)
        spread = float(np.abs(members - centre).max())
        outside = float(np.abs(values[size:] - centre).min()) if values.size > size else math.inf
        if outside < 4.0 * spread:
            continue
        floor = 1e-3 * (1.0 + abs(centre))
        radius = min(max(2.0 * spread, floor), 0.5 * outside)
        root = _multiple_root(system, members, centre, radius)
        if root is not None:
            return sorted({i for i, _ in mirrored[:size]}), root
    return None


def _multiple_root(
    system: DelaySystem, members: ComplexArray, centre: complex, radius: float
) -> Root | None:
    """Check that k roots in a disc are one k-fold root to within the tolerance.

    The moments of d ln det Δ over the circle count the roots inside and give their mean,
    which is analytic in the coefficients although the single roots are not.
    """
    size = members.size
    ring = radius * _CIRCLE
    slope = characteristic.log_derivative(system, centre + ring)
    count = complex((slope * ring).mean())
    if not abs(count - size) < 0.2:
        return None
    shift = complex((slope * ring * ring).mean()) / size
    if not abs(shift) < radius:
        return None
    refined = complex(centre.real + shift.real, centre.imag + shift.imag if centre.imag else 0.0)
    offsets = members - members.mean()
    spread = float(np.abs(offsets).max())
    # Measured where the split is felt most: a circle just outside the members.
    tight = max(2.0 * spread, 1e-6 * radius) * _CIRCLE
    ratio = np.prod(tight[:, None] / (tight[:, None] - offsets[None, :]), axis=1)
    sigma = _smallest_singular(system, refined + tight)
    change = float((np.abs(1.0 - ratio) * sigma / _weight(system, refined + tight)).max())
    if change > MULTIPLICITY_TOLERANCE:
        return None
    outer = _smallest_singular(system, refined + ring)
    weight = float(_weight(system, np.array([refined]))[0])
    rounding = change <= ROUNDING_TOLERANCE
    return Root(
        refined.real,
        abs(refined.imag),
        size,
        spread,
        refined.real if rounding else float(members.real.max()),
        float(_smallest_singular(system, np.array([refined]))[0]) / weight,
        weight * radius**size / float(outer.min()),
        True,
    )
