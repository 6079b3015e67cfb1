"""Figures of a simulated motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctrl.plotting import BLUE, GREY, ORANGE
from drillctrl.simulation.result import Simulation

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_motion(run: Simulation) -> Figure:
    """Draw axial motion, bit speed and control over time, torsional stick shaded.

    Parameters
    ----------
    run : Simulation
        Of `simulate`.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    motion, point = run.on_steps(4), run.point
    rows = [
        ("x", motion.x, BLUE),
        ("bit speed ω0 + θ'", point.omega0 + motion.dtheta, BLUE),
    ]
    if run.controller is not None:
        rows.append(("control u", motion.torque, ORANGE))
    figure = Figure(figsize=(7.2, 1.9 * len(rows) + 0.8), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(rows), 1, sharex=True)
    for ax, (label, values, colour) in zip(axes, rows, strict=True):
        for i, (start, end) in enumerate(run.phases("stuck")):
            name = "torsional stick" if i == 0 else None
            ax.axvspan(start, end, color=GREY, alpha=0.25, linewidth=0, label=name)
        ax.plot(motion.times, values, color=colour, linewidth=0.9)
        ax.set_ylabel(label)
        ax.margins(x=0)
    if run.phases("stuck"):
        axes[0].legend(loc="upper left", fontsize="small")
    axes[-1].set_xlabel("dimensionless time t")
    axes[0].set_title(
        f"{run.model.capitalize()} motion at ω0 = {point.omega0:g}, "
        f"δ0 = {point.delta0:g}, ψ = {point.psi:g}"
    )
    return figure
