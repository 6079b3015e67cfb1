"""A picture of a drill string: its sections, and how it moves in its first modes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.figure import BLUE, GREEN, GREY, ORANGE, axis_name, new_figure
from drillctrl.base.language import SI, Language
from drillctrl.drilling.rig import Rig
from drillctrl.strings.check import Mode, RigCheck
from drillctrl.strings.rig import StringRig

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = {"pipe": BLUE, "heavy-weight": GREEN, "collar": GREY}
_DRAWN = 3
# Height of a name, share of the string.
_LINE = 0.06


def plot_rig(found: RigCheck, language: Language = SI) -> Figure:
    """Draw a string by depth: outer and inner diameters, torsional and axial modes.

    Parameters
    ----------
    found : RigCheck
        Of a rig with a string.
    language : Language
        Units of the picture.

    Raises
    ------
    InputError
        If the rig is lumped: there is nothing to draw.
    """
    if not isinstance(found.rig, StringRig):
        raise InputError("rig", "lumped to one mass each way", "a rig with a string")
    figure = new_figure(8.0, 6.4)
    axes = figure.subplots(1, 3, sharey=True, width_ratios=(1.0, 1.2, 1.2))
    plot_sections(found.rig, axes[0], language)
    plot_modes(found.torsional, axes[1], language)
    plot_modes(found.axial, axes[2], language)
    axes[0].set_ylabel(axis_name("depth along the string", language.unit("depth")))
    return figure


def plot_sections(rig: StringRig, ax: Axes, language: Language = SI) -> Axes:
    """Draw the sections of a string from the top down, diameters to scale across."""
    top = 0.0
    named: list[tuple[float, float, str]] = []
    for section in rig.string.sections:
        bottom = top + language.number("depth", section.length)
        diameters = (section.outer_diameter, section.inner_diameter)
        outer, inner = (0.5 * language.number("length", diameter) for diameter in diameters)
        colour = _COLOURS[section.kind]
        for side in (-1.0, 1.0):
            ax.fill_betweenx([top, bottom], side * inner, side * outer, color=colour, lw=0)
        named.append((outer, 0.5 * (top + bottom), section.name))
        top = bottom
    # From below, each name clear of that under it.
    room = top
    for outer, middle, name in reversed(named):
        room = min(middle, room - _LINE * top)
        ax.annotate(
            name, (outer, room), (4, 0), textcoords="offset points", va="center", fontsize=8
        )
    bit = language.number("length", rig.bit_radius)
    ax.plot([-bit, bit], [top, top], color=ORANGE, lw=3)
    ax.annotate("bit", (bit, top), (4, 0), textcoords="offset points", va="center", fontsize=8)
    turned = "speed imposed" if rig.drive is None else "top drive"
    ax.plot([-bit, bit], [0.0, 0.0], color="black", lw=3, clip_on=False)
    ax.annotate(turned, (bit, 0.0), (4, -1), textcoords="offset points", va="top", fontsize=8)
    ax.set_xlim(-1.1 * bit, 4.2 * bit)
    ax.set_ylim(1.04 * top, -0.02 * top)
    ax.set_xlabel(axis_name("radius", language.unit("length")))
    ax.set_title("string", fontsize=10)
    return ax


def plot_modes(modes: tuple[Mode, ...], ax: Axes, language: Language = SI) -> Axes:
    """Draw the shapes of the first modes of a kind by depth, each with its frequency."""
    for mode, colour in zip(modes[:_DRAWN], (BLUE, ORANGE, GREEN), strict=False):
        ratio = f"{1e2 * mode.damping_ratio:.2g} %"
        largest = np.abs(mode.shape).max()
        label = f"{mode.frequency:.3g} Hz, {ratio}"
        places = language.number("depth", 1.0) * mode.places
        ax.plot(mode.shape / largest, places, color=colour, label=label)
    ax.axvline(0.0, color=GREY, lw=0.6)
    ax.set_xlabel("shape, dimensionless")
    ax.set_title(f"{modes[0].kind} modes", fontsize=10)
    ax.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.19))
    return ax


def plot_lumped(rig: Rig, language: Language = SI) -> Figure:
    """Draw a rig of one mass each way: a scheme, its bit to the scale written below."""
    figure = new_figure(2.4, 4.2)
    ax = figure.add_subplot()
    ax.plot([-0.8, 0.8], [0.0, 0.0], color="black", lw=4)
    turns = np.linspace(0.0, 1.0, 200)
    ax.plot(0.18 * np.sin(16.0 * np.pi * turns), 0.1 + 1.5 * turns, color=BLUE, lw=1.4)
    ax.plot([0.0, 0.0], [0.0, 0.1], color=BLUE, lw=1.4)
    ax.fill_between([-0.35, 0.35], 1.6, 2.4, color=GREY)
    ax.plot([-0.5, 0.5], [2.45, 2.45], color=ORANGE, lw=4)
    stiffness = language.text("torsional_stiffness", rig.torsional_stiffness, 3)
    texts = (
        (-0.12, "speed and feed imposed"),
        (0.75, f"{language.text('axial_stiffness', rig.axial_stiffness, 3)}\n{stiffness}"),
        (
            1.9,
            f"{language.text('mass', rig.mass, 3)}\n{language.text('inertia', rig.inertia, 3)}",
        ),
        (2.62, f"bit {language.text('length', 2.0 * rig.bit_radius, 4)}, {rig.blades} blades"),
    )
    for height, text in texts:
        beside = 0.6 < height < 2.5
        ax.text(0.45 if beside else 0.0, height, text, fontsize=8, va="center",
                ha="left" if beside else "center")  # fmt: skip
    ax.set_xlim(-1.0, 1.6)
    ax.set_ylim(2.8, -0.3)
    ax.set_axis_off()
    return figure
