"""Drives side by side, in words."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from drillctrl.base.language import SI, Language
from drillctrl.base.text import WIDTH, wrapped
from drillctrl.strings.drive_control import DriveControl, Transfer
from drillctrl.strings.drive_law import without_integral
from drillctrl.strings.drive_measures import DriveMeasures
from drillctrl.strings.drive_verdict import UNTRIED
from drillctrl.strings.falling import FallingTorque
from drillctrl.strings.rig import StringRig
from drillctrl.strings.slopes import HIGHEST
from drillctrl.strings.words import drive_text

_COLUMN = 11


def comparison_summary(
    rig: StringRig,
    falling: FallingTorque,
    drives: Sequence[DriveMeasures],
    language: Language = SI,
) -> str:
    """Return a table, a column for each drive."""
    line, machine = rig.string.torsion, rig.drive
    assert machine is not None
    drop, decay = language.text("torque", falling.drop, 3), _rpm(falling.decay)
    per, slope = language.number("impedance", 1.0), language.unit("impedance").removesuffix("/rad")
    first = drives[0].modes
    rows: list[tuple[str, list[str]]] = [("", [drive.control.name for drive in drives])]

    def by_mode(title: str, value: Callable[[DriveMeasures, int], str]) -> None:
        rows.append((title, []))
        for i, mode in enumerate(first):
            name = f"  {_ordinal(i + 1)} torsional, {mode.slope.mode_frequency:.3f} Hz"
            rows.append((name, [value(drive, i) for drive in drives]))

    by_mode(f"Critical slope, {slope}", lambda drive, i: f"{per * drive.modes[i].slope.slope:.4g}")
    rows.append(("  smallest", [f"{per * drive.smallest_slope:.4g}" for drive in drives]))
    rows.append((f"  weakest of all to {HIGHEST:g} Hz", [_weakest(drive, per) for drive in drives]))
    rows.append(("    at, Hz", [_where(drive) for drive in drives]))
    by_mode("|r| of the drive", lambda drive, i: f"{drive.modes[i].reflection:.3f}")
    by_mode("Damping, % of critical", _damping)
    by_mode("Threshold speed, rpm", lambda drive, i: _speed(drive.modes[i].threshold_speed))
    rows.append(("Delay margin, ms", [_margin(drive.delay_margin) for drive in drives]))
    if machine.torque_limit is not None:
        swings = [f"{_rpm(drive.swing[0]):.3g}" if drive.swing else "" for drive in drives]
        rows.append(("Top swing at the limit, rpm", swings))
    alone = ["yes" if drive.stable else "NO" for drive in drives]
    rows.append(("Stable with a free bit", alone))
    good = ["yes" if drive.verdict.recommended else "NO" for drive in drives]
    rows.append(("As good as a stiff drive", good))
    width = max(len(label) for label, _ in rows) + 1
    columns = max(_COLUMN, *(len(name) + 2 for name in rows[0][1]))
    head = [
        wrapped(_advice(drives, falling, language)),
        "",
        f"{language.text('depth', rig.string.length, 6)} of string, "
        f"{per * line.wave_impedance:.4g} {slope} of the uppermost pipe,",
        wrapped(drive_text(machine, language)),
        "Critical slope: by which the bit's torque may fall per unit of its speed.",
        f"Threshold: for a torque that falls by {drop} over {decay:.3g} rpm.",
        "",
    ]
    abreast = max(1, (WIDTH - width) // columns)
    table: list[str] = []
    for begin in range(0, len(drives), abreast):
        table += [""] * bool(begin)
        for label, cells in rows:
            beside = "".join(f"{cell:>{columns}}" for cell in cells[begin : begin + abreast])
            table.append(f"{label:<{width}}{beside}".rstrip())
    laws = [
        wrapped(f"{drive.control.name}: {settings_text(drive.control, language)}", 2)
        for drive in drives
    ]
    refused = [drive for drive in drives if not drive.verdict.recommended]
    tail = [wrapped(refusal(drive, language)) for drive in refused]
    return "\n".join([*head, *table, "", *laws, *tail])


def refusal(drive: DriveMeasures, language: Language = SI) -> str:
    """Say that a law does harm, and why."""
    return f"Refused: {drive.control.name}, {drive.verdict.reason(language)}."


def _advice(drives: Sequence[DriveMeasures], falling: FallingTorque, language: Language) -> str:
    """Say what to set of the drive that stands most, and above which speed to stay with it."""
    good = [drive for drive in drives if drive.verdict.recommended]
    if not good:
        return "None of these: under each the string swings by itself or stands too little."
    best = max(good, key=lambda drive: drive.smallest_slope)
    told = f"{setting_sentence(best.control, language)} It was {UNTRIED}."
    speed = threshold_speed(best)
    if not math.isfinite(speed):
        return told
    others = [drive for drive in drives if drive is not best]
    beside = ", ".join(
        f"{drive.control.name}: {_rpm(threshold_speed(drive)):.3g}"
        for drive in others
        if drive.stable and math.isfinite(threshold_speed(drive))
    )
    fall = language.text("torque", falling.drop, 3)
    stay = (
        f"Against stick-slip stay above {_rpm(speed):.3g} rpm with it"
        if _rpm(speed) >= 1.0
        else "By this measure no speed is too low for it"
    )
    told += f" {stay}{f' ({beside})' if beside else ''}, if the bit's torque falls by {fall}"
    told += " as it turns faster (a guess: measure it)."
    return f"{told} What grows along the string no drive reaches: analyze says whether any does."


def threshold_speed(drive: DriveMeasures) -> float:
    """Return the speed above which all modes looked at stand the falling torque, rad/s."""
    return max(mode.threshold_speed for mode in drive.modes)


def _weakest(drive: DriveMeasures, per: float) -> str:
    if not drive.stable:
        return "0"
    return "any" if drive.weakest is None else f"{per * drive.weakest.slope:.4g}"


def _where(drive: DriveMeasures) -> str:
    return "" if drive.weakest is None else f"{drive.weakest.frequency:.3g}"


def _damping(drive: DriveMeasures, i: int) -> str:
    root = drive.modes[i].root
    return "damped out" if root is None else f"{1e2 * root.damping_ratio:.3g}"


def _margin(seconds: float) -> str:
    if math.isnan(seconds):
        return "unstable"
    return "any" if math.isinf(seconds) else f"{1e3 * seconds:.3g}"


def _speed(speed: float) -> str:
    return "none" if math.isinf(speed) else f"{_rpm(speed):.1f}"


def _rpm(speed: float) -> float:
    return speed * 30.0 / math.pi


def _ordinal(number: int) -> str:
    endings = {1: "st", 2: "nd", 3: "rd"}
    teen = number % 100 in (11, 12, 13)
    return f"{number}{'th' if teen else endings.get(number % 10, 'th')}"


def drive_settings(control: DriveControl, language: Language) -> list[tuple[str, str]]:
    """Return the parameters of a law in the words of a drive: P and I, else the law in SI."""
    integral, rest = without_integral(control.speed)
    if control.torque or len(rest.denominator) > 1 or len(rest.numerator) > 2:
        return [("law, SI units", law_text(control))]
    gains = [part / rest.denominator[0] for part in rest.numerator]
    rows = [
        ("P", language.text("drive_impedance", gains[-1], 3)),
        ("I", language.text("drive_stiffness", integral, 3)),
    ]
    if len(gains) == 2 and gains[0]:
        rows.append(("compensated inertia", language.text("inertia", -gains[0], 3)))
    return rows


def settings_text(control: DriveControl, language: Language = SI) -> str:
    """Return a law in one line: in the words of a drive, else its transfer functions in SI."""
    rows = drive_settings(control, language)
    if language is SI or rows[0][0] != "P":
        return law_text(control, language)
    return ", ".join(f"{name} {value}" for name, value in rows)


def setting_sentence(control: DriveControl, language: Language) -> str:
    """Say what to set of a drive."""
    rows = drive_settings(control, language)
    if rows[0][0] != "P":
        return f"Run the drive under {control.name}, whose law is written out below."
    settings = ", ".join(f"{name} to {value}" for name, value in rows)
    return f"Set {settings} of the drive ({control.name})."


def law_text(control: DriveControl, language: Language = SI) -> str:
    """Return a law in words: gains of PI control, else its transfer functions of s in 1/s."""
    integral, rest = without_integral(control.speed)
    told = []
    if len(rest.denominator) == 1 and len(rest.numerator) <= 2:
        gains = [part / rest.denominator[0] for part in rest.numerator]
        told.append(f"Kp {language.text('drive_impedance', gains[-1])}")
        told.append(f"Ki {language.text('drive_stiffness', integral)}")
        if len(gains) == 2 and gains[0]:
            told.append(f"inertia compensated {language.text('inertia', -gains[0])}")
    else:
        told.append(f"on speed {_transfer_text(control.speed)} N·m·s/rad")
    if control.torque:
        told.append(f"on the pipe's torque {_transfer_text(control.torque)}")
    return ", ".join(told)


def _transfer_text(law: Transfer) -> str:
    def polynomial(coefficients: Sequence[float]) -> str:
        powers = range(len(coefficients) - 1, -1, -1)
        terms = [
            f"{value:.5g}" + {0: "", 1: " s"}.get(power, f" s^{power}")
            for value, power in zip(coefficients, powers, strict=True)
            if value
        ]
        return " + ".join(terms).replace("+ -", "− ")

    below = polynomial(law.denominator)
    above = polynomial(law.numerator)
    return above if below == "1" else f"({above}) / ({below})"
