"""What is told of the motion that a rig drills with: words and JSON fields."""

from __future__ import annotations

import math
import statistics
import textwrap
from collections.abc import Sequence
from typing import Any, NamedTuple

from drillctrl.drilling.case import Case
from drillctrl.drilling.quantities import si_scale
from drillctrl.motion.band import BitBand
from drillctrl.motion.orbit import AxialOrbit
from drillctrl.motion.response import BitResponse
from drillctrl.motion.swing import DrillingMotion, ModeAt, ModeSwing
from drillctrl.motion.threshold import ModeAlong
from drillctrl.spectrum.roots import spectral_abscissa


class Units(NamedTuple):
    """What dimensionless units are in those that are told; 1 where there is no rig.

    ``turn`` is what an angular frequency is divided by to be told: in Hz of a rig.
    """

    response: float
    time: float
    weight: float
    torque: float
    turn: float
    response_name: str
    rate_name: str
    weight_name: str = ""
    torque_name: str = ""


def units_of(case: Case) -> Units:
    """Return the units of the fields of a case: SI where there is a rig."""
    if case.rig is None:
        return Units(1.0, 1.0, 1.0, 1.0, 1.0, "", "")
    weight, torque, time = (si_scale(name, case.rig) for name in ("force", "torque", "time"))
    turn = 2.0 * math.pi * time
    return Units(torque * time, time, weight, torque, turn, "N·m·s/rad", "1/s", "N", "N·m")


def told_units(case: Case) -> Units:
    """Return the units in which people are told of a case."""
    language = case.language
    if not language.units:
        return Units(1.0, 1.0, 1.0, 1.0, 1.0, "", "")
    si = units_of(case)
    return si._replace(
        response=language.number("impedance", si.response),
        weight=language.number("force", si.weight),
        torque=language.number("torque", si.torque),
        response_name=language.unit("impedance"),
        weight_name=language.unit("force"),
        torque_name=language.unit("torque"),
    )


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
        "mean_torque": _number(torque),
        "mean_weight": _number(weight),
        "steady_torque": _number(torque / orbit.torque_ratio),
        "steady_weight": _number(weight / orbit.weight_ratio),
        "held_fraction": _number(orbit.held),
        "lifted_fraction": _number(orbit.lifted),
        "periodic": orbit.periodic,
        "orbit": {
            "settles": orbit.settles,
            "periodic": orbit.periodic,
            "period": None if orbit.period is None else orbit.period * units.time,
            "weight_on_bit": _number(orbit.weight * units.weight),
            "torque_on_bit": _number(orbit.torque * units.torque),
            "weight_ratio": _number(orbit.weight_ratio),
            "torque_ratio": _number(orbit.torque_ratio),
            "held_fraction": _number(orbit.held),
            "lifted_fraction": _number(orbit.lifted),
            "deepest_cut_ratio": _number(orbit.deepest),
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
        "real": _number(value.real),
        "imag": _number(value.imag),
        "error": _number(response.error * units.response),
        "mean_torque": _number(response.torque * units.torque),
        "mean_weight": _number(response.weight * units.weight),
        "held_fraction": _number(response.held),
        "lifted_fraction": _number(response.lifted),
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
        "response_re": _number(value.real),
        "response_im": _number(value.imag),
        "response_error": _number(response.error * units.response),
        "response_scatter": _number(response.scatter * units.response),
        "damping_left": _number(swing.mode.damping * units.response + value.real)
        if math.isfinite(response.error)
        else None,
        "growth_rate": _number(each.root.real / units.time),
        "growth_rate_error": _number(each.error / units.time),
        "sign": each.sign,
        "weight_on_bit": _number(response.weight * units.weight),
        "torque_on_bit": _number(response.torque * units.torque),
        "held_fraction": _number(response.held),
        "lifted_fraction": _number(response.lifted),
        "periods": response.periods,
        "ripple": response.ripple,
        "rippled": _number(response.rippled),
        "broken": None if response.broken is None else str(response.broken),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


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


def along_fields(found: ModeAlong) -> dict[str, Any]:
    """Return the JSON fields of a mode over speed or rate; in SI where there is a rig."""
    units, own = units_of(found.case), found.own_value
    return {
        "along": found.along,
        "unit": _along_unit(found),
        "mode": found.number,
        "points": [
            {
                "value": float(value),
                "amplitude": each.amplitude,
                # Where H is not known, neither is this.
                "damping_left": _number(float(left) * units.response)
                if math.isfinite(each.error)
                else None,
                "growth_rate": _number(each.root.real / units.time),
                "growth_rate_error": _number(each.error / units.time),
                "sign": each.sign,
            }
            for value, left, each in zip(found.values, found.damping_left, found.at, strict=True)
        ],
        "thresholds": [
            {
                "decays": each.decays,
                "value": each.factor * own,
                "low": each.low * own,
                "high": each.high * own,
            }
            for each in found.thresholds
        ],
    }


def _along_unit(found: ModeAlong) -> str:
    if found.case.rig is None:
        return ""
    return "rpm" if found.along == "speed" else "m/h"


def along_summary(found: ModeAlong) -> str:
    """Return what is told on a terminal of a mode over speed or rate."""
    units, (factor, unit) = told_units(found.case), found.told
    own = found.own_value * factor
    name = unit or {"speed": "ω0", "rate": "V0"}[found.along]
    held = {"speed": "the rate of penetration held", "rate": "the rotary speed held"}[found.along]
    amplitude = statistics.median(each.amplitude for each in found.at)
    lines = [
        f"Torsional mode {found.number} at a swing of {amplitude:.2g}, {held}",
        f"{name:>9} {'damping left':>13} {'growth':>9} {'±':>8}",
    ]
    for value, left, each in zip(factor * found.values, found.damping_left, found.at, strict=True):
        if not math.isfinite(each.error):
            broken = each.response.broken
            told = "the bit swings of itself" if broken is None else broken.sentence
            lines.append(f"{value:9.4g} {told}")
            continue
        growth = f"{each.root.real / units.time:9.4f} {each.error / units.time:8.2g}"
        lines.append(f"{value:9.4g} {left * units.response:13.4g} {growth}")
    for threshold in found.thresholds:
        between = f"between {threshold.low * own:.4g} and {threshold.high * own:.4g}"
        lines.append(f"Decays {threshold.decays} {threshold.factor * own:.4g} {unit} ({between}).")
    if not found.thresholds:
        sure = {each.sign for each in found.at} - {0}
        verb = "Decays" if sure == {-1} else "Grows"
        lines.append(f"{verb} wherever it is sure." if sure else "It is sure nowhere.")
    unsure = [
        value for value, each in zip(factor * found.values, found.at, strict=True) if not each.sign
    ]
    if unsure:
        listed = ", ".join(f"{value:.4g}" for value in unsure)
        lines.append(f"Not sure at {listed} {unit}: the simulator must decide there.")
    return "\n".join(lines)


def band_fields(found: BitBand) -> dict[str, Any]:
    """Return the JSON fields of a band; in SI where there is a rig."""
    units = units_of(found.case)
    model = found.rational()
    growth = spectral_abscissa(found.system())
    return {
        "samples": [
            {
                "frequency": each.frequency / units.time,
                "amplitude": each.amplitude,
                "response_re": _number(each.value.real * units.response),
                "response_im": _number(each.value.imag * units.response),
                "response_error": _number(each.error * units.response),
            }
            for each in found.responses
        ],
        "model": {
            "constant": model.constant * units.response,
            "poles": [[p.real / units.time, p.imag / units.time] for p in model.poles.tolist()],
            "residues": [
                [r.real * units.response / units.time, r.imag * units.response / units.time]
                for r in model.residues.tolist()
            ],
            "error": model.error * units.response,
        },
        "growth_rate": growth / units.time,
        "growing_roots": found.count_growing(),
    }


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


def band_summary(found: BitBand) -> str:
    """Return what is told of a band on a terminal."""
    units, model = told_units(found.case), found.rational()
    rig = bool(units.rate_name)
    amplitude = sum(each.amplitude for each in found.responses) / len(found.responses)
    unit = f", {units.response_name}" if rig else ""
    lines = [
        f"H over frequency at a swing of {amplitude:.3g}{unit}",
        f"{'Hz' if rig else 'ω':>9} {'Re H':>9} {'Im H':>9} {'±':>7}",
    ]
    for each in found.responses:
        place = each.frequency / units.time / (2.0 * math.pi if rig else 1.0)
        value, error = each.value * units.response, each.error * units.response
        lines.append(f"{place:9.4g} {value.real:9.4g} {value.imag:9.4g} {error:7.2g}")
    growth = spectral_abscissa(found.system()) / units.time
    counted = found.count_growing()
    told = (
        "cannot be told from the band" if counted is None else f"{counted}, counted with H itself"
    )
    return "\n".join(
        [
            *lines,
            f"Rational model: {model.poles.size} poles, within {model.error * units.response:.2g}.",
            f"Torsional loop with it: growth rate {growth:.4g}{' 1/s' if rig else ''}; growing "
            f"roots: {told}.",
        ]
    )
