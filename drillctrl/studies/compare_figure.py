"""Figures of a comparison. Each takes values by label and matplotlib Axes, or makes these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.arrays import ComplexArray
from drillctrl.base.figure import GREY, PALETTE, axis_name, new_axes
from drillctrl.charts.figure import STYLES, Charted, plot_charts
from drillctrl.drilling.quantities import root_scales
from drillctrl.simulation.figure import scale_of
from drillctrl.studies.measures import Response

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.drilling.case import Case
    from drillctrl.drilling.rig import Rig


MARKERS = "osD^v<"
SHOWN = 6

Looks = Mapping[str, tuple[str, str]]


def looks(labels: Sequence[str]) -> Looks:
    """Return a colour and a line style for each of the first candidates."""
    return {
        label: (PALETTE[i % len(PALETTE)], STYLES[i % len(STYLES)])
        for i, label in enumerate(labels[:SHOWN])
    }


def plot_responses(
    responses: Mapping[str, Response],
    looks: Looks,
    case: Case,
    name: str = "x",
    ax: Axes | None = None,
    model: str = "nonlinear",
) -> Axes:
    """Draw the motion of stable candidates after the disturbance.

    Parameters
    ----------
    responses : mapping of str to Response
        By label.
    looks : mapping
        Of `looks`.
    case : Case
        In whose units.
    name : str
        ``"x"``, ``"theta"``, or ``"torque"`` for the control.
    ax : Axes, optional
        By default new ones.
    model : {"nonlinear", "linear"}
        Which motion it is.
    """
    ax = new_axes() if ax is None else ax
    longest = 10.0
    (unit, time_text), (scale, text) = scale_of(case, "time"), scale_of(case, name)
    for label, response in responses.items():
        colour, style = looks[label]
        run = response.run
        longest = max(longest, response.settling_time or 0.25 * run.duration)
        motion = run.on_steps(5)
        values = scale * getattr(motion, name)
        ax.plot(unit * motion.times, values, style, color=colour, linewidth=1.1, label=label)
    ax.set_xlim(0.0, 1.2 * unit * longest)
    ax.set_xlabel(time_text)
    ax.set_ylabel(text)
    ax.set_title(
        f"{model.capitalize()} motion after the disturbance, stable loops", fontsize="medium"
    )
    _legend(ax)
    return ax


def plot_nyquist(loops: Mapping[str, ComplexArray], looks: Looks, ax: Axes | None = None) -> Axes:
    """Draw L(iω) of each stable candidate with one input around −1.

    Parameters
    ----------
    loops : mapping of str to array, (q,)
        L(iω) by label.
    looks : mapping
        Of `looks`.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes(5.2, 5.0) if ax is None else ax
    for label, loop in loops.items():
        colour, style = looks[label]
        ax.plot(loop.real, loop.imag, style, color=colour, linewidth=1.1, label=label)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    ax.plot(np.cos(angle), np.sin(angle), color=GREY, linewidth=0.6)
    ax.plot([-1.0], [0.0], "+", color="black", markersize=10, label="−1")
    ax.set_xlim(-3.0, 2.0)
    ax.set_ylim(-2.5, 2.5)
    ax.set_aspect("equal")
    ax.set_xlabel(axis_name("Re L(iω)"))
    ax.set_ylabel(axis_name("Im L(iω) for ω > 0"))
    ax.set_title("Nyquist curves, loop broken at the input", fontsize="medium")
    _legend(ax)
    return ax


def plot_dominant_roots(
    dominant: Mapping[str, ComplexArray],
    looks: Looks,
    ax: Axes | None = None,
    rig: Rig | None = None,
) -> Axes:
    """Draw the dominant roots of every candidate and of the open loop.

    Parameters
    ----------
    dominant : mapping of str to array
        Roots by label.
    looks : mapping
        Of `looks`; what has none is grey.
    ax : Axes, optional
        By default new ones.
    rig : Rig, optional
        In whose units: growth per second over Hz.
    """
    ax = new_axes() if ax is None else ax
    (rate, real, per), (turn, imaginary, cycles) = root_scales(rig)
    for i, (label, roots) in enumerate(dominant.items()):
        both = np.concatenate([roots, roots.conj()])
        ax.plot(
            rate * both.real,
            turn * both.imag,
            MARKERS[i % len(MARKERS)],
            color=looks[label][0] if label in looks else GREY,
            label=label,
        )
    ax.axvline(0.0, color="black", linewidth=0.8)
    ax.set_xlabel(axis_name(real, per))
    ax.set_ylabel(axis_name(imaginary, cycles))
    ax.set_title("Dominant roots", fontsize="medium")
    _legend(ax)
    return ax


def plot_areas(charts: Mapping[str, Charted], ax: Axes | None = None) -> Axes:
    """Draw where the gains of each candidate, and no gains, are stable; see `plot_charts`."""
    ax = plot_charts(charts, ax)
    ax.set_title("Where these gains are stable", fontsize="medium")
    return ax


def _legend(ax: Axes) -> None:
    """Name the lines, or say that there are none."""
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="best", fontsize="small")
    else:
        ax.text(0.5, 0.5, "no stable loop to show", ha="center", transform=ax.transAxes)
