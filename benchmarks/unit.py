"""The unit of cost: one dense 44 × 44 eigenvalue problem."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np


def best_time(work: Callable[[], object], repeats: int = 5, seconds: float = 0.2) -> float:
    """Return the shortest mean time of a call over a few rounds, in seconds."""
    work()
    began = time.perf_counter()
    work()
    count = max(1, int(seconds / repeats / max(time.perf_counter() - began, 1e-7)))
    rounds = []
    for _ in range(repeats):
        began = time.perf_counter()
        for _ in range(count):
            work()
        rounds.append((time.perf_counter() - began) / count)
    return min(rounds)


def unit() -> float:
    """Return the time of one dense 44 × 44 ``eigvals``, in seconds."""
    matrix = np.random.default_rng(0).normal(size=(44, 44))
    return best_time(lambda: np.linalg.eigvals(matrix))


def report(name: str, seconds: float, one: float) -> None:
    """Print a measurement in microseconds and in units."""
    print(f"{name:58s} {seconds * 1e6:12.1f} µs {seconds / one:10.3f} units")
