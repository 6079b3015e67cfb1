"""Cost of a design against differential evolution to the same value."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from scipy.optimize import differential_evolution
from unit import report, unit

from drillctrl import (
    FeedbackStructure,
    OperatingPoint,
    design,
    plant_system,
    preset_structure,
    semidiscretize,
)
from drillctrl.synthesis.family import LoopFamily, loop_family


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
        elapsed = [design(point, name, trials=False).elapsed_seconds for point in points]
        report(f"design, {name}, median of {len(points)} points", float(np.median(elapsed)), one)
        point = points[0]
        ours = design(point, name, trials=False)
        family = loop_family(plant_system(point), preset_structure(name))

        def collocated(gains: np.ndarray, family: LoopFamily = family) -> float:
            return family.abscissa(gains)[0]

        def discretised(gains: np.ndarray, family: LoopFamily = family) -> float:
            matrix = semidiscretize(family.loop(gains), 20, 1).matrix()
            return float(np.log(np.abs(np.linalg.eigvals(matrix)).max()))

        best = family.feedback.vector(ours.K1, ours.K2)
        for what, objective in (("own collocation", collocated), ("ρ(D), m = 20", discretised)):
            seconds, gap = evolve(objective, family.feedback, objective(best) + 1e-5)
            ratio = seconds / ours.elapsed_seconds
            text = f"  differential evolution on {what}, gap {gap:.0e}, {ratio:.0f} times ours"
            report(text, seconds, one)


def evolve(
    objective: Callable[[np.ndarray], float], feedback: FeedbackStructure, target: float
) -> tuple[float, float]:
    """Return the seconds until differential evolution reaches a value, and what it lacks."""
    best = [np.inf]

    def remembered(gains: np.ndarray) -> float:
        value = objective(gains)
        best[0] = min(best[0], value)
        return value

    began = time.perf_counter()
    differential_evolution(
        remembered,
        list(zip(feedback.lower, feedback.upper, strict=True)),
        rng=1,
        popsize=20,
        maxiter=200,
        tol=0,
        polish=False,
        callback=lambda *_: best[0] <= target,
    )
    return time.perf_counter() - began, best[0] - target + 1e-5


if __name__ == "__main__":
    main()
