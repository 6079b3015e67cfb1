"""Torsional modes of a string, and what becomes of them where the bit answers to its speed."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.case import Where, as_case

_ANGLES = ("angle", "angular_rate")
# Motions that are damped more than this share of critical are no modes.
_OSCILLATES = 0.9
_STEPS = 24


@dataclass(frozen=True, eq=False)
class TorsionalMode:
    """A torsional mode of the string and its drive with nothing at the bit.

    Attributes
    ----------
    number : int
        1 for the slowest.
    root : complex
        Of the string alone, in the upper half plane.
    follows : complex
        ∂s/∂H, how the root follows the bit's answer.
    matrix : array, (k, k)
        Of the torsional states, θ and θ' of the bit first.
    load : array, (k,)
        What a torque on the bit does to them.
    """

    number: int
    root: complex
    follows: complex
    matrix: FloatArray = field(repr=False)
    load: FloatArray = field(repr=False)

    @property
    def damping(self) -> float:
        """Own damping as seen at the bit: −Re H at which the mode stops decaying, first order."""
        return -self.root.real / -self.follows.real

    def with_response(self, value: complex) -> complex:
        """Return the mode's root where the bit answers with H, any complex number.

        Of one degree of freedom it is the root of s² + (2κ + H) s + 1.
        """
        root = self.root
        for share in np.linspace(0.0, 1.0, _STEPS + 1)[1:]:
            closed = self.matrix.astype(complex)
            closed[:, 1] += share * value * self.load
            roots = np.linalg.eigvals(closed)
            root = complex(roots[np.argmin(np.abs(roots - root))])
        return root


def torsional_states(where: Where) -> tuple[FloatArray, FloatArray, list[int]]:
    """Return the torsional motion of string and drive, nothing at the bit.

    Returns
    -------
    matrix : array, (k, k)
        Of the torsional states, θ and θ' of the bit first.
    load : array, (k,)
        What a torque on the bit does to them.
    places : list of int
        Those states among all of the plant.

    Raises
    ------
    InputError
        If there is no plant, axial motion enters torsion elsewhere than at the bit, or a
        signal arrives late.
    """
    case = as_case(where)
    plant, _ = case.physics("a torsional mode")
    arrays = case.motion()
    if arrays.late:
        raise InputError("plant", f"a signal that arrives {arrays.late[0][0]:g} late", "without")
    states = plant.linear.states
    places = [i for i, state in enumerate(states) if state.quantity in _ANGLES]
    others = [i for i in range(len(states)) if i not in places]
    if arrays.A[np.ix_(places, others)].any() or arrays.E[places, 0].any():
        raise InputError("string", "coupled between x and theta", "uncoupled but for the bit")
    return arrays.A[np.ix_(places, places)], arrays.E[places, 1], places


@checks_kinds
def torsional_modes(where: Where, count: int = 1) -> tuple[TorsionalMode, ...]:
    """Return the slowest torsional modes of string and drive, nothing at the bit.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where.
    count : int
        At most so many.

    Raises
    ------
    InputError
        If there is no plant, it has no torsional mode, axial motion enters torsion elsewhere
        than at the bit, or a signal arrives late.
    """
    count = checked_integer("modes", count, 1, 100)
    matrix, load, _ = torsional_states(where)
    roots, right = np.linalg.eig(matrix)
    left = np.linalg.inv(right)
    swings = np.flatnonzero((roots.imag > 0.0) & (-roots.real < _OSCILLATES * np.abs(roots)))
    if swings.size == 0:
        raise InputError("string", "without a torsional mode", "one whose bit can swing")
    slowest = swings[np.argsort(roots[swings].imag)][:count]
    return tuple(
        TorsionalMode(
            k + 1, complex(roots[i]), complex((left[i] @ load) * right[1, i]), matrix, load
        )
        for k, i in enumerate(slowest)
    )


def forced_speed(
    mode: TorsionalMode, value: complex, torque: FloatArray, spacing: float
) -> FloatArray:
    """Return the bit's speed, beside its mean, that a torque on it forces, (k,).

    Parameters
    ----------
    mode : TorsionalMode
        Any of the string; all of its torsion moves.
    value : complex
        H at the mode; its imaginary part acts as a stiffness there.
    torque : array, (k,)
        At equal distances, with zero mean; the string is at rest before.
    spacing : float
        The distance.

    Raises
    ------
    InputError
        If the string does not decay with that H.
    """
    closed = answering(mode.matrix, mode.load, value, mode.root.imag)
    if not np.linalg.eigvals(closed).real.max() < 0.0:
        raise InputError("response", value, "one with which the string decays")
    size = mode.load.size
    augmented = np.zeros((size + 2, size + 2))
    augmented[:size, :size], augmented[:size, size] = closed, mode.load
    augmented[size, size + 1] = 1.0
    step = scipy.linalg.expm(augmented * spacing)
    # Exact for a torque that runs straight between its samples.
    now, slope = step[:size, size], step[:size, size + 1] / spacing
    values, vectors = np.linalg.eig(step[:size, :size])
    inverse = np.linalg.inv(vectors)
    begin, end = inverse @ (now - slope), inverse @ slope
    speed = np.zeros(torque.size)
    for factor, a, b, row in zip(values, begin, end, vectors[1], strict=True):
        entering = a * torque[:-1] + b * torque[1:]
        speed[1:] += (row * scipy.signal.lfilter([1.0], [1.0, -factor], entering)).real
    return speed


def ripple_of(
    mode: TorsionalMode, value: complex, torque: FloatArray, spacing: float
) -> FloatArray:
    """Return the second half of `forced_speed`, less what the start from rest has left in it.

    Modes that hardly decay would keep that for longer than any record.
    """
    speed = forced_speed(mode, value, torque, spacing)
    late = speed[speed.size // 2 :]
    roots = np.linalg.eigvals(answering(mode.matrix, mode.load, value, mode.root.imag))
    free = np.exp(np.outer(spacing * np.arange(late.size), roots[roots.imag >= 0.0]))
    columns = np.hstack([free.real, free.imag])
    # Ends weigh nothing, so that what is forced is not taken for what is left.
    weight = np.sin(np.linspace(0.0, np.pi, late.size))
    left, *_ = np.linalg.lstsq(columns * weight[:, None], late * weight, rcond=None)
    return np.asarray(late - columns @ left)


def answering(matrix: FloatArray, load: FloatArray, value: complex, frequency: float) -> FloatArray:
    """Return a string's matrix with H as a damper and a spring at the bit; see `TorsionalMode`."""
    closed = matrix.copy()
    closed[:, 1] += value.real * load
    closed[:, 0] -= value.imag * frequency * load
    return closed
