"""Designs as fields for programs: what ``--json`` prints."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.text import finite_or_none
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.gain_units import gain_units
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.steady import steady_state
from drillctrl.spectrum.roots import Root

if TYPE_CHECKING:
    from drillctrl.designs.result import Design


# Share of the decay rate that the alternative beside a design may lose.
GIVE_UP = 0.05


def design_fields(design: Design) -> dict[str, Any]:
    """Return the JSON fields of ``design`` and ``analyze``."""
    point = design.point
    structure = design.structure
    fields: dict[str, Any] = {
        "schema": "drillctrl/design/1" if design.evaluations else "drillctrl/analyze/1",
        "operating_point": point and {**dataclasses.asdict(point), "delay": point.delay},
        "structure": structure.name if structure else None,
        "outputs": list(structure.outputs) if structure else [],
        "bounds": _bounds(structure) if structure else None,
        "K1": design.K1.ravel().tolist(),
        "K2": design.K2.ravel().tolist(),
        **_loop_fields(design),
        "open_loop": {
            "spectral_abscissa": design.open_loop.spectral_abscissa,
            "stable": design.open_loop.stable,
        },
        "recommended": design.recommended,
        "reason": design.reason,
        "trials": [trial.to_dict() for trial in design.trials],
        "modes_worse": [mode.to_dict() for mode in design.modes_worse],
        "robustness": None,
        "evaluations": design.evaluations,
        "elapsed_seconds": design.elapsed_seconds,
    }
    if design.optimality is not None:
        fields["certificate"]["optimality"] = dataclasses.asdict(design.optimality)
        fields["certificate"]["boundary"] = _boundary_fields(design)
        fields["remedies"] = [remedy.to_dict() for remedy in design.remedies]
        fields["objective"] = _objective_fields(design)
        fields["requirements"] = {
            **dataclasses.asdict(design.requirements),
            "met": design.requirements_met,
        }
    if design.fragility is not None:
        off = dataclasses.asdict(design.fragility)
        fields["robustness"] = {**_distance_fields(design), "spectral_abscissa_with": off}
    if has_alternative(design):
        fields["alternative"] = _alternative_fields(design)
    if design.rig_point is not None:
        fields["rig"] = _rig_fields(design.rig_point, design)
    return fields


def has_alternative(design: Design) -> bool:
    """Whether a neighbour that decays more slowly is of use: not if one was designed for."""
    return design.minimises_alpha and design.stable and not design.verdict.refused


def _boundary_fields(design: Design) -> dict[str, Any] | None:
    decision = design.boundary
    if decision is None:
        return None
    return {**dataclasses.asdict(decision), "next_root": finite_or_none(decision.next_root)}


def _objective_fields(design: Design) -> dict[str, Any]:
    assert design.objective is not None
    assert design.objective_value is not None
    return {
        "name": design.objective.name,
        **dataclasses.asdict(design.objective),
        "value": finite_or_none(design.objective_value),
    }


def _distance_fields(design: Design) -> dict[str, Any]:
    radius, margin = design.stability_radius, design.delay_margin
    fields: dict[str, Any] = {
        "stability_radius": radius.value,
        "stability_radius_lower_bound": radius.lower_bound,
        "delay_margin": None,
    }
    if margin is not None:
        fields["delay_margin"] = {
            "shorter": margin.shorter,
            "longer": finite_or_none(margin.longer),
            "limit": finite_or_none(margin.limit),
        }
    fields["point_margins"] = None
    if design.point_margins is not None:
        fields["point_margins"] = {
            name: {"lower": errors.lower, "upper": errors.upper, "limit": errors.limit}
            for name, errors in design.point_margins.items()
        }
    return fields


def _alternative_fields(design: Design) -> dict[str, Any]:
    other = design.robust_alternative(GIVE_UP)
    assert other.fragility is not None
    return {
        "give_up": GIVE_UP,
        "K1": other.K1.ravel().tolist(),
        "K2": other.K2.ravel().tolist(),
        "spectral_abscissa": other.spectral_abscissa,
        "stable": other.stable,
        "recommended": other.recommended,
        "reason": other.reason,
        "robustness": {
            **_distance_fields(other),
            "spectral_abscissa_with": dataclasses.asdict(other.fragility),
        },
    }


def _bounds(structure: FeedbackStructure) -> dict[str, list[list[float]]]:
    pairs = {}
    for name, low, high in (
        ("K1", structure.K1_lower, structure.K1_upper),
        ("K2", structure.K2_lower, structure.K2_upper),
    ):
        pairs[name] = np.column_stack([low.ravel(), high.ravel()]).tolist()
    return pairs


def _root_fields(root: Root) -> dict[str, Any]:
    return {
        "real": root.real,
        "imag": root.imag,
        "multiplicity": root.multiplicity,
        "spread": root.spread,
        "residual": root.residual,
        "condition": finite_or_none(root.condition),
        "converged": root.converged,
    }


def _loop_fields(design: Design) -> dict[str, Any]:
    loop, radius = design.loop, design.spectral_radius
    return {
        "spectral_abscissa": loop.spectral_abscissa,
        "spectral_abscissa_error": finite_or_none(loop.abscissa_error),
        "stable": loop.stable,
        "settling_time": finite_or_none(loop.settling_time),
        "dominant_roots": [_root_fields(root) for root in loop.dominant_roots],
        "spectral_radius": None
        if radius is None
        else {
            "value": radius.value,
            "m": radius.m,
            "order": radius.order,
            "growth_rate": finite_or_none(radius.growth_rate),
        },
        "certificate": {
            "method": "argument principle",
            **dataclasses.asdict(loop.certificate),
        },
    }


def _rig_fields(rig_point: RigPoint, design: Design) -> dict[str, Any]:
    steady = steady_state(rig_point)
    fields: dict[str, Any] = {
        "parameters": dataclasses.asdict(rig_point.rig),
        "rotary_speed": rig_point.rotary_speed,
        "penetration_rate": rig_point.penetration_rate,
        "time_scale": rig_point.rig.time_scale,
        "axial_scale": rig_point.rig.axial_scale,
        **dataclasses.asdict(steady),
    }
    if design.structure is not None and design.case.plant is not None:
        factors, names = gain_units(design.structure, design.case.plant, rig_point.rig)
        fields["K1"] = (design.K1 * factors).ravel().tolist()
        fields["K2"] = (design.K2 * factors).ravel().tolist()
        fields["gain_units"] = [name for row in names for name in row]
    settling = design.loop.settling_time * rig_point.rig.time_scale
    fields["settling_time_seconds"] = finite_or_none(settling)
    return fields
