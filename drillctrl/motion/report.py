"""What is told of the motion that a rig drills with: words and JSON fields."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Any

from drillctrl.base.text import finite_or_none
from drillctrl.motion.orbit import AxialOrbit
from drillctrl.motion.response import BitResponse
from drillctrl.motion.swing import DrillingMotion, ModeAt, ModeSwing
from drillctrl.motion.units import Units, told_units, units_of


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
    units = told_units(found.case)
    lines = [_orbit_text(found.orbit, units)]
    for swing in found.modes:
        lines += ["", *_mode_lines(swing, units)]
    if found.floor is not None:
        lines += [
            "",
            f"Its torque alone swings the bit's speed by {found.floor:.3g}, beside all else.",
        ]
    return "\n".join(lines)


def _orbit_text(orbit: AxialOrbit, units: Units) -> str:
    """Return what is told of the orbit, in lines of 80 columns."""
    return textwrap.fill(_orbit_told(orbit, units), 80, break_on_hyphens=False)


def _orbit_told(orbit: AxialOrbit, units: Units) -> str:
    if orbit.broken is not None:
        return f"Axial orbit at steady rotation: none; {orbit.broken.sentence}."
    if orbit.settles:
        return "Axial motion at steady rotation: smooth drilling."
    kind = "does not repeat"
    if orbit.period is not None:
        kind = f"repeats every {orbit.period * units.time:.4g}{' s' if units.rate_name else ''}"
    loads = ""
    if units.rate_name:
        weight, torque = orbit.weight * units.weight, orbit.torque * units.torque
        loads = f" ({weight:.3g} {units.weight_name}, {torque:.3g} {units.torque_name})"
    return (
        f"Axial orbit at steady rotation: {kind}; held {orbit.held:.0%} of the time, off the rock "
        f"{orbit.lifted:.0%}; cuts up to {orbit.deepest:.2f} of smooth drilling; mean weight "
        f"{orbit.weight_ratio:.3f} and torque {orbit.torque_ratio:.3f} of it{loads}."
    )


def _mode_lines(swing: ModeSwing, units: Units) -> list[str]:
    mode, rig = swing.mode, bool(units.rate_name)
    place = mode.root.imag / units.time
    frequency = f"{place / (2.0 * math.pi):.3f} Hz" if rig else f"ω = {place:.4g}"
    unit = f" {units.response_name}" if rig else ""
    lines = [
        f"Torsional mode {mode.number}: {frequency}, own damping "
        f"{mode.damping * units.response:.4g}{unit}",
        f"{'A':>7} {'Re H':>9} {'Im H':>9} {'±':>7} {'damping left':>13} {'growth':>9} {'±':>8}"
        f" {'held':>5} {'lifted':>6}",
    ]
    for each in swing.at:
        response = each.response
        if response.broken is not None:
            lines.append(f"{each.amplitude:7.3f} {response.broken.sentence}")
            continue
        if not math.isfinite(response.error):
            told = f"the bit swings of itself, by {response.rippled:.2g} beside that"
            lines.append(f"{each.amplitude:7.3f} {told}")
            continue
        value, error = response.value * units.response, response.error * units.response
        left = mode.damping * units.response + value.real
        numbers = f"{value.real:9.4g} {value.imag:9.4g} {error:7.2g} {left:13.4g}"
        growth = f"{each.root.real / units.time:9.4f} {each.error / units.time:8.2g}"
        shares = f"{response.held:5.0%} {response.lifted:6.0%}"
        lines.append(f"{each.amplitude:7.3f} {numbers} {growth} {shares}")
    return [*lines, *verdict(swing)]


def verdict(swing: ModeSwing) -> list[str]:
    """Say which swings a mode has, and from which kicks."""
    told = []
    sure = [each for each in swing.at if each.sign]
    if not sure:
        return ["At no amplitude is it sure whether the mode grows: the simulator must decide."]
    smallest, largest = sure[0], sure[-1]
    if smallest.sign < 0:
        told.append(f"Small swings decay (at A = {smallest.amplitude:.3g}).")
    else:
        told.append(f"Small swings grow (at A = {smallest.amplitude:.3g}).")
    for crossing in swing.crossings:
        between = f"between {crossing.low:.3g} and {crossing.high:.3g}"
        told.append(
            f"Swings by {crossing.amplitude:.3g} of the speed ({between})."
            if crossing.kind == "swing"
            else f"A kick beyond {crossing.amplitude:.3g} grows on ({between})."
        )
    if largest.sign > 0:
        told.append(f"Grows at A = {largest.amplitude:.3g} still: until the bit sticks.")
    unsure = [each.amplitude for each in swing.at if not each.sign]
    if unsure:
        listed = ", ".join(f"{a:.3g}" for a in unsure)
        told.append(f"Not sure at A = {listed}: the simulator must decide there.")
    return told


def responses_summary(found: DrillingMotion, responses: Sequence[BitResponse]) -> str:
    """Return what is told of H at frequencies of one's own on a terminal."""
    units = told_units(found.case)
    rig = bool(units.rate_name)
    lines = [
        _orbit_text(found.orbit, units),
        "",
        f"H{f', {units.response_name}' if rig else ''}, of a rotation imposed whole",
        f"{'Hz' if rig else 'ω':>9} {'A':>7} {'Re H':>9} {'Im H':>9} {'±':>7}",
    ]
    for each in responses:
        place = f"{each.frequency / units.turn:9.4g} {each.amplitude:7.3f}"
        if each.broken is not None:
            lines.append(f"{place} {each.broken.sentence}")
            continue
        value, error = each.value * units.response, each.error * units.response
        lines.append(f"{place} {value.real:9.4g} {value.imag:9.4g} {error:7.2g}")
    for swing in found.modes:
        lines += ["", *_mode_lines(swing, units)]
    return "\n".join(lines)
