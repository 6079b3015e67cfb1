"""How long a drag of the point waits for its pictures."""

from __future__ import annotations

import math
import random
from statistics import median

from playwright.sync_api import Page

from benchmarks.page_server import Served

# Of each move of the pointer its time and the point then; of each picture its time, painted, and
# the point that its command line names.
WATCH = """() => {
    const watched = window.moves !== undefined;
    window.moves = []; window.painted = [];
    if (watched) return;
    const value = name => Number(document.querySelector(name).value);
    document.addEventListener('pointermove', event =>
        window.moves.push([event.timeStamp, value('#speed'), value('#rop')]));
    for (const panel of ['roots', 'nyquist', 'reflection', 'motion']) {
        const own = document.querySelector(`#panel-${panel}`);
        new MutationObserver(() => requestAnimationFrame(() => setTimeout(() => {
            const words = own.querySelector('pre').textContent, now = performance.now();
            const point = words.match(/--speed '(\\S+) .*--rop '(\\S+) /);
            if (point) window.painted.push([panel, now, Number(point[1]), Number(point[2])]);
        }))).observe(own.querySelector('.picture'), { childList: true });
    }
}"""
MOVES, EVERY_MS = 150, 16


def waits(moves: list[list[float]], painted: list[list[float]]) -> list[float]:
    """Return for each move how long its picture, or a later move's, took to be painted, ms."""
    found, last = list[float](), -1
    for at, *point in painted:
        shown = [k for k, (began, *where) in enumerate(moves) if where == point and began <= at]
        if shown:
            found += [at - moves[k][0] for k in range(last + 1, shown[-1] + 1)]
            last = max(last, shown[-1])
    return found


def drags(page: Page, server: Served, words: str, seed: int) -> None:
    """Drag along the chart as a hand does, and print how long the pictures took."""
    draw = random.Random(seed)
    while page.locator(".panel[aria-busy=true]").count():
        page.wait_for_timeout(500)
    page.evaluate(WATCH)
    box = page.locator(".handle").bounding_box()
    assert box is not None
    x, y, turned = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, 0.0
    spent = server.spent()
    page.mouse.move(x, y)
    page.mouse.down()
    for _ in range(MOVES):
        turned += draw.uniform(-0.4, 0.4)
        x, y = x + 2.0 * math.cos(turned), y + math.sin(turned)
        page.mouse.move(x, y)
        page.wait_for_timeout(EVERY_MS)
    page.wait_for_timeout(2000)
    page.mouse.up()
    spent = server.spent() - spent
    moves, painted = page.evaluate("[window.moves, window.painted]")
    print(f"{words}: {len(moves)} moves, {1e3 * spent / len(moves):.0f} ms of processor each")
    for panel in ("roots", "nyquist", "reflection", "motion"):
        shown = [entry[1:] for entry in painted if entry[0] == panel]
        if found := sorted(waits(moves, shown)):
            late = found[int(0.95 * len(found))]
            told = f"median {median(found):.0f} ms, 95 % in {late:.0f} ms"
            print(f"  {panel}: {len(shown)} pictures, of {len(found)} moves; {told}")
