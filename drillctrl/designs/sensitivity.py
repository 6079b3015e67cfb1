"""How a root follows gains and operating point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.closing import close_loop, loop_channels
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Where, as_case
from drillctrl.drilling.linear import linearisation_sensitivity
from drillctrl.spectrum.multiplicity import Root
from drillctrl.spectrum.roots import dominant_roots
from drillctrl.spectrum.sensitivity import matrix_sensitivity


@dataclass(frozen=True, eq=False)
class RootSensitivity:
    """Derivatives of one simple root; the real parts are those of α if it is dominant.

    Attributes
    ----------
    root : Root
        The root.
    K1, K2 : complex array, (m, p)
        Derivatives with respect to the gains; empty for an open loop.
    parameters : dict
        Complex derivatives by the name of the parameter: the groups, each by itself, and those
        of the plant's parts.
    """

    root: Root
    K1: ComplexArray
    K2: ComplexArray
    parameters: dict[str, complex]


@checks_kinds
def root_sensitivity(
    point: Where,
    structure: FeedbackStructure | None = None,
    K1: FloatArray | None = None,
    K2: FloatArray | None = None,
    *,
    index: int = 0,
) -> RootSensitivity:
    """Differentiate a dominant root with respect to gains and operating point.

    Parameters
    ----------
    point : OperatingPoint, RigPoint or Case
        What drills, and where.
    structure, K1, K2 : optional
        Feedback; without it the open loop.
    index : int
        Which of the `dominant_roots` of the loop; 0 is the one whose real part is α.

    Raises
    ------
    InputError
        If the root is multiple: it has no derivative there. If signals of the plant arrive late.
    """
    case = as_case(point)
    plant, _ = case.physics("the derivative of a root")
    inputs = structure.inputs if structure else ("torque",)
    open_loop = case.system(inputs)
    loop = open_loop
    if structure is not None:
        loop = close_loop(open_loop, structure, np.asarray(K1), K2)
    if len(loop.delays) > 1:
        raise InputError("plant", "with signals that arrive late", "of one delay here")
    roots = dominant_roots(loop)
    if not 0 <= index < len(roots):
        raise InputError("index", index, f"in [0, {len(roots) - 1}]")
    root = roots[index]
    if root.multiplicity > 1:
        raise InputError("index", index, f"a simple root, this is {root.multiplicity}-fold")
    d_a0, d_delayed, d_tau = matrix_sensitivity(loop, root.value)
    at = loop.delays.index(open_loop.feedback_delay)
    gains = [np.zeros((0, 0), dtype=complex)] * 2
    if structure is not None:
        drive, measure = loop_channels(open_loop, structure)
        gains = [drive.T @ d @ measure.T for d in (d_a0, d_delayed[at])]
    # The CasADi Jacobian stacks A1, A2, B column by column, then τ0.
    jacobian = linearisation_sensitivity(plant)(case.parameter_vector).full()
    size = open_loop.order**2
    weights = np.concatenate([d_a0.ravel(order="F"), d_delayed[at].ravel(order="F")])
    slopes = weights @ jacobian[: 2 * size] + d_tau[at] * jacobian[-1]
    by_name = dict(zip(plant.parameter_names, map(complex, slopes), strict=True))
    return RootSensitivity(root, gains[0], gains[1], by_name)
