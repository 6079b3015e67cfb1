"""Figs. 4 to 9: stability without control."""

from __future__ import annotations

import numpy as np

from drillctrl.base.figure import BLUE, ORANGE, axis_name
from drillctrl.charts.chart import StabilityChart, chart
from drillctrl.charts.discretised import root_locus
from drillctrl.charts.figure import plot_charts
from drillctrl.charts.volume import stability_volume
from drillctrl.drilling.case import plant_system
from drillctrl.drilling.point import OperatingPoint
from drillctrl.paper.agreement import AGREES, DIFFERS, Agreement, compared, stated
from drillctrl.paper.panels import Reproduced, panels
from drillctrl.simulation.run import simulate
from drillctrl.spectrum.roots import spectral_abscissa

C = OperatingPoint(10.0, 1.75, 14.0)
SPEEDS = ("omega0", 0.5, 24.0)
POINTS = {
    "A": (10.0, 1.33),
    "B": (10.0, 1.0),
    "C": (10.0, 1.75),
    "D": (5.1, 1.75),
    "E": (5.1, 0.25),
}


def _alpha(omega0: float, delta0: float, psi: float = 14.0) -> float:
    return spectral_abscissa(plant_system(OperatingPoint(omega0, delta0, psi)))


def _stable_speeds(drawn: StabilityChart, delta0: float) -> tuple[float, float]:
    """Return the first stable range of ω0 on the line nearest to a depth of cut."""
    line = min(drawn.lines, key=lambda one: abs(one.position - delta0))
    start, end, *_ = line.stable_intervals[0]
    return start, end


def _first_stable(drawn: StabilityChart, delta0: float) -> float:
    return _stable_speeds(drawn, delta0)[0]


def figure_4() -> Reproduced:
    """Root loci of D over the rotary speed and over the depth of cut."""
    figure, axes = panels(1, 2)
    first = root_locus(OperatingPoint(10.0, 1.0, 14.0), ("omega0", 3.0, 24.0), m=4, order=0)
    second = root_locus(OperatingPoint(6.0, 1.0, 14.0), ("delta0", 0.0, 14.5), m=4, order=0)
    first.plot(axes[0])
    second.plot(axes[1])
    enters = first.values[np.flatnonzero(first.radius < 1.0)[0]]
    leaves = second.values[np.flatnonzero(second.radius < 1.0)[-1]]
    start, end = _stable_speeds(chart(C, ("omega0", 3.0, 24.0), ("delta0", 0.9, 1.1)), 1.0)
    whole = end >= 24.0
    rows = [
        Agreement(
            "Fig. 4a",
            "as ω0 rises from 3 to 24 at δ0 = 1 the loop becomes stable",
            "so",
            f"at ω0 = {enters:.3g} by the map, {start:.4g} exactly",
            AGREES if whole else DIFFERS,
            "m = 4, order 0 for the map"
            + ("" if whole else f"; exactly, it is unstable again from ω0 = {end:.4g} on"),
        ),
        stated(
            "Fig. 4b",
            "as δ0 rises to 14.5 at ω0 = 6 the loop becomes unstable",
            f"at δ0 = {leaves:.3g} by the map",
            bool(second.radius[-1] > 1.0),
            "m = 4, order 0",
        ),
    ]
    return Reproduced(figure, rows)


def figure_5() -> Reproduced:
    """Stability volume."""
    volume = stability_volume(C)
    ax = volume.plot()
    figure = ax.get_figure(root=True)
    highest = [
        max((line.position for line in lines if line.stable_intervals), default=0.0)
        for lines in volume.lines
    ]
    step = volume.lines[0][1].position
    rows = [
        stated(
            "Fig. 5",
            "the stable depth of cut grows with ψ from 0.1 to 26",
            f"up to δ0 = {highest[-1]:.3g} at ψ = 26; volume {volume.volume:.5g} ± "
            f"{volume.volume_error:.1g} (estimated)",
            bool(np.all(np.diff(highest) >= -step)),
            "101 slices, scanned exactly along ω0",
        )
    ]
    return Reproduced(figure, rows)


def figure_6() -> Reproduced:
    """Cross-sections at constant ψ."""
    figure, axes = panels(1, 1)
    drawn = {
        psi: chart(C.with_changes(psi=psi), SPEEDS, ("delta0", 0.0, 5.0))
        for psi in (5.0, 10.0, 14.0, 20.0, 26.0)
    }
    plot_charts({f"ψ = {psi:g}": one for psi, one in drawn.items()}, axes[0])
    edges = [_first_stable(one, 0.05) for one in drawn.values()]
    areas = [one.stable_area for one in drawn.values()]
    rows = [
        stated(
            "Fig. 6",
            "with ψ the left boundary moves right and the stable area grows",
            f"left edge at δ0 = 0.05 from {edges[0]:.3g} to {edges[-1]:.3g}, "
            f"area from {areas[0]:.3g} to {areas[-1]:.3g} (ψ = 5 to 26)",
            bool(np.all(np.diff(edges) > 0) and np.all(np.diff(areas) > 0)),
            "exact boundaries",
        )
    ]
    return Reproduced(figure, rows)


def figure_7() -> Reproduced:
    """Cross-sections at constant depth of cut."""
    figure, axes = panels(1, 1)
    drawn = {
        delta0: chart(C.with_changes(delta0=delta0), SPEEDS, ("psi", 0.1, 26.0))
        for delta0 in (0.5, 1.0, 1.5, 2.0)
    }
    plot_charts({f"δ0 = {delta0:g}": one for delta0, one in drawn.items()}, axes[0])
    areas = [one.stable_area for one in drawn.values()]
    rows = [
        stated(
            "Fig. 7",
            "with δ0 the stable area is reduced",
            f"from {areas[0]:.4g} at δ0 = 0.5 to {areas[-1]:.4g} at 2",
            bool(np.all(np.diff(areas) < 0)),
            "exact boundaries",
        )
    ]
    return Reproduced(figure, rows)


def figure_8() -> Reproduced:
    """Five points and the motion there."""
    figure, axes = panels(2, 3)
    chart(C, SPEEDS, ("delta0", 0.0, 3.0)).plot(axes[0])
    for ax, (name, (omega0, delta0)) in zip(axes[1:], POINTS.items(), strict=True):
        axes[0].plot([omega0], [delta0], "*", color=ORANGE, zorder=4)
        axes[0].annotate(name, (omega0, delta0), xytext=(4, 4), textcoords="offset points")
        run = simulate(
            OperatingPoint(omega0, delta0, 14.0),
            duration=40.0 if name == "E" else 200.0,
            initial={"dx": 0.01, "dtheta": 0.01},
            model="linear",
            rtol=1e-7,
        )
        motion = run.on_steps(4)
        ax.plot(motion.times, motion.theta, color=BLUE, linewidth=0.7)
        ax.set_title(f"point {name}: ω0 = {omega0:g}, δ0 = {delta0:g}", fontsize="medium")
        ax.set_xlabel(axis_name("time t"))
        ax.set_ylabel(axis_name("bit angle θ"))
    alphas = {name: _alpha(*place) for name, place in POINTS.items()}
    signs = {"B": -1, "C": 1, "D": -1, "E": 1}
    words = {-1: "stable", 1: "unstable"}
    rows = [
        compared(
            "Fig. 8",
            "point A lies on the boundary: δ0 there at ω0 = 10",
            1.33,
            boundary_depth(10.0),
            f"α = {alphas['A']:.2g} at A itself, so near that the figure shows no difference",
            digits=0.005,
        )
    ]
    for name, sign in signs.items():
        place = ", ".join(f"{value:g}" for value in POINTS[name])
        rows.append(
            stated(
                "Fig. 8",
                f"point {name} ({place}) is {words[sign]}",
                f"α = {alphas[name]:.4g}",
                bool(alphas[name] * sign > 0),
                "rightmost root, counted by the argument principle",
            )
        )
    return Reproduced(figure, rows)


def figure_9() -> Reproduced:
    """Stability boundaries for several damping ratios."""
    figure, axes = panels(1, 1)
    drawn = {
        damping: chart(C.with_changes(xi=damping, kappa=damping), SPEEDS, ("delta0", 0.0, 6.0))
        for damping in (0.005, 0.01, 0.02, 0.05)
    }
    plot_charts({f"ξ = κ = {damping:g}": one for damping, one in drawn.items()}, axes[0])
    areas = {damping: one.stable_area for damping, one in drawn.items()}
    lefts = [_first_stable(one, 0.05) for one in drawn.values()]
    least = chart(C.with_changes(xi=1e-6, kappa=1e-6), SPEEDS, ("delta0", 0.0, 6.0))
    rows = [
        stated(
            "Fig. 9",
            "the stable area grows with damping and vanishes without",
            f"{areas[0.005]:.3g} at 0.005, {areas[0.02]:.4g} at 0.02, {areas[0.05]:.4g} at 0.05, "
            f"{least.stable_area:.1g} at 1e-6",
            bool(np.all(np.diff(list(areas.values())) > 0) and least.stable_area < 1e-2),
            "exact boundaries, ω0 ≤ 24",
        ),
        stated(
            "Fig. 9",
            "the left boundary does not shift with damping",
            f"from {lefts[0]:.4g} to {lefts[-1]:.4g} for 0.005 to 0.05",
            bool(max(lefts) - min(lefts) < 0.1),
            "at δ0 = 0.05; it does shift, by less than the figure would show",
        ),
    ]
    return Reproduced(figure, rows)


def boundary_depth(omega0: float) -> float:
    """Return the largest stable δ0 at a rotary speed."""
    drawn = chart(C, ("omega0", omega0 - 0.01, omega0 + 0.01), ("delta0", 0.5, 2.0))
    return max(float(curve.points[:, 1].max()) for curve in drawn.curves)
