"""Cost of charts, and of eigenvalue grids whose areas are as good."""

from __future__ import annotations

import sys
import time

import numpy as np
from unit import best_time, report, unit

from drillctrl import (
    OperatingPoint,
    chart,
    preset_structure,
    spectral_abscissas,
    stabilisable_chart,
)

POINT = OperatingPoint(omega0=10.0, delta0=1.75, psi=14.0)
SPEEDS, DEPTHS = ("omega0", 0.5, 25.0), ("delta0", 0.0, 15.0)
CHARTS = {
    "open loop": (None, None, None),
    "p": ("p", [-1.55], None),
    "pd": ("pd", [-2.0, -1.0], None),
    "case1": ("case1", [-1.981], [0.426]),
    "case2": ("case2", [-5.03, -4.91], [-1.67, -0.31]),
}
GRIDS = (25, 50, 100, 200)


def grid_area(name: str, count: int) -> tuple[float, float]:
    """Return the area from α at the centres of count² cells, and its time in seconds."""
    structure_name, now, past = CHARTS[name]
    share = (np.arange(count) + 0.5) / count
    u, v = (a.ravel() for a in np.meshgrid(share, share, indexing="ij"))
    values = {
        axis: low + part * (high - low) for (axis, low, high), part in ((SPEEDS, u), (DEPTHS, v))
    }
    structure = None if structure_name is None else preset_structure(structure_name)
    gains = None if structure is None else np.tile([*now, *(past or [])], (u.size, 1))
    began = time.perf_counter()
    alpha = spectral_abscissas(POINT, values, structure, gains, workers=1)
    seconds = time.perf_counter() - began
    whole = (SPEEDS[2] - SPEEDS[1]) * (DEPTHS[2] - DEPTHS[1])
    return float((alpha < 0.0).mean() * whole), seconds


def main(optimised: bool) -> None:
    """Print the tables; ``optimised`` adds the chart of what feedback can reach."""
    one = unit()
    report("dense 44 × 44 eigvals", one, one)
    for name, arguments in CHARTS.items():

        def draw(arguments=arguments):
            return chart(POINT, SPEEDS, DEPTHS, *arguments)

        drawn = draw()
        cost = best_time(draw, repeats=3, seconds=1.0)
        error = drawn.area_error / drawn.stable_area
        report(f"chart, {name}, area error {error:.0e}", cost, one)
        errors, times = [], []
        for count in GRIDS:
            area, seconds = grid_area(name, count)
            errors.append(abs(area / drawn.stable_area - 1.0))
            times.append(seconds)
            report(f"  eigenvalue grid {count}², area error {errors[-1]:.0e}", seconds, one)
        # The error of a grid falls like 1/count, the cost grows like count²: what the
        # chart's accuracy would take. A lucky grid says nothing, hence the median.
        scale = np.median(np.array(errors) * np.array(GRIDS))
        equal = times[-1] * (scale / max(error, 1e-12) / GRIDS[-1]) ** 2
        print(f"  a grid of equal accuracy would cost {equal / cost:.3g} times the chart")
    if optimised:
        began = time.perf_counter()
        for name in ("p", "case1"):
            reach = stabilisable_chart(POINT, ("omega0", 0.0, 25.0), ("delta0", 0.0, 18.0), name)
            print(reach)
            print(f"  ratio {reach.area_ratio:.4f} ± {reach.area_ratio_error:.1g}")
            report(f"  reach of {name}", reach.elapsed_seconds, one)
        print(f"all three curves of Fig. 12: {time.perf_counter() - began:.1f} s")


if __name__ == "__main__":
    main("--optimise" in sys.argv)
