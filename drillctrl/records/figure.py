"""Figures of a recording. They take arrays and know no results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.figure import BLUE, GREEN, GREY, ORANGE, axis_name, headline
from drillctrl.base.language import SI, Language

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RPM = 30.0 / np.pi
# Full stick-slip.
_FULL = 1.0
_MARKS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)


def plot_motion(
    ax: Axes,
    time: FloatArray,
    top: FloatArray | None,
    carried: FloatArray | None,
    measured: FloatArray | None,
) -> None:
    """Draw speeds in rpm over seconds."""
    if measured is not None:
        ax.plot(time, _RPM * measured, color=GREY, linewidth=0.8, label="bit, measured")
    if carried is not None:
        ax.plot(time, _RPM * carried, color=ORANGE, linewidth=1.1, label="bit, from the surface")
    if top is not None:
        ax.plot(time, _RPM * top, color=BLUE, linewidth=1.1, label="top drive")
    ax.set_xlabel(axis_name("time", "s"))
    ax.set_ylabel(axis_name("rotary speed", "rpm"))
    _legend_above(ax)


def plot_torque(
    ax: Axes,
    time: FloatArray,
    torque: FloatArray,
    carried: FloatArray | None,
    told: Language = SI,
) -> None:
    """Draw torques over seconds."""
    unit, scale = told.units["torque"]
    if carried is not None:
        ax.plot(time, scale * carried, color=ORANGE, linewidth=1.0, label="bit, from the surface")
    ax.plot(time, scale * torque, color=BLUE, linewidth=1.1, label="measured at the top")
    ax.set_xlabel(axis_name("time", "s"))
    ax.set_ylabel(axis_name("torque", unit))
    _legend_above(ax)


def _legend_above(ax: Axes) -> None:
    """Show the legend in room of its own above the curves."""
    low, high = ax.get_ylim()
    count = len(ax.get_legend_handles_labels()[1])
    ax.set_ylim(low, high + (0.05 + 0.14 * count) * (high - low))
    ax.legend(fontsize="small", loc="upper right")


def plot_severity(
    ax: Axes, times: FloatArray, values: FloatArray, name: str = "stick-slip index"
) -> None:
    """Draw an index over seconds."""
    ax.plot(times, values, color=ORANGE, linewidth=1.2)
    ax.axhline(_FULL, color=GREY, linewidth=0.9, linestyle="--", label="full stick-slip")
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel(axis_name("time", "s"))
    ax.set_ylabel(headline(axis_name(name), 28))
    ax.legend(fontsize="small")


def plot_period(ax: Axes, times: FloatArray, values: FloatArray) -> None:
    """Draw the period over seconds."""
    ax.plot(times, values, "o-", color=GREEN, markersize=3, linewidth=1.0)
    ax.set_xlabel(axis_name("time", "s"))
    ax.set_ylabel(axis_name("period of the swing", "s"))


def plot_spectrum(
    ax: Axes,
    frequency: FloatArray,
    density: FloatArray,
    modes: Sequence[tuple[float, float]],
    period: float | None,
    told: Language = SI,
) -> None:
    """Draw the torque's spectrum, with modes and their errors, and the swing's own line."""
    unit, scale = told.units["torque"]
    shown = (frequency > 0.02) & (frequency < 5.0)
    ax.loglog(frequency[shown], scale * np.sqrt(density[shown]), color=BLUE, linewidth=0.8)
    for i, (place, error) in enumerate(modes):
        label = "modes" if i == 0 else None
        ax.axvspan(place - error, place + error, color=ORANGE, alpha=0.45, label=label)
        ax.axvline(place, color=ORANGE, linewidth=0.9)
    if period is not None:
        ax.axvline(1.0 / period, color=GREEN, linestyle="--", linewidth=1.1, label="stick-slip")
    ax.set_xlabel(axis_name("frequency", "Hz"))
    ax.set_ylabel(headline(axis_name("torque per root of frequency", f"{unit}/√Hz"), 28))
    if modes or period is not None:
        ax.legend(fontsize="small")


def plot_drive(
    ax: Axes,
    frequency: FloatArray,
    impedance: FloatArray,
    reflection: FloatArray | None,
    told: Language = SI,
) -> None:
    """Draw what a drive returns of waves, or its impedance where the pipe is not known."""
    if reflection is None:
        unit, scale = told.units["impedance"]
        ax.loglog(frequency, scale * impedance, ".", color=BLUE, markersize=4)
        ax.set_ylabel(axis_name("impedance of the drive", unit))
    else:
        ax.semilogx(frequency, reflection, ".", color=BLUE, markersize=4)
        ax.set_ylim(0.0, 1.2)
        ax.set_ylabel(headline(axis_name("reflection of the drive"), 28))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter("")
    ax.set_xticks([place for place in _MARKS if frequency[0] <= place <= frequency[-1]])
    ax.set_xlabel(axis_name("frequency", "Hz"))


def plot_drilled(
    ax: Axes,
    speed: FloatArray,
    weight: FloatArray,
    swing: FloatArray,
    computed: tuple[FloatArray, FloatArray, FloatArray] | None = None,
    told: Language = SI,
) -> None:
    """Draw the index over what was drilled with, speed and weight, above what was computed there.

    ``computed`` is speeds (x,), weights (y,) and indices (x, y).
    """
    unit, scale = told.units["force"]
    if computed is not None:
        ax.set_facecolor("#BBBBBB")
        ax.pcolormesh(
            _RPM * computed[0], scale * computed[1], np.ma.masked_invalid(computed[2].T),
            shading="nearest", cmap="YlOrRd", vmin=0.0, vmax=1.5,
        )  # fmt: skip
    drawn = ax.scatter(
        _RPM * speed, scale * weight, c=swing, cmap="YlOrRd", vmin=0.0, vmax=1.5, s=26,
        edgecolors=GREY if computed is None else "black", linewidths=0.6,
    )  # fmt: skip
    ax.set_xlabel(axis_name("rotary speed", "rpm"))
    ax.set_ylabel(axis_name("weight on bit", unit))
    ax.figure.colorbar(drawn, ax=ax, label=axis_name("stick-slip index"), extend="max")


def plot_law(
    ax: Axes,
    speed: FloatArray,
    torque: FloatArray,
    law: tuple[FloatArray, FloatArray] | None,
    told: Language = SI,
) -> None:
    """Draw torque over speed at the bit, and the law that was fitted."""
    unit, scale = told.units["torque"]
    ax.plot(_RPM * speed, scale * torque, ".", color=BLUE, markersize=1.5, alpha=0.4)
    if law is not None:
        ax.plot(_RPM * law[0], scale * law[1], color=ORANGE, linewidth=1.6, label="fitted law")
        ax.legend(fontsize="small")
    ax.set_xlabel(axis_name("rotary speed of the bit", "rpm"))
    ax.set_ylabel(axis_name("torque at the bit", unit))
