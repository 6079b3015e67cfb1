"""Exponents of the full motion on its orbit: the route to growth rates that averages nothing."""

from __future__ import annotations

from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.case import Where, as_case
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.floquet import check_repeats, floquet
from drillctrl.simulation.run import simulate
from drillctrl.simulation.status import Status

_REACHED, _LONGEST = 20.0, 1000.0
# The multiplier of the shift along the orbit is no further from 1.
_SHIFT = 1e-4


@checks_kinds
def orbit_exponents(
    where: Where, controller: Controller | None = None, **options: Any
) -> ComplexArray | None:
    """Return ln μ/T of the Floquet multipliers μ of the orbit that a motion comes to.

    Where torsion rests on a periodic axial orbit, one pair is the torsional mode on it: the
    growth rate that `mode_at` finds for small swings, with nothing averaged.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where.
    controller : Controller, optional
        Closes the loop; without noise and with fixed gains.
    **options
        Of `simulate`.

    Returns
    -------
    complex array or None
        By falling real part, that of the shift along the orbit left out; imaginary parts are
        known up to multiples of 2π/T. None where the motion breaks off, or comes to no orbit in
        twenty decay times of the torsional mode.

    Raises
    ------
    InputError
        If there is no plant, or the controller is one that `floquet` refuses.
    """
    check_repeats(controller)
    case = as_case(where)
    _, point = case.physics("an orbit")
    duration = min(_REACHED / max(point.kappa, 1e-9), _LONGEST)
    initial = {"dx": 0.05 * point.penetration_rate}
    options = {"backwards": "stop", **options}
    run = simulate(case, controller, duration=duration, initial=initial, **options)
    if run.status != Status.DONE:
        return None
    try:
        found = floquet(run)
    except InputError:
        # It does not repeat.
        return None
    away = np.abs(found.multipliers - 1.0)
    shift = int(away.argmin())
    # A mode that neither grows nor decays has a multiplier of 1 as well.
    kept = np.delete(found.multipliers, shift) if away[shift] < _SHIFT else found.multipliers
    return np.asarray(np.log(kept.astype(complex)) / found.period)
