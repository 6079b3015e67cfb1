"""How wrong the numbers of an operating point may be."""

from __future__ import annotations

from drillctrl.base.arrays import FloatArray
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.designs.loops import spectral_abscissas
from drillctrl.drilling.case import Where, as_case
from drillctrl.robustness.margins import ParameterMargin, parameter_margin


@checks_kinds
def point_margins(
    point: Where,
    feedback: FeedbackStructure,
    K1: FloatArray,
    K2: FloatArray,
    limit: float = 1.0,
) -> dict[str, ParameterMargin]:
    """Return how wrong ψ, δ0 and ω0 may each be before a loop with fixed gains is unstable.

    Parameters
    ----------
    point : OperatingPoint, RigPoint or Case
        As assumed by the designer.
    feedback, K1, K2 : FeedbackStructure and arrays
        The feedback. Its delay stays that of the assumed speed.
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
    case, inputs = as_case(point), feedback.inputs
    _, here = case.physics("a margin of the point")
    assumed = case.system(inputs).feedback_delay
    gains, late = feedback.vector(K1, K2), len(case.system(inputs).delays) > 1

    def margin(name: str) -> ParameterMargin:
        def loop_at(error: float) -> DelaySystem:
            there = case.with_changes(**{name: getattr(here, name) * (1.0 + error)})
            return close_loop(there.system(inputs), feedback, K1, K2, delay=assumed)

        def abscissas(errors: FloatArray) -> FloatArray:
            values = getattr(here, name) * (1.0 + errors)
            return spectral_abscissas(case, {name: values}, feedback, gains, 1, assumed)

        return parameter_margin(loop_at, limit, abscissas=None if late else abscissas)

    return {name: margin(name) for name in ("psi", "delta0", "omega0")}
