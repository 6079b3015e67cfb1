"""The page in a real browser: Debian's chromium, driven by playwright; skipped where one lacks."""

import math
import re
import shutil
import time

import pytest

from drillctrl import RigPoint, analyze, simulate, table1
from tests.explorer.rigs import LUMPED

pytest.importorskip("tornado")
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

NAMES = ("chromium", "chromium-browser", "google-chrome")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium is installed")

SOUND = """\
[[sections]]
name = "dp"
type = "drill pipe"
length = "1500 m"
outer_diameter = "5 in"
inner_diameter = "108 mm"

[bit]
diameter = "12 1/4 in"
blades = 6
wearflat_length = "1.2 mm"
cutter_inclination = 0.6
friction_coefficient = 0.6
geometry = 1.0

[rock]
strength = "60 MPa"
contact_strength = "60 MPa"
"""
# A map of hours, so that it is surely still at work when it is cancelled.
HOURS = "40"


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def window(browser, server):
    """Return what opens a window; nothing may be said on its console, nor asked of others."""
    heard, contexts = [], []
    own = server.address.split("?")[0]

    def foreign(url):
        return [] if url.startswith((own, "data:", "blob:")) else [url]

    def opened():
        context = browser.new_context(accept_downloads=True)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(60_000)
        page.on("console", lambda message: heard.append(message.text))
        page.on("pageerror", lambda error: heard.append(str(error)))
        page.on("request", lambda request: heard.extend(foreign(request.url)))
        page.goto(server.address)
        page.wait_for_selector("#panel-chart svg")
        page.wait_for_selector("#panel-motion svg")
        return page

    yield opened
    for context in contexts:
        context.close()
    assert heard == []


@pytest.fixture(scope="module")
def page(window):
    return window()


def sentence(speed, rop):
    """Return what the page has to say of the open loop."""
    found = analyze(RigPoint(table1(), speed * math.pi / 30, rop / 3600))
    rate = found.spectral_abscissa / table1().time_scale
    if rate < 0:
        return f"falls to 2 % in {math.log(50) / -rate:.3g} s."
    return f"doubles every {math.log(2) / rate:.3g} s."


def until(page, condition):
    """Ask until a condition holds; the page's policy lets nothing wait inside of it."""
    ends = time.monotonic() + 60.0
    while not page.evaluate(f"() => {condition}"):
        assert time.monotonic() < ends, condition
        page.wait_for_timeout(50)


def shows(page, panel, text):
    """Wait until a panel's command line has a text."""
    until(page, f"document.querySelector('#panel-{panel} pre').textContent.includes({text!r})")


def settled(page):
    """Wait until no panel is at work."""
    page.wait_for_timeout(200)
    until(page, "!document.querySelector('.panel[aria-busy=true]')")


def type_in(page, selector, value):
    page.fill(selector, value)
    page.dispatch_event(selector, "change")


def says(page, panel, text):
    """Wait until a panel's sentence has a text."""
    until(page, f"document.querySelector('#panel-{panel} .says').textContent.includes({text!r})")


def test_it_opens_at_the_point_of_the_command_line(page):
    assert page.title() == "drillctrl explore"
    assert page.input_value("#speed") == "120"
    assert page.input_value("#rig") == "table1"
    says(page, "roots", sentence(120, 20))
    assert sentence(120, 20) in page.inner_text("#verdict")


def test_the_point_is_dragged_and_everything_follows(page):
    handle = page.locator(".handle")
    box = handle.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 11):
        page.mouse.move(x + 14 * step, y - 3 * step)
    page.mouse.up()
    speed, rop = (float(page.input_value(name)) for name in ("#speed", "#rop"))
    assert speed > 150
    assert rop > 20
    says(page, "roots", sentence(speed, rop))
    assert "Stable" in page.inner_text("#verdict")
    assert f"{speed:.4g} rpm" in handle.get_attribute("aria-valuetext")
    shows(page, "motion", f"{speed:g} rpm")


def test_keys_move_the_point_and_the_sliders(page):
    type_in(page, "#speed", "120")
    type_in(page, "#rop", "20")
    page.focus(".handle")
    for key in ("ArrowRight", "Shift+ArrowRight", "ArrowUp", "ArrowDown", "ArrowDown"):
        page.keyboard.press(key)
    assert page.input_value("#speed") == "131"
    assert page.input_value("#rop") == "19.5"
    page.focus("#speed-range")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Shift+ArrowLeft")
    assert page.input_value("#speed") == "125.5"
    says(page, "roots", sentence(125.5, 19.5))
    # The point stays where the keyboard is, also when the chart is drawn again.
    page.focus(".handle")
    type_in(page, "#rock_strength", "80")
    page.focus(".handle")
    settled(page)
    assert page.evaluate("document.activeElement.classList.contains('handle')")
    type_in(page, "#rock_strength", "60")


def test_the_tabulator_reaches_every_control(page):
    wanted = set(
        page.evaluate("""() => [...document.querySelectorAll(
        'select, input, textarea, button, .handle, summary')].filter(e => !e.disabled &&
        e.checkVisibility()).map(e => e.id || e.getAttribute('aria-label') || e.textContent)""")
    )
    page.evaluate("document.activeElement.blur(); window.scrollTo(0, 0)")
    page.locator("body").click(position={"x": 2, "y": 2})
    reached = set()
    for _ in range(2 * len(wanted) + 10):
        page.keyboard.press("Tab")
        reached.add(
            page.evaluate("""() => { const e = document.activeElement;
            return e.id || e.getAttribute('aria-label') || e.textContent; }""")
        )
        if wanted <= reached:
            break
    assert wanted - reached == set()


def test_a_screen_reader_finds_a_name_for_all_that_has_a_role(page):
    page.select_option("#structure", "pd")
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    settled(page)
    session = page.context.new_cdp_session(page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    roles = {"button", "slider", "spinbutton", "combobox", "textbox", "checkbox", "image",
             "progressbar", "form", "region", "group", "link", "DisclosureTriangle"}  # fmt: skip
    seen = {}
    for node in nodes:
        role = node.get("role", {}).get("value")
        if node.get("ignored") or role not in roles:
            continue
        seen.setdefault(role, []).append(node.get("name", {}).get("value", ""))
    assert seen["slider"].count("") == 0
    # A fieldset is a group and is named by its legend; details need no name.
    nameless = {role: names.count("") for role, names in seen.items() if role != "group"}
    assert set(nameless.values()) == {0}, nameless
    assert {"Rotary speed, rpm", "Rate of penetration, m/h"} <= set(seen["spinbutton"])
    assert any(name.startswith("Operating point") for name in seen["slider"])
    assert len(set(seen["button"])) == len(seen["button"])
    assert page.get_attribute("#verdict", "aria-live") == "polite"
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = false; })")


def test_gains_are_moved_and_found_within_bounds(page):
    type_in(page, "#speed", "120")
    page.select_option("#structure", "p")
    type_in(page, "#gain-K1_1", "-3000")
    shows(page, "roots", "-3000 N*m/rad")
    page.wait_for_selector("#panel-nyquist svg")
    page.click("#search summary")
    type_in(page, "#bound-K1_1-low", "-2000")
    page.focus("#bound-K1_1-high-range")
    page.keyboard.press("ArrowLeft")
    assert float(page.input_value("#bound-K1_1-high")) < 9380
    page.uncheck("#trials")
    page.click("#find")
    page.wait_for_selector("#found:not([hidden])")
    until(page, "document.querySelector('#found').textContent.includes('--bound')")
    assert -2000 <= float(page.input_value("#gain-K1_1")) <= 9380
    settled(page)
    assert "edge without control" in page.text_content("#panel-chart svg")
    page.focus("#gain-K1_1-range")
    page.keyboard.press("ArrowRight")
    page.select_option("#structure", "")
    page.wait_for_selector("#panel-nyquist", state="hidden")


def test_a_search_for_gains_is_cancelled(page):
    """What was set stays; no worker goes on, and the next search finds."""
    page.select_option("#structure", "case2")
    page.locator("#search").evaluate("e => { e.open = true; }")
    type_in(page, "#gain-K1_1", "-1234")
    page.check("#trials")
    page.click("#find")
    page.wait_for_selector("#find-progress:not([hidden])")
    assert page.is_disabled("#find")
    page.focus("#find-cancel")
    page.keyboard.press("Enter")
    until(page, "document.querySelector('#found').textContent === 'Cancelled.'")
    assert page.is_enabled("#find")
    assert page.evaluate("document.activeElement.id") == "find"
    assert page.is_hidden("#find-cancel")
    assert page.is_hidden("#find-progress")
    assert page.input_value("#gain-K1_1") == "-1234"
    page.uncheck("#trials")
    page.select_option("#structure", "p")
    page.click("#find")
    until(page, "document.querySelector('#found').textContent.includes('drillctrl design')")
    page.select_option("#structure", "")


def test_axes_of_the_chart_are_set(page):
    settled(page)
    type_in(page, "#axis-x-0", "60")
    type_in(page, "#axis-x-1", "200")
    type_in(page, "#axis-y-0", "5")
    type_in(page, "#axis-y-1", "40")
    says(page, "chart", "Smooth drilling")
    shows(page, "chart", "speed=60:200 rpm")
    shows(page, "chart", "rop=5:40 m/h")
    type_in(page, "#axis-x-0", "300")
    assert page.input_value("#axis-x-0") == "60"


def test_a_simulation_and_a_map_are_started_and_downloaded(page):
    # The simulator compiles itself once, which may take longer than a page is waited for.
    simulate(RigPoint(table1(), 12.0, 20.0 / 3600.0), duration=1.0)
    page.select_option("#motion-kind", "kick")
    type_in(page, "#motion-duration", "20")
    page.click("#motion-start")
    says(page, "motion", "Swing")
    type_in(page, "#map-across", "2")
    type_in(page, "#map-up", "2")
    page.click("#map-start")
    says(page, "map", "of 4 points")
    for panel in ("chart", "roots", "motion", "map"):
        for kind, begins in (("picture", "<svg"), ("data", "")):
            button = page.locator(f"#panel-{panel} button", has_text=f"Download {kind}")
            with page.expect_download() as saved:
                button.click()
            text = saved.value.path().read_text()
            assert text.startswith(begins)
            assert saved.value.suggested_filename == f"{panel}.{'svg' if begins else 'csv'}"
            assert len(text.splitlines()) > 4 or begins
        words = page.text_content(f"#panel-{panel} pre")
        assert re.match(r"drillctrl (chart|analyze|simulate|map) --rig table1 ", words)


def test_a_map_is_cancelled(page):
    type_in(page, "#map-across", HOURS)
    type_in(page, "#map-up", HOURS)
    page.focus("#map-start")
    page.keyboard.press("Enter")
    page.wait_for_selector("#map-progress:not([hidden])")
    until(page, "document.querySelector('#panel-map .state').textContent.includes(' of 1600')")
    began = time.monotonic()
    page.click("#map-cancel")
    says(page, "map", "Cancelled.")
    assert time.monotonic() - began < 30
    assert page.is_enabled("#map-start")
    assert page.is_hidden("#map-cancel")


def test_a_rig_file_is_opened_or_told_what_is_wrong_line_by_line(page, tmp_path):
    bad = SOUND.replace('"1500 m"', '"1500 s"').replace("blades = 6", "blades = 6.5")
    (tmp_path / "bad.toml").write_text(bad)
    page.set_input_files("#file", tmp_path / "bad.toml")
    page.wait_for_selector("#complaints li")
    items = page.locator("#complaints li").all_inner_texts()
    assert [re.match(r"line (\d+)", item)[1] for item in items] == ["4", "10"]
    assert page.input_value("#rig") == "table1"
    page.click("#complaints button >> nth=1")
    marked = page.evaluate(
        "() => { const t = document.querySelector('#text');"
        " return t.value.slice(t.selectionStart, t.selectionEnd); }"
    )
    assert marked == "blades = 6.5"
    page.fill("#text", "<img src=x onerror=alert(1)>")
    page.click("#read")
    until(page, "document.querySelectorAll('#complaints li').length === 1")
    assert page.locator("#complaints img").count() == 0
    (tmp_path / "mine.toml").write_text(LUMPED)
    page.set_input_files("#file", tmp_path / "mine.toml")
    until(page, "document.querySelector('#rig').value === 'mine.toml'")
    assert page.locator("#complaints li").count() == 0
    shows(page, "roots", "--rig mine.toml")


def test_strings_stand_side_by_side(page):
    for label in page.locator("#panel-strings label.check").all():
        if label.inner_text().strip() in ("vertical-3000", "deep-5000"):
            label.locator("input").check()
    page.click("#strings-start")
    says(page, "strings", "rigs")
    rows = page.locator("#panel-strings tbody tr")
    assert rows.count() >= 3
    assert "2867 m" in page.inner_text("#panel-strings table") or "m" in rows.nth(1).inner_text()
    assert page.locator("#panel-strings svg[role=img]").count() == 1


def test_two_windows_do_not_see_each_others_rigs(page, window):
    assert page.input_value("#rig") == "mine.toml"
    other = window()
    assert other.input_value("#rig") == "table1"
    assert "mine.toml" not in other.content()
    other.fill("#speed", "100")
    page.fill("#speed", "160")
    says(other, "roots", sentence(100, 20))
    settled(page)
    assert page.input_value("#speed") == "160"
    assert other.input_value("#speed") == "100"
    other.select_option("#rig", "")
    other.wait_for_selector("#omega0")
    says(other, "roots", "angular frequency")
    other.fill("#psi", "10")
    other.fill("#delta0", "1")
    shows(other, "roots", "--omega0 10 --delta0 1 --psi 10")


def test_a_driven_string_shows_what_its_drive_returns(page):
    page.select_option("#rig", "vertical-3000")
    page.wait_for_selector("#panel-reflection svg")
    assert "soft-torque" in page.text_content("#panel-reflection svg")
    page.select_option("#structure", "stiff")
    page.focus("#gain-K1_2-range")
    page.keyboard.press("Shift+ArrowRight")
    shows(page, "reflection", "stiff,")
    assert page.is_hidden("#panel-nyquist")
    # What is sketched while the hand moves is certified when it rests.
    type_in(page, "#speed", "110")
    says(page, "roots", "being checked")
    until(page, "!document.querySelector('#verdict').textContent.includes('being checked')")
    shows(page, "roots", "110 rpm")


def test_a_window_changes_its_units_and_stays_where_it_is(window):
    page = window()
    page.select_option("#structure", "pd")
    type_in(page, "#gain-K1_1", "-3000")
    shows(page, "roots", "-3000 N*m/rad")
    settled(page)
    verdict = page.inner_text("#verdict")
    page.select_option("#units", "field")
    shows(page, "roots", "65.6168 ft/h")
    shows(page, "chart", "--units field")
    settled(page)
    assert page.inner_text("#verdict") == verdict
    assert float(page.input_value("#gain-K1_1")) == pytest.approx(-3000 * 0.737562, rel=1e-5)
    assert "rate of penetration [ft/h]" in page.text_content("#panel-chart svg")
    assert "klbf" in page.text_content("#panel-motion .picture")
    labels = page.inner_text("#controls")
    assert "Rate of penetration, ft/h" in labels
    assert "m/h" not in labels.replace("m/h, kN, N·m, MPa", "")
    with page.expect_download() as saved:
        page.locator("#panel-chart button", has_text="Download data").click()
    assert "rop in ft/h" in saved.value.path().read_text().splitlines()[0]
    page.select_option("#units", "si")
    shows(page, "roots", "--rop '20 m/h'")
    assert float(page.input_value("#gain-K1_1")) == pytest.approx(-3000, rel=1e-5)
