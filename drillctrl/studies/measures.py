"""What one candidate is measured by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drillctrl.designs.result import Analysis
from drillctrl.simulation.basin import basin_edge
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.summary import settling_time

MOST_FACTOR = 16.0
# Ratio of the multiples that bracket the edge of a basin.
_SHARPNESS = 1.02


@dataclass(frozen=True)
class Response:
    """What follows a disturbance.

    Attributes
    ----------
    run : Simulation
        The motion.
    max_abs_x, max_abs_u : float
        Largest |x| and largest input.
    settling_time : float or None
        When |x| and |θ| have gone below 2 % of their largest values for good; None if that
        is not so by the end.
    """

    run: Simulation
    max_abs_x: float
    max_abs_u: float
    settling_time: float | None


def respond(
    design: Analysis, disturbance: Mapping[str, float], duration: float, model: str
) -> Response | None:
    """Simulate a candidate after a disturbance; None where the linear motion only grows."""
    if design.point is None or (model == "linear" and not design.stable):
        return None
    run = _run(design, disturbance, duration, model)
    largest = float(np.abs(run.on_steps(9, names=("x",)).x).max())
    return Response(run, largest, run.summary.max_abs_u, run.summary.settling_time)


def _run(
    design: Analysis, disturbance: Mapping[str, float], duration: float, model: str
) -> Simulation:
    controller = None
    if design.structure is not None:
        controller = Controller(design.structure, design.K1, design.K2)
    return simulate(
        design.case, controller, duration=duration, initial=disturbance, model=model, rtol=1e-7
    )


def basin(design: Analysis, disturbance: Mapping[str, float], duration: float) -> float | None:
    """Return the largest multiple of a disturbance after which the motion still settles.

    Multiples from 1/16 to 16 are looked at; 0 if even the smallest does not settle, 16 if
    all do. What lies beyond an unsettled multiple is not looked at.
    """
    if design.point is None or not design.stable:
        return None

    def settles(factor: float) -> bool:
        scaled = {name: factor * value for name, value in disturbance.items()}
        return settling_time(_run(design, scaled, duration, "nonlinear")) is not None

    return basin_edge(settles, 1.0 / MOST_FACTOR, MOST_FACTOR, _SHARPNESS)[0]
