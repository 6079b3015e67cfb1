"""A comparison as text: the table, and what better costs."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

from drillctrl.drilling.point import RigPoint
from drillctrl.spectrum.characteristic import FloatArray

if TYPE_CHECKING:
    from drillctrl.studies.compare import Comparison

# Heading, field, format.
COLUMNS = (
    ("α", "spectral_abscissa", "{:.4f}"),
    ("radius", "stability_radius", "{:.1e}"),
    ("delay ×", "delay_margin", "{}"),
    ("phase", "phase_margin", "{:.1f}°"),
    ("peak S", "peak_sensitivity", "{:.2f}"),
    ("max|u|", "max_abs_u", "{:.3g}"),
    ("max|x|", "max_abs_x", "{:.3g}"),
    ("settles", "settling_time", "{:.3g}"),
    ("nonlinear", "nonlinear_settling_time", "{:.3g}"),
    ("stick", "stick_fraction", "{:.1%}"),
    ("basin", "basin", "{:.3g}"),
    ("Δψ", "formation_change", "{:.0%}"),
    ("area", "stable_area", "{:.4g}"),
    ("ratio", "area_ratio", "{:.3g}"),
)
LEGEND = (
    "α: spectral abscissa; radius: relative error of the plant's matrices that destabilises; "
    "delay ×: factors of the delay between which the loop is stable; peak S: peak sensitivity; "
    "max|u|, max|x|, settles: linear motion after the disturbance, to 2 %; nonlinear: the same "
    "of the nonlinear motion, or the period T of the orbit that it ends in; stick: its share of "
    "torsional stick at the end; basin: multiple of the disturbance that still settles (up to "
    "16); Δψ: relative change of the rock's strength that destabilises; area, ratio: where these "
    "gains are stable, and against no control. "
    "–: does not exist or does not settle."
)


def cells(fields: dict[str, Any]) -> list[str]:
    """Return the entries of a row as text."""
    found = []
    for _, name, form in COLUMNS:
        value = fields[name]
        if name == "nonlinear_settling_time" and value is None and fields["period"] is not None:
            found.append(f"T {fields['period']:.4g}")
        elif value is None:
            found.append("–")
        elif name == "delay_margin":
            longer = "any" if value["longer"] is None else f"{value['longer']:.3g}"
            found.append(f"{value['shorter']:.3g}-{longer}")
        else:
            found.append(form.format(value))
    return found


def point_text(comparison: Comparison) -> str:
    """Say where the candidates were compared."""
    given = comparison.point
    point = given.operating_point() if isinstance(given, RigPoint) else given
    return f"ω0 = {point.omega0:.6g}, δ0 = {point.delta0:.6g}, ψ = {point.psi:.6g}"


def gains_text(gains: FloatArray) -> str:
    """Return gains, row by row, to the digits that a person reads."""
    return ", ".join(f"{value:.6g}" for value in gains.ravel())


def comparison_text(comparison: Comparison) -> str:
    """Return an aligned table, gains, a legend and what better costs."""
    rows = [["", *(heading for heading, _, _ in COLUMNS)]]
    rows += [[row.label, *cells(row.to_dict())] for row in comparison.rows]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    pushed = ", ".join(f"{k} = {v:g}" for k, v in comparison.disturbance.items())
    lines = [f"At {point_text(comparison)}; disturbance {pushed}; by {comparison.sort}", ""]
    for row in rows:
        first, *others = (
            text.ljust(width) if i == 0 else text.rjust(width)
            for i, (text, width) in enumerate(zip(row, widths, strict=True))
        )
        lines.append("  ".join([first, *others]).rstrip())
    lines.append("")
    for one in comparison.rows:
        if one.design.structure is not None:
            now, past = (gains_text(K) for K in (one.design.K1, one.design.K2))
            word = "designed" if one.designed else "given"
            lines.append(f"{one.label} ({word}): K1 = ({now}), K2 = ({past})")
    lines.append("")
    for text in sentences(comparison):
        lines += textwrap.wrap(text, 100)
    lines.append("")
    lines += textwrap.wrap(LEGEND, 100)
    return "\n".join(lines)


def sentences(comparison: Comparison) -> list[str]:
    """Say what the first row is better at than the others, and what that costs."""
    rows = [row for row in comparison.rows if row.design.structure is not None]
    if not rows:
        return []
    best, *others = rows
    if not best.design.stable:
        text = "None of these gains stabilises this point"
        return [f"{text}; the summary of a design says what would."]
    mine = best.to_dict()
    found = []
    for other in others:
        fields = other.to_dict()
        if not other.design.stable:
            found.append(f"{best.label} stabilises the point, {other.label} does not.")
            continue
        ratio = mine["spectral_abscissa"] / fields["spectral_abscissa"]
        parts = [f"decays {ratio:.3g} times as fast as {other.label}"]
        for name, words in (
            ("max_abs_u", "the torque"),
            ("max_abs_x", "the axial amplitude"),
            ("stability_radius", "the stability radius"),
            ("stable_area", "the stable area"),
        ):
            if mine[name] and fields[name]:
                parts.append(f"{mine[name] / fields[name]:.3g} times {words}")
        if mine["delay_margin"] and fields["delay_margin"]:
            nearest = [delay_room(f["delay_margin"]) for f in (mine, fields)]
            parts.append(f"{nearest[0] / nearest[1]:.3g} times the delay margin")
        found.append(f"{best.label} {parts[0]}, with {', '.join(parts[1:])}.")
    return found


def delay_room(margin: dict[str, float | None]) -> float:
    """Return the smallest relative change of the delay that destabilises."""
    shorter, longer = margin["shorter"], margin["longer"]
    assert shorter is not None
    return min(1.0 - shorter, float("inf") if longer is None else longer - 1.0)
