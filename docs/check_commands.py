"""Run every command and every Python block of the README and the guide as printed."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md")))


def blocks(text: str, language: str) -> list[str]:
    """Return the fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def commands(text: str) -> list[str]:
    """Return the lines that call drillctrl, continuation lines joined."""
    joined = "\n".join(blocks(text, "sh")).replace("\\\n", " ")
    return [line for line in joined.splitlines() if line.startswith("drillctrl ")]


def main() -> int:
    """Run everything in an empty folder; return how many failed."""
    failed = 0
    program = shutil.which("drillctrl", path=str(Path(sys.executable).parent)) or "drillctrl"
    for page in PAGES:
        if "_build" in page.parts or "gallery" in page.parts or "reference" in page.parts:
            continue
        text = page.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            jobs = [
                (line, ["bash", "-c", line.replace("drillctrl", program, 1)])
                for line in commands(text)
            ]
            # Later blocks of a page may use what earlier ones define.
            python = "\n".join(blocks(text, "python"))
            if python:
                jobs.append(("the Python blocks", [sys.executable, "-c", python]))
            for name, job in jobs:
                began = time.perf_counter()
                done = subprocess.run(job, cwd=folder, capture_output=True, text=True, check=False)
                took = time.perf_counter() - began
                word = "ok" if done.returncode == 0 else f"FAILED ({done.returncode})"
                print(f"{page.relative_to(ROOT)}: {name}: {word}, {took:.1f} s", flush=True)
                if done.returncode:
                    failed += 1
                    print(done.stderr[-2000:])
    return failed


if __name__ == "__main__":
    sys.exit(min(main(), 1))
