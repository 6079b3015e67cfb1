"""Processes that answer the page's questions: they say how far they are, and can be ended."""

from __future__ import annotations

import asyncio
import contextlib
import io
import multiprocessing
import multiprocessing.connection
import signal
import sys
from collections.abc import Callable
from typing import Any

from drillctrl.base.errors import InputError
from drillctrl.base.workers import follow_parent

# Done, to do, and what is being done.
Tell = Callable[[float, float, str], None]
# Seconds that a process has to clear up.
_GENTLE = 3.0


class _Worker:
    """A process with a pipe to it; it loads the package before the first question comes."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, there = context.Pipe()
        self.process = context.Process(target=_work, args=(there,), name="drillctrl explore")
        self.process.start()
        there.close()

    def ask(self, question: str, tell: Tell) -> str:
        """Send a question and wait; EOFError or OSError where the process ends before."""
        self.connection.send(question)
        while True:
            kind, content = self.connection.recv()
            if kind == "answer":
                return str(content)
            tell(*content)

    def end(self) -> None:
        """End the process, whatever it is at; processes of its own end with it."""
        self.process.terminate()
        self.process.join(_GENTLE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


class Pool:
    """Workers that are started as they are needed, and stay.

    Parameters
    ----------
    most : int
        Workers at once.
    most_long : int
        How many of them may be at work that takes long; the rest are there for the hand.
    waiting : int
        Questions that may wait for one.
    """

    def __init__(self, most: int = 4, most_long: int = 2, waiting: int = 64) -> None:
        self._idle: list[_Worker] = []
        self._all: list[_Worker] = []
        self._places = asyncio.Semaphore(most)
        self._long = asyncio.Semaphore(most_long)
        self._asked, self._waiting = 0, most + waiting
        self._sketching: _Worker | None = None

    @property
    def processes(self) -> list[int]:
        """Their ids, for those who look at memory."""
        return [worker.process.pid or 0 for worker in self._all]

    def warm(self, count: int) -> None:
        """Start workers before anybody asks."""
        for _ in range(count):
            self._idle.append(self._started())

    def _started(self) -> _Worker:
        worker = _Worker()
        self._all.append(worker)
        return worker

    async def ask(self, question: str, tell: Tell, *, sketch: bool, long: bool) -> str:
        """Return the answer; where the caller is cancelled, the work ends with its process.

        Sketches, which follow the hand, go to a worker that has built their rig already.

        Raises
        ------
        InputError
            If too many wait, or the process was ended from outside.
        """
        if self._asked >= self._waiting:
            raise InputError("questions at once", self._asked, f"fewer than {self._waiting}")
        self._asked += 1
        try:
            async with contextlib.AsyncExitStack() as held:
                if long:
                    await held.enter_async_context(self._long)
                await held.enter_async_context(self._places)
                return await self._answer(self._taken(sketch), question, tell)
        finally:
            self._asked -= 1

    def _taken(self, sketch: bool) -> _Worker:
        if not self._idle:
            self._idle.append(self._started())
        wanted = [one for one in self._idle if (one is self._sketching) == sketch]
        chosen = (wanted or self._idle)[-1]
        self._idle.remove(chosen)
        if sketch:
            self._sketching = chosen
        return chosen

    async def _answer(self, worker: _Worker, question: str, tell: Tell) -> str:
        loop = asyncio.get_running_loop()

        def told(*what: Any) -> None:
            loop.call_soon_threadsafe(tell, *what)

        try:
            answer = await asyncio.to_thread(worker.ask, question, told)
        except BaseException as error:
            self._all.remove(worker)
            await asyncio.to_thread(worker.end)
            if isinstance(error, EOFError | OSError):
                wanted = "left to work; it was ended, perhaps for want of memory"
                raise InputError("process", "ended", wanted) from None
            raise
        self._idle.append(worker)
        return answer

    def close(self) -> None:
        """End all workers."""
        for worker in self._all:
            worker.process.terminate()
        for worker in self._all:
            worker.end()
        self._all.clear()
        self._idle.clear()


def _work(connection: multiprocessing.connection.Connection) -> None:
    """Answer questions until nobody is left to ask."""
    # An interrupt is for the page's server, which then ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Those that work for a map end with it only if it may clear up.
    signal.signal(signal.SIGTERM, _end)
    follow_parent()
    from drillctrl.explorer.answers import answer

    # Whoever started this process ends it; where that went away first, nobody is left to tell.
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            question = connection.recv()
            found = answer(question, lambda *told: connection.send(("told", told)))
            connection.send(("answer", found))
    signal.signal(signal.SIGTERM, signal.SIG_IGN)


def _end(*_: object) -> None:
    """End this process once: who clears up already is not ended again."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    # Libraries may take the exit for an error of their own, of which nobody need hear.
    sys.stderr = io.StringIO()
    sys.exit(1)
