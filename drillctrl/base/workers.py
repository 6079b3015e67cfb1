"""Work on many tasks: here, in processes or on a cluster."""

from __future__ import annotations

import contextlib
import logging
import math
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from threadpoolctl import threadpool_limits

from drillctrl.base.errors import InputError
from drillctrl.base.extras import required

Task = TypeVar("Task")
Result = TypeVar("Result")
# Name of a stage, tasks done, tasks to do.
Progress = Callable[[str, int, int], None]


def spread_out(
    executor: Executor | None, work: Callable[[Task], Result], tasks: Sequence[Task]
) -> Iterable[Result]:
    """Yield the results of all tasks, in any order; chunks cost less than single tasks.

    Each is worked on by one thread, here and elsewhere: the sums of the linear algebra, and
    with them the last bits of a result, depend on how many there are.
    """
    if executor is None:
        for task in tasks:
            yield from _work_through(work, [task])
        return
    size = max(1, min(16, math.ceil(len(tasks) / 16)))
    chunks = [tasks[i : i + size] for i in range(0, len(tasks), size)]
    futures = [executor.submit(_work_through, work, chunk) for chunk in chunks]
    for future in as_completed(futures):
        yield from future.result()


def _work_through(work: Callable[[Task], Result], tasks: Sequence[Task]) -> list[Result]:
    with threadpool_limits(1, user_api="blas"):
        return [work(task) for task in tasks]


@contextlib.contextmanager
def open_executor(workers: int, scheduler: str | None) -> Iterator[Executor | None]:
    """Yield what works side by side: a cluster, processes, or nothing.

    Parameters
    ----------
    workers : int
        Processes; with 1 the work is done here.
    scheduler : str or None
        Address of a Dask cluster, which has workers of its own.

    Raises
    ------
    InputError
        If Dask is missing, the scheduler does not answer, or either is lost on the way.
    """
    if scheduler is not None:
        with _cluster(scheduler) as executor:
            yield executor
    elif workers == 1:
        yield None
    else:
        with _processes(workers) as executor:
            yield executor


@contextlib.contextmanager
def _processes(workers: int) -> Iterator[Executor]:
    # A forked child would inherit the threads of the linear algebra.
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), follow_parent)
    usual = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        # Each task that finds none idle starts a process, which inherits that an interrupt is
        # not for it.
        for _ in range(workers):
            pool.submit(int)
    finally:
        signal.signal(signal.SIGINT, usual)
    try:
        yield pool
    except BrokenProcessPool:
        wanted = "processes that are not killed; the same command goes on where this one stopped"
        raise InputError("workers", workers, wanted) from None
    except BaseException:
        # Nobody waits for what they are at.
        for process in multiprocessing.active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1


def follow_parent() -> None:
    """Let a process end when the one that started it has ended, however it did."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextlib.contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    distributed = required("distributed", "cluster")
    # What it logs on the way is what is raised in the end.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        from distributed.comm.addressing import get_address_host_port
        from distributed.comm.core import CommClosedError

        # A client given what is no address tries to close what it has not opened.
        get_address_host_port(address)
        client = distributed.Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError("scheduler", address, f"a scheduler that answers ({error})") from None
    executor = client.get_executor(pure=False)
    try:
        yield executor
    except (CancelledError, TimeoutError, CommClosedError):
        wanted = "a scheduler that stays; the same command goes on where this one stopped"
        raise InputError("scheduler", address, wanted) from None
    finally:
        executor.shutdown(wait=False)
        client.close(timeout=2)
