"""Work on many tasks, here or wherever an executor takes it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, as_completed
from typing import TypeVar

from threadpoolctl import threadpool_limits

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
