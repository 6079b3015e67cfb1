"""Rate of the nodes of a table: one process and two, one Dask worker and two, on this machine."""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor

import numpy as np
from unit import report, unit

from drillctrl import GainTable, dimensionless_grid, linear_axis, table
from drillctrl.tables.grid import Grid

WIDEST = 2


def grid(count: int) -> Grid:
    """Return count² operating points over the range that the paper optimises for."""
    omega0, delta0 = (
        linear_axis("omega0", 6.0, 24.0, count),
        linear_axis("delta0", 0.5, 12.0, count),
    )
    return dimensionless_grid(omega0, delta0, 14.0)


@contextlib.contextmanager
def processes(workers: int) -> Iterator[Executor]:
    """Yield a pool of processes."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context) as pool:
        yield pool


@contextlib.contextmanager
def dask_workers(workers: int) -> Iterator[Executor]:
    """Yield a Dask cluster of single-threaded workers on loopback."""
    import distributed

    with (
        distributed.LocalCluster(
            n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
        client.get_executor(pure=False) as executor,
    ):
        yield executor


def timed(count: int, structure: str, executor: Executor | None) -> tuple[GainTable, float]:
    """Return a table and the time that it took, in seconds."""
    warm = dimensionless_grid(linear_axis("omega0", 8.0, 14.0, 4), 2.0, 14.0)
    # Every worker has then imported what it needs.
    table(warm, structure, executor=executor)
    began = time.perf_counter()
    found = table(grid(count), structure, executor=executor)
    return found, time.perf_counter() - began


def main(count: int, structure: str, dask: bool) -> None:
    """Print rates of ``count``² nodes and how they grow with the workers."""
    one = unit()
    print(f"{count}² nodes of {structure}; load of this machine before: {os.getloadavg()[0]:.2f}")
    report("dense 44 × 44 eigvals", one, one)
    seams = {"processes": processes, "Dask workers": dask_workers}
    first, whole = timed(count, structure, None)
    report("a node in this process", whole / count**2, one)
    for name, make in seams.items():
        if name != "processes" and not dask:
            continue
        times = {}
        for workers in range(1, WIDEST + 1):
            with make(workers) as executor:
                found, times[workers] = timed(count, structure, executor)
            report(f"a node, {name}: {workers}", times[workers] / count**2, one)
            same = np.array_equal(found.gains, first.gains)
            print(f"  {count**2 / times[workers]:.1f} nodes a second; same table: {same}")
        print(f"  {WIDEST} {name} over one: {times[1] / times[WIDEST]:.2f} times the rate")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=16, help="nodes along each axis")
    parser.add_argument("--structure", default="case2")
    parser.add_argument("--no-dask", action="store_true")
    chosen = parser.parse_args()
    main(chosen.count, chosen.structure, not chosen.no_dask)
