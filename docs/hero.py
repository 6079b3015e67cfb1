"""Draw the picture of the README: where drilling is stable, and a bit that sticks set free.

Run `python docs/hero.py` where the drawing or a number behind it changes.
"""

from __future__ import annotations

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drillctrl import Controller, OperatingPoint, chart, design, preset_structure, simulate
from drillctrl.base.figure import BLUE, GREY, save_figure
from drillctrl.charts.figure import plot_charts

TARGET = Path(__file__).parent / "_static" / "hero.png"
SWITCHED_ON = 150.0


def main() -> None:
    """Compute both halves and write the picture."""
    point = OperatingPoint(omega0=10, delta0=2.5, psi=14)
    best = design(point, "case1")
    axes = ("omega0", 0, 25), ("delta0", 0, 6)
    charts = {
        "without control": chart(point, *axes),
        "with the gains designed at the cross": chart(point, *axes, "case1", best.K1, best.K2),
    }
    controller = Controller(preset_structure("case1"), best.K1, best.K2, activation=SWITCHED_ON)
    run = simulate(point, controller, duration=220.0, initial={"dx": 1, "dtheta": 1})
    motion = run.on_steps(4)

    figure = Figure(figsize=(9.2, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.25))
    plot_charts(charts, left)
    left.plot(point.omega0, point.delta0, "kx", markersize=8)
    for start, end in run.phases("stuck"):
        right.axvspan(start, end, color=GREY, alpha=0.3, linewidth=0)
    right.plot(motion.times, point.omega0 + motion.dtheta, color=BLUE, linewidth=0.8)
    right.axvline(SWITCHED_ON, color="k", linestyle="--", linewidth=1)
    right.margins(x=0)
    right.set_xlabel("time t, dimensionless")
    right.set_ylabel("bit speed, dimensionless")
    right.set_title("At the cross: stick (grey) until control begins at t = 150", fontsize="medium")
    TARGET.parent.mkdir(exist_ok=True)
    save_figure(figure, TARGET)


if __name__ == "__main__":
    main()
