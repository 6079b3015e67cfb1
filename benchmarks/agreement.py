"""Roots and count of random delay systems: they agree, or one of them is refused.

A system has 1 to 8 states and 1 to 6 delays, of any rank, well or badly scaled, and its bound
times its largest delay is up to 1e3, for one in 200 up to 1e5 (they take up to minutes). For
each one the rightmost root is found, and the argument principle counts the roots right of lines
on either side of it; then the roots right of a line further left are listed and counted. What
is no refusal and no agreement is printed with its seed: it is a defect.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter

import numpy as np

from drillctrl import (
    DelaySystem,
    InputError,
    characteristic_roots,
    count_right_of,
    dominant_roots,
    spectral_abscissa,
)
from drillctrl.spectrum.characteristic import magnitude_bound

KINDS = ("agrees", "refused", "silent")


def random_system(seed: int) -> DelaySystem:
    """Return the system of a seed."""
    rng = np.random.default_rng(seed)
    n, many = int(rng.integers(1, 9)), int(rng.integers(1, 7))
    matrices = []
    for _ in range(many + 1):
        rank = int(rng.integers(1, n + 1)) if rng.random() < 0.5 else n
        left, right = rng.normal(size=(n, rank)), rng.normal(size=(rank, n))
        matrices.append(left @ right / np.sqrt(n * rank) * 10.0 ** rng.uniform(-2.0, 0.5))
    if rng.random() < 0.7:
        # Most systems that people have are damped.
        matrices[0] = matrices[0] - rng.uniform(0.0, 3.0) * np.eye(n)
    if rng.random() < 0.3:
        # Whole numbers make multiple roots, zeros and defective matrices.
        matrices = [np.rint(2.0 * matrix) for matrix in matrices]
    if rng.random() < 0.4:
        scale = 10.0 ** rng.uniform(-6.0, 6.0, n)
        matrices = [matrix * scale / scale[:, None] for matrix in matrices]
    delays = np.sort(rng.uniform(0.0, 1.0, many)) if rng.random() < 0.8 else np.arange(many) + 1.0
    delays = delays / delays.max()
    system = DelaySystem(matrices[0], tuple(matrices[1:]), tuple(delays))
    # The product bound · τ is as drawn, in any unit of time.
    size = rng.choice(3, p=[0.94, 0.055, 0.005])
    product = 10.0 ** rng.uniform(*((-2.0, 2.0), (2.0, 3.0), (3.0, 5.0))[size])
    longest = product / max(magnitude_bound(system.balanced, 0.0), 1e-6)
    system = DelaySystem(matrices[0], tuple(matrices[1:]), tuple(delays * longest))
    return system.scaled_time(10.0 ** rng.uniform(-6.0, 6.0))


def turns(system: DelaySystem) -> float:
    """Return bound · τ: how far s τ of roots right of the axis may lie from 0."""
    return magnitude_bound(system.balanced, 0.0) * system.max_delay


def verdict(system: DelaySystem, further: float) -> tuple[str, str]:
    """Return one of `KINDS` and what was seen.

    Parameters
    ----------
    system : DelaySystem
        Any.
    further : float
        How far left of the rightmost root the second line lies, in units of 1/τ.
    """
    try:
        alpha = spectral_abscissa(system)
        roots = dominant_roots(system)
    except InputError as error:
        return "refused", f"abscissa: {error}"
    top = roots[0]
    scale = abs(top.value) + 1.0 / system.max_delay
    # A root that may lie anywhere by its condition is looked for nearby all the same.
    error = 10.0 * max(root.error + root.spread for root in roots[:3])
    room = 1e-6 * scale + min(error, 0.1 * scale)
    if not abs(alpha - top.rightmost) <= room:
        return "silent", f"abscissa {alpha!r}, first root {top.rightmost!r}"
    right = count_right_of(system, alpha + room).count
    left = count_right_of(system, alpha - room).count
    if right is None or left is None:
        return "refused", "the count beside the rightmost root"
    # Of roots that are told apart only by a circle the line may leave out all but one.
    together = top.multiplicity if top.rightmost == top.real else 1
    if right != 0 or left < together * (2 if top.imag > 0 else 1):
        return "silent", f"α = {alpha!r}: {right} right of it, {left} with it"
    line = alpha - further / system.max_delay
    try:
        listed = characteristic_roots(system, line)
    except InputError as error:
        return "agrees", f"list refused: {error}"
    counted = count_right_of(system, line).count
    total = sum(root.multiplicity * (2 if root.imag > 0 else 1) for root in listed)
    off = [root for root in listed if not (root.converged and root.residual < 1e-6)]
    if counted is None or (counted == total and not off):
        return "agrees", ""
    return "silent", f"line {line!r}: {total} listed, {counted} counted, {len(off)} no roots"


def main(first: int, count: int, seconds: float, shortest: float, longest: float) -> int:
    """Try systems of seeds from ``first`` on; return how many were silently wrong.

    Those whose bound · τ is not between ``shortest`` and ``longest`` are passed over.
    """
    began = time.perf_counter()
    seen: Counter[str] = Counter()
    slowest = (0.0, first)
    for seed in range(first, first + count):
        start = time.perf_counter()
        system = random_system(seed)
        if not shortest <= turns(system) <= longest:
            continue
        try:
            kind, told = verdict(system, 1.0)
        except KeyboardInterrupt:
            break
        except Exception as error:
            kind, told = "silent", f"{type(error).__name__}: {error}"
        slowest = max(slowest, (time.perf_counter() - start, seed))
        seen[kind] += 1
        if kind != "agrees":
            print(f"{kind}: seed {seed}: {told}", flush=True)
        if time.perf_counter() - began > seconds:
            break
    print(f"seeds {first} to {seed}: " + ", ".join(f"{seen[kind]} {kind}" for kind in KINDS))
    print(f"{time.perf_counter() - began:.0f} s; slowest {slowest[0]:.1f} s, seed {slowest[1]}")
    return seen["silent"]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="seed of the first system")
    parser.add_argument("--count", type=int, default=100_000, help="how many systems")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--shortest", type=float, default=0.0, help="pass over smaller bound · τ")
    parser.add_argument("--longest", type=float, default=1e5, help="pass over larger bound · τ")
    given = parser.parse_args()
    raise SystemExit(1 if main(**vars(given)) else 0)
