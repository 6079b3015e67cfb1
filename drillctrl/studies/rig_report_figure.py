"""Figures of a report of a rig. They take arrays and know no results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.figure import BLUE, GREY, ORANGE, axis_name, new_axes, new_figure
from drillctrl.base.language import Language

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = (GREY, BLUE)


class Line(NamedTuple):
    """A run to draw.

    Attributes
    ----------
    label : str
        What closed the loop.
    times, bit_speed, torque : array, (k,)
        SI; torque of the control.
    """

    label: str
    times: FloatArray
    bit_speed: FloatArray
    torque: FloatArray


def plot_courses(lines: Sequence[Line], speed: float, language: Language) -> Figure:
    """Draw bit speed and torque over time, runs over each other.

    Parameters
    ----------
    lines : sequence of Line
        Runs.
    speed : float
        Imposed, rad/s.
    language : Language
        Units.
    """
    figure = new_figure(7.2, 3.0)
    upper, lower = figure.subplots(2, 1, sharex=True)
    for line, colour in zip(lines, _COLOURS, strict=False):
        for ax, name, values in (
            (upper, "angular_rate", line.bit_speed),
            (lower, "torque", line.torque),
        ):
            scale = language.number(name, 1.0)
            ax.plot(line.times, scale * values, color=colour, lw=1.0, label=line.label)
    imposed = language.number("angular_rate", speed)
    upper.axhline(imposed, color="black", lw=0.7, ls=":", label="speed set at the top")
    upper.set_ylabel(axis_name("bit speed", language.unit("angular_rate")))
    lower.set_ylabel(axis_name("torque of control", language.unit("torque")))
    lower.set_xlabel(axis_name("time", language.unit("time")))
    lower.margins(x=0)
    # A stiff drive without a limit may ask for any torque at first: the last line says the scale.
    ends = [language.number("torque", value) for value in _range(lines[-1].torque)]
    if ends[0] < ends[1]:
        lower.set_ylim(*ends)
    figure.legend(
        *upper.get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8
    )
    return figure


def _range(values: FloatArray) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    return low - 0.3 * (high - low), high + 0.3 * (high - low)


def plot_thresholds(
    slopes: Mapping[str, float],
    decay: float,
    drop: float,
    speed: float,
    language: Language,
) -> Axes:
    """Draw, for each drive, from which speed up it stands how much falling torque.

    Parameters
    ----------
    slopes : mapping
        Drive → smallest critical slope of its modes, N m s/rad.
    decay, drop : float
        Of the falling torque, rad/s and N m; the drop is drawn as a line.
    speed : float
        At which the rig drills, rad/s.
    language : Language
        Units.
    """
    ax = new_axes(7.2, 2.4)
    speeds = np.linspace(0.2 * speed, 1.5 * speed, 200)
    turned = language.number("angular_rate", 1.0)
    torque = language.number("torque", 1.0)
    top = 3.0 * drop
    for (name, slope), colour in zip(slopes.items(), _COLOURS, strict=False):
        edge = np.minimum(slope * decay * np.exp(speeds / decay), 10.0 * top)
        ax.plot(turned * speeds, torque * edge, color=colour, lw=1.8, label=f"edge, {name}")
        ax.fill_between(
            turned * speeds, 0.0, torque * edge, color=colour, alpha=0.15, lw=0,
            label=f"dies away, {name}",
        )  # fmt: skip
    ax.axhline(torque * drop, color=ORANGE, lw=1.0, ls="--", label="fall assumed")
    ax.plot(
        [turned * speed], [torque * drop], "*", color="white", markeredgecolor="black",
        markersize=13, ls="none", label="here", zorder=4,
    )  # fmt: skip
    ax.set_xlim(turned * speeds[0], turned * speeds[-1])
    ax.set_ylim(0.0, torque * top)
    ax.set_xlabel(axis_name("rotary speed", language.unit("angular_rate")))
    ax.set_ylabel(axis_name("fall of the bit's torque", language.unit("torque")))
    ax.legend(fontsize=8, loc="upper left", ncols=2)
    return ax
