"""A server of the page for those who measure it: its address, memory and processor time."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


def _below(pid: int) -> Iterator[int]:
    """Yield a process and all below it that still run."""
    with contextlib.suppress(OSError):
        tasks = list(Path(f"/proc/{pid}/task").iterdir())
        yield pid
        for task in tasks:
            for child in (task / "children").read_text().split():
                yield from _below(int(child))


@dataclass
class Served:
    """A running `drillctrl explore`."""

    address: str
    process: subprocess.Popen[str]
    errors: Path
    status: int | None = None

    def memory(self) -> str:
        """Return the resident memory of the server and, after a plus, of each worker, MB."""
        found = []
        for pid in _below(self.process.pid):
            with contextlib.suppress(OSError):
                for line in Path(f"/proc/{pid}/status").read_text().splitlines():
                    if line.startswith("VmRSS"):
                        found.append(int(line.split()[1]) / 1024.0)
        return f"{found[0]:.0f} + " + " ".join(f"{mb:.0f}" for mb in found[1:]) + " MB"

    def spent(self) -> float:
        """Return the processor time of all that still run, seconds."""
        ticks = 0
        for pid in _below(self.process.pid):
            with contextlib.suppress(OSError):
                fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
                ticks += int(fields[11]) + int(fields[12])
        return ticks / os.sysconf("SC_CLK_TCK")


@contextlib.contextmanager
def served(rig: str) -> Iterator[Served]:
    """Start a page at 120 rpm and 20 m/h, and end it."""
    command = [sys.executable, "-m", "drillctrl", "explore", "--no-browser", "--rig", rig]
    errors = Path(tempfile.mkstemp(prefix="explore-", suffix=".log")[1])
    with errors.open("w") as log:
        process = subprocess.Popen(
            [*command, "--speed", "120 rpm", "--rop", "20 m/h"],
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )
    assert process.stdout is not None
    server = Served(process.stdout.readline().strip(), process, errors)
    try:
        yield server
    finally:
        process.send_signal(signal.SIGINT)
        server.status = process.wait(60)
