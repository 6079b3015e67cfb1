"""What one candidate is measured by."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from drillctrl.designs.result import Design
from drillctrl.robustness.transfer import frequency_grid, loop_transfer
from drillctrl.simulation.basin import basin_edge
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.spectrum.characteristic import ComplexArray, FloatArray

Transfer = Callable[[FloatArray], ComplexArray]

MOST_FACTOR = 16.0
# Ratio of the multiples that bracket the edge of a basin.
_SHARPNESS = 1.02


@dataclass(frozen=True)
class LoopMargins:
    """Margins of the loop broken at the plant input.

    Attributes
    ----------
    gain_up, gain_down : float
        Nearest factors above and below 1 of the loop gain that destabilise; inf and 0 where
        there is none.
    phase : float
        Smallest phase change that destabilises, degrees; inf if there is none.
    sensitivity : float
        Largest |1/(1 + L(iω))|.
    """

    gain_up: float
    gain_down: float
    phase: float
    sensitivity: float


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


def loop_margins(design: Design) -> LoopMargins | None:
    """Read gain and phase margins and the peak of the sensitivity from exact data.

    Parameters
    ----------
    design : Design
        A stable loop with one driven input.

    Returns
    -------
    LoopMargins or None
        None for an open loop, an unstable one, or one with several inputs.

    Notes
    -----
    Each crossing of the negative real axis, and of the unit circle, is found between two
    frequencies of a grid on which L turns little, and sharpened by bisection.
    """
    structure = design.structure
    if structure is None or not design.stable or len(structure.inputs) != 1:
        return None

    def transfer(omega: FloatArray) -> ComplexArray:
        data = loop_transfer(design.plant, structure, design.K1, design.K2, omega)
        return np.asarray(data[0, 0])

    omega = frequency_grid(design.system())
    loop = transfer(omega)
    crossings = _bisected(lambda w: transfer(w).imag, omega, loop.imag)
    real = transfer(crossings).real if crossings.size else np.zeros(0)
    factors = -1.0 / np.append(real[real < 0.0], _at_zero(transfer))
    factors = factors[np.isfinite(factors) & (factors > 0.0)]
    unit = _bisected(lambda w: np.abs(transfer(w)) - 1.0, omega, np.abs(loop) - 1.0)
    phases = np.abs(np.angle(-transfer(unit))) if unit.size else np.zeros(0)
    return LoopMargins(
        float(factors[factors > 1.0].min(initial=math.inf)),
        float(factors[factors < 1.0].max(initial=0.0)),
        float(np.degrees(phases).min(initial=math.inf)),
        float((1.0 / np.abs(1.0 + loop)).max()),
    )


def _at_zero(transfer: Transfer) -> FloatArray:
    """Return L(0) where it lies on the negative real axis."""
    value = transfer(np.zeros(1)).real
    return np.asarray(value[value < 0.0])


def _bisected(
    function: Callable[[FloatArray], FloatArray], omega: FloatArray, values: FloatArray
) -> FloatArray:
    """Return where a function changes sign between the points of a grid."""
    change = np.flatnonzero(np.signbit(values[1:]) != np.signbit(values[:-1]))
    low, high, sign = omega[change], omega[change + 1], np.signbit(values[change])
    if not change.size:
        return np.zeros(0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        left = np.signbit(function(middle)) == sign
        low, high = np.where(left, middle, low), np.where(left, high, middle)
    return np.asarray(0.5 * (low + high))


def respond(
    design: Design, disturbance: Mapping[str, float], duration: float, model: str
) -> Response | None:
    """Simulate a candidate after a disturbance; None where the linear motion only grows."""
    if design.point is None or (model == "linear" and not design.stable):
        return None
    controller = None
    if design.structure is not None:
        controller = Controller(design.structure, design.K1, design.K2)
    run = simulate(
        design.point, controller, duration=duration, initial=disturbance, model=model, rtol=1e-7
    )
    motion = run.on_steps(9)
    inputs = max(float(np.abs(motion.axial).max()), float(np.abs(motion.torque).max()))
    return Response(run, float(np.abs(motion.x).max()), inputs, run.summary.settling_time)


def basin(design: Design, disturbance: Mapping[str, float], duration: float) -> float | None:
    """Return the largest multiple of a disturbance after which the motion still settles.

    Multiples from 1/16 to 16 are looked at; 0 if even the smallest does not settle, 16 if
    all do. What lies beyond an unsettled multiple is not looked at.
    """
    if design.point is None or not design.stable:
        return None

    def settles(factor: float) -> bool:
        scaled = {name: factor * value for name, value in disturbance.items()}
        found = respond(design, scaled, duration, "nonlinear")
        return found is not None and found.settling_time is not None

    return basin_edge(settles, 1.0 / MOST_FACTOR, MOST_FACTOR, _SHARPNESS)[0]
