"""Where work is done side by side, and how far it has come."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from typing import TYPE_CHECKING, Any

from drillctrl.errors import InputError

if TYPE_CHECKING:
    from drillctrl.spreading import Progress


@contextlib.contextmanager
def open_executor(workers: int, scheduler: str | None) -> Iterator[Executor | None]:
    """Yield what works side by side: a cluster, processes, or nothing."""
    if scheduler is not None:
        with _cluster(scheduler) as executor:
            yield executor
    elif workers == 1:
        yield None
    else:
        import multiprocessing

        # A forked child would inherit the threads of the linear algebra.
        with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
            yield pool


@contextlib.contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        import distributed
    except ImportError:
        raise InputError(
            "--scheduler", address, "used with Dask: pip install 'drillctrl[cluster]'"
        ) from None
    try:
        from distributed.comm.addressing import get_address_host_port

        # A client given what is no address tries to close what it has not opened.
        get_address_host_port(address)
        make: Any = distributed.Client
        client = make(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError("--scheduler", address, f"a scheduler that answers ({error})") from None
    with client, client.get_executor(pure=False) as executor:
        yield executor


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
