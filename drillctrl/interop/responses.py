"""Simulated motions as python-control time responses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drillctrl.errors import checked_integer
from drillctrl.plant import INPUT_NAMES, STATE_NAMES

if TYPE_CHECKING:
    import control

    from drillctrl.simulation.result import Simulation


def time_response(simulation: Simulation, samples: int = 2001) -> control.TimeResponseData:
    """Return a simulation on an even time grid, with ``plot`` and all of python-control.

    Parameters
    ----------
    simulation : Simulation
        A finished run.
    samples : int
        Instants, from the dense output.
    """
    import control

    count = checked_integer("samples", samples, 2, 10_000_000)
    motion = simulation.at(np.linspace(0.0, float(simulation.times[-1]), count))
    states = np.stack([getattr(motion, name) for name in STATE_NAMES])
    return control.TimeResponseData(
        motion.times,
        states,
        states,
        np.stack([motion.axial, motion.torque]),
        issiso=False,
        output_labels=list(STATE_NAMES),
        state_labels=list(STATE_NAMES),
        input_labels=list(INPUT_NAMES),
        title=f"Drill string, {simulation.model} model",
        sysname="drill_string",
    )
