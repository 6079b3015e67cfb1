"""Spectral abscissa by other packages, where they are installed, beside ours.

The triple root is the test: the optimum of case1 at point C, where three real roots meet.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from unit import best_time, report, unit

from drillctrl import (
    DelaySystem,
    OperatingPoint,
    close_loop,
    plant_system,
    preset_structure,
    spectral_abscissa,
)


def tdcpy_abscissa(system: DelaySystem) -> float:
    """Return α by tdcpy."""
    import tdcpy

    matrices = np.dstack([system.A0, *system.delayed])
    other = tdcpy.RDDE(matrices, np.array([0.0, *system.delays]))
    return float(tdcpy.spectral_abscissa(other, r=-1.0))


def tdscontrol_abscissa(system: DelaySystem) -> float:
    """Return α by tdscontrol, from the roots right of −1."""
    import tdscontrol

    matrices = [np.asfortranarray(m) for m in (system.A0, *system.delayed)]
    roots = tdscontrol.roots(tdscontrol.tds(matrices, [0.0, *system.delays]), -1.0)
    return max((complex(s).real for s in roots), default=float("nan"))


def qpmr_abscissa(system: DelaySystem) -> float:
    """Return α by qpmr on a region that holds the dominant roots."""
    import qpmr

    a0, a1 = system.A0, system.delayed[0]
    p0, plus, minus = (np.poly(m) for m in (a0, a0 + a1, a0 - a1))
    # det Δ is quadratic in exp(−sτ): two signals are delayed.
    rows = np.array([p0, (plus - minus) / 2, (plus + minus) / 2 - p0])[:, ::-1]
    tau = system.delays[0]
    roots, _ = qpmr.qpmr(rows, np.array([0.0, tau, 2 * tau]), region=(-1.0, 1.0, -0.1, 15.0))
    return max((complex(s).real for s in roots), default=float("nan"))


def main() -> None:
    """Print cost and error of each."""
    one = unit()
    report("dense 44 × 44 eigvals", one, one)
    plant, case1 = plant_system(OperatingPoint(10.0, 1.75, 14.0)), preset_structure("case1")
    loops = {
        "open loop": (plant, 0.00976035806953387),
        "paper's gains": (close_loop(plant, case1, [-5.17], [5.06]), None),
        "triple root": (
            close_loop(plant, case1, [-9.525113872283], [9.2200137104]),
            -0.811927438342,
        ),
    }
    peers: dict[str, Callable[[DelaySystem], float]] = {
        "drillctrl": spectral_abscissa,
        "tdcpy": tdcpy_abscissa,
        "tdscontrol": tdscontrol_abscissa,
        "qpmr": qpmr_abscissa,
    }
    for loop_name, (system, known) in loops.items():
        exact = spectral_abscissa(system) if known is None else known
        for name, compute in peers.items():
            try:
                error = abs(compute(system) - exact)
            except ModuleNotFoundError:
                print(f"{name} is not installed")
                continue
            cost = best_time(lambda f=compute, s=system: f(s))
            report(f"{loop_name}, {name}, error {error:.0e}", cost, one)


if __name__ == "__main__":
    main()
