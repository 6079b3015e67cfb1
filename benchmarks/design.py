"""Cost of a design against differential evolution to the same value."""

from __future__ import annotations

import time

import numpy as np
from scipy.optimize import differential_evolution
from unit import report, unit

from drillctrl import OperatingPoint, design, plant_system, preset_structure
from drillctrl.optimisation.family import loop_family


def main() -> None:
    """Print median costs over random points, and the oracle beside them."""
    one = unit()
    report("dense 44 × 44 eigvals", one, one)
    rng = np.random.default_rng(2)
    points = [
        OperatingPoint(rng.uniform(3, 25), rng.uniform(0.2, 13), rng.uniform(2, 26), xi=d, kappa=d)
        for d in (0.02, 0.05) * 6
    ]
    for name in ("p", "case1", "case2"):
        elapsed = [design(point, name).elapsed_seconds for point in points]
        report(f"design, {name}, median of {len(points)} points", float(np.median(elapsed)), one)
        point = points[0]
        ours = design(point, name)
        family = loop_family(plant_system(point), preset_structure(name))
        bounds = list(zip(family.feedback.lower, family.feedback.upper, strict=True))
        best = [np.inf]

        def objective(gains: np.ndarray, family=family, best=best) -> float:
            value = family.abscissa(gains)[0]
            best[0] = min(best[0], value)
            return value

        began = time.perf_counter()
        target = ours.spectral_abscissa + 1e-5
        differential_evolution(
            objective,
            bounds,
            rng=1,
            popsize=20,
            maxiter=400,
            tol=0,
            polish=False,
            callback=lambda *_, best=best, target=target: best[0] <= target,
        )
        seconds = time.perf_counter() - began
        gap = best[0] - ours.spectral_abscissa
        ratio = seconds / ours.elapsed_seconds
        report(f"  differential evolution, gap {gap:.0e}, {ratio:.0f} times ours", seconds, one)


if __name__ == "__main__":
    main()
