"""Simulations in words for people and in fields for programs."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base import units
from drillctrl.base.text import set_out, wrapped
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.drive import CONSTANT_TORQUE, TopDrive
from drillctrl.drilling.quantities import told_scale
from drillctrl.simulation.irregular import irregular, still_grows
from drillctrl.simulation.loads import loads
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.status import Outcome, Status
from drillctrl.simulation.summary import SHORTEST

if TYPE_CHECKING:
    from drillctrl.simulation.floquet import Floquet
    from drillctrl.simulation.starts import StartSet


# Motions that go on and may or may not repeat.
_LASTING = (Outcome.ORBIT, Outcome.CHAOTIC, Outcome.BOUNCES, Outcome.STICK_SLIP)
# Steps by which chattering is told, and how short they are then on the mean.
_LAST_STEPS, _CHATTER = 10_000, 1e-3
# The same of a sampled command: over so much of the run and of so many samples, how many are at
# a limit, and how many jump to the other one next. A command that turns with the motion does so
# once in many samples.
_TAIL, _FEWEST_SAMPLES, _ALWAYS, _OFTEN = 0.25, 16, 0.9, 0.25


def simulation_fields(run: Simulation, multipliers: Floquet | None = None) -> dict[str, Any]:
    """Return the JSON fields of ``simulate``."""
    summary = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in run.summary.as_dict().items()
    }
    controller = run.controller
    fields = {
        "schema": "drillctrl/simulate/1",
        "operating_point": dataclasses.asdict(run.point),
        "structure": controller.feedback.name if controller else None,  # type: ignore[union-attr]
        "drive": _drive_of(run),
        "model": run.model,
        "cutting": run.cutting,
        "duration": run.duration,
        "status": run.status,
        "time_scale": None if run.rig is None else run.rig.time_scale,
        "saturated_fraction": _saturated(run),
        **summary,
        **_judged(run),
    }
    if multipliers is not None:
        fields["multipliers"] = [
            {"real": float(value.real), "imag": float(value.imag), "residual": float(residual)}
            for value, residual in zip(multipliers.multipliers, multipliers.residuals, strict=True)
        ]
        fields["multiplier_error"] = multipliers.trivial_error
    return fields


def _judged(run: Simulation) -> dict[str, Any]:
    """Return what became of the motion, in the words and figures that trials use as well."""
    found = figures(run)
    known = {
        name: value if value is None or math.isfinite(value) else None
        for name, value in loads(run).to_dict().items()
    }
    told = {"outcome": found.outcome, "irregular": _irregular(run, found.outcome)}
    return {**told, "swing": found.swing, "feed": found.feed, **known}


def _irregular(run: Simulation, outcome: Outcome) -> bool | None:
    """Return whether a motion is chaotic; None where its name leaves no such question."""
    return irregular(run) if outcome in _LASTING else None


def _outcome_text(run: Simulation) -> str:
    """Return what became of the motion in one line."""
    found = figures(run)
    parts = [found.outcome.sentence]
    if found.outcome is Outcome.UNDECIDED and run.status == Status.DONE:
        parts.append(f"which takes {_seconds(run, SHORTEST)} at least")
    if found.outcome is not Outcome.CHAOTIC and _irregular(run, found.outcome):
        parts.append("irregularly")
    if found.outcome is Outcome.ORBIT and still_grows(run):
        parts.append("still growing at the end")
    if found.swing is not None and found.outcome is not Outcome.SETTLES:
        parts.append(f"swing {found.swing:.3g}")
    if found.feed is not None and found.outcome is not Outcome.SETTLES:
        parts.append(f"{found.feed:.1%} of the feed")
    return ", ".join(parts)


def _load_lines(run: Simulation) -> list[tuple[str, str]]:
    """Return weight and torque beside the steady ones, and the share off the rock."""
    found = loads(run)
    lines = []
    for word, mean, peak in (
        ("Weight", found.weight_ratio, found.weight_peak),
        ("Torque", found.torque_ratio, found.torque_peak),
    ):
        if mean is not None:
            lines.append((word, f"{mean:.3g} of that of steady drilling, at most {peak:.3g}"))
    if found.off_rock_fraction:
        lines.append(("", f"off the rock for {found.off_rock_fraction:.1%} of the time"))
    return lines


def _drive_of(run: Simulation) -> str | None:
    """Return the law of the top drive; None where there is no drive."""
    if not any(isinstance(block, TopDrive) for block in run.case.physics("a run")[0].blocks):
        return None
    law = None if run.controller is None else run.controller.feedback
    if isinstance(law, FeedbackStructure) and "drive" in law.inputs:
        return law.name
    return CONSTANT_TORQUE


def _drive_lines(run: Simulation) -> list[tuple[str, str]]:
    """Say what turns a string under a top drive."""
    law = _drive_of(run)
    if law is None:
        return []
    if law == CONSTANT_TORQUE:
        return [("Drive", "its torque is constant: no law was given, such as stiff")]
    return [("Drive", law)]


def _backwards_lines(run: Simulation) -> list[tuple[str, str]]:
    """Say how often the bit turned back, and for how much of the whole run it was behind."""
    times = run.summary.reversals
    if not times:
        return []
    behind = sum(b - a for a, b in run.phases("behind")) / float(run.times[-1])
    told = f"{times} time{'s' if times > 1 else ''}, until where it turned {behind:.1%} of the run"
    return [("Turns back", told)]


def _chatter_lines(run: Simulation) -> list[tuple[str, str]]:
    """Say that gains act like a relay, where that used up the steps or shows in the samples."""
    switched = _switched(run)
    if switched is not None:
        return [
            (
                "",
                f"at its limit nearly always, at the other one in {switched:.0%} of next samples:",
            ),
            ("", "gains this high act like a relay; lower gains or a shorter period end that"),
        ]
    last = np.diff(run.times)[-_LAST_STEPS:]
    if run.status != Status.STEP_LIMIT or run.controller is None or not last.size:
        return []
    if float(last.mean()) > _CHATTER:
        return []
    return [
        ("", f"the last {last.size} steps are {last.mean():.1g} long: gains this high act like"),
        ("", "a relay and chatter; a sampling period or lower gains would end that"),
    ]


def _switched(run: Simulation) -> float | None:
    """Return how often an input jumps from limit to limit between samples of the last quarter.

    None where it is not at a limit nearly always, or stays on one side for many samples: then
    more than the sign of what is fed back reaches the plant.
    """
    given, end = run.controller, float(run.times[-1])
    if given is None or given.period is None or given.limit is None:
        return None
    samples = np.arange((1.0 - _TAIL) * end + 0.5 * given.period, end, given.period)
    if samples.size < _FEWEST_SAMPLES:
        return None
    motion = run.at(samples, run.input_names)
    for name in run.input_names:
        values = getattr(motion, name)
        side = np.where(np.abs(values) >= 0.999 * given.limit, np.sign(values), 0.0)
        jumps = float((side[1:] * side[:-1] < 0.0).mean())
        if np.abs(side).mean() > _ALWAYS and jumps > _OFTEN:
            return jumps
    return None


def _near_zero(value: float, scale: float) -> float:
    """Return 0 for what is rounding beside a scale."""
    return 0.0 if abs(value) <= scale else value


def _saturated(run: Simulation) -> float:
    """Return the share of the whole run in which a control is at a limit."""
    end = float(run.times[-1])
    return sum(b - a for a, b in run.phases("saturated")) / end if end > 0.0 else 0.0


def _steady(run: Simulation) -> str:
    """Say when the motion had settled."""
    after = run.summary.settling_time
    told = "settles to steady drilling"
    return told if after is None else f"{told}, to 2 % after {_seconds(run, after)}"


def _resting(run: Simulation) -> bool:
    """Whether the rates hardly change any more in the last tenth of the run.

    Where the drive was changed the positions go on.
    """
    motion, tail = run.motion, run.on_steps(3, 0.9 * float(run.times[-1]))
    return all(
        float(np.ptp(getattr(tail, name))) <= 1e-3 * float(np.ptp(getattr(motion, name)))
        for name in ("dx", "dtheta")
    )


def _ended(run: Simulation) -> str:
    """Say how the run ended, and when if it broke off."""
    if run.status == Status.DONE:
        return str(run.status)
    return f"{run.status} at {_seconds(run, float(run.times[-1]))}"


def _seconds(run: Simulation, time: float) -> str:
    told = run.case.told_rig
    return f"{time:.6g}" if told is None else f"{time * told.time_scale:.4g} s"


def simulation_summary(run: Simulation, multipliers: Floquet | None = None) -> str:
    """Return the summary of a run for people, in rig units too where it was of a rig."""
    s, p, rig = run.summary, run.point, run.case.told_rig
    least, most = (_near_zero(v, 1e-9 * p.omega0) for v in (s.bit_speed_min, s.bit_speed_max))
    lowest, highest = (_near_zero(v, run.resolved) for v in (s.axial_min, s.axial_max))
    speed = f"{least:.6g} to {most:.6g}"
    if rig is not None:
        low, high = (
            units.from_si(v / rig.time_scale, units.ROTARY_SPEED, "rpm") for v in (least, most)
        )
        speed = f"{low:.4g} to {high:.4g} rpm"
    if s.settled:
        motion = _steady(run)
    elif s.period is not None:
        motion = f"periodic orbit, period {_seconds(run, s.period)}"
    elif run.scenario.changes and _resting(run):
        motion = "steady by the end, at the changed point"
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
        ("Outcome", _outcome_text(run)),
        *([] if rig is None else [("Drilling", run.case.place)]),
        *_drive_lines(run),
        ("Point", f"ω0 = {p.omega0:.6g}, δ0 = {p.delta0:.6g}, ψ = {p.psi:.6g}"),
        ("Run", f"{run.model} model, "
         f"{_seconds(run, run.duration)}{' time units' if rig is None else ''}, {_ended(run)}"),
        *([] if run.status == Status.DONE else [("", str(run.status.sentence))]),
        *_chatter_lines(run),
        ("Motion", motion),
        ("", ", ".join(kinds) if kinds else "no stick, contact kept"),
    ]  # fmt: skip
    if multipliers is not None:
        values = ", ".join(_complex(value) for value in multipliers.multipliers[:5])
        error = multipliers.trivial_error
        found = f"over {multipliers.period:.4g}" if error is None else f"1 found within {error:.0e}"
        lines.append(("Multipliers", f"{values} ({found})"))
    lines += [
        ("Bit speed", speed),
        ("Axial", _length_text(run, lowest, highest)),
        *_load_lines(run),
        *_backwards_lines(run),
        ("Delay", f"at most {_seconds(run, s.delay_max)} (steady {_seconds(run, p.delay)})"),
    ]
    if run.controller is not None:
        torque = f"largest |u| = {s.max_abs_u:.6g}"
        driven = run.controller.feedback.inputs  # type: ignore[union-attr]
        if rig is not None and driven in (("torque",), ("drive",)):
            newton_metres = s.max_abs_u * rig.torsional_stiffness
            torque = f"largest torque {run.case.language.text('torque', newton_metres)}"
        share = _saturated(run)
        limited = f", at a limit for {share:.1%} of the run" if share else ""
        lines.append(("Control", f"{torque}{limited}"))
    lines.append(("Effort", f"{s.steps} steps, {s.events} events, {s.elapsed_seconds:.3g} s"))
    if run.unsettled:
        told = f"friction on the wall was not found in {run.unsettled} steps"
        lines.append(("", told))
    return set_out(lines)


def starts_summary(found: StartSet) -> str:
    """Return the worst of what became of some starts, and a table of them, for people."""
    rows = [("Start", "Outcome", "swing", "stick", "feed")]
    for run in found.runs:
        f = run.figures
        shares = (_cell(f.swing, ".3g"), _cell(f.stick_fraction, ".1%"), _cell(f.feed, ".1%"))
        rows.append((run.start, str(f.outcome), *shares))
    widths = [max(len(row[i]) for row in rows) + 2 for i in range(len(rows[0]))]
    lines = [
        "".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    worst = found.worst
    told = wrapped(f"Worst: {worst.start}, {worst.figures.outcome.sentence}")
    return "\n".join([told, *lines])


def _cell(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def _length_text(run: Simulation, *axial: float) -> str:
    factor, unit = told_scale("length", run.case.told_rig, run.case.language)
    low, high = (factor * x for x in axial)
    return f"{low:.4g} to {high:.4g} {unit}" if unit else f"x from {low:.6g} to {high:.6g}"


def _complex(value: complex) -> str:
    real = f"{value.real:.5g}"
    return (
        real
        if abs(value.imag) < 1e-9
        else f"{real} {'+' if value.imag > 0 else '−'} " + (f"{abs(value.imag):.5g}i")
    )
