"""A python-control plant with a delay as a DelaySystem."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drillctrl.base.errors import InputError, checked_number
from drillctrl.delay.system import DelaySystem

if TYPE_CHECKING:
    import control


def from_control(
    plant: control.StateSpace,
    delay: float,
    delayed: npt.ArrayLike | None = None,
) -> DelaySystem:
    """Return a continuous python-control plant with a delay as a `DelaySystem`.

    Parameters
    ----------
    plant : control.StateSpace
        X' = A X + B u, Y = C X; names are kept.
    delay : float
        τ > 0.
    delayed : array_like, (n, n), optional
        A1 in X' = A X(t) + A1 X(t − τ) + B u. Without it the plant itself has no delay, and
        τ is that of the fed-back signals: a loop with a delay in its input or its
        measurement is one whose structure feeds back Y(t − τ) only, K1 = 0.

    Raises
    ------
    InputError
        If the plant is sampled, feeds its input through, or shapes do not fit.
    """
    if plant.dt:
        raise InputError("plant", f"sampled every {plant.dt}", "in continuous time")
    if np.any(plant.D):
        raise InputError("plant", "with direct feedthrough D", "with D = 0")
    tau = checked_number("delay", delay, 0.0, open_low=True)
    a = np.asarray(plant.A, dtype=float)
    past = np.zeros_like(a) if delayed is None else np.asarray(delayed, dtype=float)
    return DelaySystem(
        a,
        (past,),
        (tau,),
        np.asarray(plant.B, dtype=float),
        np.asarray(plant.C, dtype=float),
        state_names=tuple(plant.state_labels),
        input_names=tuple(plant.input_labels),
        output_names=tuple(plant.output_labels),
    )
