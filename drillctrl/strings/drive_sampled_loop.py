"""The loop of a sampled law and its drive, on endless pipe and on the string itself."""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np
import scipy.linalg

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.rig import Rig
from drillctrl.strings.changed import changed_rig, string_of
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.drive_sampled import DriveNode, SampledDrive
from drillctrl.strings.drive_verdict import enough, stiff_slope, told
from drillctrl.strings.elements import Matrices, resolved
from drillctrl.strings.line import Line
from drillctrl.strings.slopes import lowest_impedance

# Hz, up to which the string of a sampled loop is right, and how closely.
_FREQUENCY, _TOLERANCE = 10.0, 5e-3
# Growth, 1/s, from which a loop counts as unstable: a string that turns freely has a root at 0.
_GROWTH = 1e-4
# Coordinates of a law that change its string.
_OF_STRING = ("depth", "mud")
# Of a radius.
_ROUNDING = 1e-6
# Between slopes of zero and of the lowest stretch's impedance.
_HALVINGS = 14


@checks_kinds
def sampled_radius(law: SampledDrive, pipe: float) -> float:
    """Return the spectral radius of a sampled drive on endless pipe; above 1 its loop grows.

    That is the fast part of the loop. Waves that return are slower: `sampled_slope` counts them.

    Parameters
    ----------
    law : SampledDrive
        The largest radius of all its places is taken.
    pipe : float
        ζ of the uppermost pipe, N m s/rad.
    """
    pipe = checked_number("pipe", pipe, 0.0, 1e9)
    motion = np.array([[-pipe]]) / law.machine.inertia, np.array([1.0]) / law.machine.inertia
    return max(_radius(law, node, motion) for node in law.nodes)


@checks_kinds
def sampled_slope(law: SampledDrive, line: Line, node: int = 0) -> float:
    """Return the critical slope of a string whose drive is under a sampled law, N m s/rad.

    The torque is held between samples, and comes late by whole periods; the string is in modes
    up to 10 Hz and whatever folds onto them, the bit's torque falls with its speed.

    Parameters
    ----------
    law : SampledDrive
        The law.
    line : Line
        The string in torsion.
    node : int
        Which of the law's places.

    Returns
    -------
    float
        By how much the torque may fall per speed; 0 where drive and string swing up under a bit
        that turns freely, the impedance of the lowest stretch where no slope does it.
    """
    at = checked_integer("node", node, 0, len(law.nodes) - 1)

    def stands(slope: float) -> bool:
        motion = _on_string(line, law.machine, slope)
        return _radius(law, law.nodes[at], motion) <= 1.0 + _GROWTH * law.period

    low, high = 0.0, lowest_impedance(line)
    if not stands(low):
        return 0.0
    if stands(high):
        return high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stands(middle) else (low, middle)
    return low


@checks_kinds
def sampled_slopes(law: SampledDrive, rig: Rig) -> tuple[float, ...]:
    """Ask the string of a rig whether a sampled law does it harm.

    Parameters
    ----------
    law : SampledDrive
        Each of its laws is asked of the string at its depth and mud; one that stands anywhere of
        the string as it is.
    rig : StringRig
        The rig.

    Returns
    -------
    tuple of float
        `sampled_slope` at each place.

    Raises
    ------
    InputError
        If with this period drive and pipe swing up, or a string stands less than under a stiff
        drive.
    """
    string = string_of(rig)
    shown = f"{law.period:g} s"
    radius = sampled_radius(law, string.torsion.wave_impedance)
    if radius > 1.0 + _ROUNDING:
        wanted = f"shorter: with it drive and pipe alone swing up, {radius:.3g}-fold a sample"
        raise InputError("period", shown, wanted)
    found = []
    for node, place in enumerate(itertools.product(*(values for _, values in law.axes))):
        names = (name for name, _ in law.axes)
        # A law that stands anywhere is asked of the string as it is.
        moved = {n: at for n, at in zip(names, place, strict=True) if n in _OF_STRING and at}
        there = changed_rig(rig, **moved).string if moved else string
        line = there.torsion
        stands = sampled_slope(law, line, node)
        if stands < enough(line, law.machine):
            swings = f"the string stands {stands:.4g} N·m·s" if stands else "it swings up"
            stiff = told(stiff_slope(line, law.machine))
            wanted = f"{swings} at {there.length:.6g} m, under a stiff drive {stiff}"
            raise InputError("period", shown, f"shorter: with it {wanted}")
        found.append(stands)
    return tuple(found)


@functools.lru_cache(maxsize=8)
def _matrices(line: Line) -> Matrices:
    return resolved(line, _FREQUENCY, _TOLERANCE)[0].matrices


def _on_string(line: Line, machine: DriveMachine, slope: float) -> tuple[FloatArray, FloatArray]:
    """Return the matrix of drive and string, the top's speed first, and what torque does."""
    mass, damping, stiffness = (part.copy() for part in _matrices(line))
    mass[-1, -1] += machine.inertia
    damping[0, 0] -= slope
    k = len(mass)
    inverse, none = np.linalg.inv(mass)[::-1, ::-1], np.zeros((k, k))
    # The top first, the bit last.
    moved = np.block([[-inverse @ damping[::-1, ::-1], -inverse @ stiffness[::-1, ::-1]],
                      [np.eye(k), none]])  # fmt: skip
    return moved, np.append(inverse[:, 0], np.zeros(k))


def _radius(law: SampledDrive, node: DriveNode, motion: tuple[FloatArray, FloatArray]) -> float:
    """Return the spectral radius of one law's loop, by its matrix."""
    machine, step = law.machine, law.period
    a, b = motion
    k = len(b)
    # Then the torque that acts, and the one that is asked for and held.
    whole = np.zeros((k + 2, k + 2))
    whole[:k, :k], whole[:k, k] = a, b
    whole[k, k:] = np.array([-1.0, 1.0]) / max(machine.lag, 1e-3 * step)
    moved = scipy.linalg.expm(step * whole)[: k + 1]
    late = math.ceil(machine.delay / step - 1e-9)
    stiff, kept, new, held = law.filters
    n = law.order
    # Beside these: filtered speed and torque, speed before, integral, law, commands.
    rows = np.eye(k + 1 + 4 + n + late + 1)
    speed, given = rows[0], rows[k]
    slow, drag, before, integral = rows[k + 1 : k + 5]
    states, asked = rows[k + 5 : k + 5 + n], rows[k + 5 + n :]
    slow = kept * slow + new * (speed + before)
    drag = held * drag + (1.0 - held) * given
    seen = np.stack([speed, stiff * (speed - slow) - drag])
    integral = integral - node.K * 0.5 * step * (speed + before)
    torque = node.C @ states + node.D @ seen + integral
    acting = torque if late == 0 else asked[late - 1]
    after = np.vstack(
        [moved @ np.vstack([rows[: k + 1], acting]), slow, drag, speed, integral,
         node.F @ states + node.G @ seen, torque, asked[:late]]
    )  # fmt: skip
    return float(abs(np.linalg.eigvals(after)).max())
