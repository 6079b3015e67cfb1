"""The page of `drillctrl explore` in a real browser: answers to a drag, and hours of clicks.

Needs the extra `explore`, playwright and chromium. `--drags` times drags of the point; otherwise
two windows click at random on all that can be clicked, while memory and errors are told.
"""

from __future__ import annotations

import argparse
import random
import shutil
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, ElementHandle, Error, Page, sync_playwright

from benchmarks.drags import drags
from benchmarks.page_server import Served, served

LUMPED = """\
mass = "40 t"
inertia = "120 kg*m^2"
axial_stiffness = "700 kN/m"
torsional_stiffness = "938 N*m/rad"
axial_damping = "15.6 kN*s/m"
torsional_damping = "32.9 N*m*s/rad"
rock_strength = "{strength} MPa"
contact_strength = "60 MPa"
bit_radius = "108 mm"
wearflat_length = "1.2 mm"
cutter_inclination = 0.6
friction_coefficient = 0.6
bit_geometry = 1.0
submerged_weight = "330 kN"
"""
CONTROLS = "select, input, textarea, button, summary, .handle"
# What is started by hand, and what ends it.
JOBS = {"motion-start": "motion-cancel", "map-start": "map-cancel",
        "strings-start": "strings-cancel", "find": "find-cancel"}  # fmt: skip
# Longer work is cancelled: the machine may have others.
LONGEST_JOB = 8.0


def name_of(control: ElementHandle) -> str:
    """Return what a control is called."""
    return str(control.evaluate(
        "e => e.id || e.getAttribute('aria-label') || e.getAttribute('class') ||"
        " e.textContent.replace(/\\d+/g, 'N').slice(0, 40)"
    ))  # fmt: skip


def drag(page: Page, draw: random.Random) -> None:
    """Drag the point about."""
    handle = page.locator(".handle")
    if not handle.count():
        # No chart is drawn where its axes are refused.
        return
    handle.scroll_into_view_if_needed()
    box = handle.bounding_box()
    if box is None:
        return
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for _ in range(draw.randint(3, 15)):
        x, y = x + draw.uniform(-40, 40), y + draw.uniform(-25, 25)
        page.mouse.move(x, y)
    page.mouse.up()


def press_button(page: Page, control: ElementHandle, name: str, draw: random.Random) -> None:
    """Click; what is started by it ends by itself or is cancelled."""
    if name.startswith("Download"):
        with page.expect_download() as saved:
            control.click()
        assert saved.value.path().stat().st_size > 0, name
        return
    control.click()
    if name in JOBS:
        ends = time.monotonic() + draw.uniform(0.0, LONGEST_JOB)
        while time.monotonic() < ends and page.is_visible(f"#{JOBS[name]}"):
            page.wait_for_timeout(100)
        if page.is_visible(f"#{JOBS[name]}"):
            page.click(f"#{JOBS[name]}")


def use(
    page: Page, control: ElementHandle, name: str, files: list[Path], draw: random.Random
) -> None:
    """Do with a control what a person might."""
    tag, kind = control.evaluate("e => [e.tagName.toLowerCase(), e.type || '']")
    if tag == "select":
        control.select_option(index=draw.randrange(len(control.query_selector_all("option"))))
    elif tag == "textarea":
        control.fill("".join(draw.choice("[]='\"ab1\n") for _ in range(40)))
    elif tag == "button":
        press_button(page, control, name, draw)
    elif kind == "file":
        control.set_input_files(draw.choice(files))
    elif kind == "range" or tag == "g":
        control.focus()
        for _ in range(draw.randint(1, 8)):
            page.keyboard.press(draw.choice(["ArrowLeft", "ArrowRight", "Shift+ArrowRight"]))
    elif kind == "number":
        largest = 4 if name in ("map-across", "map-up") else 200
        control.fill(
            draw.choice(["", "-5", "0", *(str(draw.randint(1, largest)) for _ in range(9))])
        )
        control.dispatch_event("change")
    else:
        control.click()


def act(page: Page, files: list[Path], draw: random.Random, used: Counter[str]) -> None:
    """Do one thing at random."""
    if draw.random() < 0.3:
        used["drag"] += 1
        drag(page, draw)
        return
    found = page.query_selector_all(CONTROLS)
    seen: dict[str, list[ElementHandle]] = {}
    for control in found:
        if control.is_visible() and control.is_enabled():
            seen.setdefault(name_of(control), []).append(control)
    jobs = sorted(seen.keys() & JOBS)
    name = draw.choice(jobs if jobs and draw.random() < 0.15 else sorted(seen))
    used[name] += 1
    try:
        use(page, draw.choice(seen[name]), name, files, draw)
    finally:
        # What is held here would stay in the page's memory.
        for control in found:
            control.dispose()


def opened(browser: Browser, address: str, heard: list[str]) -> Page:
    """Open a window of its own; what its console says is kept."""
    page = browser.new_context(accept_downloads=True).new_page()
    page.set_viewport_size({"width": 1400, "height": 900})
    page.on("console", lambda message: heard.append(message.text))
    page.on("pageerror", lambda error: heard.append(str(error)))
    page.goto(address)
    page.wait_for_selector(".handle", timeout=120_000)
    page.set_default_timeout(10_000)
    return page


def heap(session: Any) -> str:
    """Return the page's heap after its garbage was collected, and its nodes."""
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")["usedSize"] / 1e6
    return f"{used:.1f} MB {session.send('Memory.getDOMCounters')['nodes']} nodes"


def written(folder: Path, window: int) -> list[Path]:
    """Return files that only one window opens: two rigs, and one with faults."""
    texts = {"": LUMPED.format(strength=50 + 20 * window), "-bad": LUMPED.replace("kg*m^2", "kg")}
    for name, text in texts.items():
        (folder / f"rig{window}{name}.toml").write_text(text)
    return [folder / f"rig{window}{name}.toml" for name in texts]


def clicked(browser: Browser, server: Served, seconds: float, pace: float, seed: int) -> list[str]:
    """Click for so long in two windows; return what went wrong."""
    draw, heard, used = random.Random(seed), list[str](), Counter[str]()
    pages = [opened(browser, server.address, heard) for _ in range(2)]
    sessions = [page.context.new_cdp_session(page) for page in pages]
    clicks = missed = 0
    began = told = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        files = [written(Path(folder), window) for window in range(2)]
        while time.monotonic() - began < seconds:
            due = time.monotonic() + draw.uniform(0.0, 2.0 * pace)
            window = clicks % 2
            try:
                act(pages[window], files[window], draw, used)
            except Error as error:
                # What was to be clicked went away, as a button does when its work is done.
                missed += 1
                used[f"({str(error).splitlines()[0]})"] += 1
            clicks += 1
            pages[window].wait_for_timeout(max(1.0, 1e3 * (due - time.monotonic())))
            if time.monotonic() - told > 60.0:
                told = time.monotonic()
                for one, other in ((0, 1), (1, 0)):
                    if f"rig{other}" in pages[one].content():
                        heard.append(f"window {one} shows the rig of window {other}")
                heaps = ", ".join(heap(session) for session in sessions)
                done = f"{(told - began) / 60:.0f} min, {clicks} actions, {missed} missed"
                memory = f"server {server.memory()}; pages {heaps}"
                print(f"{done}: {memory}; {len(heard)} errors", flush=True)
    print("used: " + ", ".join(f"{name} {count}" for name, count in used.most_common()))
    return heard


def main() -> None:
    """Time drags, or click and print every minute."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--drags", action="store_true")
    parser.add_argument("--rigs", default="table1,paper-string,vertical-3000,deep-5000")
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--pace", type=float, default=0.2, help="seconds between two actions")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    with sync_playwright() as driver:
        path = shutil.which("chromium")
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        if given.drags:
            for rig in given.rigs.split(","):
                with served(rig) as server:
                    page = opened(browser, server.address, [])
                    drags(page, server, rig, given.seed)
                    if page.locator("#structure option[value=case2]").count():
                        page.select_option("#structure", "case2")
                        drags(page, server, f"{rig} with case2", given.seed)
            return
        with served("table1") as server:
            heard = clicked(browser, server, given.seconds, given.pace, given.seed)
        for line in sorted(set(heard)):
            print(f"  {line} ({heard.count(line)})")
        print(f"{len(heard)} errors in the windows; the server ended with {server.status} and "
              f"wrote: {server.errors.read_text() or 'nothing'}")  # fmt: skip


if __name__ == "__main__":
    main()
