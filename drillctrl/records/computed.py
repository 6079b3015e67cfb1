"""What the fitted string would do over speed and weight: the map beside what was drilled."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.workers import Progress
from drillctrl.drilling.bit_rock import BitRock, Contact, Load, Rates, steady_depth
from drillctrl.drilling.case import Case, as_case
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.rig import Rig
from drillctrl.drilling.steady import rig_point_at_weight_on_bit
from drillctrl.records.findings import ComputedMap
from drillctrl.records.fitted_rig import fitted_rig
from drillctrl.records.study import RecordStudy
from drillctrl.strings.drive_law import driven_plant
from drillctrl.strings.drives import drive_control
from drillctrl.strings.model import PipeString
from drillctrl.strings.rig import StringRig
from drillctrl.studies.vibration import vibration_map

_RPM, _KN = 30.0 / np.pi, 1e-3
# Around what was drilled: so much more on each side, and at least so much of the middle.
_WIDER, _LEAST = 0.1, 0.1
_START, _SECONDS = "kick", 60.0
# Share of the lowest weight that the wear flat carries in these runs, where it plays no part.
_WEAR = 0.1


class SeenLaw(BitRock):
    """A bit's torque as a record shows it: in proportion to the mean weight, falling with speed.

    The weight is that of steady drilling at all times: a record of the surface tells nothing of
    how the bit moves along the hole.

    Attributes
    ----------
    parameters : mapping
        ``level`` and ``drop``, torques over that of cutting alone at the same weight, and
        ``decay`` > 0, a rotary speed.
    """

    parameters = {"level": 1.0, "drop": 1.0, "decay": 1.5}  # noqa: RUF012
    quantities = {"level": "number", "drop": "number", "decay": "angular_rate"}  # noqa: RUF012

    def load(self, c: Coefficients, contact: Contact, rates: Rates, q: Any) -> Load:
        """Return a constant weight, and level + drop · exp(−abs(Φ')/decay)."""
        weight = c.cutting_force * steady_depth(c) + c.wear_force
        share = q.level + q.drop * ca.exp(-ca.fabs(rates.rotary) / q.decay)
        arm = c.cutting_torque / c.cutting_force
        return Load(weight, weight * arm * share * contact.direction)


@checks_kinds
def with_computed_map(
    study: RecordStudy,
    rig: Rig,
    counts: tuple[int, int] = (5, 4),
    *,
    structure: str | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> RecordStudy:
    """Return a study with runs over the speeds and weights that were drilled with, and beyond.

    Each run starts from a kick to the bit.

    Parameters
    ----------
    study : RecordStudy
        Its fitted string and the bit's law are simulated, without axial motion, of which a record
        tells nothing; where none was fitted, the rig as it is.
    rig : Rig
        That the study was made with.
    counts : (int, int)
        Of speeds and of weights, at least 2 each.
    structure : str, optional
        Law of the top drive, as of `drive_control`; without one the speed is held at the top.
    executor, progress : optional
        As of `vibration_map`.

    Raises
    ------
    InputError
        If the record has no weight on bit, or a parameter is not permitted.
    """
    drilled = [row for row in study.drilled() if row["weight_on_bit"] is not None]
    spans = [
        _span(np.array([row[name] for row in drilled], dtype=float))
        for name in ("speed", "weight_on_bit")
    ]
    if not drilled or spans[1][0] <= 0.0:
        raise InputError("counts", f"{counts}", "left out: the record tells no weight on bit")
    case, top = _case(study, rig, spans[0][0], spans[1][0], structure)
    found = vibration_map(
        case,
        ("speed", _RPM * spans[0][0], _RPM * spans[0][1]),
        ("wob", _KN * spans[1][0], _KN * spans[1][1]),
        counts=counts,
        refine=0,
        starts=(_START,),
        duration=_SECONDS / rig.time_scale,
        mark=False,
        executor=executor,
        progress=progress,
    )
    # Points come column by column.
    shape = found.shape
    speeds, weights = (np.linspace(*span, size) for span, size in zip(spans, shape, strict=True))
    severity = found.uncontrolled
    computed = ComputedMap(
        speeds, weights, severity.swing.reshape(shape), severity.outcomes.reshape(shape), top
    )
    return replace(study, computed=computed)


def _span(values: FloatArray) -> tuple[float, float]:
    if not values.size:
        return 0.0, 0.0
    low, high = float(values.min()), float(values.max())
    more = max(_WIDER * (high - low), 0.5 * _LEAST * (low + high))
    return max(low - more, 0.3 * low), high + more


def _case(
    study: RecordStudy, rig: Rig, speed: float, weight: float, structure: str | None
) -> tuple[Case, str]:
    fit, law = study.fit, None
    if fit is not None and fit.identifiable and fit.weight_on_bit is not None:
        rig = fitted_rig(rig, fit)
        wear = rig.contact_strength * rig.bit_radius * rig.wearflat_length
        rig = replace(rig, contact_strength=rig.contact_strength * _WEAR * weight / wear)
        cutting = fit.weight_on_bit * rig.bit_radius / (2.0 * rig.cutter_inclination)
        law = SeenLaw(
            level=fit.level.value / cutting,
            drop=fit.drop.value / cutting,
            decay=fit.decay.value * rig.time_scale,
        )
    where = rig_point_at_weight_on_bit(rig, speed, weight)
    if structure is not None:
        if not isinstance(rig, StringRig):
            raise InputError("structure", structure, "left out: the rig has no string")
        plant = driven_plant(rig, drive_control(structure, rig), law)
        return as_case(where, plant), f"a drive under {structure}"
    if isinstance(rig, StringRig):
        return as_case(where, paper_plant(law, PipeString(rig.string), rig.hoist())), "speed held"
    return as_case(where, paper_plant(law)), "speed held"
