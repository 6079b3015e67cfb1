"""All that is said of a result: how robust it is, what would be better, what else would help."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from drillctrl.base.kinds import checks_kinds
from drillctrl.base.text import finite_or_none, set_out
from drillctrl.designs.quieter import Quieter, quieter
from drillctrl.designs.remedies import Remedy, remedies
from drillctrl.designs.result import Analysis, Design, dominant_kind
from drillctrl.designs.robustness import GIVE_UP, Robustness, robust_alternative, robustness_of
from drillctrl.designs.words import Lines, decay_text, design_lines, rate_text, result_lines
from drillctrl.drilling.gain_units import gain_texts
from drillctrl.robustness.margins import ParameterMargin
from drillctrl.strings.named_roots import NamedRoots, named_roots
from drillctrl.synthesis.boundary import BoundaryDecision, decide
from drillctrl.synthesis.family import loop_family

# How far left of a design its explicit boundary is asked for better gains.
_LEFT = 1e-3
# States up to which margins of the point and a more robust alternative are looked for.
_SOON = 20
_GROUPS = {"psi": "ψ", "delta0": "δ0", "omega0": "ω0"}
_OF_RIG = {"psi": "rock strength", "delta0": "depth of cut", "omega0": "rotary speed"}

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Alternative:
    """Gains that decay more slowly and stand more.

    Attributes
    ----------
    result : Analysis
        The loop that they close.
    robustness : Robustness
        What it stands.
    """

    result: Analysis
    robustness: Robustness


@dataclass(frozen=True, eq=False)
class Report:
    """A result with all that is said of it.

    Attributes
    ----------
    result : Analysis or Design
        Of which it tells.
    robustness : Robustness or None
        What the loop stands; None without feedback.
    boundary : BoundaryDecision or None
        Whether any gains within the bounds stabilise, if a design does not; else whether any
        put all roots left of a line a thousandth left of its abscissa. None for given gains,
        where α is not what was minimised, and where there are more than two gains or several
        inputs.
    alternative : Alternative or None
        Beside a stable design of a plant of few states that minimises α and is not refused.
    remedies : tuple of Remedy
        What else stabilises the point, if a design does not.
    quieter : tuple of Quieter
        With what the motion is quiet without control, where a design on it is refused.
    modes : NamedRoots or None
        Roots by the modes of a string of pipe, and the drive that turns it.
    kind : str or None
        ``"axial"`` or ``"torsional"``, where that motion alone makes the first root.
    """

    result: Analysis
    robustness: Robustness | None
    boundary: BoundaryDecision | None
    alternative: Alternative | None
    remedies: tuple[Remedy, ...]
    quieter: tuple[Quieter, ...] = ()
    modes: NamedRoots | None = None
    kind: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        fields = self.result.to_dict()
        found = self.robustness
        fields["robustness"] = None if found is None else found.to_dict()
        if self.modes is not None:
            fields |= self.modes.to_dict()
            if self.modes.control is not None:
                fields["structure"] = self.modes.control.name
        if isinstance(self.result, Design):
            decision, other = self.boundary, self.alternative
            fields["certificate"]["boundary"] = decision and {
                **dataclasses.asdict(decision),
                "next_root": finite_or_none(decision.next_root),
            }
            fields["remedies"] = [remedy.to_dict() for remedy in self.remedies]
            fields["quieter"] = [change.to_dict() for change in self.quieter]
            if other is not None:
                fields["alternative"] = _alternative_fields(other)
        return fields

    def summary(self) -> str:
        """Return a text for people, in rig units too where a rig was given."""
        design = self.result
        if isinstance(design, Design):
            lines = [*design_lines(design, self.kind), *_boundary_lines(design, self.boundary)]
            lines += _remedy_lines(design, self.remedies)
            lines += _quieter_lines(design, self.quieter)
        else:
            lines = result_lines(design, self.kind)
        if self.modes is not None:
            lines += self.modes.lines + self.modes.others
        if self.robustness is not None:
            lines += _robustness_lines(design, self.robustness)
        if self.alternative is not None:
            lines += _alternative_lines(self.alternative)
        return set_out(lines)


@checks_kinds
def report(result: Analysis, progress: Progress | None = None) -> Report:
    """Find out what a loop stands, and what would be better or would help.

    Parameters
    ----------
    result : Analysis or Design
        What `analyze` or `design` returned.
    progress : callable, optional
        Called with what is being worked on.

    Returns
    -------
    Report
        Values alone: printing it computes nothing.
    """

    def at(what: str) -> None:
        if progress is not None:
            progress(what)

    # Of a plant of many states these take longer than all else together.
    soon = len(result.plant.A0) <= _SOON
    stands = None
    if result.structure is not None:
        at("margins")
        stands = robustness_of(result, with_point=soon)
    modes = named_roots(result.case, result.structure, result.K1, result.K2)
    if not isinstance(result, Design):
        return Report(result, stands, None, None, (), modes=modes, kind=dominant_kind(result))
    at("bounds")
    decision = boundary_decision(result)
    other = None
    if soon and result.stable and result.minimises_alpha and not result.verdict.refused:
        at("a more robust alternative")
        found = robust_alternative(result)
        other = Alternative(found, robustness_of(found))
    if not result.stable:
        at("what would stabilise")
    helps = remedies(result)
    quiet: tuple[Quieter, ...] = ()
    if result.on_motion is not None and result.verdict.refused:
        at("what would be quiet")
        quiet = quieter(result.case)
    kind = dominant_kind(result)
    return Report(result, stands, decision, other, helps, quiet, modes, kind)


def boundary_decision(design: Design) -> BoundaryDecision | None:
    """Return what the explicit boundary of one or two gains says; see `Report.boundary`."""
    assert design.structure is not None
    if design.stable and not design.minimises_alpha:
        return None
    alpha = design.spectral_abscissa
    line = alpha - _LEFT * (1.0 + abs(alpha)) if design.stable else 0.0
    return decide(loop_family(design.plant, design.structure), line)


def _alternative_fields(found: Alternative) -> dict[str, Any]:
    other = found.result
    return {
        "give_up": GIVE_UP,
        "K1": other.K1.ravel().tolist(),
        "K2": other.K2.ravel().tolist(),
        "spectral_abscissa": other.spectral_abscissa,
        "stable": other.stable,
        "recommended": other.recommended,
        "reason": other.reason,
        "robustness": found.robustness.to_dict(),
    }


def _alternative_lines(found: Alternative) -> Lines:
    other = found.result
    assert other.structure is not None
    case = other.case
    told = {
        name: [
            t
            for row in gain_texts(other.structure, matrix, case.plant, case.told_rig, case.language)
            for t in row
        ]
        for name, matrix in (("K1", other.K1), ("K2", other.K2))
        if matrix.any()
    }
    gains = "; ".join(f"{name} = {', '.join(texts)}" for name, texts in told.items())
    lines: Lines = [("", ""), ("More robust", gains)]
    if other.trials:
        word = "recommended" if other.recommended else "REFUSED"
        lines.append(("", f"{word}: {other.reason}"))
    text = f"{decay_text(case, other.loop)}: at most {GIVE_UP:.0%} of the decay given up"
    return [*lines, ("", text), *_robustness_lines(other, found.robustness)]


def _boundary_lines(design: Design, decision: BoundaryDecision | None) -> Lines:
    """Say what is known of all gains within the bounds."""
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


def _remedy_lines(design: Design, found: tuple[Remedy, ...]) -> Lines:
    """Say what would stabilise where these gains do not."""
    if design.stable or design.point is None:
        return []
    words = []
    for remedy in found:
        alpha = f"α = {remedy.spectral_abscissa:.4g}"
        if (rig := design.case.told_rig) is not None:
            alpha = rate_text(remedy.spectral_abscissa / rig.time_scale)
        if remedy.kind == "speed":
            faster = _speed_text(remedy.result)
            feedback = "no feedback" if remedy.result.structure is None else remedy.name
            words.append(f"{faster} at this rate of penetration, {feedback}: {alpha}")
        elif remedy.kind == "feed":
            words.append(f"an axial actuator, structure {remedy.name}: {alpha}")
        else:
            words.append(f"structure {remedy.name} within the paper's bounds: {alpha}")
    if not words:
        tried = "richer presets, an axial actuator, this structure and none up to 4 times the speed"
        return [("Would stabilise", f"nothing that was tried ({tried})")]
    return list(zip(["Would stabilise", *[""] * (len(words) - 1)], words, strict=True))


def _quieter_lines(design: Design, found: tuple[Quieter, ...]) -> Lines:
    """Say what would be quiet without control where nothing was found that helps."""
    if design.on_motion is None or not design.verdict.refused:
        return []
    words = []
    for change in found:
        text = _change_text(design, change)
        words.append(f"{text}: swing {change.swing:.2g} at most, small start and kicks")
    if not words:
        words = ["nothing up to twice the speed, a tenth of the feed or four more blades"]
    return list(zip(["Quiet without", *[""] * (len(words) - 1)], words, strict=True))


def _change_text(design: Design, change: Quieter) -> str:
    """Return a change in the units of whoever asked."""
    point, language = design.case.told_point, design.case.language
    if change.kind == "blades":
        return f"{change.value:.0f} blades"
    if point is None:
        what = "the speed" if change.kind == "speed" else "the feed"
        return f"{change.value:.2g} times {what}"
    if change.kind == "speed":
        speed = language.text("angular_rate", change.value * point.rotary_speed)
        return f"{speed} at this rate of penetration"
    return f"{language.text('axial_rate', change.value * point.penetration_rate)} at this speed"


def _speed_text(design: Analysis) -> str:
    """Return a rotary speed, in rpm where there is a rig."""
    if (told := design.case.told_point) is not None:
        return told.language.text("angular_rate", told.rotary_speed)
    assert design.point is not None
    return f"ω0 = {design.point.omega0:.4g}"


def _robustness_lines(result: Analysis, found: Robustness) -> Lines:
    """Say how near instability is, and what small errors do."""
    lines: Lines = []
    off, rig = found.fragility, result.case.told_rig
    groups, rock, delay, per = _GROUPS, "ψ 5 % lower or higher", "τ0", 1.0
    if rig is not None:
        groups, rock, delay = _OF_RIG, "rock 5 % softer or harder", "the delay"
        per = rig.time_scale
    if result.stable:
        radius = found.stability_radius
        text = f"relative errors of the plant below {radius.lower_bound:.2g}"
        if radius.lower_bound == 0.0:
            text = f"relative errors of the plant of {radius.value:.2g} destabilise; of smaller"
            text += " ones nothing is known"
        lines.append(("Margins", text))
    if (margin := found.delay_margin) is not None:
        longer = "any" if math.isinf(margin.limit) else f"{margin.limit:g} (or more)"
        longer = longer if math.isinf(margin.longer) else f"{margin.longer:.4g}"
        lines.append(("", f"delay between {margin.shorter:.4g} and {longer} times the assumed"))
    for name, errors in (found.point_margins or {}).items():
        lines.append(("", f"{groups[name]} {_margin_text(errors)}"))
    head = "If off, α is" if rig is None else "Growth, 1/s"
    rounded = f"{off.rounded_gains / per:.4f} with the gains rounded to 3 digits"
    lines.append((head, rounded))
    if off.psi_low is not None and off.psi_high is not None:
        text = f"{off.psi_low / per:.4f} and {off.psi_high / per:.4f} with {rock}"
        lines.append(("", text))
    if off.delay_low is not None and off.delay_high is not None:
        text = f"{off.delay_low / per:.4f} and {off.delay_high / per:.4f} "
        text += f"with {delay} 2 % shorter or longer"
        lines.append(("", text))
    return lines
