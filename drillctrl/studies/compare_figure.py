"""Figures of a comparison. Each takes matplotlib Axes, or makes them, and returns them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.figure import BLUE, GREEN, GREY, ORANGE, new_axes
from drillctrl.charts.figure import STYLES, plot_charts
from drillctrl.robustness.transfer import frequency_grid, loop_transfer

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.studies.compare import Comparison, Row

# The same order as in the charts.
PALETTE = (BLUE, ORANGE, GREEN, GREY, "#CC79A7", "#56B4E9")
MARKERS = "osD^v<"
_SHOWN = 6


def _candidates(comparison: Comparison) -> list[tuple[Row, str, str]]:
    """Return the first candidates with feedback, each with a colour and a line style."""
    rows = [row for row in comparison.rows if row.design.structure is not None][:_SHOWN]
    return [(row, PALETTE[i % len(PALETTE)], STYLES[i % len(STYLES)]) for i, row in enumerate(rows)]


def plot_responses(
    comparison: Comparison, name: str = "x", ax: Axes | None = None, model: str = "nonlinear"
) -> Axes:
    """Draw the motion of each stable candidate after the disturbance.

    Parameters
    ----------
    comparison : Comparison
        Of `compare`.
    name : str
        ``"x"``, ``"theta"``, or ``"torque"`` for the control.
    ax : Axes, optional
        By default new ones.
    model : {"nonlinear", "linear"}
        Which motion.
    """
    ax = new_axes() if ax is None else ax
    longest = 10.0
    for row, colour, style in _candidates(comparison):
        response = row.nonlinear if model == "nonlinear" else row.linear
        if response is None or not row.design.stable:
            continue
        run = response.run
        longest = max(longest, response.settling_time or 0.25 * run.duration)
        motion = run.on_steps(5)
        values = getattr(motion, name)
        ax.plot(motion.times, values, style, color=colour, linewidth=1.1, label=row.label)
    ax.set_xlim(0.0, 1.2 * longest)
    ax.set_xlabel("dimensionless time t")
    ax.set_ylabel({"theta": "θ", "torque": "control u"}.get(name, name))
    ax.set_title(
        f"{model.capitalize()} motion after the disturbance, stable loops", fontsize="medium"
    )
    ax.legend(loc="best", fontsize="small")
    return ax


def plot_nyquist(comparison: Comparison, ax: Axes | None = None) -> Axes:
    """Draw the loop L(iω) of each stable candidate with one input around −1."""
    ax = new_axes(5.2, 5.0) if ax is None else ax
    for row, colour, style in _candidates(comparison):
        design, structure = row.design, row.design.structure
        if structure is None or row.margins is None:
            continue
        omega = frequency_grid(design.system())
        loop = loop_transfer(design.plant, structure, design.K1, design.K2, omega)[0, 0]
        ax.plot(loop.real, loop.imag, style, color=colour, linewidth=1.1, label=row.label)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    ax.plot(np.cos(angle), np.sin(angle), color=GREY, linewidth=0.6)
    ax.plot([-1.0], [0.0], "+", color="black", markersize=10, label="−1")
    ax.set_xlim(-3.0, 2.0)
    ax.set_ylim(-2.5, 2.5)
    ax.set_aspect("equal")
    ax.set_xlabel("Re L(iω)")
    ax.set_ylabel("Im L(iω), ω > 0")
    ax.set_title("Nyquist curves, loop broken at the input", fontsize="medium")
    ax.legend(loc="best", fontsize="small")
    return ax


def plot_dominant_roots(comparison: Comparison, ax: Axes | None = None) -> Axes:
    """Draw the dominant roots of every candidate and of the open loop."""
    ax = new_axes() if ax is None else ax
    colours = {row.label: colour for row, colour, _ in _candidates(comparison)}
    for i, row in enumerate(comparison.rows[: _SHOWN + 1]):
        roots = np.array([root.value for root in row.design.loop.dominant_roots])
        both = np.concatenate([roots, roots.conj()])
        ax.plot(
            both.real,
            both.imag,
            MARKERS[i % len(MARKERS)],
            color=colours.get(row.label, GREY),
            label=row.label,
        )
    ax.axvline(0.0, color="black", linewidth=0.8)
    ax.set_xlabel("Re s")
    ax.set_ylabel("Im s")
    ax.set_title("Dominant roots", fontsize="medium")
    ax.legend(loc="best", fontsize="small")
    return ax


def plot_areas(comparison: Comparison, ax: Axes | None = None) -> Axes | None:
    """Draw where the gains of each candidate, and no gains, are stable; None without charts."""
    shown = [row for row, _, _ in _candidates(comparison)][: _SHOWN - 1]
    shown += [row for row in comparison.rows if row.design.structure is None]
    charts = {row.label: row.chart for row in shown if row.chart is not None}
    if not charts:
        return None
    ax = plot_charts(charts, ax)
    ax.set_title("Where these gains are stable", fontsize="medium")
    return ax
