"""Axes of charts and maps as texts."""

from __future__ import annotations

from typing import Any

from drillctrl.base.errors import InputError

# Of bare numbers on a rig's axes.
_UNITS = {"speed": "rpm", "rop": "m/h", "wob": "kN"}
_OF_FIELD = {"speed": "rpm", "rop": "ft/h", "wob": "klbf"}


def read_axis(option: str, text: str) -> tuple[str, object, object]:
    """Return name and limits from a text such as ``omega0=0.5:25`` or ``rop=0:40 m/h``.

    Raises
    ------
    InputError
        If the text has not that form.
    """
    name, equals, interval = text.partition("=")
    low, colon, high = (part.strip() for part in interval.partition(":"))
    if not (equals and colon and low and high):
        raise InputError(option, text, "of the form omega0=0.5:25 or 'speed=30:200 rpm'")
    unit = " ".join(high.split()[1:])
    if unit and " " not in low:
        low = f"{low} {unit}"
    limits: list[object] = []
    for part in (low, high):
        try:
            limits.append(float(part))
        except ValueError:
            limits.append(part)
    return name.strip(), limits[0], limits[1]


def with_axes(point: dict[str, Any], *axes: tuple[str, object, object]) -> dict[str, Any]:
    """Return the options of the point, those that are axes at the upper end of theirs."""
    given = dict(point)
    units = _OF_FIELD if point.get("units") == "field" else _UNITS
    for name, _, high in axes:
        if given.get("rig") is None or name not in ("speed", "rop", "wob"):
            continue
        other = {"rop": "wob", "wob": "rop"}.get(name)
        if other is not None and point.get(other) is not None:
            raise InputError(f"--{other}", point[other], f"left out where {name} is an axis")
        # Two axes that contradict each other are told as such later.
        if given[name] is None and (other is None or given[other] is None):
            given[name] = high if isinstance(high, str) else f"{high} {units[name]}"
    return given


def read_counted_axis(option: str, text: str, usual: int) -> tuple[tuple[str, object, object], int]:
    """Return an axis and its number of points from a text such as ``speed=50:180:15 rpm``.

    Parameters
    ----------
    option, text : str
        What was typed, and where.
    usual : int
        Number of points where none is given.

    Raises
    ------
    InputError
        If the text has not that form.
    """
    name, _, interval = text.partition("=")
    parts = [part.strip() for part in interval.split(":")]
    if len(parts) != 3:
        return read_axis(option, text), usual
    count, _, unit = parts[2].partition(" ")
    axis = read_axis(option, f"{name}={parts[0]}:{parts[1]} {unit}".rstrip())
    if not count.isdecimal():
        raise InputError(option, text, "of the form 'speed=50:180:15 rpm'")
    return axis, int(count)
