"""What a motion has left behind at an instant: a start for another run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.kernel import data
from drillctrl.simulation.structure import Structure

if TYPE_CHECKING:
    from drillctrl.simulation.trace import Trace


# Steps more than the faces need, so that a search for them begins before.
_SPARE = 4


@dataclass(frozen=True, eq=False)
class Past:
    """A motion up to an instant, which becomes the t = 0 of another run.

    With a delay that depends on the motion a state is no start: what was cut before, and the
    signals that a controller has yet to use, belong to it.

    Attributes
    ----------
    point : OperatingPoint
        Where the rig drilled.
    structure : Structure
        What drilled.
    model : str
        Of the run that it was taken from.
    state : array, (n + m,)
        States and inputs at the instant.
    real, whole : array
        Steps of the integrator up to the instant, as in its history; times end at 0.
    known : float
        So much time before it is known; infinite where all is.
    """

    point: OperatingPoint
    structure: Structure
    model: str
    state: FloatArray
    real: FloatArray
    whole: npt.NDArray[np.int64]
    known: float = math.inf

    def __repr__(self) -> str:
        begun = float(self.real[1, 0]) if len(self.real) > 1 else 0.0
        return f"<Past: {-begun:g} units of time, {len(self.real) - 1} steps>"


def past_of(
    run: Trace,
    time: float | None = None,
    changed: float | None = None,
    kept: float | None = None,
    known: float = math.inf,
) -> Past:
    """Return what a run has left behind.

    Parameters
    ----------
    run : Trace
        What was integrated.
    time : float, optional
        The instant; by default the end of the run.
    changed : float, optional
        When the drive or the rock was first changed, which must not be before the instant.
    kept : float, optional
        So much time is kept, and besides it what the faces in the rock need; by default all.
    known : float
        So much time before the run is known.

    Raises
    ------
    InputError
        If the instant lies outside the run, or something was changed before it.
    """
    end = float(run.times[-1])
    when = end if time is None else checked_number("time", time, 0.0, end)
    if changed is not None and changed < when:
        raise InputError("time", when, f"at most {changed:g}, where the rig is changed")
    history = run.history
    start = history.real[:, data.START]
    names = (*run.state_names, *run.input_names)
    motion = run.at([when], names)
    state = np.array([float(getattr(motion, name)[0]) for name in names])
    last = int(np.searchsorted(start, when, side="left"))
    first = run.first
    last = max(last, first)
    dropped = 0 if kept is None else _not_needed(history, last, when - kept)
    real, whole = history.real[dropped:last].copy(), history.whole[dropped:last].copy()
    places = whole[:, [data.LAG, data.FACE]] - dropped
    whole[:, [data.LAG, data.FACE]] = np.maximum(places, 0)
    if last > first:
        begun, length = real[-1][[data.START, data.LENGTH]]
        restrict(real[-1], 0.0, (when - begun) / length, len(names))
    real[:, data.START] -= when
    known = -float(real[0, data.START]) if dropped else known + when
    return Past(run.point, run.structure, run.model, state, real, whole, known)


def _not_needed(history: data.History, last: int, since: float) -> int:
    """Return how many of the first steps nothing looks at from the end of step ``last`` − 1 on.

    A blade meets what was left one pitch before or since, and what a bit off the rock had
    under itself then.
    """
    whole = history.whole
    pitch = slice(int(whole[last - 1, data.LAG]), last)
    faces = whole[pitch, data.FACE][whole[pitch, data.PASSES] > 1]
    first = min(int(whole[pitch, data.LAG].min()), int(faces.min(initial=last)))
    first = min(first, int(np.searchsorted(history.real[:last, data.START], since)))
    while first > 0 and whole[first - 1, data.BEHIND]:
        first -= 1
    return max(first - _SPARE, 0)


def restrict(row: FloatArray, low: float, high: float, signals: int) -> None:
    """Keep the part of a step between two places on it, in place; its motion stays the same.

    Parameters
    ----------
    row : array
        A step of the history.
    low, high : float
        In [0, 1], from its start to its end.
    signals : int
        Number of states and inputs, n + m.
    """
    share = high - low
    row[data.START] += low * row[data.LENGTH]
    row[data.LENGTH] *= share
    others = data.OTHERS + data.QUARTIC * (signals - 4)
    for begin, end, count in (
        (data.X, data.OTHERS, data.QUINTIC),
        (data.OTHERS, others, data.QUARTIC),
    ):
        part = row[begin:end].reshape(-1, count)
        part[:] = part @ _shifted_powers(low, share, count)


def _shifted_powers(low: float, share: float, count: int) -> FloatArray:
    """Return the matrix whose row k has the coefficients of (low + share s)^k, (count, count)."""
    powers = np.zeros((count, count))
    power = Polynomial([1.0])
    for k in range(count):
        powers[k] = padded(power, count)
        power = power * Polynomial([low, share])
    return powers


def padded(polynomial: Polynomial, count: int) -> FloatArray:
    """Return that many coefficients of a polynomial."""
    coefficients = np.zeros(count)
    coefficients[: polynomial.coef.size] = polynomial.coef
    return coefficients
