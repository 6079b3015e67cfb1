"""Exact frequency responses as python-control data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.extras import required
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.robustness.transfer import (
    frequencies,
    frequency_grid,
    frequency_response,
    loop_transfer,
)

# What is smaller is left out at high frequencies: gain margins are looked for up to its inverse.
_SMALL = 1e-4

if TYPE_CHECKING:
    import control


@checks_kinds
def to_frd(
    system: DelaySystem, omega: npt.ArrayLike | None = None
) -> control.FrequencyResponseData:
    """Return the exact frequency response as python-control data.

    Bode, Nyquist, margins and feedback of python-control work on it without a Padé
    approximation.

    Parameters
    ----------
    system : DelaySystem
        Any.
    omega : array_like, optional
        By default `frequency_grid`.
    """
    control = required("control", "control")

    grid = frequency_grid(system) if omega is None else frequencies(omega)
    response = frequency_response(system, grid)
    return control.frd(
        response,
        grid,
        inputs=list(system.input_names),
        outputs=list(system.output_names),
        smooth=_is_smooth(response),
    )


@checks_kinds
def loop_frd(
    system: DelaySystem,
    structure: FeedbackStructure,
    K1: npt.ArrayLike,
    K2: npt.ArrayLike | None = None,
    omega: npt.ArrayLike | None = None,
) -> control.FrequencyResponseData:
    """Return `loop_transfer` as python-control data, ready for ``stability_margins``.

    Its signals are the inputs that the structure drives, as they act and as they are demanded.
    """
    control = required("control", "control")

    def transfer(points: FloatArray) -> ComplexArray:
        return loop_transfer(system, structure, K1, K2, points)

    if omega is None:
        grid = frequency_grid(system, response=transfer, small=_SMALL)
    else:
        grid = frequencies(omega)
    names, response = list(structure.inputs), transfer(grid)
    return control.frd(
        response,
        grid,
        inputs=names,
        outputs=[f"{name}_demanded" for name in names],
        smooth=_is_smooth(response),
    )


def _is_smooth(response: ComplexArray) -> bool:
    """Whether a curve is drawn through the points: of one channel, with no pole among them.

    A cubic takes four.
    """
    one = response.shape[:2] == (1, 1) and response.shape[2] > 3
    return bool(one and np.isfinite(response).all())
