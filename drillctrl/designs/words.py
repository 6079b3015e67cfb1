"""Results of `analyze` and `design` in words for people."""

from __future__ import annotations

import math

from drillctrl.designs.drilling import ASKED, Drilling
from drillctrl.designs.loop_analysis import LoopAnalysis
from drillctrl.designs.values import AnalysisValues, DesignValues
from drillctrl.designs.worst_case import WorstCase
from drillctrl.drilling.case import Case
from drillctrl.drilling.gain_units import gain_texts
from drillctrl.drilling.steady import steady_state
from drillctrl.simulation.outcome import Figures
from drillctrl.simulation.status import Outcome
from drillctrl.synthesis.objectives import HInfinity, Robust, SemiDiscrete

Lines = list[tuple[str, str]]

# Share of a growth rate from which on its error is shown.
_SHOWN = 0.05
_OF_RIG = {"theta": "its angle", "dtheta": "its speed", "x": "its place", "dx": "its rate"}
_SIGNALS = {"theta": "θ", "dtheta": "θ'", "x": "x", "dx": "x'", "phi": "φ", "dphi": "φ'"}
_ALONG = {"axial": " along the string", "torsional": " in torsion"}
_VERDICTS = {True: "Recommended", False: "REFUSED", None: "Not tried"}


def result_lines(result: AnalysisValues, kind: str | None = None) -> Lines:
    """Return what is known of gains, or of an open loop, whose first root is of one motion."""
    word = "stabilised" if result.stable else "not stabilised"
    if result.structure is None:
        word = "stable" if result.stable else "not stable"
    return [
        *_answer_lines(result, kind),
        *_opening(result),
        *_loop_lines(result, f"{word}: α = ", []),
    ]


def _answer_lines(result: AnalysisValues, kind: str | None) -> Lines:
    """Say first, of a rig, what becomes of small vibration; of gains that were tried, runs say."""
    rig = result.case.told_rig
    if rig is None or result.trials:
        return []
    lines = [("Vibration", f"small {vibration_text(result.loop, rig.time_scale, kind)}")]
    if not result.loop.stable:
        if kind == "axial":
            lines.append(("", "the cuts of the bit feed it, where torque hardly reaches"))
        lines.append(("", "simulate says how far it goes, and whether the bit sticks"))
    return lines


def vibration_text(loop: LoopAnalysis, time_scale: float, kind: str | None) -> str:
    """Say what becomes of vibration, of which motion, with frequency in Hz and rate in 1/s."""
    rate = loop.spectral_abscissa / time_scale
    hertz = abs(loop.dominant_roots[0].value.imag) / (2.0 * math.pi * time_scale)
    which = f"{hertz:.3g} Hz" if hertz else "without swinging"
    which += _ALONG.get(kind or "", "")
    if loop.stable:
        return f"vibration dies away, slowest {which}, by {-rate:.3g} 1/s"
    return f"vibration GROWS, fastest {which}, by {rate:.3g} 1/s"


def design_lines(design: DesignValues, kind: str | None = None) -> Lines:
    """Return what is known of gains that were designed."""
    word = "stabilised: α = " if design.stable else "not stabilised: best α = "
    if design.on_motion is not None:
        word = f"smooth drilling is {'stable' if design.stable else 'unstable'}: α = "
    best = design.optimality
    text = f"{best.method}, residual {best.stationarity:.1g}"
    if best.active_bounds:
        text += f"; on a bound: {', '.join(best.active_bounds)}"
    hits = f"{best.hits} descent(s) ended here, {best.basins} distinct end(s)"
    if best.next_best is not None:
        hits += f", next best {best.next_best:.4f}"
    first, *rest = _opening(design)
    return [
        first,
        *_answer_lines(design, kind),
        *rest,
        *_motion_lines(design),
        *_loop_lines(design, word, _objective_lines(design)),
        ("Optimal by", text),
        ("", hits),
    ]


def _opening(result: AnalysisValues) -> Lines:
    return [*_trial_lines(result), *_point_lines(result), *_gain_lines(result)]


def _trial_lines(result: AnalysisValues) -> Lines:
    """Say first whether the gains can be recommended, and what the runs showed."""
    if result.structure is None:
        return []
    lines: Lines = [(_VERDICTS[result.recommended], result.reason)]
    if result.verdict.refused:
        lines.append(("", "no gains are offered for this point; those below are refused"))
    for trial in result.trials:
        free = trial.uncontrolled
        text = f"{trial.start.name}: {_figures_text(trial.controlled)}"
        text += f", |u| ≤ {_input_text(result, trial.controlled.max_abs_u)}"
        if free is not None:
            text += f"; without control: {_figures_text(free)}"
        lines.append(("Trial runs" if trial is result.trials[0] else "", text))
    for mode in result.modes_worse:
        kind = mode.kind or "mixed"
        before, after = (_root_text(s, result.case) for s in (mode.open_loop, mode.root))
        first = mode is result.modes_worse[0]
        lines.append(("Worse damped" if first else "", f"{kind} mode: {before} becomes {after}"))
    return lines


def _figures_text(found: Figures) -> str:
    text = str(found.outcome)
    if found.swing is not None and found.outcome != Outcome.SETTLES:
        text += f", swing {found.swing:.3f}"
    if found.stick_fraction:
        text += f", stick {found.stick_fraction:.1%}"
    return text


def _input_text(result: AnalysisValues, largest: float) -> str:
    assert result.structure is not None
    rig = result.case.told_rig
    if rig is None or result.structure.inputs != ("torque",):
        return f"{largest:.3g}"
    return result.case.language.text("torque", largest * rig.torsional_stiffness, 3)


def _root_text(s: complex, case: Case) -> str:
    if (rig := case.told_rig) is not None:
        told = rate_text(s.real / rig.time_scale).removeprefix("vibration ")
        return f"{told} at {abs(s.imag) / (2.0 * math.pi * rig.time_scale):.3g} Hz"
    return f"{s.real:.4g}" + (f" ± {s.imag:.4g}i" if s.imag else "")


def _point_lines(result: AnalysisValues) -> Lines:
    p = result.point
    lines: Lines = []
    if (told := result.case.told_point) is not None:
        steady, say = steady_state(told), result.case.language.text
        place = f"{say('angular_rate', told.rotary_speed, 6)}, "
        place += f"{say('axial_rate', told.penetration_rate, 6)} in rock of "
        place += say("stress", told.rig.rock_strength, 6)
        load = f"{say('force', steady.weight_on_bit, 5)} on bit, "
        load += f"{say('torque', steady.torque_on_bit, 5)} on bit, "
        load += f"cut {say('length', steady.depth_of_cut)} per turn"
        lines += [("Drilling", place), ("Steady load", load)]
    if p is None:
        plant = result.plant
        delays = ", ".join(f"{tau:.6g}" for tau in plant.delays) or "none"
        lines.append(("Plant", f"{plant.order} states; delays {delays}"))
    else:
        same = p.xi == p.kappa
        damping = f"ξ = κ = {p.xi:.6g}" if same else f"ξ = {p.xi:.6g}, κ = {p.kappa:.6g}"
        text = f"ω0 = {p.omega0:.6g}, δ0 = {p.delta0:.6g}, ψ = {p.psi:.6g}, "
        text += f"η = {p.eta:.6g}, {damping}, {p.blades} blades; τ0 = {p.delay:.6g}"
        lines.append(("Point", text))
    open_loop = result.open_loop
    state = "stable" if open_loop.stable else "unstable"
    if result.structure is not None:
        lines.append(("Without control", f"{state}, {decay_text(result.case, open_loop)}"))
    return lines


def decay_text(case: Case, loop: LoopAnalysis) -> str:
    """Return how fast vibration dies away or grows, of a rig per second; else α."""
    rig = case.told_rig
    if rig is None:
        return f"α = {alpha_text(loop)}"
    return rate_text(loop.spectral_abscissa / rig.time_scale)


def rate_text(rate: float) -> str:
    """Return a growth rate in 1/s in words."""
    return f"vibration {'grows' if rate > 0.0 else 'dies away'} by {abs(rate):.3g} 1/s"


def alpha_text(loop: LoopAnalysis) -> str:
    """Return α with as many digits as rounding of the coefficients leaves."""
    error = loop.abscissa_error
    digits = 9 if error < 1e-10 else max(1, -math.floor(math.log10(error)))
    text = f"{loop.spectral_abscissa:.{min(digits, 9)}f}"
    return text if error < 1e-10 else f"{text} ± {error:.1g}"


def _gain_lines(result: AnalysisValues) -> Lines:
    structure = result.structure
    if structure is None:
        return []
    words = _SIGNALS if result.case.told_rig is None else _OF_RIG
    outputs = [words.get(name, name) for name in structure.outputs]
    past = bool(structure.K2_lower.any() or structure.K2_upper.any())
    law = "u" if words is _SIGNALS else "torque"
    law += f" = K1·({', '.join(outputs)})" if len(outputs) > 1 else f" = K1·{outputs[0]}"
    if past:
        law += f" + K2·(the same, {'τ0' if words is _SIGNALS else 'one delay'} ago)"
    refused = " (refused)" if result.verdict.refused else ""
    lines: Lines = [("Feedback", f"{structure.name}{refused}: {law}")]
    plant, rig, language = result.case.plant, result.case.told_rig, result.case.language
    matrices = [("K1", "", result.K1, structure.K1_lower, structure.K1_upper)]
    if past:
        matrices.append(("K2", " delayed", result.K2, structure.K2_lower, structure.K2_upper))
    for name, when, *values in matrices:
        gains, low, high = (gain_texts(structure, each, plant, rig, language) for each in values)
        for i, row in enumerate(gains):
            for j, symbol in enumerate(outputs):
                bounds = f"{low[i][j]} to {high[i][j]}"
                if low[i][j].partition(" ")[2] == high[i][j].partition(" ")[2]:
                    bounds = f"{low[i][j].partition(' ')[0]} to {high[i][j]}"
                text = f"{row[j]} on {symbol}{when}, within {bounds}"
                lines.append((name if i == 0 and j == 0 else "", text))
    if not result.verdict.refused:
        label = "To copy" if rig is None else "Dimensionless"
        for name, _, exact, *_ in matrices:
            digits = ",".join(repr(float(gain)) for gain in exact.ravel())
            lines.append((label, f"{name}={digits}"))
            label = ""
    return lines


def _loop_lines(result: AnalysisValues, word: str, aims: Lines) -> Lines:
    loop = result.loop
    lines: Lines = [("Result", f"{word}{alpha_text(loop)}"), *aims]
    roots = [
        f"{root.real:.6f}{f' ± {root.imag:.6f}i' if root.imag else ''}"
        + (f" ({root.multiplicity}-fold)" if root.multiplicity > 1 else "")
        + ("" if root.converged else " (not converged)")
        for root in loop.dominant_roots
    ]
    lines.append(("Dominant roots", ", ".join(roots)))
    if loop.stable:
        time = f"to 2 % in {loop.settling_time:.4g} time units"
        if (rig := result.case.told_rig) is not None:
            time = f"to 2 % in {loop.settling_time * rig.time_scale:.3g} s"
        lines.append(("Settling", time))
    check = loop.certificate
    word = "agrees" if check.agrees else "DOES NOT AGREE"
    counted = "undecided" if check.counted is None else str(check.counted)
    right = f"{counted} root(s) right of {check.line:.4g}, {check.found} found"
    lines.append(("Checked by", f"argument principle {word}: {right}"))
    radius = result.spectral_radius
    if radius is not None:
        lines.append(
            (
                "",
                f"semi-discretisation (m = {radius.m}, order {radius.order}): "
                f"ρ(D) = {radius.value:.9f}, ln ρ/Δt = {radius.growth_rate:.6f}",
            )
        )
    return lines


def _motion_lines(design: DesignValues) -> Lines:
    """Say what the gains do on the motion that is drilled with."""
    found = design.on_motion
    if found is None:
        return []
    unit, per = 1.0, "unit of time"
    if (rig := design.case.told_rig) is not None:
        unit, per = rig.time_scale, "s"
    lines: Lines = [("Designed on", "the motion that is drilled with, torsional swings about it")]
    if found.why != ASKED:
        lines.append(("", f"because {found.why}"))
    if found.swings:
        lines.append(("", f"growth rates per {per}, without control → with it:"))
    for each in found.swings:
        swing = each.swing
        text = f"mode {swing.mode}, swing {swing.amplitude:.2f}: {swing.growth / unit:.3g}"
        if swing.growth_error > _SHOWN * abs(swing.growth):
            text += f" ± {swing.growth_error / unit:.1g}"
        text += f" → {each.growth / unit:.3g}"
        if each.mode != swing.mode:
            text += f" of mode {each.mode}"
        lines.append(("", text + ("" if each.in_band else " (outside the band of H)")))
    if found.unknown:
        swings = ", ".join(dict.fromkeys(f"{swing.amplitude:.2f}" for swing in found.unknown))
        lines.append(("", f"too irregular to tell at swing {swings}: there runs alone decide"))
    share = f"1/{1.0 / found.share:.0f} of the bounds" if found.share < 1.0 else "all of the bounds"
    why = "as trial runs chose" if design.trials else "the most that keeps modes near H"
    lines.append(("", f"within {share}, {why}"))
    return lines


def _objective_lines(design: DesignValues) -> Lines:
    """Say what was minimised and required, where that is not the spectral abscissa alone."""
    lines: Lines = []
    match design.objective:
        case SemiDiscrete(m=m, order=order):
            goal = f"ln ρ(D)/Δt of the semi-discretisation (m = {m}, order {order})"
        case WorstCase() as case:
            goal = f"largest α of {len(case.around(design.case))} points"
        case Robust(epsilon=epsilon):
            goal = f"largest Re s with relative errors of the plant up to {epsilon:g}"
        case Drilling():
            goal = "largest growth rate of torsional swings on that motion"
        case HInfinity(inputs=inputs, outputs=outputs):
            ends = (", ".join(names) or "all" for names in (inputs, outputs))
            goal = "H∞ norm from {} to {}".format(*ends)
        case _:
            goal = ""
    if goal:
        lines.append(("Minimised", f"{goal}: {design.objective_value:.9f}"))
    if design.requirements:
        wanted = (
            ("decay rate ≥ {:g}", design.requirements.decay),
            ("stability radius ≥ {:g}", design.requirements.stability_radius),
            ("input gain ≤ {:g}", design.requirements.input_gain),
            ("H∞ norm ≤ {:g}", design.requirements.h_infinity),
        )
        text = ", ".join(form.format(value) for form, value in wanted if value is not None)
        lines.append(("Required", f"{text}: {'met' if design.requirements_met else 'NOT MET'}"))
    return lines
