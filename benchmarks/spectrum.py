"""Cost of abscissa, certificate, proof and batch, and agreement of roots and count."""

from __future__ import annotations

import sys
import time

import numpy as np
from unit import best_time, report, unit

from drillctrl import (
    OperatingPoint,
    analyze_loop,
    close_loop,
    count_right_of,
    plant_system,
    preset_structure,
    semidiscretize,
    spectral_abscissa,
    spectral_abscissas,
)
from drillctrl.spectrum.proof import prove_count


def main(points: int) -> None:
    """Print the table; ``points`` random loops are checked against the count."""
    one = unit()
    report("dense 44 × 44 eigvals", one, one)
    centre = OperatingPoint(10.0, 1.75, 14.0)
    plant, case1 = plant_system(centre), preset_structure("case1")
    loop = close_loop(plant, case1, [-5.17], [5.06])
    triple = close_loop(plant, case1, [-9.525113872283], [9.2200137104])
    for name, system in (("open loop", plant), ("case1", loop), ("triple root", triple)):
        alone = best_time(lambda s=system: spectral_abscissa(s))
        counted = best_time(lambda s=system: count_right_of(s, -2.0))
        report(f"abscissa, {name}", alone, one)
        report(f"abscissa and count, {name}", alone + counted, one)
    report("proved count, case1", best_time(lambda: prove_count(loop, -2.0)), one)
    for order, m in ((1, 40), (1, 320), (2, 16)):
        exact = spectral_abscissa(loop)
        scheme = semidiscretize(loop, m, order)
        cost = best_time(lambda m=m, order=order: semidiscretize(loop, m, order).spectral_radius)
        error = abs(scheme.growth_rate - exact)
        report(f"semi-discretisation, order {order}, m = {m}, error {error:.0e}", cost, one)

    rng = np.random.default_rng(0)
    case2 = preset_structure("case2")
    varied = {
        "omega0": rng.uniform(0.3, 25, points),
        "delta0": rng.uniform(0, 15, points),
        "psi": rng.uniform(0.1, 26, points),
    }
    gains = rng.uniform(case2.lower, case2.upper, (points, 4))
    for name, structure, vectors in (("open loop", None, None), ("case2", case2, gains)):
        began = time.perf_counter()
        alpha = spectral_abscissas(centre, varied, structure, vectors, workers=1)
        each = (time.perf_counter() - began) / points
        report(f"batch of {points} on one thread, {name}, each", each, one)
    disagree = 0
    began = time.perf_counter()
    for i in range(points):
        point = centre.with_changes(**{key: float(v[i]) for key, v in varied.items()})
        system = close_loop(plant_system(point), case2, *case2.gains(gains[i]))
        analysis = analyze_loop(system)
        wrong = abs(analysis.spectral_abscissa - alpha[i]) > 1e-9 + analysis.abscissa_error
        if not analysis.certificate.agrees or wrong:
            disagree += 1
            print("disagreement", point, gains[i].tolist(), analysis.certificate)
    seconds = time.perf_counter() - began
    print(f"{points} random loops of case2: {disagree} disagreements, {seconds:.0f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5000)
