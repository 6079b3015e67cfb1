"""Where work is done side by side, and how far it has come."""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import TYPE_CHECKING, Any

from drillctrl.base.errors import InputError

if TYPE_CHECKING:
    from drillctrl.base.workers import Progress


@contextlib.contextmanager
def open_executor(workers: int, scheduler: str | None) -> Iterator[Executor | None]:
    """Yield what works side by side: a cluster, processes, or nothing.

    Raises
    ------
    InputError
        If the scheduler does not answer, or workers or scheduler are lost on the way.
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
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _follow_parent)
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
        raise InputError("--workers", workers, wanted) from None
    except BaseException:
        # Nobody waits for what they are at.
        for process in multiprocessing.active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _follow_parent() -> None:
    """Let a process end when the one that started it has ended, however it did."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextlib.contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        import distributed
    except ImportError:
        raise InputError(
            "--scheduler", address, "used with Dask: pip install 'drillctrl[cluster]'"
        ) from None
    # What it logs on the way is what is raised in the end.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        from distributed.comm.addressing import get_address_host_port
        from distributed.comm.core import CommClosedError

        # A client given what is no address tries to close what it has not opened.
        get_address_host_port(address)
        make: Any = distributed.Client
        client = make(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError("--scheduler", address, f"a scheduler that answers ({error})") from None
    executor = client.get_executor(pure=False)
    try:
        yield executor
    except (CancelledError, TimeoutError, CommClosedError):
        wanted = "a scheduler that stays; the same command goes on where this one stopped"
        raise InputError("--scheduler", address, wanted) from None
    finally:
        executor.shutdown(wait=False)
        client.close(timeout=2)


@contextlib.contextmanager
def open_progress() -> Iterator[Progress | None]:
    """Yield what draws progress on a terminal; nothing is drawn into a file."""
    if not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    bars: list[tqdm[Any]] = []

    def show(stage: str, done: int, total: int) -> None:
        if done == 1:
            bars.append(tqdm(total=total, desc=stage, unit="node", file=sys.stderr, leave=False))
        bars[-1].update()
        if done == total:
            bars[-1].close()

    try:
        yield show
    finally:
        for bar in bars:
            bar.close()
