"""Designs in words for people."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from drillctrl.base import units
from drillctrl.designs.fields import GIVE_UP, has_alternative
from drillctrl.designs.loop_analysis import LoopAnalysis
from drillctrl.designs.worst_case import WorstCase
from drillctrl.drilling.gain_units import gain_units
from drillctrl.drilling.steady import steady_state
from drillctrl.robustness.margins import ParameterMargin
from drillctrl.simulation.outcome import SETTLES, Figures
from drillctrl.synthesis.objectives import Robust, SemiDiscrete

if TYPE_CHECKING:
    from drillctrl.designs.result import Design


_SIGNALS = {"theta": "θ", "dtheta": "θ'", "x": "x", "dx": "x'", "phi": "φ", "dphi": "φ'"}
_GROUPS = {"psi": "ψ", "delta0": "δ0", "omega0": "ω0"}


def design_summary(design: Design) -> str:
    """Return the summary of a design or analysis for people."""
    lines = [
        *_trial_lines(design),
        *_point_lines(design),
        *_gain_lines(design),
        *_verdict_lines(design),
    ]
    width = max(len(label) for label, _ in lines) + 2
    return "\n".join(f"{label:<{width}}{text}".rstrip() for label, text in lines)


_Lines = list[tuple[str, str]]
_VERDICTS = {True: "Recommended", False: "REFUSED", None: "Not tried"}


def _trial_lines(design: Design) -> _Lines:
    """Say first whether the gains can be recommended, and what the runs showed."""
    if design.structure is None:
        return []
    lines: _Lines = [(_VERDICTS[design.recommended], design.reason)]
    if design.verdict.refused:
        lines.append(("", "no gains are offered for this point; those below are refused"))
    for trial in design.trials:
        free = trial.uncontrolled
        text = f"{trial.start}: {_figures_text(trial.controlled)}"
        text += f", |u| ≤ {_input_text(design, trial.controlled.max_abs_u)}"
        if free is not None:
            text += f"; without control: {_figures_text(free)}"
        lines.append(("Trial runs" if trial is design.trials[0] else "", text))
    for mode in design.modes_worse:
        kind = mode.kind or "mixed"
        before, after = _root_text(mode.open_loop), _root_text(mode.root)
        first = mode is design.modes_worse[0]
        lines.append(("Worse damped" if first else "", f"{kind} mode: {before} becomes {after}"))
    return lines


def _figures_text(found: Figures) -> str:
    text = found.outcome
    if found.swing is not None and found.outcome != SETTLES:
        text += f", swing {found.swing:.3f}"
    if found.stick_fraction:
        text += f", stick {found.stick_fraction:.1%}"
    return text


def _input_text(design: Design, largest: float) -> str:
    assert design.structure is not None
    if design.rig_point is None or design.structure.inputs != ("torque",):
        return f"{largest:.3g}"
    newton_metres = largest * design.rig_point.rig.torsional_stiffness
    return f"{units.from_si(newton_metres, units.TORQUE, 'kN*m'):.3g} kN·m"


def _root_text(s: complex) -> str:
    return f"{s.real:.4g}" + (f" ± {s.imag:.4g}i" if s.imag else "")


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
    if p is None:
        plant = design.plant
        delays = ", ".join(f"{tau:.6g}" for tau in plant.delays) or "none"
        lines.append(("Plant", f"{plant.order} states; delays {delays}"))
    else:
        same = p.xi == p.kappa
        damping = f"ξ = κ = {p.xi:.6g}" if same else f"ξ = {p.xi:.6g}, κ = {p.kappa:.6g}"
        text = f"ω0 = {p.omega0:.6g}, δ0 = {p.delta0:.6g}, ψ = {p.psi:.6g}, "
        text += f"η = {p.eta:.6g}, {damping}, {p.blades} blades; τ0 = {p.delay:.6g}"
        lines.append(("Point", text))
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
    outputs = [_SIGNALS.get(name, name) for name in structure.outputs]
    past = bool(structure.K2_lower.any() or structure.K2_upper.any())
    law = f"u = K1·({', '.join(outputs)})" if len(outputs) > 1 else f"u = K1·{outputs[0]}"
    if past:
        law += " + K2·(the same, τ0 ago)"
    refused = " (refused)" if design.verdict.refused else ""
    lines: _Lines = [("Feedback", f"{structure.name}{refused}: {law}")]
    rows = [("K1", "", design.K1, structure.K1_lower, structure.K1_upper)]
    if past:
        rows.append(("K2", " delayed", design.K2, structure.K2_lower, structure.K2_upper))
    for name, when, gains, low, high in rows:
        for i in range(gains.shape[0]):
            for j, symbol in enumerate(outputs):
                text = f"{float(gains[i, j])!r:>22} on {symbol}{when}, "
                text += f"within [{low[i, j]:g}, {high[i, j]:g}]"
                if design.case.plant is not None and design.case.rig is not None:
                    factors, names = gain_units(structure, design.case.plant, design.case.rig)
                    text += f"  = {gains[i, j] * factors[i, j]:.6g} {names[i][j]}"
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
    lines: _Lines = [(label, verdict), *_objective_lines(design)]
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
    radius = design.spectral_radius
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
            text += f", next best {best.next_best:.4f}"
        lines.append(("", text))
        lines += _boundary_lines(design)
        lines += _remedy_lines(design)
    if design.fragility is not None:
        lines += _robustness_lines(design)
    if has_alternative(design):
        other = design.robust_alternative(GIVE_UP)
        names = [*zip(("K1", "K2"), (other.K1, other.K2), strict=True)]
        gains = "; ".join(
            f"{name} = {', '.join(repr(float(g)) for g in matrix.ravel())}"
            for name, matrix in names
            if matrix.any()
        )
        lines.append(("", ""))
        lines.append(("More robust", f"{gains}"))
        if other.trials:
            word = "recommended" if other.recommended else "REFUSED"
            lines.append(("", f"{word}: {other.reason}"))
        lines.append(("", f"α = {_alpha(other.loop)}: at most {GIVE_UP:.0%} of the decay given up"))
        lines += _robustness_lines(other)
    return lines


def _objective_lines(design: Design) -> _Lines:
    """Say what was minimised and required, where that is not the spectral abscissa alone."""
    lines: _Lines = []
    match design.objective:
        case SemiDiscrete(m=m, order=order):
            goal = f"ln ρ(D)/Δt of the semi-discretisation (m = {m}, order {order})"
        case WorstCase() as case:
            assert design.point is not None
            goal = f"largest α of {len(case.around(design.point))} points"
        case Robust(epsilon=epsilon):
            goal = f"largest Re s with relative errors of the plant up to {epsilon:g}"
        case _:
            goal = ""
    if goal:
        lines.append(("Minimised", f"{goal}: {design.objective_value:.9f}"))
    if design.requirements:
        wanted = (
            ("decay rate ≥ {:g}", design.requirements.decay),
            ("stability radius ≥ {:g}", design.requirements.stability_radius),
            ("input gain ≤ {:g}", design.requirements.input_gain),
        )
        text = ", ".join(form.format(value) for form, value in wanted if value is not None)
        lines.append(("Required", f"{text}: {'met' if design.requirements_met else 'NOT MET'}"))
    return lines


def _boundary_lines(design: Design) -> _Lines:
    """Say what is known of all gains within the bounds."""
    decision = design.boundary
    if decision is None:
        if design.stable:
            return []
        return [("", "a failed search is no proof: with more than two gains none is known")]
    where = f"explicit boundary, {decision.points} places"
    if not design.stable:
        if decision.possible:
            return [("", f"BUT some gains within the bounds stabilise ({where})")]
        return [("Impossible", f"no gains within the bounds stabilise ({where})")]
    if decision.possible:
        return [("", f"BUT some gains within the bounds reach α = {decision.line:.6g} ({where})")]
    return [("", f"no gains within the bounds reach α = {decision.line:.6g} ({where})")]


def _margin_text(errors: ParameterMargin) -> str:
    """Return between which multiples of its assumed value a parameter may lie."""
    upper = f"{1.0 + errors.upper:.4g}" + (" (or more)" if errors.upper == errors.limit else "")
    return f"between {1.0 + errors.lower:.4g} and {upper} times the assumed"


def _remedy_lines(design: Design) -> _Lines:
    """Say what would stabilise where these gains do not."""
    if design.stable or design.point is None:
        return []
    words = []
    for remedy in design.remedies:
        alpha = f"α = {remedy.spectral_abscissa:.4g}"
        if remedy.kind == "speed":
            faster = _speed_text(remedy.design)
            words.append(f"{faster} at this rate of penetration, no feedback: {alpha}")
        elif remedy.kind == "feed":
            words.append(f"an axial actuator, structure {remedy.name}: {alpha}")
        else:
            words.append(f"structure {remedy.name} within the paper's bounds: {alpha}")
    if not words:
        tried = "richer presets, an axial actuator, up to four times the speed"
        return [("Would stabilise", f"nothing that was tried ({tried})")]
    return list(zip(["Would stabilise", *[""] * (len(words) - 1)], words, strict=True))


def _speed_text(design: Design) -> str:
    """Return a rotary speed, in rpm where there is a rig."""
    if design.rig_point is not None:
        rpm = units.from_si(design.rig_point.rotary_speed, units.ROTARY_SPEED, "rpm")
        return f"{rpm:.4g} rpm"
    assert design.point is not None
    return f"ω0 = {design.point.omega0:.4g}"


def _robustness_lines(design: Design) -> _Lines:
    """Say how near instability is, and what small errors do."""
    lines: _Lines = []
    off = design.fragility
    if design.stable:
        radius = design.stability_radius
        text = f"relative errors of the plant below {radius.lower_bound:.2g}"
        if radius.lower_bound == 0.0:
            text = f"relative errors of the plant of {radius.value:.2g} destabilise; of smaller"
            text += " ones nothing is known"
        lines.append(("Margins", text))
    if (margin := design.delay_margin) is not None:
        longer = "any" if math.isinf(margin.limit) else f"{margin.limit:g} (or more)"
        longer = longer if math.isinf(margin.longer) else f"{margin.longer:.4g}"
        lines.append(("", f"delay between {margin.shorter:.4g} and {longer} times τ0"))
    for name, errors in (design.point_margins or {}).items():
        lines.append(("", f"{_GROUPS[name]} {_margin_text(errors)}"))
    if off is not None:
        lines.append(
            ("If off, α is", f"{off.rounded_gains:.4f} with the gains rounded to 3 digits")
        )
        if off.psi_low is not None and off.psi_high is not None:
            text = f"{off.psi_low:.4f} and {off.psi_high:.4f} with ψ 5 % lower or higher"
            lines.append(("", text))
        if off.delay_low is not None and off.delay_high is not None:
            text = f"{off.delay_low:.4f} and {off.delay_high:.4f} with τ0 2 % shorter or longer"
            lines.append(("", text))
    return lines
