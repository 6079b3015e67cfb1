"""Decide by the explicit boundary whether any gains within bounds put all roots left of a line.

With one or two gains the gains that hold a root at s = σ + iω form an explicit set: for two
gains a curve with ω as its parameter, for one gain isolated values; a real root at s = σ
adds a straight line (or one value). If some gains in the box put all roots left of σ but
not all do, the box meets the edge of that set, and on the edge every root other than those
held at σ lies left of it. So it suffices to follow the boundary within the box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillctrl.optimisation.family import LoopFamily
from drillctrl.spectrum.characteristic import ComplexArray, FloatArray, magnitude_bound

_FREQUENCIES = 4000
_SPACING = 0.01
_ROUNDS = 12
_MOST = 20_000


@dataclass(frozen=True)
class BoundaryDecision:
    """Whether some gains within the bounds put all roots left of a line.

    Attributes
    ----------
    line : float
        σ.
    possible : bool
        The answer.
    next_root : float
        Smallest real part, over the boundary within the bounds, of the rightmost root that
        is not held at the line; infinite where no boundary enters the box.
    points : int
        Places on the boundary that were looked at.
    spacing : float
        Largest step between them, as a share of the bounds: what decides the answer could
        hide only in a part of the boundary shorter than this.
    """

    line: float
    possible: bool
    next_root: float
    points: int
    spacing: float


def decide(family: LoopFamily, line: float = 0.0) -> BoundaryDecision | None:
    """Decide whether gains within the bounds put all roots left of Re s = ``line``.

    Parameters
    ----------
    family : LoopFamily
        Loops with one or two gains that drive one input.
    line : float
        σ.

    Returns
    -------
    BoundaryDecision or None
        None where there are more gains, or several inputs.
    """
    count = family.feedback.lower.size
    if count not in (1, 2) or not family.is_affine:
        return None
    lower, upper = family.feedback.lower, family.feedback.upper
    pairs, omega = (_isolated if count == 1 else _curve)(family, line)
    real = _real_crossings(family, line)
    gains = np.vstack([pairs, real])
    held = np.concatenate([omega, np.zeros(len(real))])
    others = _other_roots(family, gains, line + 1j * held)
    next_root = float(others.min()) if others.size else np.inf
    inside = float(family.abscissa(0.5 * (lower + upper))[0]) < line
    return BoundaryDecision(
        line, inside or next_root < line, next_root, len(gains), _SPACING if count == 2 else 0.0
    )


def _affine(family: LoopFamily, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    values, slopes = family.taylor(s, np.zeros(family.feedback.lower.size), 1)
    return values[:, 0], slopes[:, 0]


def _grid(family: LoopFamily, line: float) -> FloatArray:
    """Return frequencies up to the bound that no root right of the line exceeds."""
    corners = np.array(np.meshgrid(*zip(family.feedback.lower, family.feedback.upper, strict=True)))
    reach = max(magnitude_bound(family.loop(g), line) for g in corners.reshape(len(corners), -1).T)
    # Closest where roots are: spacing grows with the frequency.
    share = np.linspace(0.0, 1.0, _FREQUENCIES + 1)[1:]
    return np.asarray(reach * (0.3 * share + 0.7 * share**3))


def _isolated(family: LoopFamily, line: float) -> tuple[FloatArray, FloatArray]:
    """Return all g, (q, 1), and ω > 0 with a root at σ + iω, where Im(a b*) changes sign."""
    omega = _grid(family, line)

    def imaginary(w: FloatArray) -> tuple[FloatArray, FloatArray]:
        a, b = _affine(family, np.asarray(line + 1j * w, dtype=complex))
        b = b[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = -a / b
        return np.asarray((a * b.conj()).imag), np.asarray(ratio.real)

    values, _ = imaginary(omega)
    change = np.flatnonzero(np.signbit(values[1:]) != np.signbit(values[:-1]))
    low, high, sign = omega[change], omega[change + 1], np.signbit(values[change])
    for _ in range(60):
        middle = 0.5 * (low + high)
        left = np.signbit(imaginary(middle)[0]) == sign
        low, high = np.where(left, middle, low), np.where(left, high, middle)
    omega = 0.5 * (low + high)
    gains = imaginary(omega)[1]
    within = (gains >= family.feedback.lower) & (gains <= family.feedback.upper)
    return gains[within, None], omega[within]


def _curve(family: LoopFamily, line: float) -> tuple[FloatArray, FloatArray]:
    """Return points (q, 2) and ω of the curve within the box, closely spaced."""
    lower, upper = family.feedback.lower, family.feedback.upper
    width = upper - lower

    def solve(w: FloatArray) -> FloatArray:
        a, b = _affine(family, np.asarray(line + 1j * w, dtype=complex))
        matrix = np.stack([b.real, b.imag], axis=1)
        right = -np.stack([a.real, a.imag], axis=1)
        det = np.linalg.det(matrix)
        gains = np.full((w.size, 2), np.inf)
        regular = np.abs(det) > 1e-14 * np.abs(matrix).max(axis=(1, 2)) ** 2
        gains[regular] = np.linalg.solve(matrix[regular], right[regular][..., None])[..., 0]
        return gains

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
    within = ((gains >= lower) & (gains <= upper)).all(axis=1)
    return gains[within], omega[within]


def _real_crossings(family: LoopFamily, line: float) -> FloatArray:
    """Return gains in the box that put a real root at σ, (q, k)."""
    lower, upper = family.feedback.lower, family.feedback.upper
    a, b = _affine(family, np.array([line + 0j]))
    constant, slope = float(a[0].real), b[0].real
    if not slope.any():
        return np.zeros((0, lower.size))
    if lower.size == 1:
        gains = np.array([[-constant / slope[0]]])
    else:
        # Run along the axis on which the line is flatter.
        i = int(np.argmin(np.abs(slope)))
        gains = np.empty((int(2.0 / _SPACING) + 1, 2))
        gains[:, i] = np.linspace(lower[i], upper[i], len(gains))
        gains[:, 1 - i] = -(constant + slope[i] * gains[:, i]) / slope[1 - i]
    within = ((gains >= lower) & (gains <= upper)).all(axis=1)
    return np.asarray(gains[within])


def _other_roots(family: LoopFamily, gains: FloatArray, held: ComplexArray) -> FloatArray:
    """Return the largest real part of the roots other than the held ones, (q,)."""
    values: list[FloatArray] = []
    for start in range(0, len(gains), 500):
        some, here = gains[start : start + 500], held[start : start + 500]
        roots = np.linalg.eigvals(family.matrices(some)).astype(complex)
        for root in (here, np.where(here.imag > 0.0, here.conj(), np.nan)):
            rows = np.flatnonzero(np.isfinite(root))
            nearest = np.abs(roots[rows] - root[rows, None]).argmin(axis=1)
            roots[rows, nearest] = -np.inf
        values.append(roots.real.max(axis=1))
    return np.concatenate(values) if values else np.zeros(0)
