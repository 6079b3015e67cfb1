"""Characteristic roots: collocation finds them, the characteristic equation sharpens them.

Collocation supplies a starting value for every root right of a line; Aberth's simultaneous
iteration drives all of them to the characteristic equation without two of them meeting in
one root (`polishing`); clusters are told from roots apart (`multiplicity`).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray
from drillctrl.base.errors import InputError, UndecidedError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.reduced import reduced
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.climb import MOST_ROOTS, Climb
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.multiplicity import CLOSE, Root, resolve, rightmost
from drillctrl.spectrum.parts import parts
from drillctrl.spectrum.polishing import are_roots, polish
from drillctrl.spectrum.pseudospectral import (
    MAX_DEGREE,
    degree_for_reach,
    generator_eigenvalues,
    generator_size,
)

BoolArray = npt.NDArray[np.bool_]
_Gathered = tuple[ComplexArray, BoolArray, float]
# How far left of the rightmost start, relative, others are polished with it: a cluster, a
# root that stands alone.
_WIDE = 0.1
_NARROW = 1e-3
# How far, over what the starts have moved by, and how often others are taken along.
_AS_FAR, _WIDER = 4.0, 4
# Largest matrix of a collocation that is to resolve everything, and of one that is to
# supply first places only.
_LARGEST = 240
# The same of many states, as a multiple of them: a point of a count costs their cube.
_MANY, _LARGEST_SHARE = 30, 24
_SMALLEST = 100
# Roots that are iterated on together.
_FEW = 100


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
    if not system.delays:
        return _eigenvalues(system, depth, line)
    for gather in (_collocated, _apart):
        found = gather(system, depth, line)
        if found is not None:
            return found
    return _counted(system, depth, line)


def _apart(system: DelaySystem, depth: float, line: float | None) -> _Gathered | None:
    """Return the roots of the parts of a system; None if it has one part or they do not fit."""
    every = parts(system)
    if len(every) == 1 and every[0].delays == system.delays:
        return None
    try:
        found = [_gather(part, depth, line) for part in every]
    except UndecidedError:
        return None
    s = np.concatenate([found_there for found_there, _, _ in found])
    floor = line
    if floor is None:
        floor = max(float(s.real.max()) - depth, *(lowest for *_, lowest in found))
        if depth > 0.0 and not floor < s.real.max():
            # Numbers so large that a depth is rounded away.
            return None
    if not are_roots(system, s).all():
        return None
    return s[np.argsort(-s.real, kind="stable")], np.ones(s.size, dtype=bool), floor


def _eigenvalues(system: DelaySystem, depth: float, line: float | None) -> _Gathered:
    """Return the roots of a system without delays: no iteration knows them better."""
    values = np.linalg.eigvals(system.A0).astype(complex)
    floor = float(values.real.max()) - depth if line is None else line
    found = values[(values.imag >= 0.0) & (values.real >= floor)]
    found = found[np.argsort(-found.real, kind="stable")]
    return found, np.ones(found.size, dtype=bool), floor


def _collocated(system: DelaySystem, depth: float, line: float | None) -> _Gathered | None:
    """Polish what a collocation that resolves all of it supplies; None beyond its reach."""

    def in_reach(degree: int) -> bool:
        largest = _LARGEST_SHARE * system.order if system.order >= _MANY else _LARGEST
        return degree < MAX_DEGREE and generator_size(system, degree) <= largest

    # Drawn a little to the left, so that it need not be drawn again for most systems.
    sure = -0.5 / system.max_delay if system.delays else 0.0
    sure = sure if line is None else line
    reach = characteristic.tight_bound(system, sure)
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
                reach = characteristic.tight_bound(system, sure)
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
            near = int((np.abs(inside - top) < CLOSE * (1.0 + abs(top))).sum())
            slack = _NARROW if near == 1 and not 0.0 < top.imag < CLOSE else slack
        left = slack * (1.0 + np.abs(inside))
        for _ in range(_WIDER):
            start = inside[inside.real >= floor - left]
            s, done = polish(system, start)
            moved = np.abs(s - start)
            # What ran away to no number has moved as far as can be.
            moved[np.isnan(moved)] = np.inf
            wider = left
            if (moved > _NARROW * (1.0 + np.abs(start))).any():
                # A simple root starts far nearer than that: it has neighbours that pull.
                wider = np.maximum(wider, _WIDE * (1.0 + np.abs(inside)))
            # As far as one has come from the left another may still have to come.
            far = moved[(start.real >= floor) | (s.real >= floor)].max(initial=0.0)
            wider = np.maximum(wider, _AS_FAR * far)
            if not ((inside.real >= floor - wider) & (inside.real < floor - left)).any():
                break
            left = wider
        strayed = np.abs(s - start) > 0.1 * (1.0 + np.abs(start))
        lost = ~done | strayed
        wanted = floor
        if line is None:
            # Starts may lie right of their roots.
            wanted = min(floor, float(s.real[~lost].max(initial=-np.inf)) - depth)
        # Far left of what is wanted the collocation may be rough.
        if not (lost & ((start.real >= floor - _AS_FAR * far) | (s.real >= wanted))).any():
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
    found, refused = None, None
    for _ in range(20):
        floor = float(climb.roots[0].real) - depth if line is None else line
        try:
            most = MOST_ROOTS if line is not None or depth == unit else _FEW
            found = climb.right_of(floor, most)
        except UndecidedError as error:
            # Nearer to the rightmost root there are fewer to find.
            refused = error
        if found is not None or line is not None:
            break
        depth *= 0.25 if refused is None else 0.02
    if found is None:
        raise refused or climb.refuse(f"more than {MOST_ROOTS} roots lie right of {floor:.6g}")
    if not found.size and line is None:
        raise climb.refuse(f"none is found right of {floor:.6g}, near the rightmost")
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
    if generator_size(system, degree) <= _LARGEST:
        values = generator_eigenvalues(system, degree)
        places.append(values[np.argsort(-values.real)[:64]])
    return np.concatenate(places).astype(complex)


@checks_kinds
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
    s, _, _ = _gather(system, 0.0)
    top = complex(s[0])
    isolated = s.size == 1 or (np.abs(top - s[1:]) > CLOSE * (1.0 + abs(top))).all()
    if isolated and (top.imag == 0 or top.imag > CLOSE):
        return top.real / unit
    return rightmost(system, s) / unit


@checks_kinds
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
    return _slowed(resolve(system, s, done), unit), floor / unit


@checks_kinds
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
    why = ""
    for gather in (_collocated, _apart, _counted):
        try:
            found = gather(system, 0.0, line)
            if found is None:
                continue
            roots = tuple(root for root in resolve(system, *found[:2]) if root.rightmost >= line)
        except UndecidedError as error:
            why = why or error.permitted
            continue
        if _total(roots) == counted:
            return _slowed(roots, unit)
        why = f"{counted} roots are counted, {_total(roots)} found"
    raise InputError("right_of", right_of, f"another line: {why}")


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


def _total(roots: tuple[Root, ...]) -> int:
    """Return the number of roots, conjugates and multiplicities counted."""
    return sum(root.multiplicity * (2 if root.imag > 0 else 1) for root in roots)
