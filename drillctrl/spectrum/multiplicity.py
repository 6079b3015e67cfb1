"""Multiple roots: a cluster told from roots apart, with residual and condition of each.

Contour moments give the centre of a cluster to rounding even though its members are known to
the k-th root of rounding only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic

BoolArray = npt.NDArray[np.bool_]
# Roots that a relative change of the coefficients this small makes coincide are reported
# as one multiple root: gains are rarely known to more digits.
MULTIPLICITY_TOLERANCE = 1e-8
# Below this the split of a cluster is rounding and says nothing about the system.
ROUNDING_TOLERANCE = 32 * float(np.finfo(float).eps)
_CIRCLE = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)
# Roots nearer than that, relative, may be one.
CLOSE = 0.2
# Share of a cluster's spread by which its members may be off before the circle's are taken.
_ASTRAY = 1e-2
# Share of what tells them apart that a circle's own errors may have.
_SHARP = 0.1
_LARGEST_CLUSTER = 24
# A count on a circle that is off by more is disturbed by a root close to it.
_SHARP_COUNT = 1e-12
# Relative rounding of a mean over the circle, at least.
_LEAST_NOISE = 1e-14


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


def resolve(system: DelaySystem, s: ComplexArray, done: BoolArray) -> tuple[Root, ...]:
    """Merge clusters and attach residual and condition."""
    left = list(range(s.size))
    roots: list[Root] = []
    while left:
        first = left[0]
        cluster = _cluster(system, s, first, left)
        if cluster is None:
            members, root = [first], _simple_root(system, complex(s[first]), bool(done[first]))
        else:
            members, root = cluster
        roots.append(root)
        left = [i for i in left if i not in members]
    return tuple(sorted(roots, key=lambda root: (-root.rightmost, root.imag)))


def rightmost(system: DelaySystem, s: ComplexArray) -> float:
    """Return the largest ``rightmost`` of what `resolve` makes of roots, without the rest."""
    left = np.argsort(-s.real, kind="stable").tolist()
    top = -math.inf
    while left and s[left[0]].real > top:
        members, root = _cluster(system, s, left[0], left) or ([left[0]], None)
        top = max(top, float(s[left[0]].real) if root is None else root.rightmost)
        left = [i for i in left if i not in members]
    return top


def _simple_root(system: DelaySystem, value: complex, converged: bool) -> Root:
    delta, slope = characteristic.matrix_and_derivative(system, np.array(value))
    size, left, right = characteristic.nearly_null(delta)
    weight = float(characteristic.weight(system, np.array([value]))[0])
    turn = abs(left.conj() @ slope @ right)
    return Root(
        float(value.real),
        float(value.imag),
        1,
        0.0,
        float(value.real),
        size / weight,
        weight / max(float(turn), 1e-300),
        converged,
    )


def _cluster(
    system: DelaySystem, s: ComplexArray, first: int, left: list[int]
) -> tuple[list[int], Root] | None:
    """Return the largest cluster about root ``first`` that is one multiple root, if any."""
    mirrored = [(i, s[i]) for i in left] + [(i, s[i].conjugate()) for i in left if s[i].imag > 0]
    mirrored.sort(key=lambda item: abs(item[1] - s[first]))
    values = np.array([value for _, value in mirrored])
    settled = np.delete(s, left)
    beside = np.abs(np.concatenate([settled, settled.conj()]) - s[first]).min(initial=math.inf)
    # Roots of a chain lie 2π/τ apart.
    close = CLOSE * (1.0 + abs(s[first]))
    close = min(close, 2.0 / system.max_delay) if system.delays else close
    near = min(int((np.abs(values - s[first]) < close).sum()), _LARGEST_CLUSTER)
    for size in range(near, 1, -1):
        members = values[:size]
        centre = complex(members.mean())
        if abs(centre.imag) < 1e-9 * (1.0 + abs(centre)):
            centre = complex(centre.real, 0.0)
        spread = float(np.abs(members - centre).max())
        outside = float(np.abs(values[size:] - centre).min()) if values.size > size else math.inf
        outside = min(outside, float(beside) - abs(centre - s[first]))
        if outside <= 4.0 * spread:
            continue
        # A wide circle: the mean is as exact as κ ε divided by its radius to the k − 1.
        wide = min(0.2 * (1.0 + abs(centre)), 0.3 / system.max_delay if system.delays else 1.0)
        radius = min(max(2.0 * spread, wide), 0.5 * outside)
        root = _multiple_root(system, members, centre, radius)
        if root is not None:
            return sorted({i for i, _ in mirrored[:size]}), root
    return None


def _change(
    system: DelaySystem, centre: complex, tight: ComplexArray, ratio: ComplexArray
) -> float:
    """Return the relative change of the coefficients that makes members of a cluster one."""
    at = centre + tight
    sizes = characteristic.smallest_singular(system, at) / characteristic.weight(system, at)
    return float((np.abs(1.0 - ratio) * sizes).max())


def _from_moments(moments: ComplexArray) -> ComplexArray:
    """Return numbers by their power sums Σ zʲ, j = 1 … k (Newton's identities)."""
    size = moments.size
    coefficients = np.zeros(size + 1, dtype=complex)
    coefficients[0] = 1.0
    for j in range(1, size + 1):
        known = coefficients[:j] @ moments[j - 1 :: -1][:j]
        coefficients[j] = -known / j
    return np.asarray(np.roots(coefficients), dtype=complex)


def _multiple_root(
    system: DelaySystem, members: ComplexArray, centre: complex, radius: float
) -> Root | None:
    """Check that k roots in a disc are one k-fold root to within the tolerance.

    The moments of d ln det Δ over the circle count the roots inside and give their mean,
    which is analytic in the coefficients although the single roots are not.
    """
    size = members.size
    offsets = members - members.mean()
    spread = float(np.abs(offsets).max())
    # Measured where the split is felt most: a circle just outside the members.
    tight = max(2.0 * spread, 1e-6 * radius) * _CIRCLE
    ratio = np.prod(tight[:, None] / (tight[:, None] - offsets[None, :]), axis=1)
    # Most that are no multiple root show it at a single point, even if the centre is rough.
    worst = [int(np.abs(1.0 - ratio).argmax())]
    if _change(system, centre, tight[worst], ratio[worst]) > 1e3 * MULTIPLICITY_TOLERANCE:
        return None
    for reach in (radius, 0.5 * radius, 0.25 * radius):
        ring = reach * _CIRCLE
        slope = characteristic.log_derivative(system, centre + ring)
        with np.errstate(invalid="ignore"):
            count = complex((slope * ring).mean())
        # A root that was not gathered may stand close outside, and would pull at the mean.
        if abs(count - size) < _SHARP_COUNT or reach < 8.0 * spread:
            break
    if not abs(count - size) < 0.2:
        return None
    shift = complex((slope * ring * ring).mean()) / size
    if not abs(shift) < reach:
        return None
    refined = complex(centre.real + shift.real, centre.imag + shift.imag if centre.imag else 0.0)
    change = _change(system, refined, tight, ratio)
    if change > MULTIPLICITY_TOLERANCE:
        return None
    # So close together the iteration may come to rest between roots: the circle knows better.
    exact = centre + _from_moments(np.array([(slope * ring ** (j + 1)).mean() for j in
                                             range(1, size + 1)]))  # fmt: skip
    apart = float(np.abs(exact - exact.mean()).max())
    astray = np.abs(exact[:, None] - members[None, :]).min(axis=1).max()
    # How far rounding throws numbers apart that are told by their power sums.
    thrown = reach * max(abs(count - size), _LEAST_NOISE) ** (1.0 / size)
    rounding = change <= ROUNDING_TOLERANCE and apart < 8.0 * thrown
    # The circle tells members by its own errors, or that they are nearer together than it seems.
    sharp = thrown < _SHARP * apart or apart + 4.0 * thrown < spread
    if not sharp and abs(refined - members.mean()) > spread:
        # Neither knows how far apart they are.
        rounding = True
    if not rounding and sharp and astray > _ASTRAY * spread:
        members, spread = exact, apart
    outer = characteristic.smallest_singular(system, refined + ring)
    weight = float(characteristic.weight(system, np.array([refined]))[0])
    residual = float(characteristic.smallest_singular(system, np.array([refined]))[0]) / weight
    if residual > MULTIPLICITY_TOLERANCE:
        return None
    return Root(
        refined.real,
        abs(refined.imag),
        size,
        spread,
        refined.real if rounding else float(members.real.max()),
        residual,
        weight * reach**size / max(float(outer.min()), 1e-300),
        True,
    )
