"""The torsional loop about the axial orbit: string and drive, what is fed back, and the bit's H."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem
from drillctrl.drilling.case import Where, as_case
from drillctrl.motion.torsion import answering, torsional_states


@checks_kinds
def torsional_system(
    where: Where, value: complex, frequency: float, inputs: Sequence[str] | None = None
) -> DelaySystem:
    """Return the torsional motion of a string whose bit answers with H, to close loops around.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where.
    value : complex
        H at the frequency: a damper Re H and a spring −ω Im H at the bit, which are H there,
        and near it as far as H changes little.
    frequency : float
        ω.
    inputs : sequence of str, optional
        Those that are driven; all that act on torsion without it.

    Returns
    -------
    DelaySystem
        Without delay of its own; what is fed back late is so by τ0 of the point.

    Raises
    ------
    InputError
        If there is no plant, its axial motion enters torsion elsewhere than at the bit, a
        signal arrives late, or an input does not act on torsion alone.
    """
    case = as_case(where)
    plant, point = case.physics("a torsional loop")
    matrix, load, places = torsional_states(case)
    arrays = case.motion()
    others = [i for i in range(len(plant.state_names)) if i not in places]
    usable = [
        name
        for name, column in zip(plant.input_names, arrays.B.T, strict=True)
        if column[places].any() and not column[others].any()
    ]
    chosen = tuple(usable if inputs is None else inputs)
    for name in chosen:
        if name not in usable:
            raise InputError("inputs", name, f"among {', '.join(usable)}: others move x")
    seen = [i for i, row in enumerate(arrays.C) if not row[others].any()]
    columns = [plant.input_names.index(name) for name in chosen]
    return DelaySystem(
        answering(matrix, load, value, frequency),
        B=arrays.B[np.ix_(places, columns)],
        C=arrays.C[np.ix_(seen, places)],
        state_names=tuple(plant.state_names[i] for i in places),
        input_names=chosen,
        output_names=tuple(plant.output_names[i] for i in seen),
        feedback_delay=point.delay,
    )
