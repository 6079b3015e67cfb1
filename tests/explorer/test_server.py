"""Who is answered by the page's server, and what becomes of those who are not friendly."""

import contextlib
import http.client
import json
import math
import re
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import drillctrl
from drillctrl import InputError, RigPoint, analyze
from tests.explorer.rigs import LUMPED

pytest.importorskip("tornado")

from drillctrl.explorer.rig_text import rig_from_text
from drillctrl.explorer.server import ASSETS, LARGEST, bound

PAGE = Path(drillctrl.__file__).parent / "explorer" / "page"
STATE = {"rig": {"name": "table1", "text": None}, "speed": 120, "rop": 20, "structure": None}


def test_it_prints_its_address_first(server):
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{32,}", server.address)


def test_it_listens_on_loopback_alone(server):
    port = int(server.host.partition(":")[2])
    listening = Path(f"/proc/{server.process.pid}/net/tcp").read_text().split("\n")[1:]
    own = [line.split()[1] for line in listening if f":{port:04X} " in line[:30]]
    assert own == [f"0100007F:{port:04X}"]
    with socket.socket() as other, pytest.raises(OSError, match="refused"):
        other.connect(("127.0.0.2", port))


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/", {}),
        ("/?token=", {}),
        ("/?token=wrong", {}),
        ("/?token=ω", {}),
        ("/explore.js", {}),
        ("/api/start", {}),
        ("/nowhere", {}),
        ("/?token=TOKEN", {"Host": "evil.example"}),
        ("/?token=TOKEN", {"Host": "evil.example:PORT"}),
        ("/?token=TOKEN", {"Host": "127.0.0.1"}),
        ("/?token=TOKEN", {"Origin": "http://evil.example"}),
        ("/?token=TOKEN", {"Origin": "null"}),
    ],
)
def test_whoever_is_not_the_page_is_refused(server, path, headers):
    port = server.host.partition(":")[2]
    path = path.replace("TOKEN", server.token).replace("ω", "%CF%89")
    headers = {name: value.replace("PORT", port) for name, value in headers.items()}
    status, _, text = server.request("GET", path, **headers)
    assert status == 403
    assert server.token not in text
    assert "drillctrl explore printed" in text


def test_a_question_needs_token_kind_and_form(server):
    question = json.dumps({"view": "roots", "state": STATE, "options": {}})
    plain = {"Content_Type": "application/json"}
    assert server.request("POST", "/api/ask", question.encode(), **plain)[0] == 403
    assert server.send(question, Origin="http://evil.example")[0] == 403
    # What a form of another page can send.
    assert server.send(question, Content_Type="text/plain")[0] == 415
    for body in ("", "{", "[]", '"view"', "[" * 100_000, "\x00", "{}"):
        assert server.send(body)[0] == 400
    assert server.request("GET", "/api/ask", X_Token=server.token)[0] == 405


@pytest.mark.parametrize(
    "path", ["/../server.py", "/%2e%2e/server.py", "/page/index.html", "//etc/passwd", "/server.py"]
)
def test_no_other_file_is_sent(server, path):
    status, _, text = server.request("GET", f"{path}?token={server.token}")
    assert status == 404
    assert "import" not in text


def test_every_part_of_the_page_is_sent_and_may_ask_nobody_else(server):
    for name in ("", *ASSETS):
        status, headers, text = server.request("GET", f"/{name}?token={server.token}")
        assert status == 200
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert "Access-Control-Allow-Origin" not in headers
        found = set(re.findall(r"(?:https?:)?//[\w.]+\.\w+[\w/]*", text))
        assert found <= {"http://www.w3.org/2000/svg"}, name
    assert {path.name for path in PAGE.iterdir()} == {"index.html", *ASSETS}


def test_what_is_too_large_is_refused_and_the_next_is_answered(server):
    # It may be closed before all of it was sent.
    with contextlib.suppress(ConnectionResetError, BrokenPipeError):
        assert server.send(" " * (LARGEST + 1))[0] == 400
    long = "#" * 300_000
    found = server.ask("describe", {"rig": {"name": "long.toml", "text": long}})
    assert "at most 200000" in found["error"]
    assert server.ask("describe", STATE)["result"]["lumped"] is True


HOSTILE = [
    {"view": "describe", "state": {"rig": {"name": "/etc/passwd", "text": None}}, "options": {}},
    {"view": "describe", "state": {"rig": {"name": "../a.toml", "text": None}}, "options": {}},
    {"view": "describe", "state": {"rig": "table1"}, "options": {}},
    {"view": "describe", "state": {"rig": {"name": 3}}, "options": {}},
    {"view": "__class__", "state": {}, "options": {}},
    {"view": ["roots"], "state": {}, "options": {}},
    {"view": "roots", "state": [], "options": {}},
    {"view": "roots", "state": {**STATE, "speed": "120 rpm"}, "options": {}},
    {"view": "roots", "state": {**STATE, "speed": 1e308}, "options": {}},
    {"view": "roots", "state": {**STATE, "speed": float("nan")}, "options": {}},
    {"view": "roots", "state": {**STATE, "structure": "soft-torque"}, "options": {}},
    {"view": "roots", "state": {**STATE, "structure": {"name": "p"}}, "options": {}},
    {"view": "roots", "state": {**STATE, "structure": "p"}, "options": {}},
    {"view": "roots", "state": {**STATE, "structure": "p", "K1": [1, 2]}, "options": {}},
    {"view": "roots", "state": {**STATE, "structure": "p", "K1": "1"}, "options": {}},
    {"view": "roots", "state": {"rig": None}, "options": {}},
    {"view": "nyquist", "state": STATE, "options": {}},
    {"view": "reflection", "state": STATE, "options": {}},
    {"view": "chart", "state": STATE, "options": {}},
    {"view": "chart", "state": STATE, "options": {"x": [5, 1], "y": [0, 1]}},
    {"view": "motion", "state": STATE, "options": {"duration": -1, "start": "kick"}},
    {"view": "motion", "state": STATE, "options": {"duration": 1, "start": "__init__"}},
    {"view": "map", "state": STATE, "options": {"x": [1, 2], "y": [1, 2], "counts": [1e9, 2]}},
    {"view": "gains", "state": STATE, "options": {"bounds": []}},
    {"view": "strings", "state": STATE, "options": {"rigs": [None] * 100}},
]


@pytest.mark.parametrize("question", HOSTILE, ids=str)
def test_a_hostile_question_is_answered_in_a_line(server, question):
    status, _, text = server.send(json.dumps(question))
    if status == 400:
        return
    answer = json.loads(text.splitlines()[-1])
    assert status == 200
    assert next(iter(answer)) == "error"
    assert "\n" not in answer["error"]
    assert "could not be computed" not in answer["error"]


def test_a_window_that_goes_away_ends_its_work(server):
    """Both places for long work are taken by maps of hours; a chart is answered all the same."""
    hours = {"x": [30, 240], "y": [1, 50], "counts": [40, 40]}
    question = json.dumps({"view": "map", "state": STATE, "options": hours}).encode()
    for _ in range(2):
        connection = http.client.HTTPConnection(server.host, timeout=60)
        connection.request(
            "POST",
            "/api/ask",
            question,
            {"X-Token": server.token, "Content-Type": "application/json"},
        )
        response = connection.getresponse()
        assert json.loads(response.readline())["words"]
        connection.close()
        response.close()
    began = time.monotonic()
    found = server.ask("chart", STATE, x=[100, 200], y=[10, 30])
    assert "result" in found
    assert time.monotonic() - began < 100


def test_no_window_sees_the_rig_of_another(server):
    mine = "mass = 'secret'"
    assert server.ask("describe", {"rig": {"name": "mine.toml", "text": mine}})["result"]
    found = server.ask("describe", {"rig": {"name": "mine.toml", "text": None}})
    assert "one of table1" in found["error"]
    assert "secret" not in json.dumps(server.ask("describe", STATE))


def test_two_users_with_rigs_of_one_name_get_their_own_answers(server):
    """Both ask at once and again, so that workers and what they remember are shared."""
    rigs = [{"name": "mine.toml", "text": LUMPED.replace("40 t", m)} for m in ("30 t", "60 t")]
    states = [{**STATE, "rig": rig, "units": "si"} for rig in rigs] * 2
    with ThreadPoolExecutor(2) as users:
        heard = list(users.map(lambda state: server.ask("roots", state)["result"], states))
    points = [RigPoint(rig_from_text(rig["text"], "x"), 4 * math.pi, 20 / 3600) for rig in rigs]
    wanted = [analyze(point).spectral_abscissa for point in points]
    assert wanted[0] != pytest.approx(wanted[1], rel=1e-3)
    for k, found in enumerate(heard):
        assert found["data"]["spectral_abscissa"] == pytest.approx(wanted[k % 2], rel=1e-9)


def test_a_port_that_is_taken_is_named(server):
    port = int(server.host.partition(":")[2])
    with pytest.raises(InputError, match=f"port = {port}: must be a free port"):
        bound(port)
