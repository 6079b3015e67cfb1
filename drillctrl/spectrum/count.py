"""Count the characteristic roots right of a line by the argument principle.

Independent of how the roots were found: only det Δ is evaluated, on the line itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drillctrl.delay_system import DelaySystem
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.characteristic import FloatArray, magnitude_bound

_LARGEST_TURN = 0.8
_MAX_POINTS = 200_000


@dataclass(frozen=True)
class RootCount:
    """Number of characteristic roots right of a line.

    Attributes
    ----------
    line : float
        Re s of the line.
    count : int or None
        Roots right of it, with multiplicity, conjugates counted; None if undecided.
    height : float
        The line was followed up to this |Im s|; beyond it the norm bound decides.
    points : int
        Evaluations of det Δ.
    """

    line: float
    count: int | None
    height: float
    points: int


def _determinant(system: DelaySystem, line: float, omega: FloatArray) -> np.ndarray:
    """Return det Δ(line + iω) / |s + height|^n, so that nothing overflows."""
    s = line + 1j * omega
    delta = characteristic.matrix(system, s) / (1.0 + np.abs(s))[:, None, None]
    return np.asarray(np.linalg.det(delta))


def count_right_of(system: DelaySystem, line: float, hints: FloatArray | None = None) -> RootCount:
    """Count the roots with Re s > ``line``.

    For |s| above the Perron bound ρ each eigenvalue of I − M(s)/s turns by less than
    asin(ρ/|s|), so det Δ(s)/sⁿ stays in the right half-plane beyond ρ/sin(π/2n) and the
    contour closes at infinity without further evaluation. Below, steps are halved until
    det Δ turns by less than 0.8 rad in each.

    Parameters
    ----------
    system : DelaySystem
        Any.
    line : float
        Re s of the line.
    hints : array, optional
        Imaginary parts near which roots lie close to the line.
    """
    n = system.order
    height = magnitude_bound(system, line) / math.sin(math.pi / (2 * n)) * 1.001 + 1e-9
    spacing = min(0.5 / max(system.max_delay, 1e-300), height / 24)
    first = min(64 + 2 * int(height / spacing), _MAX_POINTS // 8)
    # Denser towards the bottom, where det Δ is far from its asymptote.
    grid = height * np.linspace(0.0, 1.0, first) ** 1.5
    if hints is not None and len(hints):
        near = np.abs(np.asarray(hints))[:, None] + spacing * np.array([-0.1, -0.02, 0.02, 0.1])
        grid = np.union1d(grid, near[(near > 0) & (near < height)])
    omega, values = grid, _determinant(system, line, grid)
    points = omega.size
    while True:
        if (values == 0).any() or not np.isfinite(values).all():
            return RootCount(line, None, height, points)
        turn = np.angle(values[1:] / values[:-1])
        coarse = np.flatnonzero(np.abs(turn) > _LARGEST_TURN)
        if coarse.size == 0:
            break
        middle = 0.5 * (omega[coarse] + omega[coarse + 1])
        exhausted = (middle <= omega[coarse]).any() or points > _MAX_POINTS
        if exhausted or (omega[coarse + 1] - omega[coarse] < 1e-13 * height).any():
            return RootCount(line, None, height, points)
        between = _determinant(system, line, middle)
        omega = np.insert(omega, coarse + 1, middle)
        values = np.insert(values, coarse + 1, between)
        points += middle.size
    end = line + 1j * omega[-1]
    rest = n * (math.pi / 2 - np.angle(end)) - np.angle(values[-1] / (end / abs(end)) ** n)
    count = n / 2 - (turn.sum() + rest) / math.pi
    whole = round(float(count))
    return RootCount(line, whole if abs(count - whole) < 1e-3 else None, height, points)
