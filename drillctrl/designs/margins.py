"""How wrong the numbers of an operating point may be."""

from __future__ import annotations

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.drilling.linear import plant_system
from drillctrl.drilling.plant import Plant
from drillctrl.drilling.point import OperatingPoint
from drillctrl.robustness.margins import ParameterMargin, parameter_margin


def point_margins(
    point: OperatingPoint,
    feedback: FeedbackStructure,
    K1: FloatArray,
    K2: FloatArray,
    physics: Plant | None = None,
    limit: float = 1.0,
) -> dict[str, ParameterMargin]:
    """Return how wrong ψ, δ0 and ω0 may each be before a loop with fixed gains is unstable.

    Parameters
    ----------
    point : OperatingPoint
        As assumed by the designer.
    feedback, K1, K2 : FeedbackStructure and arrays
        The feedback. Its delay stays that of the assumed speed.
    physics : Plant, optional
        The plant's equations; by default `dimensionless_plant`.
    limit : float
        Largest relative increase to look at.

    Returns
    -------
    dict
        By the names ``psi``, ``delta0`` and ``omega0``.

    Raises
    ------
    InputError
        If the loop is unstable at the point.
    """
    inputs = feedback.inputs
    assumed = plant_system(point, inputs, physics).max_delay

    def margin(name: str) -> ParameterMargin:
        def loop_at(error: float) -> DelaySystem:
            there = point.with_changes(**{name: getattr(point, name) * (1.0 + error)})
            plant = plant_system(there, inputs, physics)
            return close_loop(plant, feedback, K1, K2, delay=assumed)

        return parameter_margin(loop_at, limit)

    return {name: margin(name) for name in ("psi", "delta0", "omega0")}
