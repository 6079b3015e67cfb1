"""What a report of a rig says, in the words and units of the people who drill."""

from __future__ import annotations

import math
from collections.abc import Sequence

from drillctrl.base.language import Language
from drillctrl.designs.result import Design
from drillctrl.drilling.gain_units import gain_units
from drillctrl.simulation.status import Outcome
from drillctrl.strings.check import Mode
from drillctrl.strings.drive_measures import DriveMeasures
from drillctrl.strings.drives_words import setting_sentence, threshold_speed
from drillctrl.strings.rig import StringRig
from drillctrl.studies.rig_report_values import Course, ReportValues

Rows = list[tuple[str, str]]

# Outputs that are fed back → what a drive's engineer calls the gain on them, and its quantity.
_TERMS = {
    "theta": ("I, torque per turned angle behind", "drive_stiffness"),
    "dtheta": ("P, torque per speed behind", "drive_impedance"),
}
_MODES = 3


def place_text(found: ReportValues) -> str:
    """Say where the rig drills."""
    point = found.point
    speed = found.language.text("angular_rate", point.rotary_speed)
    rate = found.language.text("axial_rate", point.penetration_rate)
    return f"{speed}, {rate} in rock of {found.language.text('stress', point.rig.rock_strength)}"


def report_answer(found: ReportValues) -> list[str]:
    """Return what to do, then what happens without it: a sentence each."""
    told = _of_drive(found) if found.drives else _at_bit(found)
    return [*told, _as_it_is(found)]


def _as_it_is(found: ReportValues) -> str:
    """Say what the bit did in the runs."""
    seconds = found.language.text("time", float(found.courses[0].times[-1]), 2)
    start = found.courses[0].start
    told = "; ".join(f"{_under(found, i)} {_motion(c)}" for i, c in enumerate(found.courses))
    return f"{start[:1].upper()}{start[1:]} was simulated for {seconds}: {told}."


def _under(found: ReportValues, i: int) -> str:
    if found.drives is None:
        return found.courses[i].label
    label = found.courses[i].label
    return "under a stiff drive" if label == "stiff" else f"under {label}"


def _motion(course: Course) -> str:
    figures = course.figures
    text = figures.outcome.sentence
    if figures.outcome is Outcome.SETTLES or figures.swing is None:
        return text
    if figures.outcome is Outcome.TURNS_BACK:
        text = "the bit turns backwards for a moment"
    return f"{text}, and by the end its speed varies by ±{1e2 * figures.swing:.2g} %"


def _of_drive(found: ReportValues) -> list[str]:
    """Say how to set the drive, and what that changes."""
    assert found.drives is not None
    stiff, law = found.drives.drives[0], found.drives.drives[-1]
    if not law.verdict.recommended:
        reason = law.verdict.reason(found.language)
        return [f"Do not use {law.control.name} on this string: {reason}."]
    if not found.recommended:
        return [f"Do not use {law.control.name} here: in runs the bit did worse with it."]
    told = [setting_sentence(law.control, found.language)]
    if law is not stiff:
        first = law.modes[0]
        hertz = found.language.text("frequency", first.slope.mode_frequency, 3)
        told.append(
            f"That damps the slowest torsional vibration, {hertz}, by {_damping(law)} of critical"
            f" instead of {_damping(stiff)} with a stiff drive."
        )
    speeds = [threshold_speed(drive) for drive in (law, stiff)]
    if math.isfinite(speeds[0]):
        texts = [found.language.text("angular_rate", speed, 3) for speed in speeds]
        beside = f" ({texts[1]} with a stiff drive)" if law is not stiff else ""
        fall = found.language.text("torque", found.drives.falling.drop, 3)
        stay = (
            f"Against stick-slip stay above {texts[0]} with it"
            if speeds[0] * 30.0 / math.pi >= 1.0
            else "By this measure no speed is too low for it"
        )
        told.append(
            f"{stay}{beside}, if the bit's torque falls by {fall} as it"
            " turns faster (a guess: measure it)."
        )
    if not found.does_no_harm:
        told.append("Bring a bit that stands up to speed under the stiff drive.")
    return told


def _damping(drive: DriveMeasures) -> str:
    root = drive.modes[0].root
    return "nearly all" if root is None else f"{1e2 * root.damping_ratio:.2g} %"


def _at_bit(found: ReportValues) -> list[str]:
    """Say at which speed the bit is quiet, and which gains help."""
    design = found.design
    assert design is not None
    assert found.gains is not None
    rate = found.language.text("axial_rate", found.point.penetration_rate)
    told = []
    if found.free.stable:
        told.append(f"Drill as planned: at {place_text(found)} small vibration dies away.")
    for remedy in found.gains.remedies:
        point = remedy.result.rig_point
        if remedy.kind == "speed" and remedy.result.structure is None and point is not None:
            speed = found.language.text("angular_rate", point.rotary_speed)
            told.append(f"Drill above {speed} at the same {rate}: there small vibration dies away.")
    for change in found.gains.quieter:
        if change.kind == "speed":
            speed = found.language.text("angular_rate", change.value * found.point.rotary_speed)
            told.append(
                f"At {speed} and the same {rate} the bit keeps turning, after a small "
                "disturbance and after kicks by half the speed."
            )
    if found.recommended:
        rows = gain_settings(design, found.language)
        settings = ", ".join(f"{name.partition(',')[0]} {value}" for name, value in rows)
        told.append(f"Or control the torque at the bit, {settings}: {_good(design)}.")
    else:
        told.append("No control is offered: " + _why_not(found, design) + ".")
    return told


def _good(design: Design) -> str:
    return design.reason.rstrip(".")


def _why_not(found: ReportValues, design: Design) -> str:
    if design.recommended is True:
        return "on the string itself the bit did worse with it"
    return design.reason.rstrip(".")


def gain_settings(design: Design, language: Language) -> Rows:
    """Return the gains of torque feedback at the bit, in the words of a drive."""
    structure, case = design.structure, design.case
    assert structure is not None
    assert case.plant is not None
    assert case.rig is not None
    factors, names = gain_units(structure, case.plant, case.rig)
    rows: Rows = []
    for when, matrix in (("", design.K1), (", measured one blade passage ago", design.K2)):
        if not matrix.any():
            continue
        for i, row in enumerate(matrix * factors):
            for output, value, unit in zip(structure.outputs, row, names[i], strict=True):
                if structure.inputs[i] == "torque" and output in _TERMS:
                    # u adds to what turns the bit on: behind is negative.
                    words, quantity = _TERMS[output]
                    rows.append((f"{words}{when}", language.text(quantity, -float(value), 3)))
                else:
                    rows.append(
                        (f"{structure.inputs[i]} per {output}{when}", f"{value:.3g} {unit}")
                    )
    return rows


def point_rows(found: ReportValues) -> Rows:
    """Return what is set and what follows from it without vibration."""
    steady, point = found.steady, found.point
    return [
        ("Rotary speed", found.language.text("angular_rate", point.rotary_speed)),
        ("Rate of penetration", found.language.text("axial_rate", point.penetration_rate)),
        ("Weight on bit", found.language.text("force", steady.weight_on_bit, 3)),
        ("Torque on bit", found.language.text("torque", steady.torque_on_bit, 3)),
        ("Depth of cut", f"{found.language.text('length', steady.depth_of_cut, 3)} per turn"),
        ("Rock strength", found.language.text("stress", point.rig.rock_strength)),
    ]


def rig_rows(found: ReportValues) -> Rows:
    """Return what the rig is."""
    rig, language = found.point.rig, found.language
    rows: Rows = []
    if isinstance(rig, StringRig):
        assert found.check.length is not None
        assert found.check.buoyed_weight is not None
        rows.append(("String", language.text("depth", found.check.length)))
        rows.append(("Weight in mud", language.text("force", found.check.buoyed_weight)))
        rows += [
            (
                section.name[:1].upper() + section.name[1:],
                f"{language.text('depth', section.length)}, "
                f"{language.text('length', section.outer_diameter)} outside",
            )
            for section in rig.string.sections
        ]
        drive = rig.drive
        top = "speed imposed" if drive is None else language.text("inertia", drive.inertia)
        rows.append(("Top drive", top))
        if drive is not None and drive.torque_limit is not None:
            rows.append(("Torque limit", language.text("torque", drive.torque_limit)))
    else:
        stiffness = language.text("torsional_stiffness", rig.torsional_stiffness)
        rows.append(("String", "one mass each way"))
        rows.append(("Mass", language.text("mass", rig.mass)))
        rows.append(("Rotary inertia", language.text("inertia", rig.inertia)))
        rows.append(("Torsional stiffness", stiffness))
        rows.append(("Axial stiffness", language.text("axial_stiffness", rig.axial_stiffness)))
    rows.append(("Bit", f"{language.text('length', 2.0 * rig.bit_radius)}, {rig.blades} blades"))
    rows.append(("Wear flat", language.text("length", rig.wearflat_length, 3)))
    return rows


def mode_rows(found: ReportValues) -> list[tuple[str, ...]]:
    """Return the first modes: name, frequency, speed in step with the blades, damping."""
    modes: Sequence[Mode] = (*found.check.torsional[:_MODES], *found.check.axial[:_MODES])
    blades = found.point.rig.blades
    return [
        (
            mode.name,
            found.language.text("frequency", mode.frequency, 3),
            f"{1e2 * mode.damping_ratio:.2g} %",
            found.language.text("angular_rate", 2.0 * math.pi * mode.frequency / blades, 3),
        )
        for mode in modes
    ]


def checked(found: ReportValues) -> list[str]:
    """Say what was checked, a sentence each."""
    loop = found.free.loop
    agrees = "agrees" if loop.certificate.agrees else "DOES NOT agree: do not trust this page"
    told = [f"All growing vibrations were counted a second time by another method, which {agrees}."]
    design = found.design
    if design is not None and design.trials:
        told.append(
            f"The settings were tried in {len(design.trials)} simulated runs with stick, bounce and"
            " loss of contact, beside the same runs without control."
        )
    if found.map is not None:
        points = len(found.map.nodes)
        told.append(
            f"The map is of simulated runs at {points} points, without control and with it."
            if found.drives is None
            else f"The map is of simulated runs at {points} points, under each law."
        )
    if found.is_lumped:
        told.append(
            "Settings and map are of the string taken as one mass each way; the runs over time are"
            " of the string itself, with all its modes."
        )
    if found.drives is not None:
        told.append(
            "The drive was looked at with a free bit at all frequencies to 30 Hz, and in the runs"
            " over time with the bit in the rock."
        )
    return told


def unknown(found: ReportValues) -> list[str]:
    """Say what is not known, a sentence each."""
    told = [
        "Rock, wear flat and damping are as the rig file has them; where they are guesses, so is"
        " this page.",
        "Whirl, friction along the wall, bends of the hole and reamers are not in the model.",
    ]
    rig = found.point.rig
    drive = rig.drive if isinstance(rig, StringRig) else None
    if drive is None:
        told.append(
            "A top drive cannot put torque on the bit at once: the settings are for a motor above"
            " the bit."
        )
    else:
        if drive.torque_limit is None:
            told.append("The torque limit of the drive is not given: none was assumed.")
        if not drive.lateness:
            told.append("Delay and lag of the drive are not given: none were assumed.")
        told.append("By how much the bit's torque falls as it turns faster is a guess.")
    if found.map is None and drive is None:
        told.append("What happens away from this point was not looked at.")
    return told
