"""How far the best gains within bounds bring the roots left of a line, by explicit curves.

The gains that hold a root at s = σ + iω form a curve with ω as its parameter (two gains), or
isolated values (one gain); a real root at σ adds a straight line, or one value. If some but
not all gains within the bounds put all roots left of σ, then these curves pass through a
place where every root that is not held there lies left of σ. So the lowest "next root" along
the curves decides, and where it vanishes lies the edge of what feedback can reach.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import elementwise

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.spectrum.characteristic import magnitude_bound
from drillctrl.synthesis.family import LoopFamily

_FREQUENCIES = 1500
_SPACING = 0.06
_ROUNDS = 12
_MOST = 8000
_GAPS = 60
_REFINEMENTS = 20
# Margins beyond this need no more digits: they do not lie near an edge.
_CLEAR = 0.1
_FLAT = 1e-7


@dataclass(frozen=True, eq=False)
class GainMargin:
    """The best place on the curves of gains that hold a root at the line.

    Attributes
    ----------
    margin : float
        Real part of the next root there, less σ: negative where some gains within the
        bounds put all roots left of the line; infinite where no curve enters the bounds and
        no gains do.
    omega : float
        Frequency of the root that is held; NaN where none is.
    gains : array, (k,)
        The gains there.
    places : int
        How many places on the curves were looked at.
    """

    margin: float
    omega: float
    gains: FloatArray
    places: int


@dataclass(frozen=True, eq=False)
class _Piece:
    """A curve in gain space: gains and held roots by a parameter."""

    at: FloatArray
    gains: FloatArray
    solve: Callable[[FloatArray], FloatArray]
    frequency: Callable[[FloatArray], FloatArray]


def gain_margin(family: LoopFamily, line: float = 0.0) -> GainMargin:
    """Find the gains within the bounds that hold a root at the line and leave the rest lowest.

    Parameters
    ----------
    family : LoopFamily
        Loops with one or two gains that drive one input.
    line : float
        σ.

    Raises
    ------
    InputError
        If there are more gains, or several inputs.
    """
    count = family.feedback.lower.size
    if count not in (1, 2):
        raise InputError("structure", f"{count} gains", "one with one or two free gains")
    if not family.is_affine:
        raise InputError("structure", family.feedback.name, "one with a single input")
    middle = 0.5 * (family.feedback.lower + family.feedback.upper)
    best = family.abscissa(middle)[0] - line
    found = GainMargin(best if best < 0.0 else np.inf, float("nan"), middle, 0)
    places = 0
    pieces = _isolated(family, line) if count == 1 else [_curve(family, line)]
    pieces += _real_crossings(family, line)
    for piece in pieces:
        margin, at, gains, looked = _lowest(family, piece, line)
        places += looked
        if margin < found.margin:
            omega = float(piece.frequency(np.array([at]))[0])
            found = GainMargin(margin, omega, gains, 0)
    return dataclasses.replace(found, places=places)


def _inside(family: LoopFamily, gains: FloatArray) -> np.ndarray:
    lower, upper = family.feedback.lower, family.feedback.upper
    slack = 1e-12 * (upper - lower)
    with np.errstate(invalid="ignore"):
        return np.asarray(((gains >= lower - slack) & (gains <= upper + slack)).all(axis=1))


def _lowest(family: LoopFamily, piece: _Piece, line: float) -> tuple[float, float, FloatArray, int]:
    """Return the lowest next root along a piece, where, the gains there, and places looked at."""

    def values(at: FloatArray, gains: FloatArray) -> FloatArray:
        result = np.full(at.size, np.inf)
        here = _inside(family, gains)
        held = np.asarray(line + 1j * piece.frequency(at[here]), dtype=complex)
        result[here] = _next_roots(family, gains[here], held) - line
        return result

    at, gains = piece.at, piece.gains
    margin = values(at, gains)
    for _ in range(_REFINEMENTS if at.size > 1 else 0):
        lowest = margin.min(initial=np.inf)
        if not np.isfinite(lowest) or lowest < -_CLEAR:
            break
        gaps = _promising(at, margin, min(float(lowest), 0.0))
        if gaps.size == 0:
            break
        new = 0.5 * (at[gaps] + at[gaps + 1])
        new_gains = piece.solve(new)
        new_margin = values(new, new_gains)
        at = np.insert(at, gaps + 1, new)
        gains = np.insert(gains, gaps + 1, new_gains, axis=0)
        margin = np.insert(margin, gaps + 1, new_margin)
    if margin.size == 0 or not np.isfinite(margin.min()):
        return np.inf, float("nan"), np.full(family.feedback.lower.size, np.nan), at.size
    i = int(margin.argmin())
    return float(margin[i]), float(at[i]), gains[i], at.size


def _promising(at: FloatArray, margin: FloatArray, target: float) -> np.ndarray:
    """Return the gaps between places in which the margin may fall below a target."""
    low, high = np.minimum(margin[1:], margin[:-1]), np.maximum(margin[1:], margin[:-1])
    with np.errstate(invalid="ignore"):
        step = np.where(np.isfinite(high), high - low, _CLEAR)
    # What the margin does next to a gap it may do within it.
    padded = np.concatenate([[0.0], step, [0.0]])
    reach = np.maximum(step, np.maximum(padded[:-2], padded[2:]))
    with np.errstate(invalid="ignore"):
        bound = low - reach
    wide = np.diff(at) > 1e-11 * (1.0 + np.abs(at[1:]))
    gaps = np.flatnonzero(np.isfinite(low) & (bound < target) & (reach > _FLAT) & wide)
    return np.sort(gaps[np.argsort(bound[gaps], kind="stable")[:_GAPS]])


def _next_roots(family: LoopFamily, gains: FloatArray, held: ComplexArray) -> FloatArray:
    """Return the largest real part of the roots other than the held ones, (q,)."""
    if len(gains) == 0:
        return np.zeros(0)
    roots = np.linalg.eigvals(family.matrices(gains)).astype(complex)
    for root in (held, np.where(held.imag > 0.0, held.conj(), np.nan)):
        rows = np.flatnonzero(np.isfinite(root))
        nearest = np.abs(roots[rows] - root[rows, None]).argmin(axis=1)
        roots[rows, nearest] = -np.inf
    return np.asarray(roots.real.max(axis=1))


def _grid(family: LoopFamily, line: float) -> FloatArray:
    """Return frequencies up to the bound that no root right of the line exceeds."""
    lower, upper = family.feedback.lower, family.feedback.upper
    corners = np.array(np.meshgrid(*zip(lower, upper, strict=True)))
    reach = max(magnitude_bound(family.loop(g), line) for g in corners.reshape(len(lower), -1).T)
    share = np.linspace(0.0, 1.0, _FREQUENCIES + 1)[1:]
    return np.asarray(reach * (0.3 * share + 0.7 * share**3))


def _affine(family: LoopFamily, line: float, omega: FloatArray) -> tuple[ComplexArray, ...]:
    s = np.asarray(line + 1j * omega, dtype=complex)
    value, slope = family.taylor(s, np.zeros(family.feedback.lower.size), 1)
    return value[:, 0], slope[:, 0]


def _isolated(family: LoopFamily, line: float) -> list[_Piece]:
    """Return the values of one gain with a root at σ + iω: Im(a b*) changes sign there."""
    omega = _grid(family, line)

    def imaginary(w: FloatArray) -> FloatArray:
        a, b = _affine(family, line, w)
        return np.asarray((a * b[:, 0].conj()).imag)

    def solve(w: FloatArray) -> FloatArray:
        a, b = _affine(family, line, w)
        return np.asarray((-a / b[:, 0]).real[:, None])

    values = imaginary(omega)
    change = np.flatnonzero(np.signbit(values[1:]) != np.signbit(values[:-1]))
    if change.size == 0:
        return []
    found = elementwise.find_root(imaginary, (omega[change], omega[change + 1])).x
    gains = solve(found)
    return [
        _Piece(found[i : i + 1], gains[i : i + 1], solve, lambda at: at) for i in range(found.size)
    ]


def _curve(family: LoopFamily, line: float) -> _Piece:
    """Return the curve of two gains, with points closely spaced within the bounds."""
    lower, upper = family.feedback.lower, family.feedback.upper
    width = upper - lower

    def solve(w: FloatArray) -> FloatArray:
        a, b = _affine(family, line, w)
        (p, q), (r, t) = (b[:, 0].real, b[:, 1].real), (b[:, 0].imag, b[:, 1].imag)
        det = p * t - q * r
        with np.errstate(divide="ignore", invalid="ignore"):
            first = (q * a.imag - t * a.real) / det
            second = (r * a.real - p * a.imag) / det
        gains = np.stack([first, second], axis=1)
        return np.where(np.isfinite(gains), gains, np.inf)

    omega = _grid(family, line)
    gains = solve(omega)
    for _ in range(_ROUNDS):
        place = (gains - lower) / width
        with np.errstate(invalid="ignore"):
            low, high = np.minimum(place[1:], place[:-1]), np.maximum(place[1:], place[:-1])
            step = (high - low).max(axis=1)
            # A piece far from the box by more than its own length does not enter it.
            near = ((low < 1.0 + step[:, None]) & (high > -step[:, None])).all(axis=1)
        split = np.flatnonzero(near & ~(step <= _SPACING))
        if split.size == 0 or omega.size > _MOST:
            break
        middle = 0.5 * (omega[split] + omega[split + 1])
        omega = np.insert(omega, split + 1, middle)
        gains = np.insert(gains, split + 1, solve(middle), axis=0)
    return _thinned(_Piece(omega, gains, solve, lambda at: at), family)


def _thinned(piece: _Piece, family: LoopFamily) -> _Piece:
    """Drop points that lie closer together than the spacing asks for."""
    width = family.feedback.upper - family.feedback.lower
    inside = _inside(family, piece.gains)
    place = np.where(inside[:, None], piece.gains / width, 0.0)
    length = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(place, axis=0)).max(axis=1))])
    cell = np.floor(length / (0.5 * _SPACING))
    edge = np.concatenate([[True], inside[1:] != inside[:-1]])
    edge |= np.concatenate([inside[1:] != inside[:-1], [True]])
    keep = edge | (inside & np.concatenate([[True], cell[1:] != cell[:-1]]))
    return _Piece(piece.at[keep], piece.gains[keep], piece.solve, piece.frequency)


def _real_crossings(family: LoopFamily, line: float) -> list[_Piece]:
    """Return the gains that put a real root at σ: one value, or a straight line."""
    lower, upper = family.feedback.lower, family.feedback.upper
    a, b = _affine(family, line, np.zeros(1))
    constant, slope = float(a[0].real), np.asarray(b[0].real)
    if not slope.any():
        return []

    def still(at: FloatArray) -> FloatArray:
        return np.zeros(at.shape)

    if lower.size == 1:
        gains = np.array([[-constant / slope[0]]])
        return [_Piece(np.zeros(1), gains, lambda at: np.repeat(gains, at.size, axis=0), still)]
    # Run along the axis on which the line is flatter.
    i = int(np.argmin(np.abs(slope)))

    def along(at: FloatArray) -> FloatArray:
        points = np.empty((at.size, 2))
        points[:, i] = at
        points[:, 1 - i] = -(constant + slope[i] * at) / slope[1 - i]
        return points

    # The stretch of the line that lies within the bounds of the other gain.
    first, last = lower[i], upper[i]
    if slope[i] != 0.0:
        ends = -(constant + slope[1 - i] * np.array([lower[1 - i], upper[1 - i]])) / slope[i]
        first, last = max(first, float(ends.min())), min(last, float(ends.max()))
    if not first < last:
        return []
    at = np.linspace(first, last, int(1.0 / _SPACING) + 1)
    return [_Piece(at, along(at), along, still)]
