"""A picture of a drill string: its sections, and how it moves in its first modes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.figure import BLUE, GREEN, GREY, ORANGE, new_figure
from drillctrl.strings.check import Mode, RigCheck
from drillctrl.strings.rig import StringRig

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = {"pipe": BLUE, "heavy-weight": GREEN, "collar": GREY}
_DRAWN = 3


def plot_rig(found: RigCheck) -> Figure:
    """Draw a string by depth: outer and inner diameters, torsional and axial modes.

    Parameters
    ----------
    found : RigCheck
        Of a rig with a string.

    Raises
    ------
    InputError
        If the rig is lumped: there is nothing to draw.
    """
    if not isinstance(found.rig, StringRig):
        raise InputError("rig", "lumped to one mass each way", "a rig with a string")
    figure = new_figure(8.0, 6.0)
    axes = figure.subplots(1, 3, sharey=True, width_ratios=(1.0, 1.2, 1.2))
    plot_sections(found.rig, axes[0])
    plot_modes(found.torsional, axes[1])
    plot_modes(found.axial, axes[2])
    axes[0].set_ylabel("depth along the string, m")
    return figure


def plot_sections(rig: StringRig, ax: Axes) -> Axes:
    """Draw the sections of a string from the top down, diameters to scale across."""
    top = 0.0
    for section in rig.string.sections:
        bottom = top + section.length
        outer, inner = 5e2 * section.outer_diameter, 5e2 * section.inner_diameter
        colour = _COLOURS[section.kind]
        for side in (-1.0, 1.0):
            ax.fill_betweenx([top, bottom], side * inner, side * outer, color=colour, lw=0)
        ax.annotate(
            section.name,
            (outer, 0.5 * (top + bottom)),
            (4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
        )
        top = bottom
    bit = 1e3 * rig.bit_radius
    ax.plot([-bit, bit], [top, top], color=ORANGE, lw=3)
    ax.annotate("bit", (0.0, top), (0, -10), textcoords="offset points", ha="center", fontsize=8)
    ax.set_xlim(-1.1 * bit, 3.0 * bit)
    ax.set_ylim(1.04 * top, -0.02 * top)
    ax.set_xlabel("radius, mm")
    ax.set_title("string", fontsize=10)
    return ax


def plot_modes(modes: tuple[Mode, ...], ax: Axes) -> Axes:
    """Draw the shapes of the first modes of a kind by depth, each with its frequency."""
    for mode, colour in zip(modes[:_DRAWN], (BLUE, ORANGE, GREEN), strict=False):
        ratio = f"{1e2 * mode.damping_ratio:.2g} %"
        largest = np.abs(mode.shape).max()
        label = f"{mode.frequency:.3g} Hz, {ratio}"
        ax.plot(mode.shape / largest, mode.places, color=colour, label=label)
    ax.axvline(0.0, color=GREY, lw=0.6)
    ax.set_xlabel("amplitude over the largest, dimensionless")
    ax.set_title(f"{modes[0].kind} modes", fontsize=10)
    ax.legend(fontsize=8, loc="lower left")
    return ax
