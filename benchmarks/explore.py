"""The page of `drillctrl explore` under random clicks: answers to a drag, and memory.

Needs the extra `explore`, playwright and chromium.
"""

from __future__ import annotations

import argparse
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

from playwright.sync_api import Error, Page, sync_playwright

# Moves the point by the arrow keys, and waits until the roots' sentence is of the new point.
FOLLOWED = """async () => {
    const handle = document.querySelector('.handle'), command = '#panel-roots pre';
    const before = document.querySelector(command).textContent, began = performance.now();
    const key = Math.random() < 0.5 ? 'ArrowRight' : 'ArrowLeft';
    handle.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
    while (document.querySelector(command).textContent === before) {
        if (performance.now() - began > 5000) return null;
        await new Promise(done => setTimeout(done, 2));
    }
    return performance.now() - began;
}"""


def resident(pid: int) -> float:
    """Return the memory of a process and all below it, MB."""
    total, left = 0, [pid]
    while left:
        one = left.pop()
        try:
            for line in Path(f"/proc/{one}/status").read_text().splitlines():
                if line.startswith("VmRSS"):
                    total += int(line.split()[1])
            for task in Path(f"/proc/{one}/task").iterdir():
                left += [int(child) for child in (task / "children").read_text().split()]
        except OSError:
            continue
    return total / 1024.0


def click_somewhere(page: Page, draw: random.Random) -> None:
    """Do one of the things that a person might."""
    kind = draw.choice(
        ["drag"] * 6 + ["slider"] * 4 + ["structure", "rig", "job", "details", "text"]
    )
    if kind == "drag":
        box = page.locator(".handle").bounding_box()
        if box is None:
            return
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        for _ in range(draw.randint(3, 15)):
            x, y = x + draw.uniform(-40, 40), y + draw.uniform(-25, 25)
            page.mouse.move(x, y)
        page.mouse.up()
    elif kind == "slider":
        found = page.locator("#point input[type=range], #gains input[type=range]")
        found.nth(draw.randrange(found.count())).focus()
        for _ in range(draw.randint(1, 8)):
            page.keyboard.press(draw.choice(["ArrowLeft", "ArrowRight", "Shift+ArrowRight"]))
    elif kind == "structure":
        page.select_option("#structure", index=draw.randrange(5))
    elif kind == "rig":
        page.select_option("#rig", draw.choice(["", "table1", "table1", "table1"]))
    elif kind == "details":
        found = page.locator("details summary")
        found.nth(draw.randrange(found.count())).click()
    elif kind == "text":
        page.evaluate("document.querySelector('#paste').open = true")
        page.fill("#text", "".join(draw.choice("[]='\"ab1\n") for _ in range(40)))
        page.click("#read")
    else:
        name = draw.choice(["map", "motion", "strings"])
        if page.is_enabled(f"#{name}-start"):
            page.click(f"#{name}-start")
        page.wait_for_timeout(draw.randint(0, 3000))
        if page.is_visible(f"#{name}-cancel"):
            page.click(f"#{name}-cancel")


def heap(session: Any) -> tuple[float, int]:
    """Return the page's heap after its garbage was collected, MB, and its nodes."""
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")["usedSize"] / 1e6
    return used, session.send("Memory.getDOMCounters")["nodes"]


def main() -> None:
    """Click, and print every half minute."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    draw = random.Random(given.seed)
    command = [sys.executable, "-m", "drillctrl", "explore", "--no-browser", "--rig", "table1"]
    began = time.perf_counter()
    server = subprocess.Popen(
        [*command, "--speed", "120 rpm", "--rop", "20 m/h"], stdout=subprocess.PIPE, text=True
    )
    assert server.stdout is not None
    address = server.stdout.readline().strip()
    print(f"address after {time.perf_counter() - began:.2f} s")
    heard: list[str] = []
    with sync_playwright() as driver:
        path = shutil.which("chromium")
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.on("console", lambda message: heard.append(message.text))
        page.on("pageerror", lambda error: heard.append(str(error)))
        page.goto(address)
        page.wait_for_selector("#panel-motion svg", timeout=120_000)
        print(f"first pictures after {time.perf_counter() - began:.2f} s")
        session = page.context.new_cdp_session(page)
        waits = sorted(w for _ in range(40) if (w := page.evaluate(FOLLOWED)) is not None)
        print(f"a step of the point is answered in {median(waits):.0f} ms, 9 of 10 in "
              f"{waits[int(0.9 * len(waits))]:.0f} ms")  # fmt: skip
        clicks, told = 0, time.monotonic()
        ends = told + given.seconds
        while time.monotonic() < ends:
            try:
                click_somewhere(page, draw)
            except Error as error:
                heard.append(str(error).splitlines()[0])
            clicks += 1
            page.wait_for_timeout(draw.randint(20, 300))
            if time.monotonic() - told > 30.0:
                told = time.monotonic()
                used, nodes = heap(session)
                own = f"server {resident(server.pid):.0f} MB, page {used:.1f} MB, {nodes} nodes"
                print(f"{clicks} clicks: {own}, {len(heard)} errors", flush=True)
        browser.close()
    for line in sorted(set(heard)):
        print(f"  {line} ({heard.count(line)})")
    server.send_signal(signal.SIGINT)
    print(f"ended with {server.wait(60)}")


if __name__ == "__main__":
    main()
