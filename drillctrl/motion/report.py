"""What is told of the motion that a rig drills with: words and JSON fields."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from drillctrl.base.text import finite_or_none, wrapped
from drillctrl.motion.orbit import AxialOrbit
from drillctrl.motion.response import BitResponse
from drillctrl.motion.swing import DrillingMotion, ModeAt, ModeSwing
from drillctrl.motion.units import Units, told_units, units_of
from drillctrl.motion.words import asked_text, motion_lines, theory_lines, unknown_text, verdict


def motion_fields(
    found: DrillingMotion, responses: Sequence[BitResponse] | None = None
) -> dict[str, Any]:
    """Return the JSON fields; in SI and Hz where there is a rig, else dimensionless.

    Parameters
    ----------
    found : DrillingMotion
        Of the case.
    responses : sequence of BitResponse, optional
        Those told as ``response``; by default those of the modes.
    """
    units = units_of(found.case)
    orbit = found.orbit
    if responses is None:
        responses = [each.response for swing in found.modes for each in swing.at]
    torque, weight = orbit.torque * units.torque, orbit.weight * units.weight
    return {
        "schema": "drillctrl/bit/1",
        "units": "SI" if found.case.rig is not None else "dimensionless",
        "response": [_response_fields(each, units) for each in responses],
        "mean_torque": finite_or_none(torque),
        "mean_weight": finite_or_none(weight),
        "steady_torque": finite_or_none(torque / orbit.torque_ratio),
        "steady_weight": finite_or_none(weight / orbit.weight_ratio),
        "held_fraction": finite_or_none(orbit.held),
        "lifted_fraction": finite_or_none(orbit.lifted),
        "periodic": orbit.periodic,
        "orbit": {
            "settles": orbit.settles,
            "periodic": orbit.periodic,
            "period": None if orbit.period is None else orbit.period * units.time,
            "weight_on_bit": finite_or_none(orbit.weight * units.weight),
            "torque_on_bit": finite_or_none(orbit.torque * units.torque),
            "weight_ratio": finite_or_none(orbit.weight_ratio),
            "torque_ratio": finite_or_none(orbit.torque_ratio),
            "held_fraction": finite_or_none(orbit.held),
            "lifted_fraction": finite_or_none(orbit.lifted),
            "deepest_cut_ratio": finite_or_none(orbit.deepest),
            "broken": None if orbit.broken is None else str(orbit.broken),
        },
        "forced_swing": found.floor,
        "modes": [_mode_fields(swing, units) for swing in found.modes],
    }


def _response_fields(response: BitResponse, units: Units) -> dict[str, Any]:
    value = response.value * units.response
    return {
        "frequency": response.frequency / units.turn,
        "amplitude": response.amplitude,
        "real": finite_or_none(value.real),
        "imag": finite_or_none(value.imag),
        "error": finite_or_none(response.error * units.response),
        "mean_torque": finite_or_none(response.torque * units.torque),
        "mean_weight": finite_or_none(response.weight * units.weight),
        "held_fraction": finite_or_none(response.held),
        "lifted_fraction": finite_or_none(response.lifted),
        "broken": None if response.broken is None else str(response.broken),
    }


def _mode_fields(swing: ModeSwing, units: Units) -> dict[str, Any]:
    mode = swing.mode
    return {
        "number": mode.number,
        "frequency": mode.root.imag / units.turn,
        "damping": _damping_left(swing, units),
        "swings": [
            {"amplitude": each.amplitude, "attracts": each.kind == "swing"}
            for each in swing.crossings
        ],
        "growth_rate": mode.root.real / units.time,
        "own_damping": mode.damping * units.response,
        "amplitudes": [_at_fields(each, swing, units) for each in swing.at],
        "crossings": [
            {"kind": each.kind, "amplitude": each.amplitude, "low": each.low, "high": each.high}
            for each in swing.crossings
        ],
    }


def _damping_left(swing: ModeSwing, units: Units) -> float | None:
    """Return the damping left at the smallest amplitude at which H is known."""
    left = zip(swing.damping_left.tolist(), swing.at, strict=True)
    known = [value for value, each in left if math.isfinite(each.response.error)]
    return known[0] * units.response if known else None


def _at_fields(each: ModeAt, swing: ModeSwing, units: Units) -> dict[str, Any]:
    response = each.response
    value = response.value * units.response
    return {
        "amplitude": each.amplitude,
        "frequency": response.frequency / units.turn,
        "response_re": finite_or_none(value.real),
        "response_im": finite_or_none(value.imag),
        "response_error": finite_or_none(response.error * units.response),
        "response_scatter": finite_or_none(response.scatter * units.response),
        "damping_left": finite_or_none(swing.mode.damping * units.response + value.real)
        if math.isfinite(response.error)
        else None,
        "growth_rate": finite_or_none(each.root.real / units.time),
        "growth_rate_error": finite_or_none(each.error / units.time),
        "sign": each.sign,
        "weight_on_bit": finite_or_none(response.weight * units.weight),
        "torque_on_bit": finite_or_none(response.torque * units.torque),
        "held_fraction": finite_or_none(response.held),
        "lifted_fraction": finite_or_none(response.lifted),
        "periods": response.periods,
        "ripple": response.ripple,
        "rippled": finite_or_none(response.rippled),
        "broken": None if response.broken is None else str(response.broken),
    }


def motion_summary(found: DrillingMotion) -> str:
    """Return what is told on a terminal."""
    return _told(found, [])


def responses_summary(found: DrillingMotion, responses: Sequence[BitResponse]) -> str:
    """Return what is told of H at frequencies of one's own on a terminal."""
    units = told_units(found.case)
    rig = bool(units.rate_name)
    lines = [
        f"H{f', {units.response_name}' if rig else ''}, of a rotation imposed whole",
        f"{'Hz' if rig else 'ω':>9} {'A':>7} {'Re H':>9} {'Im H':>9} {'±':>7}",
    ]
    for each in responses:
        place = f"{each.frequency / units.turn:9.4g} {each.amplitude:7.3f}"
        if each.broken is not None:
            lines.append(f"{place} {each.broken.sentence}")
        else:
            lines.append(f"{place} {_answer_text(each, units)}")
    return _told(found, lines, [asked_text(each, units) for each in responses])


def _told(found: DrillingMotion, asked: list[str], answers: Sequence[str] = ()) -> str:
    """Return the motion; of a rig in a driller's words, and the theory behind."""
    units = told_units(found.case)
    if not units.rate_name:
        lines = [wrapped(_orbit_told(found.orbit, units))]
        if asked:
            lines += ["", *asked]
        for swing in found.modes:
            lines += ["", *_mode_lines(swing, units)]
        if found.floor is not None:
            told = f"Its torque alone swings the bit's speed by {found.floor:.3g}, beside all else."
            lines += ["", told] if not asked else []
        return "\n".join(lines)
    theory = [*asked, *(line for swing in found.modes for line in _mode_lines(swing, units))]
    return "\n".join([*motion_lines(found, answers), *theory_lines(theory)])


def _orbit_told(orbit: AxialOrbit, units: Units) -> str:
    if orbit.broken is not None:
        return f"Axial orbit at steady rotation: none; {orbit.broken.sentence}."
    if orbit.settles:
        return "Axial motion at steady rotation: smooth drilling."
    kind = "does not repeat"
    if orbit.period is not None:
        kind = f"repeats every {orbit.period * units.time:.4g}"
    return (
        f"Axial orbit at steady rotation: {kind}; held {orbit.held:.0%} of the time, off the rock "
        f"{orbit.lifted:.0%}; cuts up to {orbit.deepest:.2f} of smooth drilling; mean weight "
        f"{orbit.weight_ratio:.3f} and torque {orbit.torque_ratio:.3f} of it."
    )


def _mode_lines(swing: ModeSwing, units: Units) -> list[str]:
    """Return a mode as theory has it; a rig is told of its damping and growth elsewhere."""
    mode, rig = swing.mode, bool(units.rate_name)
    place = mode.root.imag / units.time
    frequency = f"{place / (2.0 * math.pi):.3f} Hz" if rig else f"ω = {place:.4g}"
    unit = f" {units.response_name}" if rig else ""
    rest = f" {'damping left':>13} {'growth':>9} {'±':>8} {'held':>5} {'lifted':>6}"
    lines = [
        f"Torsional mode {mode.number}: {frequency}, own damping "
        f"{mode.damping * units.response:.4g}{unit}",
        f"{'A':>6} {'Re H':>9} {'Im H':>9} {'±':>7}{'' if rig else rest}",
    ]
    for each in swing.at:
        response = each.response
        if not math.isfinite(response.error):
            lines.append(f"{each.amplitude:6.3f} {unknown_text(response)}")
            continue
        text = f"{each.amplitude:6.3f} {_answer_text(response, units)}"
        left = mode.damping + response.value.real
        growth = f"{left:13.4g} {each.root.real:9.4f} {each.error:8.2g}"
        shares = f"{response.held:5.0%} {response.lifted:6.0%}"
        lines.append(text if rig else f"{text} {growth} {shares}")
    return lines if rig else [*lines, *verdict(swing)]


def _answer_text(response: BitResponse, units: Units) -> str:
    value, error = response.value * units.response, response.error * units.response
    return f"{value.real:9.4g} {value.imag:9.4g} {error:7.2g}"
