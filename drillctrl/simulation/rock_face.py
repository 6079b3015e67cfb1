"""The rock face ahead of a blade: what is left to cut until it reaches where the last one is."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.simulation.kernel import data
from drillctrl.simulation.trace import Trace


@dataclass(frozen=True, eq=False)
class RockFace:
    """The face over the blade pitch ahead of a blade at an instant.

    Attributes
    ----------
    angle : array, (q,)
        Ahead of the blade, from 0 to 2π/n.
    height : array, (q,)
        Of the rock above the tip of the blade (dimensionless length): n times that at
        angle 0 is the depth of cut; negative where the rock is deeper than the bit.
    passes : int array, (q,)
        How many blades ago the face was left there.
    """

    angle: FloatArray
    height: FloatArray
    passes: npt.NDArray[np.int64]


def rock_face(run: Trace, time: float, count: int = 181) -> RockFace:
    """Return the rock face ahead of a blade.

    Parameters
    ----------
    run : Trace
        Of the nonlinear model.
    time : float
        The instant.
    count : int
        Number of angles, the first 0 and the last a blade pitch.

    Raises
    ------
    InputError
        If the instant is outside the run, or the model linear.

    Notes
    -----
    A blade meets at the angle φ what was cut when the bit stood 2π/n − φ, 4π/n − φ, … of
    its angle back. With ``cutting="single"`` the first of these counts, with ``"multiple"``
    the deepest. Passes are followed back until one was made in contact, since a bit in the
    rock leaves nothing of the passes before.
    """
    if run.model != "nonlinear":
        raise InputError("model", run.model, "nonlinear, for a rock face")
    when = checked_number("time", time, 0.0, float(run.times[-1]))
    checked_integer("count", count, 2, 100_000)
    pitch = 2.0 * np.pi / run.point.blades
    here = run.at([when])
    turned = run.point.omega0 * when + float(here.theta[0])
    low = run.point.penetration_rate * when + float(here.x[0])
    angle = np.linspace(0.0, pitch, count)
    # Where the blade is about to come to, the bit itself was now.
    face, contact = _face(run, turned + angle - pitch, when)
    passes = np.ones(count, dtype=np.int64)
    if run.cutting == "multiple":
        # Before t = 0 all was drilled in contact, so that this ends.
        for back in itertools.count(2):
            open_ = ~contact
            if not open_.any():
                break
            deeper, touched = _face(run, turned + angle[open_] - back * pitch, when)
            places = np.flatnonzero(open_)
            better = deeper > face[places]
            face[places[better]] = deeper[better]
            passes[places[better]] = back
            contact[places[touched]] = True
    return RockFace(angle, low - face, passes)


def _face(run: Trace, angles: FloatArray, until: float) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return how deep the bit was when it stood at some angles, and whether it was in the rock.

    Steps before t = 0 count as well; the first of all is uniform motion without end.
    """
    real, whole = run.history
    rows = int(np.searchsorted(real[:, data.START], until, side="right"))
    real, spin = real[:rows], run.point.omega0

    def turned(j: npt.NDArray[np.int64], s: FloatArray) -> FloatArray:
        time = real[j, data.START] + s * real[j, data.LENGTH]
        return np.asarray(spin * time + _on_step(real, data.THETA, j, s))

    every = np.arange(1, rows)
    begun = np.maximum.accumulate(turned(every, np.zeros(every.size)))
    j = np.searchsorted(begun, angles, side="right")
    low = np.zeros(angles.size)
    high = np.minimum((until - real[j, data.START]) / real[j, data.LENGTH], 1.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        past = turned(j, middle) > angles
        low, high = np.where(past, low, middle), np.where(past, middle, high)
    first = np.zeros_like(j)
    start, end = (turned(first, np.full(j.size, s)) for s in (0.0, 1.0))
    s = np.where(j == 0, (angles - start) / np.maximum(end - start, 1e-300), high)
    time = real[j, data.START] + s * real[j, data.LENGTH]
    depth = run.point.penetration_rate * time + _on_step(real, data.X, j, s)
    return depth, whole[j, data.CONTACT] == 1


def _on_step(real: FloatArray, column: int, j: npt.NDArray[np.int64], s: FloatArray) -> FloatArray:
    """Return a signal at places of steps."""
    return np.asarray(sum(real[j, column + i] * s**i for i in range(6)))
