"""Run, as printed, every command and Python block of the README, the guide and the help texts."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import click

ROOT = Path(__file__).parents[1]
BUILT = {"_build", "gallery", "reference"}
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(text: str) -> list[str]:
    """Return the lines that call drillctrl, continuation lines joined."""
    lines = (line.strip() for line in re.sub(r"\\\n\s*", "", text).splitlines())
    return [line for line in lines if line.startswith("drillctrl ")]


def page_jobs(text: str) -> Iterator[tuple[str, str]]:
    """Yield language and content of what a page shows, in the reader's order.

    Later Python blocks of a page may use what earlier ones define, so they run as one, where
    the first stands.
    """
    blocks = BLOCK.findall(text)
    python = "\n".join(content for language, content in blocks if language == "python")
    for language, content in blocks:
        if language == "sh":
            yield from (("sh", command) for command in commands(content))
        elif python:
            yield "python", python
            python = ""


def verbs(group: click.Group, name: str) -> Iterator[tuple[str, click.Command]]:
    """Yield every command below a group, and groups themselves, by the words that call it."""
    for word, verb in sorted(group.commands.items()):
        yield f"{name} {word}", verb
        if isinstance(verb, click.Group):
            yield from verbs(verb, f"{name} {word}")


def sources() -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """Yield each place that shows commands, and what it shows."""
    pages = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("**/*.md")))
    for page in pages:
        if not BUILT & set(page.parts):
            yield str(page.relative_to(ROOT)), list(page_jobs(page.read_text(encoding="utf-8")))
    from drillctrl.cli import cli

    for name, verb in verbs(cli, "drillctrl"):
        examples = commands(verb.help or "")
        if not examples:
            raise SystemExit(f"{name} --help shows no example")
        yield f"{name} --help", [("sh", command) for command in examples]


def look_at_page(job: list[str], folder: str) -> subprocess.CompletedProcess[str]:
    """Start what goes on until it is interrupted, read the page's address, and interrupt it."""
    with subprocess.Popen(
        ["bash", "-c", f"exec {job[2]}"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        assert running.stdout is not None
        address = running.stdout.readline()
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=60)
    status = running.returncode if address.startswith("http://127.0.0.1:") else 1
    return subprocess.CompletedProcess(job, status, address, errors)


def main() -> int:
    """Run everything, each place in an empty folder; return how many failed."""
    failed = 0
    program = shutil.which("drillctrl", path=str(Path(sys.executable).parent)) or "drillctrl"
    seen: set[str] = set()
    for place, jobs in sources():
        with tempfile.TemporaryDirectory() as folder:
            for language, content in jobs:
                if language == "sh":
                    if content in seen:
                        continue
                    seen.add(content)
                    name = content
                    job = ["bash", "-c", content.replace("drillctrl", program, 1)]
                else:
                    name, job = "the Python blocks", [sys.executable, "-c", content]
                began = time.perf_counter()
                if name.startswith("drillctrl explore"):
                    done = look_at_page(job, folder)
                else:
                    done = subprocess.run(
                        job, cwd=folder, capture_output=True, text=True, check=False
                    )
                took = time.perf_counter() - began
                word = "ok" if done.returncode == 0 else f"FAILED ({done.returncode})"
                print(f"{place}: {name}: {word}, {took:.1f} s", flush=True)
                if done.returncode:
                    failed += 1
                    print(done.stderr[-2000:])
    return failed


if __name__ == "__main__":
    sys.exit(min(main(), 1))
