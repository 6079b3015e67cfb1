"""What is understood of a rig, in words."""

from __future__ import annotations

from drillctrl.drilling.rig import STANDARD_GRAVITY
from drillctrl.strings.check import Mode, RigCheck
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.rig import StringRig, lump
from drillctrl.strings.section import Section

# Modes of a kind that are told in words.
_TOLD = 6


def rig_summary(found: RigCheck) -> str:
    """Return what is understood of a rig, for people, in 80 columns."""
    rig = found.rig
    lumped = lump(rig)
    lines: list[tuple[str, str]] = []
    if isinstance(rig, StringRig):
        string, damping = rig.string, rig.string.damping
        assert found.weight_in_air is not None
        assert found.buoyed_weight is not None
        lines += [
            ("String", f"{string.length:.6g} m, {found.weight_in_air / 1e3:.5g} kN in air"
             f" = {found.weight_in_air / STANDARD_GRAVITY / 1e3:.4g} t"),
            ("", f"{found.buoyed_weight / 1e3:.5g} kN in mud of {string.mud_density:.5g} kg/m³"
             if string.mud_density else "no mud"),
            ("Top end", _top_end(rig)),
            ("Impedance", f"{found.impedance:.5g} N·m·s of the uppermost pipe in torsion"),
            ("Damping", f"torsional {damping.torsional:g} 1/s, axial {damping.axial:g} 1/s,"
             f" Kelvin-Voigt {1e3 * damping.retardation:g} ms"),
        ]  # fmt: skip
        for i, section in enumerate(string.sections):
            lines.append(("Sections" if not i else "", _section_text(section)))
    mm = 1e3 * rig.bit_radius
    lines += [
        ("Bit", f"{2 * mm:.5g} mm = {2 * mm / 25.4:.4g} in, {rig.blades} blades, wear flat"
         f" {1e3 * rig.wearflat_length:.4g} mm"),
        ("Rock", f"strength {rig.rock_strength / 1e6:.5g} MPa, contact"
         f" {rig.contact_strength / 1e6:.5g} MPa"),
        ("Lumped", f"axial {lumped.mass / 1e3:.5g} t on {lumped.axial_stiffness / 1e3:.5g} kN/m,"
         f" {lumped.axial_damping / 1e3:.4g} kN·s/m"),
        ("", f"torsional {lumped.inertia:.5g} kg·m² on {lumped.torsional_stiffness:.5g} N·m/rad,"
         f" {lumped.torsional_damping:.4g} N·m·s/rad"),
        ("Modes", "top end held, bit free; damping in % of critical"),
    ]  # fmt: skip
    for kind, modes in (("torsional", found.torsional), ("axial", found.axial)):
        lines += _mode_lines(kind, modes)
    width = max(len(label) for label, _ in lines) + 2
    return "\n".join(f"{label:<{width}}{text}".rstrip() for label, text in lines)


def _top_end(rig: StringRig) -> str:
    turned = "speed imposed" if rig.drive is None else drive_text(rig.drive)
    ropes = rig.string.hoisting_stiffness
    fed = "feed imposed" if ropes is None else f"ropes of {ropes / 1e3:.5g} kN/m"
    if rig.weight_control is not None:
        gain = rig.weight_control.feed_gain * 3.6e6
        fed = f"fed by weight, {gain:.3g} m/h per kN"
    return f"{turned}, {fed}"


def drive_text(drive: DriveMachine) -> str:
    """Return what a drive is."""
    told = f"top drive of {drive.inertia:g} kg·m² at the string"
    if drive.torque_limit is not None:
        told += f", at most {drive.torque_limit / 1e3:.4g} kN·m"
    times = (("delay", drive.delay), ("lag", drive.lag), ("encoder", drive.encoder))
    return told + "".join(f", {name} {1e3 * time:.3g} ms" for name, time in times if time)


def _section_text(section: Section) -> str:
    size = f"{1e3 * section.outer_diameter:.4g} × {1e3 * section.inner_diameter:.4g} mm"
    told = f"{section.name}: {section.length:.6g} m, {size}, {section.mass_per_metre:.4g} kg/m"
    return told if section.tool_joint is None else f"{told}, {section.joints} joints"


def _mode_lines(kind: str, modes: tuple[Mode, ...]) -> list[tuple[str, str]]:
    told = [f"{m.frequency:.4g} Hz ({1e2 * m.damping_ratio:.2g} %)" for m in modes[:_TOLD]]
    rows = [", ".join(told[i : i + 3]) for i in range(0, len(told), 3)]
    if len(modes) > _TOLD:
        rows.append(f"… {len(modes)} in all, up to {modes[-1].frequency:.3g} Hz")
    indent = " " * (len(kind) + 1)
    return [("", f"{kind if not i else indent[:-1]} {row}") for i, row in enumerate(rows)]
