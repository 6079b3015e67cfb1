"""Words for the motion that a rig drills with; theory stands behind them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from drillctrl.base.text import set_out
from drillctrl.motion.orbit import AxialOrbit
from drillctrl.motion.response import BitResponse
from drillctrl.motion.swing import DrillingMotion, ModeSwing
from drillctrl.motion.units import Units, told_units

# From this share of the speed on, a swing that still grows is at the point of sticking.
_NEAR_STICK = 0.8


def theory_lines(lines: Sequence[str]) -> list[str]:
    """Return lines that a rig is told with ``--verbose`` alone."""
    told = "H is the bit's torque that follows its speed, A the swing over that"
    return [f"Theory  {told}", *(f"  {line}" for line in lines)]


def motion_lines(found: DrillingMotion, answers: Sequence[str] = ()) -> list[str]:
    """Return what becomes of swings of a rig's bit, and why.

    Parameters
    ----------
    found : DrillingMotion
        Of a rig.
    answers : sequence of str
        What was asked beside that, told first.
    """
    units = told_units(found.case)
    lines, tables = [("Answer", each) for each in answers], []
    for swing in found.modes:
        mode = swing.mode
        label = "Swing" if len(found.modes) == 1 else f"Swing {mode.number}"
        lines.append((label, " ".join(verdict(swing, of_rig=True) + _caution(found.orbit))))
        own = f"{mode.damping * units.response:.4g} {units.response_name}"
        hertz = mode.root.imag / units.turn
        told = f"swings at {hertz:.3f} Hz; its own damping, seen at the bit, is {own}"
        tables += [
            (label.replace("Swing", "String"), told),
            *(("", row) for row in _table(swing, units)),
        ]
    lines.append(("Bit", _bit_text(found.orbit, units)))
    if found.floor is not None:
        told = f"the bit's own torque swings its speed by ±{found.floor:.2%} beside all else"
        lines.append(("Ripple", told.replace("%", " %")))
    return set_out([*lines, *tables]).splitlines()


def _caution(orbit: AxialOrbit) -> list[str]:
    """Say where the bit's own motion may stick it, whatever swings do."""
    if orbit.settles or orbit.broken is not None or orbit.period is not None:
        return []
    return ["But the bit bounces irregularly: simulate says whether it sticks."]


def asked_text(response: BitResponse, units: Units) -> str:
    """Say what damping the bit adds at a frequency and a swing."""
    place = f"at {response.frequency / units.turn:.4g} Hz, swinging by {_share(response.amplitude)}"
    if not math.isfinite(response.error):
        return f"{place}: {unknown_text(response)}"
    value, error = response.value.real * units.response, response.error * units.response
    does = "takes" if value < 0.0 else "adds"
    return (
        f"{place}, the bit {does} {abs(value):.4g} ± {error:.2g} {units.response_name} of damping"
    )


def unknown_text(response: BitResponse) -> str:
    """Say why it is not known how a bit answers."""
    if response.broken is not None:
        return response.broken.sentence
    return f"the bit swings of itself, by {response.rippled:.2g} beside that"


def _bit_text(orbit: AxialOrbit, units: Units) -> str:
    if orbit.broken is not None:
        return f"has no steady motion along the hole: {orbit.broken.sentence}"
    if orbit.settles:
        return "drills smoothly while it turns evenly"
    often = "irregularly"
    if orbit.period is not None:
        often = f"every {orbit.period * units.time:.4g} s"
    weight, torque = orbit.weight * units.weight, orbit.torque * units.torque
    return (
        f"moves up and down {often} while it turns evenly: held {_part(orbit.held)} of the time, "
        f"off the rock {_part(orbit.lifted)}, cutting up to {orbit.deepest:.2f} times as deep as "
        f"in smooth drilling; {weight:.3g} {units.weight_name} on it ({orbit.weight_ratio:.3f} of "
        f"smooth drilling's), {torque:.3g} {units.torque_name} ({orbit.torque_ratio:.3f})"
    )


def _table(swing: ModeSwing, units: Units) -> list[str]:
    unit = units.response_name
    rows = [
        "  swing  bit's damping   damping left         growth    held  off rock",
        f"      % {unit:>14} {unit:>14}            1/s       %         %",
    ]
    for each in swing.at:
        response = each.response
        place = f"{100.0 * each.amplitude:7.3g}"
        if not math.isfinite(response.error):
            rows.append(f"{place}  {unknown_text(response)}")
            continue
        of_bit = response.value.real * units.response
        left = swing.mode.damping * units.response + of_bit
        growth = f"{each.root.real / units.time:7.4f} ± {each.error / units.time:<7.1g}"
        shares = f"{100.0 * response.held:4.0f} {100.0 * response.lifted:9.0f}"
        rows.append(f"{place} {of_bit:14.4g} {left:14.4g} {growth} {shares}")
    return rows


def _part(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _share(amplitude: float) -> str:
    return f"±{100.0 * amplitude:.3g} %"


def verdict(swing: ModeSwing, *, of_rig: bool = False) -> list[str]:
    """Say which swings a mode has, and from which kicks."""
    size = _share if of_rig else "{:.3g}".format
    at, of = ("", " of the bit's speed") if of_rig else ("A = ", "")
    sure = [each for each in swing.at if each.sign]
    if not sure:
        return ["At no amplitude is it sure whether the mode grows: the simulator must decide."]
    smallest, largest = sure[0], sure[-1]
    verb = "decay" if smallest.sign < 0 else "grow"
    told = [f"Small swings {verb} (at {at}{size(smallest.amplitude)}{of})."]
    for crossing in swing.crossings:
        between = f"between {size(crossing.low)} and {size(crossing.high)}"
        told.append(
            f"Swings by {size(crossing.amplitude)} of the speed ({between})."
            if crossing.kind == "swing"
            else f"A kick beyond {size(crossing.amplitude)} grows on ({between})."
        )
    if of_rig and largest.sign < 0 and largest is not smallest:
        told.append(f"Those by {size(largest.amplitude)} decay too.")
    if largest.sign > 0:
        beyond = "what larger ones do was not looked at"
        if largest.amplitude >= _NEAR_STICK:
            beyond = "until the bit sticks"
        told.append(f"Grows at {at}{size(largest.amplitude)} still: {beyond}.")
    unsure = [each.amplitude for each in swing.at if not each.sign]
    if unsure:
        listed = ", ".join(size(a) for a in unsure)
        told.append(f"Not sure at {at}{listed}: the simulator must decide there.")
    return told
