"""Designs as fields for programs: what ``--json`` prints."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from drillctrl.base.text import finite_or_none
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.values import AnalysisValues, DesignValues
from drillctrl.drilling.gain_units import gain_units
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.steady import steady_state
from drillctrl.spectrum.multiplicity import Root


def result_fields(result: AnalysisValues) -> dict[str, Any]:
    """Return the JSON fields of what `analyze` returns."""
    point = result.point
    structure = result.structure
    fields: dict[str, Any] = {
        "schema": "drillctrl/analyze/1",
        "operating_point": point and {**dataclasses.asdict(point), "delay": point.delay},
        "structure": structure.name if structure else None,
        "outputs": list(structure.outputs) if structure else [],
        "bounds": _bounds(structure) if structure else None,
        "K1": result.K1.ravel().tolist(),
        "K2": result.K2.ravel().tolist(),
        **_loop_fields(result),
        "open_loop": {
            "spectral_abscissa": result.open_loop.spectral_abscissa,
            "stable": result.open_loop.stable,
        },
        "recommended": result.recommended,
        "reason": result.reason,
        "trials": [trial.to_dict() for trial in result.trials],
        "modes_worse": [mode.to_dict() for mode in result.modes_worse],
        "elapsed_seconds": result.elapsed_seconds,
    }
    if result.rig_point is not None:
        fields["rig"] = _rig_fields(result.rig_point, result)
    return fields


def design_fields(design: DesignValues) -> dict[str, Any]:
    """Return the JSON fields of what `design` returns."""
    fields = {**result_fields(design), "schema": "drillctrl/design/1"}
    fields["certificate"]["optimality"] = dataclasses.asdict(design.optimality)
    fields["objective"] = _objective_fields(design)
    fields["requirements"] = {
        **dataclasses.asdict(design.requirements),
        "met": design.requirements_met,
    }
    fields["evaluations"] = design.evaluations
    fields["on_motion"] = None if design.on_motion is None else design.on_motion.to_dict()
    return fields


def _objective_fields(design: DesignValues) -> dict[str, Any]:
    return {
        "name": design.objective.name,
        **dataclasses.asdict(design.objective),
        "value": finite_or_none(design.objective_value),
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


def _loop_fields(design: AnalysisValues) -> dict[str, Any]:
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


def _rig_fields(rig_point: RigPoint, design: AnalysisValues) -> dict[str, Any]:
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
