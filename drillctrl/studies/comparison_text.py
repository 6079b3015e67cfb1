"""A comparison in words: the table, and what better costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from drillctrl.base.text import WIDTH, wrapped
from drillctrl.drilling.case import Case
from drillctrl.drilling.quantities import root_scales, told_scale

# Of a row; see `Row.to_dict`.
Fields = dict[str, Any]
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
    ("swing", "largest_swing", "{:.3g}"),
    ("torsion", "torsional_growth", "{:.3g}"),
    ("trials", "recommended", "{}"),
)
# Headings where a rig was given.
_OF_RIG = {"α": "growth", "Δψ": "Δrock"}
# What columns with a unit measure; of a rig they are told in its units.
_QUANTITIES = {
    "max_abs_u": "torque",
    "max_abs_x": "length",
    "settling_time": "time",
    "nonlinear_settling_time": "time",
}
LEGEND = (
    "α: spectral abscissa; radius: relative error of the plant's matrices that destabilises; "
    "delay ×: factors of the delay between which the loop is stable; peak S: peak sensitivity; "
    "max|u|, max|x|, settles: linear motion after the disturbance, to 2 %; nonlinear: the same "
    "of the nonlinear motion, or the period T of the orbit that it ends in; stick: its share of "
    "torsional stick at the end; basin: multiple of the disturbance that still settles (up to "
    "16); Δψ: relative change of the rock's strength that destabilises; area, ratio: where these "
    "gains are stable, and against no control; trials: what runs from three starts beside no "
    "control say of the gains; swing: the largest of the bit's speed that they end in; torsion: "
    "growth rate of torsional swings on the motion that is drilled with, of gains for that motion. "
    "–: does not exist or does not settle."
)


def _scale(name: str, case: Case) -> tuple[float, str]:
    """Return factor and unit of a column."""
    if name == "spectral_abscissa":
        factor, _, unit = root_scales(case.told_rig)[0]
        return factor, unit
    return (
        told_scale(_QUANTITIES[name], case.told_rig, case.language)
        if name in _QUANTITIES
        else (1.0, "")
    )


def headings(case: Case) -> list[str]:
    """Return the heads of the columns, with units where there is a rig."""
    units = [_scale(name, case)[1] for _, name, _ in COLUMNS]
    words = {} if case.told_rig is None else _OF_RIG
    return [
        f"{words.get(heading, heading)}, {unit}" if unit else words.get(heading, heading)
        for (heading, _, _), unit in zip(COLUMNS, units, strict=True)
    ]


def legend(case: Case) -> str:
    """Return what the columns are."""
    if case.told_rig is None:
        return LEGEND
    growth = "growth: of the slowest vibration, which dies away below 0"
    return LEGEND.replace("α: spectral abscissa", growth).replace("Δψ", _OF_RIG["Δψ"])


def cells(fields: Fields, case: Case) -> list[str]:
    """Return the entries of a row as text, those with a unit in the rig's."""
    found = []
    for _, name, form in COLUMNS:
        value = fields[name]
        factor = _scale(name, case)[0]
        if name == "nonlinear_settling_time" and value is None and fields["period"] is not None:
            found.append(f"T {factor * fields['period']:.4g}")
        elif value is None:
            found.append("–")
        elif name == "recommended":
            found.append("good" if value else "REFUSED")
        elif name == "delay_margin":
            longer = "any" if value["longer"] is None else f"{value['longer']:.3g}"
            found.append(f"{value['shorter']:.3g}-{longer}")
        else:
            found.append(form.format(value if factor == 1.0 else factor * value))
    return found


def comparison_text(
    head: str,
    rows: Sequence[Fields],
    gains: Mapping[str, Mapping[str, str]],
    case: Case,
) -> str:
    """Return an aligned table, gains, a legend and what better costs.

    Parameters
    ----------
    head : str
        Where the candidates were compared, and how.
    rows : sequence of dict
        Of `Row.to_dict`, best first.
    gains : mapping
        Texts of K1 and K2 by label.
    case : Case
        In whose units.
    """
    table = [["", *headings(case)]]
    table += [[row["label"], *cells(row, case)] for row in rows]
    lines = [wrapped(_answer(rows)), wrapped(head), "", *_blocks(table)]
    for one in rows:
        if one["structure"] is not None:
            word = "designed" if one["designed"] else "given"
            told = ", ".join(f"{name} = ({text})" for name, text in gains[one["label"]].items())
            lines.append(wrapped(f"{one['label']} ({word}): {told}", 2))
    lines.append("")
    for text in sentences(rows):
        lines.append(wrapped(text))
    lines.append("")
    lines.append(wrapped(legend(case)))
    return "\n".join(lines)


def _answer(rows: Sequence[Fields]) -> str:
    """Say first which of them to take."""
    offered = [r for r in rows if r["structure"] is not None and r["recommended"] is not False]
    if not offered:
        return "None of these is offered: no control does as well here."
    best = offered[0]
    if any(row["structure"] is None for row in rows[: rows.index(best)]):
        return "No control does better here than any of these that is offered."
    if best["recommended"] is None:
        kept = "dies away" if best["stable"] else "GROWS"
        told = f"{best['label']} does best: with it small vibration {kept}"
        return f"{told}; it was not tried from several starts."
    if best["stable"]:
        return f"{best['label']} does best: with it small vibration dies away."
    told = f"{best['label']} does best: small vibration grows, and in trials the bit swings on"
    swing = best["largest_swing"]
    return f"{told}, at most by {100.0 * swing:.2g} %." if swing else f"{told}."


def _blocks(table: list[list[str]]) -> list[str]:
    """Return a table in blocks of columns that fit a terminal, each with the first column."""
    widths = [max(len(row[i]) for row in table) for i in range(len(table[0]))]
    lines: list[str] = []
    start = 1
    while start < len(widths):
        stop, used = start, widths[0]
        while stop < len(widths) and (stop == start or used + 2 + widths[stop] <= WIDTH):
            used += 2 + widths[stop]
            stop += 1
        for row in table:
            others = [row[i].rjust(widths[i]) for i in range(start, stop)]
            lines.append("  ".join([row[0].ljust(widths[0]), *others]).rstrip())
        lines.append("")
        start = stop
    return lines


def sentences(rows: Sequence[Fields]) -> list[str]:
    """Say what the first row is better at than the others, and what that costs."""
    fed = [row for row in rows if row["structure"] is not None]
    if not fed:
        return []
    told = [
        f"{row['label']} is REFUSED: {row['reason']}." for row in fed if row["recommended"] is False
    ]
    offered = [row for row in fed if row["recommended"] is not False]
    if not offered:
        return [*told, "None of these gains is offered."]
    best, *others = offered
    if not best["stable"]:
        text = "None of these gains makes smooth drilling stable"
        return [*told, f"{text}; the summary of a design says what would."]
    found = told
    for other in others:
        if not other["stable"]:
            found.append(f"{best['label']} stabilises the point, {other['label']} does not.")
            continue
        ratio = best["spectral_abscissa"] / other["spectral_abscissa"]
        parts = [f"decays {ratio:.3g} times as fast as {other['label']}"]
        for name, words in (
            ("max_abs_u", "the torque"),
            ("max_abs_x", "the axial amplitude"),
            ("stability_radius", "the stability radius"),
            ("stable_area", "the stable area"),
        ):
            if best[name] and other[name]:
                parts.append(f"{best[name] / other[name]:.3g} times {words}")
        if best["delay_margin"] and other["delay_margin"]:
            nearest = [delay_room(f["delay_margin"]) for f in (best, other)]
            parts.append(f"{nearest[0] / nearest[1]:.3g} times the delay margin")
        found.append(f"{best['label']} {parts[0]}, with {', '.join(parts[1:])}.")
    return found


def delay_room(margin: dict[str, float | None]) -> float:
    """Return the smallest relative change of the delay that destabilises."""
    shorter, longer = margin["shorter"], margin["longer"]
    assert shorter is not None
    return min(1.0 - shorter, float("inf") if longer is None else longer - 1.0)
