"""What is understood of a rig, in words."""

from __future__ import annotations

from drillctrl.base.language import FIELD, SI, Language
from drillctrl.base.text import set_out
from drillctrl.drilling.rig import STANDARD_GRAVITY, Rig
from drillctrl.strings.check import Mode, RigCheck
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.rig import StringRig, lump
from drillctrl.strings.section import Section

# Modes of a kind that are told in words.
_TOLD = 6


def rig_summary(found: RigCheck, language: Language = SI) -> str:
    """Return what is understood of a rig, for people, in 80 columns."""
    rig, say = found.rig, language.text
    lumped = lump(rig)
    slowest = found.torsional[0].frequency
    told = f"with its top end held the bit swings at {slowest:.3g} Hz, once in {1 / slowest:.3g} s"
    lines: list[tuple[str, str]] = [("Rig", told)]
    if isinstance(rig, StringRig):
        string, damping = rig.string, rig.string.damping
        assert found.weight_in_air is not None
        assert found.buoyed_weight is not None
        lines += [
            ("String", f"{say('depth', string.length, 6)}, {say('force', found.weight_in_air, 5)}"
             f" in air{_mass(found.weight_in_air / STANDARD_GRAVITY, language)}"),
            ("", f"{say('force', found.buoyed_weight, 5)} in mud of"
             f" {say('density', string.mud_density, 5)}" if string.mud_density else "no mud"),
            ("Top end", _top_end(rig, language)),
            ("Impedance", f"{_impedance(found, language)} of the uppermost pipe in torsion"),
            ("Damping", f"torsional {damping.torsional:g} 1/s, axial {damping.axial:g} 1/s,"
             f" Kelvin-Voigt {1e3 * damping.retardation:g} ms"),
        ]  # fmt: skip
        if string.wall_torque:
            told = f"{say('torque', string.wall_torque)} on the wall while all of it slides"
            lines.append(("Friction", told))
        for i, section in enumerate(string.sections):
            lines.append(("Sections" if not i else "", _section_text(section, language)))
    lines += [
        ("Bit", f"{_bit_size(rig, language)}, {rig.blades} blades, wear flat"
         f" {say('length', rig.wearflat_length)}"),
        ("Rock", f"strength {say('stress', rig.rock_strength, 5)}, contact"
         f" {say('stress', rig.contact_strength, 5)}"),
        ("Lumped", f"axial {say('mass', lumped.mass, 5)} on"
         f" {say('axial_stiffness', lumped.axial_stiffness, 5)},"
         f" {say('axial_damping', lumped.axial_damping)}"),
        ("", f"torsional {say('inertia', lumped.inertia, 5)} on"
         f" {say('torsional_stiffness', lumped.torsional_stiffness, 5)},"
         f" {say('impedance', lumped.torsional_damping)}"),
        ("Modes", "top end held, bit free; damping in % of critical"),
    ]  # fmt: skip
    for kind, modes in (("torsional", found.torsional), ("axial", found.axial)):
        lines += _mode_lines(kind, modes)
    return set_out(lines)


def wall_note(rig: Rig) -> str | None:
    """Return what has to be said of friction on the wall; None where there is none."""
    torque = rig.string.wall_torque if isinstance(rig, StringRig) else 0.0
    if torque == 0.0:
        return None
    return (
        f"friction on the wall, {1e-3 * torque:.3g} kN*m, acts in nonlinear runs alone;"
        " in small motion the whole string slides, and it is constant"
    )


def _mass(value: float, language: Language) -> str:
    """Return a mass beside a weight; in pounds they are one number."""
    return "" if language is FIELD else f" = {language.text('mass', value)}"


def _impedance(found: RigCheck, language: Language) -> str:
    assert found.impedance is not None
    return language.text("impedance", found.impedance, 5).removesuffix("/rad")


def _bit_size(rig: Rig, language: Language) -> str:
    told = language.text("length", 2.0 * rig.bit_radius, 5)
    # Bits are sold by the inch.
    return told if language is FIELD else f"{told} = {FIELD.text('length', 2.0 * rig.bit_radius)}"


def _top_end(rig: StringRig, language: Language) -> str:
    turned = "speed imposed" if rig.drive is None else drive_text(rig.drive, language)
    ropes = rig.string.hoisting_stiffness
    fed = "feed imposed"
    if ropes is not None:
        fed = f"ropes of {language.text('axial_stiffness', ropes, 5)}"
    if rig.weight_control is not None:
        gain = rig.weight_control.feed_gain * 3.6e6
        fed = f"fed by weight, {gain:.3g} m/h per kN"
        if language is FIELD:
            ratio = language.number("axial_rate", 1.0) / language.number("force", 1.0)
            fed = f"fed by weight, {rig.weight_control.feed_gain * ratio:.3g} ft/h per klbf"
    return f"{turned}, {fed}"


def drive_text(drive: DriveMachine, language: Language = SI) -> str:
    """Return what a drive is."""
    told = f"top drive of {language.text('inertia', drive.inertia, 6)} at the string"
    if drive.torque_limit is not None:
        told += f", at most {language.text('torque', drive.torque_limit)}"
    times = (("delay", drive.delay), ("lag", drive.lag), ("encoder", drive.encoder))
    return told + "".join(f", {name} {1e3 * time:.3g} ms" for name, time in times if time)


def _section_text(section: Section, language: Language) -> str:
    say = language.text
    outer = f"{language.number('length', section.outer_diameter):.4g}"
    told = f"{section.name}: {say('depth', section.length, 6)},"
    told += f" {outer} × {say('length', section.inner_diameter)},"
    told += f" {say('linear_density', section.mass_per_metre)}"
    return told if section.tool_joint is None else f"{told}, {section.joints} joints"


def _mode_lines(kind: str, modes: tuple[Mode, ...]) -> list[tuple[str, str]]:
    told = [f"{m.frequency:.4g} Hz ({1e2 * m.damping_ratio:.2g} %)" for m in modes[:_TOLD]]
    rows = [", ".join(told[i : i + 3]) for i in range(0, len(told), 3)]
    if len(modes) > _TOLD:
        rows.append(f"… {len(modes)} in all, up to {modes[-1].frequency:.3g} Hz")
    indent = " " * (len(kind) + 1)
    return [("", f"{kind if not i else indent[:-1]} {row}") for i, row in enumerate(rows)]
