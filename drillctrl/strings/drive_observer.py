"""Observer-based control of a top drive: the string's first modes estimated and fed back.

The string turns as a whole with its drive, φ, and swings in its first modes qk under a held top:

    (J + I) φ'' + Σ Γk qk'' = u + …,   qk'' + Γk φ'' + ck qk' + ωk² qk = ψk T,

T the bit's torque. A Kalman filter estimates it all from the angle, speed and pipe torque that a
drive has, and a linear-quadratic regulator feeds it back against swings of the bit (Anderson and
Moore 1990). What both weigh is scanned for the largest smallest critical slope on the exact string.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer
from drillctrl.base.kinds import checks_kinds
from drillctrl.strings.drive_control import DriveControl, DriveMachine, Transfer
from drillctrl.strings.elements import elements, free_modes
from drillctrl.strings.line import Line
from drillctrl.strings.slopes import drive_is_stable, mode_slopes

# Swings of the bit that are worth one ζ of torque at the top, and noise of the measured torque.
_WEIGHTS, _NOISE = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0), (0.1, 0.3, 1.0)
# Weight of the angle by which the drive falls behind, over that of the bit's speed, 1/s².
_ANGLE = 0.05
# A swing of the top of 10 rpm must not take more than the torque limit.
_SMALLEST_SWING = 10.0 * math.pi / 30.0
_SOONEST = 2e-3
_MOST_MODES = 3


@checks_kinds
def observer_drive_control(line: Line, machine: DriveMachine, modes: int = 1) -> DriveControl:
    """Return an observer of the first modes of torsion with feedback of what it estimates.

    Parameters
    ----------
    line : Line
        The string in torsion.
    machine : DriveMachine
        The drive; its delay, lag and filters count as one lag in the observer. A swing of the
        top of 10 rpm at one of the first four modes never takes more than its torque limit.
    modes : int
        How many are estimated, 1 to 3.

    Returns
    -------
    DriveControl
        ``observer-N``.

    Raises
    ------
    InputError
        If no such law is stable on the exact string.
    """
    n = checked_integer("modes", modes, 1, _MOST_MODES)
    known = mode_slopes(line, None, 4)
    held = np.array([mode.mode_frequency for mode in known])
    best: tuple[float, DriveControl] | None = None
    model = _model(line, machine, n)
    for weight in _WEIGHTS:
        for noise in _NOISE:
            law = DriveControl(
                f"observer-{n}", machine, *_law(*model, line.wave_impedance, weight, noise)
            )
            swing = law.saturating_swing(held)
            if swing is not None and swing[0] < _SMALLEST_SWING:
                continue
            least = min(mode.slope for mode in mode_slopes(line, law, 4))
            if (best is None or least > best[0]) and drive_is_stable(line, law):
                best = least, law
    if best is None:
        raise InputError("structure", f"observer-{n}", "another: none is stable on this string")
    return best[1]


def _model(
    line: Line, machine: DriveMachine, count: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return A, the columns of the command and of the bit's torque, and what is seen and bad.

    States: φ, q1 …, their rates, and the torque of the drive. Rows seen: φ, φ', torque of the
    pipe on the drive; the row that is bad: the bit's speed.
    """
    chain = elements(line)
    found = free_modes(chain, count)
    shapes = np.zeros((chain.diagonal.shape[1], 1 + count))
    shapes[:, 0] = 1.0
    shapes[:-1, 1:] = found.shapes
    mass, damping, stiffness = (shapes.T @ chain.product(i, shapes) for i in range(3))
    mass[0, 0] += machine.inertia
    n = 1 + count
    inverse = np.linalg.inv(mass)
    a = np.zeros((2 * n + 1, 2 * n + 1))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n], a[n : 2 * n, n : 2 * n] = -inverse @ stiffness, -inverse @ damping
    a[n : 2 * n, -1] = inverse[:, 0]
    late = max(machine.lateness + machine.torque_filter, _SOONEST)
    a[-1, -1] = -1.0 / late
    command, bit = np.zeros(2 * n + 1), np.zeros(2 * n + 1)
    command[-1] = 1.0 / late
    bit[n : 2 * n] = inverse @ shapes[0]
    seen = np.zeros((3, 2 * n + 1))
    seen[0, 0] = seen[1, n] = 1.0
    seen[2] = machine.inertia * a[n]
    seen[2, -1] -= 1.0
    bad = np.zeros(2 * n + 1)
    bad[n : 2 * n] = shapes[0]
    return a, command, bit, seen, bad


def _law(
    a: FloatArray,
    command: FloatArray,
    bit: FloatArray,
    seen: FloatArray,
    bad: FloatArray,
    pipe: float,
    weight: float,
    noise: float,
) -> tuple[Transfer, Transfer]:
    """Return A and B of regulator and filter."""
    angle = np.zeros_like(bad)
    angle[0] = 1.0
    cost = np.outer(bad, bad) + _ANGLE * np.outer(angle, angle)
    cost += 1e-9 * np.eye(len(a))
    effort = np.array([[1.0 / (weight * pipe) ** 2]])
    b = command[:, None]
    gain = b.T @ scipy.linalg.solve_continuous_are(a, b, cost, effort) / effort
    # In units of the bit's torque: the pipe's as noisy as told, speed and angle by its ζ.
    sizes = np.array([1.0 / pipe, 1.0 / pipe, noise])
    drive = np.outer(bit, bit) + 1e-6 * np.outer(command, command) + 1e-12 * np.eye(len(a))
    spread = np.diag(sizes**2)
    trusted = scipy.linalg.solve_continuous_are(a.T, seen.T, drive, spread)
    into = trusted @ seen.T @ np.linalg.inv(spread)
    inner = a - b @ gain - into @ seen
    below = np.real(np.poly(inner))
    # det(sI − A + b c) − det(sI − A) is the numerator of c (sI − A)⁻¹ b.
    above = [np.real(np.poly(inner - np.outer(into[:, i], gain[0]))) - below for i in range(3)]
    speed = np.polyadd(np.append(above[1], 0.0), above[0])
    return (
        Transfer(tuple(speed), (*below, 0.0)),
        Transfer(tuple(-above[2]), tuple(below)),
    )
