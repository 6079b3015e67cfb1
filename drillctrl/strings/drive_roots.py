"""Roots of string and drive under a free bit, from the echoes between both ends."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import ComplexArray
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.line import Line

_STEPS = 50
# Share of critical damping beyond which nothing swings.
_OVERDAMPED = 0.999


class DriveRoot(NamedTuple):
    """A root of string and drive.

    Attributes
    ----------
    frequency : float
        Of its modulus, Hz.
    damping_ratio : float
        Share of critical; negative where it grows.
    """

    frequency: float
    damping_ratio: float


def drive_roots(
    line: Line, control: DriveControl, highest: float, step: float = 1e-3
) -> tuple[DriveRoot, ...]:
    """Return the roots of torsion that swing, by frequency.

    A wave that comes back after both ends as it began, r E = 1, is a root. On s = iω its phase
    says where one is near, its size and how fast the phase turns how far; Newton's method does
    the rest on the exact characteristic function. Roots that are damped so strongly that no echo
    tells of them are left out.

    Parameters
    ----------
    line : Line
        The string in torsion.
    control : DriveControl
        Of the drive.
    highest : float
        Hz.
    step : float
        Hz between samples.
    """
    pipe = line.wave_impedance

    def function(s: ComplexArray) -> ComplexArray:
        speed, torque = control.ends(s)
        matrix, _ = line.scaled_transfer(s)
        moment = matrix[..., 1, 0] * speed + matrix[..., 1, 1] * s * torque
        return np.asarray(moment / (np.abs(s) + 1.0) ** 2)

    omega = 2.0 * np.pi * np.arange(step, highest + step, step)
    s = np.asarray(1j * omega, dtype=complex)
    matrix, _ = line.scaled_transfer(s)
    moment, angle = matrix[:, 1, 0], pipe * s * matrix[:, 1, 1]
    echo = control.reflection(s, pipe) * (moment - angle) / (moment + angle)
    phase = np.unwrap(np.angle(echo))
    turns = np.floor(phase / (2.0 * np.pi))
    found: list[complex] = []
    for at in np.flatnonzero(turns[1:] != turns[:-1]):
        slope = (phase[at + 1] - phase[at]) / (omega[at + 1] - omega[at])
        start = complex(np.log(np.abs(echo[at])) / abs(slope), omega[at])
        for begin in (start, 1j * omega[at]):
            root = _newton(function, begin)
            if root is not None and all(abs(root - known) > 1e-6 * abs(root) for known in found):
                found.append(root)
                break
    roots = [
        DriveRoot(abs(root) / (2.0 * np.pi), -root.real / abs(root))
        for root in found
        if 0.0 < root.imag < 2.0 * np.pi * highest and -root.real < _OVERDAMPED * abs(root)
    ]
    return tuple(sorted(roots))


def _newton(function: Callable[[ComplexArray], ComplexArray], start: complex) -> complex | None:
    s = start
    for _ in range(_STEPS):
        step = 1e-6 * max(abs(s), 1e-3)
        around = function(np.asarray(s + step * np.array([0.0, 1.0, -1.0]), dtype=complex))
        slope = (around[1] - around[2]) / (2.0 * step)
        change = complex(around[0] / slope) if slope else 0.0
        # A long step leads to another root.
        change *= min(1.0, 0.3 * abs(start) / max(abs(change), 1e-300))
        s -= change
        if abs(change) < 1e-11 * max(abs(s), 1e-3):
            return s
    return None
