"""Characteristic roots: collocation finds them, the characteristic equation sharpens them.

Collocation supplies a starting value for every root right of a line; Aberth's simultaneous
iteration drives all of them to the characteristic equation without two of them meeting in
one root; contour moments give the centre of a cluster to rounding even though its members
are known to the k-th root of rounding only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, UndecidedError, checked_number
from drillctrl.delay.reduced import reduced
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.climb import MOST_ROOTS, Climb
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.pseudospectral import (
    MAX_DEGREE,
    degree_for_reach,
    generator_eigenvalues,
)

BoolArray = npt.NDArray[np.bool_]
_Polished = tuple[ComplexArray, BoolArray]
_Gathered = tuple[ComplexArray, BoolArray, float]
EPSILON = float(np.finfo(float).eps)
# Roots that a relative change of the coefficients this small makes coincide are reported
# as one multiple root: gains are rarely known to more digits.
MULTIPLICITY_TOLERANCE = 1e-8
# Below this the split of a cluster is rounding and says nothing about the system.
ROUNDING_TOLERANCE = 32 * EPSILON
_CIRCLE = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)
# An iteration that comes to rest with steps larger than this has found a multiple root, or
# nothing: at a root Δ is singular to so much.
_ROUGH_STEP, _SINGULAR = 1e-7, 1e-12
_CLOSE = 0.2
# A count on a circle that is off by more is disturbed by a root close to it.
_SHARP_COUNT = 1e-8
# How far left of the rightmost start, relative, others are polished with it: a cluster, a
# root that stands alone.
_WIDE = 0.1
_NARROW = 1e-3
# Share of a cluster's spread by which its members may be off before the circle's are taken.
_ASTRAY = 1e-2
# Largest matrix of a collocation that is to resolve everything, and of one that is to
# supply first places only.
_LARGEST = 240
# The same of many states, as a multiple of them: a point of a count costs their cube.
_MANY, _LARGEST_SHARE = 30, 24
_SMALLEST = 100
_LARGEST_CLUSTER = 24
# Roots that are iterated on together.
_FEW = 100


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


def polish(system: DelaySystem, start: ComplexArray) -> _Polished:
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
        last = size
        # The iteration squares the error relative to the distance of the next root.
        square = size**2 <= EPSILON * scale * np.abs(gap).min(axis=1)
        done |= stalled | square | (size <= 4 * EPSILON * scale)
        if done.all():
            break
    rough = np.flatnonzero(done & (last > _ROUGH_STEP * (1.0 + np.abs(s))))
    if rough.size:
        done[rough] = _are_roots(system, s[rough])
    return s, done


def _are_roots(system: DelaySystem, s: ComplexArray) -> BoolArray:
    """Whether Δ is singular to rounding: of a multiple root more cannot be told."""
    return np.asarray(_smallest_singular(system, s) <= _SINGULAR * _weight(system, s))


def _polish_one(system: DelaySystem, s: complex) -> tuple[complex, bool]:
    """Do for a single root what `polish` does for many, at half the cost."""
    last = math.inf
    for _ in range(24):
        newton = 1.0 / characteristic.log_derivative_at(system, s)
        step = newton / (1.0 - newton / (2j * s.imag)) if s.imag else complex(newton.real)
        size, scale = abs(step), 1.0 + abs(s)
        if size >= last and size < 1e-3 * scale:
            return s, size <= _ROUGH_STEP * scale or bool(_are_roots(system, np.array([s]))[0])
        s -= step * min(1.0, 0.3 * scale / max(size, 1e-300))
        s = complex(s.real, abs(s.imag))
        last = size
        if size**2 <= EPSILON * scale * min(2.0 * s.imag or scale, scale):
            return s, True
    return s, False


def _gather(system: DelaySystem, depth: float, line: float | None = None) -> _Gathered:
    """Return polished roots, rightmost first, all of them converged, and where they end.

    Parameters
    ----------
    system : DelaySystem
        Any.
    depth : float
        How far left of the rightmost root roots are wanted.
    line : float, optional
        Roots right of it are wanted, whatever the depth.
    """
    found = _collocated(system, depth, line)
    return _counted(system, depth, line) if found is None else found


def _collocated(system: DelaySystem, depth: float, line: float | None) -> _Gathered | None:
    """Polish what a collocation that resolves all of it supplies; None beyond its reach."""
    ranks = sum(left.shape[1] for left, _ in system.factors)

    def in_reach(degree: int) -> bool:
        size = system.order + degree * ranks
        largest = _LARGEST_SHARE * system.order if system.order >= _MANY else _LARGEST
        return degree < MAX_DEGREE and size <= largest

    # Drawn a little to the left, so that it need not be drawn again for most systems.
    sure = -0.5 / system.max_delay if system.delays else 0.0
    sure = sure if line is None else line
    reach = characteristic.magnitude_bound(system, sure)
    degree = degree_for_reach(reach * system.max_delay)
    while in_reach(degree):
        values = generator_eigenvalues(system, degree)
        # No root lies beyond the bound: what the collocation has there is its own.
        inside = values[(values.imag >= 0) & (np.abs(values) <= 1.1 * reach)]
        floor = line
        if floor is None:
            while inside.size == 0 or inside.real.max() - depth < sure:
                if inside.size:
                    top = float(inside.real.max())
                    sure = min(top, sure) - depth - 0.01 * (1.0 + abs(top))
                else:
                    sure -= 0.5 / system.max_delay
                reach = characteristic.magnitude_bound(system, sure)
                degree = max(degree, degree_for_reach(reach * system.max_delay))
                if not in_reach(degree):
                    return None
                values = generator_eigenvalues(system, degree)
                inside = values[(values.imag >= 0) & (np.abs(values) <= 1.1 * reach)]
            floor = float(inside.real.max()) - depth
        elif inside.size == 0:
            return np.zeros(0, dtype=complex), np.zeros(0, dtype=bool), floor
        # Starting values of a k-fold root are off by the k-th root of the error.
        slack = _WIDE
        if depth == 0.0 and line is None:
            top = inside[int(np.argmax(inside.real))]
            near = int((np.abs(inside - top) < _CLOSE * (1.0 + abs(top))).sum())
            slack = _NARROW if near == 1 and not 0.0 < top.imag < _CLOSE else slack
        start = inside[inside.real >= floor - slack * (1.0 + np.abs(inside))]
        s, done = polish(system, start)
        if slack == _NARROW and (np.abs(s - start) > _NARROW * (1.0 + np.abs(start))).any():
            # A simple root starts far nearer than that: it has neighbours that pull.
            start = inside[inside.real >= floor - _WIDE * (1.0 + np.abs(inside))]
            s, done = polish(system, start)
        strayed = np.abs(s - start) > 0.1 * (1.0 + np.abs(start))
        lost = ~done | strayed
        # Far left of what is wanted the collocation may be rough.
        if not (lost & ((start.real >= floor) | (s.real >= floor))).any():
            s, done = s[~lost], done[~lost]
            order = np.argsort(-s.real, kind="stable")
            return s[order], done[order], floor
        degree *= 2
    return None


def _counted(system: DelaySystem, depth: float, line: float | None) -> _Gathered:
    """Return roots that the argument principle has counted.

    Raises
    ------
    UndecidedError
        If as many roots as are counted cannot be found.
    """
    climb = Climb(system, reduced(system))
    unit = 1.0 / system.max_delay if system.delays else 1.0
    climb.ascend(_first_places(system))
    if line is None:
        depth = max(min(depth, unit), 0.05 * unit)
    found = None
    for _ in range(20):
        floor = float(climb.roots[0].real) - depth if line is None else line
        found = climb.right_of(floor, MOST_ROOTS if line is not None or depth == unit else _FEW)
        if found is not None or line is not None:
            break
        depth *= 0.25
    if found is None:
        raise climb.refuse(f"more than {MOST_ROOTS} roots lie right of {floor:.6g}")
    s, done = polish(system, found) if found.size <= _FEW else (found, np.ones(found.size, bool))
    if not done.all():
        raise climb.refuse(f"{int((~done).sum())} of {done.size} roots do not converge")
    order = np.argsort(-s.real, kind="stable")
    return s[order], done[order], floor


def _first_places(system: DelaySystem) -> ComplexArray:
    """Return where to look first: eigenvalues without delay and of a small collocation."""
    ranks = max(1, sum(left.shape[1] for left, _ in system.factors))
    degree = max(4, (_SMALLEST - system.order) // ranks)
    places = [np.linalg.eigvals(system.A0), np.linalg.eigvals(system.A0 + sum(system.delayed))]
    if system.order + degree * ranks <= _LARGEST:
        values = generator_eigenvalues(system, degree)
        places.append(values[np.argsort(-values.real)[:64]])
    return np.concatenate(places).astype(complex)


def spectral_abscissa(system: DelaySystem) -> float:
    """Return the largest real part of the characteristic roots.

    Raises
    ------
    UndecidedError
        If the rightmost root cannot be found, or roots are counted right of it.

    Notes
    -----
    Where roots coincide to rounding the value is the real part of their centre; see
    `dominant_roots` for the spread.
    """
    system, unit = _in_own_units(system)
    s, done, _ = _gather(system, 0.0)
    top = complex(s[0])
    isolated = s.size == 1 or (np.abs(top - s[1:]) > _CLOSE * (1.0 + abs(top))).all()
    if isolated and (top.imag == 0 or top.imag > _CLOSE):
        return top.real / unit
    return max(root.rightmost for root in _resolve(system, s, done)) / unit


def dominant_roots(system: DelaySystem) -> tuple[Root, ...]:
    """Return the rightmost characteristic roots with imag ≥ 0, rightmost first.

    Those within 1/τ of the spectral abscissa are given, with τ the largest delay, or nearer
    to it if there are several hundred, and all of them where there is no delay.

    Raises
    ------
    UndecidedError
        If they cannot be told apart: it says what was tried.
    """
    return known_roots(system)[0]


def known_roots(system: DelaySystem, most: int | None = None) -> tuple[tuple[Root, ...], float]:
    """Return `dominant_roots`, ``most`` at most, and a line that no others lie right of.

    It lies 1/τ left of the spectral abscissa unless that would be too many roots.
    """
    system, unit = _in_own_units(system)
    depth = 1.0 / system.max_delay if system.delays else 1e300
    s, done, floor = _gather(system, depth)
    if most is not None and s.size > most:
        # Cut where it is least likely to part a cluster.
        half = most // 2
        cut = half + int(np.argmax(s.real[half:most] - s.real[half + 1 : most + 1])) + 1
        floor = max(floor, float(s.real[cut]))
        s, done = s[:cut], done[:cut]
    return _slowed(_resolve(system, s, done), unit), floor / unit


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
    system, unit = _in_own_units(system)
    line *= unit
    counted = count_right_of(system, line).count
    if counted is None:
        raise InputError("right_of", right_of, "another line: roots right of it cannot be counted")
    if counted == 0:
        return ()
    try:
        for gather in (_collocated, _counted):
            found = gather(system, 0.0, line)
            if found is None:
                continue
            roots = tuple(root for root in _resolve(system, *found[:2]) if root.rightmost >= line)
            if _total(roots) == counted:
                return _slowed(roots, unit)
    except UndecidedError as error:
        raise InputError("right_of", right_of, f"another line: {error.permitted}") from None
    raise InputError(
        "right_of", right_of, f"another line: {counted} roots are counted, {_total(roots)} found"
    )


def _in_own_units(system: DelaySystem) -> tuple[DelaySystem, float]:
    """Return the system balanced, in a unit of time that suits its roots, and that unit."""
    system = system.balanced
    delay = system.max_delay
    size = float(np.abs(system.A0).max())
    if 1e-2 <= delay <= 1e2 and size * max(delay, 1.0) >= 1e-2:
        return system, 1.0
    bound = characteristic.magnitude_bound(system, 0.0)
    if not bound > 1e-290:
        return system, 1.0
    unit = 2.0 ** round(math.log2(max(delay, 1.0 / bound)))
    return system.scaled_time(unit), unit


def _slowed(roots: tuple[Root, ...], unit: float) -> tuple[Root, ...]:
    """Return roots per old unit of time."""
    if unit == 1.0:
        return roots
    return tuple(
        replace(
            root,
            real=root.real / unit,
            imag=root.imag / unit,
            spread=root.spread / unit,
            rightmost=root.rightmost / unit,
            condition=root.condition / unit**root.multiplicity,
        )
        for root in roots
    )


def _resolve(system: DelaySystem, s: ComplexArray, done: BoolArray) -> tuple[Root, ...]:
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


def _total(roots: tuple[Root, ...]) -> int:
    """Return the number of roots, conjugates and multiplicities counted."""
    return sum(root.multiplicity * (2 if root.imag > 0 else 1) for root in roots)


def _weight(system: DelaySystem, s: ComplexArray) -> FloatArray:
    """S(s) = ‖A0‖ + Σ ‖Ai‖ |exp(−sτi)|, what relative changes are measured against."""
    first, *others = system.norms
    total = np.full(s.shape, first)
    for delay, norm in zip(system.delays, others, strict=True):
        total += norm * np.exp(np.minimum(-s.real * delay, 300.0))
    return np.asarray(np.maximum(total, 1e-300))


def _smallest_singular(system: DelaySystem, s: ComplexArray) -> FloatArray:
    values = np.linalg.svd(characteristic.matrix(system, s), compute_uv=False)
    return np.asarray(values[..., -1])


def _simple_root(system: DelaySystem, value: complex, converged: bool) -> Root:
    delta, slope = characteristic.matrix_and_derivative(system, np.array(value))
    left, sizes, right = np.linalg.svd(delta)
    weight = float(_weight(system, np.array([value]))[0])
    turn = abs(left[:, -1].conj() @ slope @ right[-1].conj())
    return Root(
        float(value.real),
        float(value.imag),
        1,
        0.0,
        float(value.real),
        float(sizes[-1]) / weight,
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
    close = _CLOSE * (1.0 + abs(s[first]))
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
    sizes = _smallest_singular(system, at) / _weight(system, at)
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
    if change > ROUNDING_TOLERANCE:
        # So close together the iteration may come to rest between roots: the circle knows better.
        exact = centre + _from_moments(np.array([(slope * ring ** (j + 1)).mean() for j in
                                                 range(1, size + 1)]))  # fmt: skip
        astray = np.abs(exact[:, None] - members[None, :]).min(axis=1).max()
        if astray > _ASTRAY * spread:
            members, spread = exact, float(np.abs(exact - exact.mean()).max())
    outer = _smallest_singular(system, refined + ring)
    weight = float(_weight(system, np.array([refined]))[0])
    residual = float(_smallest_singular(system, np.array([refined]))[0]) / weight
    if residual > MULTIPLICITY_TOLERANCE:
        return None
    rounding = change <= ROUNDING_TOLERANCE
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
