"""Simulations in words for people and in fields for programs."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from drillctrl import units
from drillctrl.operating_point import RigPoint
from drillctrl.simulation.result import Simulation


def simulation_fields(run: Simulation) -> dict[str, Any]:
    """Return the JSON fields of ``simulate``."""
    summary = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in run.summary.as_dict().items()
    }
    controller = run.controller
    return {
        "schema": "drillctrl/simulate/1",
        "operating_point": dataclasses.asdict(run.point),
        "structure": controller.feedback.name if controller else None,  # type: ignore[union-attr]
        "model": run.model,
        "cutting": run.cutting,
        "duration": run.duration,
        "status": run.status,
        **summary,
    }


def simulation_summary(run: Simulation, rig_point: RigPoint | None) -> str:
    """Return the summary of a run for people, in rig units too where a rig was given."""
    s, p = run.summary, run.point
    time, speed = "", ""
    if rig_point is not None:
        unit = rig_point.rig.time_scale
        if s.period is not None:
            time = f" = {s.period * unit:.4g} s"
        low, high = (
            units.from_si(v / unit, units.ROTARY_SPEED, "rpm")
            for v in (s.bit_speed_min, s.bit_speed_max)
        )
        speed = f" = {low:.4g} to {high:.4g} rpm"
    if s.settled:
        motion = "settles to steady drilling"
    elif s.period is not None:
        motion = f"periodic orbit, period {s.period:.6g}{time}"
    else:
        motion = "neither settled nor periodic by the end"
    kinds = []
    if s.stick_fraction > 0.0:
        kinds.append(f"torsional stick for {s.stick_fraction:.1%} of the time")
    if s.axial_stick_fraction > 0.0:
        kinds.append(f"axial stick for {s.axial_stick_fraction:.1%}")
    if s.lost_contact:
        kinds.append("the bit leaves the rock")
    lines = [
        ("Point", f"ω0 = {p.omega0:.6g}, δ0 = {p.delta0:.6g}, ψ = {p.psi:.6g}"),
        ("Run", f"{run.model} model, {run.duration:g} time units, {run.status}"),
        ("Motion", motion),
        ("", ", ".join(kinds) if kinds else "no stick, contact kept"),
        ("Bit speed", f"{s.bit_speed_min:.6g} to {s.bit_speed_max:.6g}{speed}"),
        ("Axial", f"x from {s.axial_min:.6g} to {s.axial_max:.6g}"),
        ("Delay", f"at most {s.delay_max:.6g} (steady {p.delay:.6g})"),
    ]
    if run.controller is not None:
        lines.append(("Control", f"largest |u| = {s.max_abs_u:.6g}"))
    lines.append(("Effort", f"{s.steps} steps, {s.events} events, {s.elapsed_seconds:.3g} s"))
    width = max(len(label) for label, _ in lines) + 2
    return "\n".join(f"{label:<{width}}{text}".rstrip() for label, text in lines)
