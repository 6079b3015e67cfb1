"""Designs in words for people and in fields for programs."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from drillctrl import units
from drillctrl.analysis import LoopAnalysis
from drillctrl.designing import Design
from drillctrl.feedback import FeedbackStructure
from drillctrl.operating_point import RigPoint
from drillctrl.robustness import delay_margin, stability_radius
from drillctrl.spectrum.characteristic import FloatArray
from drillctrl.spectrum.roots import Root
from drillctrl.steady_state import steady_state

# Share of the decay rate that the alternative in the summary may lose.
GIVE_UP = 0.05
_SYMBOLS = {"theta": "θ", "dtheta": "θ'", "x": "x", "dx": "x'"}


def finite_or_none(value: float) -> float | None:
    """Return a float that JSON can hold; None for what is not finite."""
    return float(value) if math.isfinite(value) else None


def design_fields(design: Design) -> dict[str, Any]:
    """Return the JSON fields of ``design`` and ``analyze``."""
    point = dataclasses.asdict(design.point)
    structure = design.structure
    fields: dict[str, Any] = {
        "schema": "drillctrl/design/1" if design.evaluations else "drillctrl/analyze/1",
        "operating_point": {**point, "delay": design.point.delay},
        "structure": structure.name if structure else None,
        "outputs": list(structure.outputs) if structure else [],
        "bounds": _bounds(structure) if structure else None,
        "K1": design.K1.ravel().tolist(),
        "K2": design.K2.ravel().tolist(),
        **_loop_fields(design.loop),
        "open_loop": {
            "spectral_abscissa": design.open_loop.spectral_abscissa,
            "stable": design.open_loop.stable,
        },
        "robustness": None,
        "evaluations": design.evaluations,
        "elapsed_seconds": design.elapsed_seconds,
    }
    if design.optimality is not None:
        fields["certificate"]["optimality"] = dataclasses.asdict(design.optimality)
    if design.fragility is not None:
        off = dataclasses.asdict(design.fragility)
        fields["robustness"] = {**_distance_fields(design), "spectral_abscissa_with": off}
    if design.optimality is not None and design.stable:
        fields["alternative"] = _alternative_fields(design)
    if design.rig_point is not None:
        fields["rig"] = _rig_fields(design.rig_point, design)
    return fields


def _distance_fields(design: Design) -> dict[str, Any]:
    radius = stability_radius(design.system())
    fields: dict[str, Any] = {
        "stability_radius": radius.value,
        "stability_radius_lower_bound": radius.lower_bound,
        "delay_margin": None,
    }
    if design.stable:
        margin = delay_margin(design.system())
        fields["delay_margin"] = {
            "shorter": margin.shorter,
            "longer": finite_or_none(margin.longer),
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


def _loop_fields(loop: LoopAnalysis) -> dict[str, Any]:
    radius = loop.spectral_radius
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


def gain_units(structure: FeedbackStructure, rig_point: RigPoint) -> tuple[FloatArray, list[str]]:
    """Return the SI value of each unit gain of one row, and its unit.

    A torque is counted in Kt per rad, a rate in radians per time unit; an axial force in
    the rig's axial force unit.
    """
    rig = rig_point.rig
    factors, names = [], []
    for output in structure.outputs:
        rate, axial = output.startswith("d"), output.endswith("x")
        scale = rig.torsional_stiffness * (rig.time_scale if rate else 1.0)
        factors.append(scale / (rig.axial_scale if axial else 1.0))
        names.append(f"N·m{'·s' if rate else ''}/{'m' if axial else 'rad'}")
    return np.array(factors), names


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
    if design.structure is not None and design.structure.inputs == ("torque",):
        factors, names = gain_units(design.structure, rig_point)
        fields["K1"] = (design.K1 * factors).ravel().tolist()
        fields["K2"] = (design.K2 * factors).ravel().tolist()
        fields["gain_units"] = names
    settling = design.loop.settling_time * rig_point.rig.time_scale
    fields["settling_time_seconds"] = finite_or_none(settling)
    return fields


def design_summary(design: Design) -> str:
    """Return the summary of a design or analysis for people."""
    lines = [*_point_lines(design), *_gain_lines(design), *_verdict_lines(design)]
    width = max(len(label) for label, _ in lines) + 2
    return "\n".join(f"{label:<{width}}{text}".rstrip() for label, text in lines)


_Lines = list[tuple[str, str]]


def _point_lines(design: Design) -> _Lines:
    p = design.point
    lines: _Lines = []
    if design.rig_point is not None:
        rig_point, steady = design.rig_point, steady_state(design.rig_point)
        rpm = units.from_si(rig_point.rotary_speed, units.ROTARY_SPEED, "rpm")
        rop = units.from_si(rig_point.penetration_rate, units.SPEED, "m/hour")
        lines += [
            (
                "Drilling",
                f"{rpm:.6g} rpm, {rop:.6g} m/h in rock of "
                f"{rig_point.rig.rock_strength / 1e6:.6g} MPa",
            ),
            (
                "Steady load",
                f"{steady.weight_on_bit / 1e3:.5g} kN on bit, "
                f"{steady.torque_on_bit / 1e3:.5g} kN·m on bit, "
                f"cut {steady.depth_of_cut * 1e3:.4g} mm per turn",
            ),
        ]
    damping = f"ξ = κ = {p.xi:.6g}" if p.xi == p.kappa else f"ξ = {p.xi:.6g}, κ = {p.kappa:.6g}"
    lines.append(
        (
            "Point",
            f"ω0 = {p.omega0:.6g}, δ0 = {p.delta0:.6g}, ψ = {p.psi:.6g}, "
            f"η = {p.eta:.6g}, {damping}, {p.blades} blades; τ0 = {p.delay:.6g}",
        )
    )
    open_loop = design.open_loop
    state = "stable" if open_loop.stable else "unstable"
    if design.structure is not None:
        lines.append(("Without control", f"{state}, α = {_alpha(open_loop)}"))
    return lines


def _alpha(loop: LoopAnalysis) -> str:
    error = loop.abscissa_error
    digits = 9 if error < 1e-10 else max(1, -math.floor(math.log10(error)))
    text = f"{loop.spectral_abscissa:.{min(digits, 9)}f}"
    return text if error < 1e-10 else f"{text} ± {error:.1g}"


def _gain_lines(design: Design) -> _Lines:
    structure = design.structure
    if structure is None:
        return []
    outputs = [_SYMBOLS.get(name, name) for name in structure.outputs]
    past = bool(structure.K2_lower.any() or structure.K2_upper.any())
    law = f"u = K1·({', '.join(outputs)})" if len(outputs) > 1 else f"u = K1·{outputs[0]}"
    if past:
        law += " + K2·(the same, τ0 ago)"
    lines: _Lines = [("Feedback", f"{structure.name}: {law}")]
    rows = [("K1", "", design.K1, structure.K1_lower, structure.K1_upper)]
    if past:
        rows.append(("K2", " delayed", design.K2, structure.K2_lower, structure.K2_upper))
    for name, when, gains, low, high in rows:
        for i in range(gains.shape[0]):
            for j, symbol in enumerate(outputs):
                text = f"{float(gains[i, j])!r:>22} on {symbol}{when}, "
                text += f"within [{low[i, j]:g}, {high[i, j]:g}]"
                if design.rig_point is not None and structure.inputs == ("torque",):
                    factors, names = gain_units(structure, design.rig_point)
                    text += f"  = {gains[i, j] * factors[j]:.6g} {names[j]}"
                lines.append((name if j == 0 and i == 0 else "", text))
    return lines


def _verdict_lines(design: Design) -> _Lines:
    loop = design.loop
    label = "Result"
    if design.structure is None:
        verdict = "stable" if loop.stable else "not stable"
        verdict += f": α = {_alpha(loop)}"
    elif loop.stable:
        verdict = f"stabilised: α = {_alpha(loop)}"
    elif design.evaluations:
        verdict = f"not stabilised: best α = {_alpha(loop)}"
    else:
        verdict = f"not stabilised: α = {_alpha(loop)}"
    lines: _Lines = [(label, verdict)]
    roots = [
        f"{root.real:.6f}{f' ± {root.imag:.6f}i' if root.imag else ''}"
        + (f" ({root.multiplicity}-fold)" if root.multiplicity > 1 else "")
        + ("" if root.converged else " (not converged)")
        for root in loop.dominant_roots
    ]
    lines.append(("Dominant roots", ", ".join(roots)))
    if loop.stable:
        time = f"to 2 % in {loop.settling_time:.4g} time units"
        if design.rig_point is not None:
            seconds = loop.settling_time * design.rig_point.rig.time_scale
            time += f" = {seconds:.3g} s"
        lines.append(("Settling", time))
    check = loop.certificate
    word = "agrees" if check.agrees else "DOES NOT AGREE"
    counted = "undecided" if check.counted is None else str(check.counted)
    right = f"{counted} root(s) right of {check.line:.4g}, {check.found} found"
    lines.append(("Checked by", f"argument principle {word}: {right}"))
    radius = loop.spectral_radius
    if radius is not None:
        lines.append(
            (
                "",
                f"semi-discretisation (m = {radius.m}, order {radius.order}): "
                f"ρ(D) = {radius.value:.9f}, ln ρ/Δt = {radius.growth_rate:.6f}",
            )
        )
    if design.optimality is not None:
        best = design.optimality
        text = f"{best.method}, residual {best.stationarity:.1g}"
        if best.active_bounds:
            text += f"; on a bound: {', '.join(best.active_bounds)}"
        lines.append(("Optimal by", text))
        text = f"{best.hits} descent(s) ended here, {best.basins} distinct end(s)"
        if best.next_best is not None:
            text += f", next best α = {best.next_best:.4f}"
        lines.append(("", text))
    if design.fragility is not None:
        lines += _robustness_lines(design)
    if design.optimality is not None and design.stable:
        other = design.robust_alternative(GIVE_UP)
        names = [*zip(("K1", "K2"), (other.K1, other.K2), strict=True)]
        gains = "; ".join(
            f"{name} = {', '.join(repr(float(g)) for g in matrix.ravel())}"
            for name, matrix in names
            if matrix.any()
        )
        lines.append(("", ""))
        lines.append(("More robust", f"{gains}"))
        lines.append(("", f"α = {_alpha(other.loop)}: at most {GIVE_UP:.0%} of the decay given up"))
        lines += _robustness_lines(other)
    return lines


def _robustness_lines(design: Design) -> _Lines:
    """Say how near instability is, and what small errors do."""
    lines: _Lines = []
    off = design.fragility
    if design.stable:
        radius, margin = stability_radius(design.system()), delay_margin(design.system())
        lines.append(("Margins", f"relative errors of the matrices below {radius.lower_bound:.2g}"))
        longer = "any" if math.isinf(margin.longer) else f"{margin.longer:.4g}"
        lines.append(("", f"delay between {margin.shorter:.4g} and {longer} times τ0"))
    if off is not None:
        lines += [
            ("If off, α is", f"{off.rounded_gains:.4f} with the gains rounded to 3 digits"),
            ("", f"{off.psi_low:.4f} and {off.psi_high:.4f} with ψ 5 % lower or higher"),
            (
                "",
                f"{off.delay_low:.4f} and {off.delay_high:.4f} with τ0 2 % shorter or longer",
            ),
        ]
    return lines
