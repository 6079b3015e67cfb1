"""A report of a rig as one page of HTML that needs nothing else and prints to two sheets of A4."""

from __future__ import annotations

from importlib.metadata import version

from drillctrl.base.figure import embedded, restyled
from drillctrl.base.templates import filled
from drillctrl.strings.drives_words import drive_settings
from drillctrl.strings.figure import plot_lumped, plot_rig
from drillctrl.strings.rig import StringRig
from drillctrl.studies.rig_report_figure import Line, plot_courses, plot_thresholds
from drillctrl.studies.rig_report_values import ReportValues
from drillctrl.studies.rig_report_words import (
    Rows,
    checked,
    gain_settings,
    mode_rows,
    place_text,
    point_rows,
    report_answer,
    rig_rows,
    unknown,
)

# Widths on paper, mm, and the size of texts in figures, points.
_WHOLE, _STRING, _LUMPED, _TEXT = 186.0, 112.0, 58.0, 7.5


def report_page(found: ReportValues) -> str:
    """Return the page.

    Parameters
    ----------
    found : ReportValues
        What `rig_report` found out.
    """
    map_image, map_text = _map(found)
    answer = report_answer(found)
    lines = [Line(c.label, c.times, c.bit_speed, c.torque) for c in found.courses]
    courses = plot_courses(lines, found.point.rotary_speed, found.language)
    return filled(
        "drillctrl.studies",
        "rig_report.html.j2",
        name=found.name,
        place=place_text(found),
        date=found.date,
        version=version("drillctrl"),
        first=answer[0],
        rest=answer[1:],
        rig_image=_rig(found),
        wide=isinstance(found.point.rig, StringRig),
        point=point_rows(found),
        rig=rig_rows(found),
        modes=mode_rows(found),
        map_image=map_image,
        map_text=map_text,
        settings=_settings(found),
        control=_control(found),
        start=found.courses[0].start,
        courses=embedded(restyled(courses, _WHOLE, _TEXT)),
        checked=checked(found),
        unknown=unknown(found),
    )


def _rig(found: ReportValues) -> str:
    if isinstance(found.point.rig, StringRig):
        return embedded(restyled(plot_rig(found.check, found.language), _STRING, _TEXT))
    return embedded(restyled(plot_lumped(found.point.rig, found.language), _LUMPED, _TEXT))


def _map(found: ReportValues) -> tuple[str | None, str]:
    """Return the picture of what becomes of the bit elsewhere, and what it shows."""
    if found.map is not None:
        drawn = found.map.plot(("outcome",), found.name)
        text = "What becomes of the bit after a kick, at other speeds and rates of penetration."
        if found.drives is not None:
            seconds = found.language.text("time", float(found.courses[0].times[-1]), 2)
            text = f"{text[:-1]}: so far as {seconds} of simulated motion tell, at each of"
            text += f" {len(found.map.nodes)} points."
        return embedded(restyled(drawn, _WHOLE, _TEXT)), text
    if found.drives is None:
        return None, ""
    falling = found.drives.falling
    slopes = {drive.control.name: drive.smallest_slope for drive in found.drives.drives}
    ax = plot_thresholds(
        slopes, falling.decay, falling.drop, found.point.rotary_speed, found.language
    )
    text = (
        "Torsional vibration of the first modes dies away where the bit's torque falls by less than"
        " the edge says as it turns faster; above the edge it grows to stick-slip. Found with the"
        " linear motion of string and drive; drillctrl map simulates it."
    )
    return embedded(restyled(ax, _WHOLE, _TEXT)), text


def _settings(found: ReportValues) -> Rows:
    if not found.recommended:
        return []
    if found.drives is not None:
        law = found.drives.drives[-1]
        return drive_settings(law.control, found.language)
    assert found.design is not None
    return gain_settings(found.design, found.language)


def _control(found: ReportValues) -> str:
    """Say what the settings are of."""
    if found.drives is not None:
        return f"Of the top drive, law {found.drives.drives[-1].control.name}:"
    return "Of a torque at the bit, beside that of steady drilling:"
