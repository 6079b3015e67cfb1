"""Spectral abscissa by other packages, where they are installed, beside ours.

The drill's triple root is the test of accuracy: the optimum of case1 at point C, where three real
roots meet. The others are tests of size: chains, full matrices, bad units. Each package has its
own process and a limit of time, for some take minutes and gigabytes.
"""

from __future__ import annotations

import json
import math
import resource
import subprocess
import sys
import time
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

# Seconds that a package is given for one system.
LIMIT = 60.0


def tdcpy_abscissa(system: DelaySystem, line: float) -> float:
    """Return α by tdcpy."""
    import tdcpy

    matrices = np.dstack([system.A0, *system.delayed])
    other = tdcpy.RDDE(matrices, np.array([0.0, *system.delays]))
    return float(tdcpy.spectral_abscissa(other, r=line))


def tdscontrol_abscissa(system: DelaySystem, line: float) -> float:
    """Return α by tdscontrol, from the roots right of a line."""
    import tdscontrol

    matrices = [np.asfortranarray(m) for m in (system.A0, *system.delayed)]
    roots = tdscontrol.roots(tdscontrol.tds(matrices, [0.0, *system.delays]), line)
    return max((complex(s).real for s in roots), default=float("nan"))


def qpmr_abscissa(system: DelaySystem, line: float) -> float:
    """Return α of the drill by qpmr on a region that holds the dominant roots."""
    import qpmr

    a0, a1 = system.A0, system.delayed[0]
    p0, plus, minus = (np.poly(m) for m in (a0, a0 + a1, a0 - a1))
    # det Δ is quadratic in exp(−sτ): two signals are delayed.
    rows = np.array([p0, (plus - minus) / 2, (plus + minus) / 2 - p0])[:, ::-1]
    tau = system.delays[0]
    roots, _ = qpmr.qpmr(rows, np.array([0.0, tau, 2 * tau]), region=(line, 1.0, -0.1, 15.0))
    return max((complex(s).real for s in roots), default=float("nan"))


def our_abscissa(system: DelaySystem, line: float) -> float:
    """Return α by ourselves; the line says nothing to us."""
    return spectral_abscissa(system)


PEERS: dict[str, Callable[[DelaySystem, float], float]] = {
    "drillctrl": our_abscissa,
    "tdcpy": tdcpy_abscissa,
    "tdscontrol": tdscontrol_abscissa,
    "qpmr": qpmr_abscissa,
}


def chain(count: int, delay: float) -> DelaySystem:
    """Return masses in a row between springs, the first with late feedback."""
    springs = 2.0 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1)
    rest = np.zeros((count, count))
    a0 = np.block([[rest, np.eye(count)], [-springs, -0.05 * np.eye(count)]])
    a1 = np.zeros_like(a0)
    a1[count, 0], a1[count, count] = 0.3, -0.2
    return DelaySystem(a0, (a1,), (delay,))


def full(count: int, seed: int, share: float, delay: float = 1.0) -> DelaySystem:
    """Return a damped system whose matrices are full of random numbers."""
    rng = np.random.default_rng(seed)
    now = rng.normal(size=(count, count)) - 1.2 * math.sqrt(count) * np.eye(count)
    return DelaySystem(now, (share * rng.normal(size=(count, count)),), (delay,))


def badly_balanced(count: int) -> DelaySystem:
    """Return a system whose states have units 1e12 apart."""
    rng = np.random.default_rng(3)
    scale = 10.0 ** rng.uniform(-6.0, 6.0, count)
    now = rng.normal(size=(count, count)) - 2.0 * np.eye(count)
    late = 0.5 * rng.normal(size=(count, count))
    return DelaySystem(now * scale / scale[:, None], (late * scale / scale[:, None],), (1.0,))


def large(count: int, rank: int, delay: float) -> DelaySystem:
    """Return a system of many states, with a delayed matrix of a rank."""
    rng = np.random.default_rng(4)
    now = rng.normal(size=(count, count)) / math.sqrt(count) - 1.5 * np.eye(count)
    left, right = rng.normal(size=(count, rank)), rng.normal(size=(rank, count))
    return DelaySystem(now, (left @ right / (count * math.sqrt(rank)) * 1.5,), (delay,))


def _drill(K1: float, K2: float) -> DelaySystem:
    plant, case1 = plant_system(OperatingPoint(10.0, 1.75, 14.0)), preset_structure("case1")
    return close_loop(plant, case1, [K1], [K2]) if K1 else plant


# Name → system, α where it is known, and a line left of it for those that need one.
SYSTEMS: dict[str, tuple[Callable[[], DelaySystem], float | None, float]] = {
    "drill, open loop": (lambda: _drill(0.0, 0.0), 0.00976035806953387, -1.0),
    "drill, paper's gains": (lambda: _drill(-5.17, 5.06), None, -1.0),
    "drill, triple root": (lambda: _drill(-9.525113872283, 9.2200137104), -0.811927438342, -1.0),
    "40 masses (80 states)": (lambda: chain(40, 0.5), None, -0.1),
    "20 states, full rank": (lambda: full(20, 0, 0.7), None, -0.6),
    "6 states, badly balanced": (lambda: badly_balanced(6), None, -0.6),
    "3 delays, 8 states": (
        lambda: DelaySystem(
            full(8, 1, 0.0).A0,
            tuple(0.5 * np.random.default_rng(k).normal(size=(8, 8)) for k in (2, 3, 4)),
            (0.3, 0.71, 1.0),
        ),
        None,
        -0.6,
    ),
    "100 states, full rank": (lambda: large(100, 100, 1.0), None, -0.9),
    "200 states, rank 2": (lambda: large(200, 2, 2.0), None, -0.6),
}


def measured(peer: str, name: str) -> dict[str, float]:
    """Return α, seconds and megabytes of one package on one system."""
    make, _, line = SYSTEMS[name]
    system, compute = make(), PEERS[peer]
    began = time.perf_counter()
    alpha = compute(system, line)
    once = time.perf_counter() - began
    # In all, with what the packages themselves take.
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds = once if once > 2.0 else best_time(lambda: compute(system, line))
    return {"alpha": alpha, "seconds": seconds, "megabytes": most / 1e3}


def main() -> None:
    """Print cost, error and memory of each."""
    one = unit()
    report("dense 44 × 44 eigvals", one, one)
    for name, (make, known, _) in SYSTEMS.items():
        exact = spectral_abscissa(make()) if known is None else known
        for peer in PEERS:
            if peer == "qpmr" and not name.startswith("drill"):
                continue
            try:
                done = subprocess.run(
                    [sys.executable, __file__, peer, name],
                    capture_output=True, text=True, timeout=LIMIT, check=False,
                )  # fmt: skip
            except subprocess.TimeoutExpired:
                print(f"{name}, {peer}: more than {LIMIT:g} s")
                continue
            if done.returncode:
                reason = done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "killed"
                print(f"{name}, {peer}: {reason[:80]}")
                continue
            found = json.loads(done.stdout.splitlines()[-1])
            told = f"error {abs(found['alpha'] - exact):.0e}, {found['megabytes']:.0f} MB"
            report(f"{name}, {peer}, {told}", found["seconds"], one)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        print(json.dumps(measured(sys.argv[1], sys.argv[2])))
    else:
        main()
