"""The page's server: this machine only, one token, nothing kept of what is asked."""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import importlib.resources
import json
import logging
import secrets
import signal
import socket
from collections.abc import Callable, Mapping
from typing import Any

import tornado.httpserver
import tornado.iostream
import tornado.web

from drillctrl.base.errors import InputError
from drillctrl.explorer.pool import Pool

LARGEST = 1_000_000
# What takes seconds leaves workers to what follows the hand.
_LONG = ("map", "chart", "gains", "strings", "simulate")
# A worker whose question nobody waits for any more may still end by itself.
_GRACE = 0.3
_KINDS = {"html": "text/html", "css": "text/css", "js": "text/javascript"}
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}
ASSETS = ("style.css", "plot.js", "panels.js", "explore.js")


class _Guarded(tornado.web.RequestHandler):
    """A request from this machine's own page, or none."""

    def initialize(
        self, hosts: tuple[str, ...], token: str, pool: Pool, initial: Mapping[str, Any]
    ) -> None:
        """Take who may ask, who answers, and the state that a window begins with."""
        self.hosts, self.token, self.pool, self.initial = hosts, token, pool, initial

    def set_default_headers(self) -> None:
        """Forbid everything that the page does not need."""
        self.clear_header("Server")
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        """Refuse other names of this machine, other pages, and whoever has not the token."""
        origin = self.request.headers.get("Origin")
        if self.request.host not in self.hosts:
            raise tornado.web.HTTPError(403, reason="Another host name")
        if origin is not None and origin not in {f"http://{host}" for host in self.hosts}:
            raise tornado.web.HTTPError(403, reason="Another page")
        given = self.request.headers.get("X-Token") or self.get_query_argument("token", "")
        if not hmac.compare_digest(given.encode(), self.token.encode()):
            raise tornado.web.HTTPError(403, reason="No token")

    def write_error(self, status_code: int, **_: Any) -> None:
        """Say what is wrong in a line, and nothing else."""
        self.set_header("Content-Type", "text/plain; charset=UTF-8")
        hint = ""
        if status_code == 403:
            hint = ": open the address that drillctrl explore printed, with its token"
        self.finish(f"{status_code} {self._reason}{hint}\n")


class _Page(_Guarded):
    """The page and its parts."""

    def get(self, name: str) -> None:
        """Send one of the files of the page."""
        name = name or "index.html"
        if name not in (*ASSETS, "index.html"):
            raise tornado.web.HTTPError(404)
        page = importlib.resources.files("drillctrl.explorer") / "page" / name
        text = page.read_text(encoding="utf-8")
        if name == "index.html":
            text = text.replace("{{token}}", self.token)
        self.set_header("Content-Type", f"{_KINDS[name.rpartition('.')[2]]}; charset=UTF-8")
        self.finish(text)


class _Start(_Guarded):
    """What the window begins with."""

    def get(self) -> None:
        """Send it."""
        self.set_header("Content-Type", "application/json; charset=UTF-8")
        self.finish(json.dumps(self.initial, allow_nan=False))


class _Ask(_Guarded):
    """A question: lines of JSON say how far it is, the last is the answer.

    Whoever goes away ends the work.
    """

    work: asyncio.Task[str] | None = None

    async def post(self) -> None:
        """Answer it."""
        kind = self.request.headers.get("Content-Type", "")
        if kind.partition(";")[0] != "application/json":
            raise tornado.web.HTTPError(415)
        try:
            question = self.request.body.decode("utf-8")
            asked = json.loads(question)
            view, sketch = asked["view"], "rough" in (asked.get("options") or {})
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            raise tornado.web.HTTPError(400, reason="No question") from None
        self.set_header("Content-Type", "application/x-ndjson; charset=UTF-8")
        work = self.pool.ask(question, self._tell, sketch=sketch, long=view in _LONG)
        self.work = asyncio.ensure_future(work)
        try:
            answer = await self.work
        except InputError as error:
            answer = json.dumps({"error": str(error)})
        except asyncio.CancelledError:
            return
        self.write(answer + "\n")
        with contextlib.suppress(tornado.iostream.StreamClosedError):
            await self.finish()

    def _tell(self, done: float, total: float, words: str) -> None:
        if self.work is None or self.work.done():
            return
        self.write(json.dumps({"done": done, "total": total, "words": words}) + "\n")
        # Nobody waits for it: a window that went away is heard of elsewhere.
        future = self.flush()
        future.add_done_callback(lambda sent: sent.exception())

    def on_connection_close(self) -> None:
        """End the work that nobody waits for, if it does not end by itself."""
        if self.work is not None and not self.work.done():
            asyncio.get_running_loop().call_later(_GRACE, self.work.cancel)


def make_app(pool: Pool, port: int, token: str, initial: Mapping[str, Any]) -> Any:
    """Return the application.

    Parameters
    ----------
    pool : Pool
        Who answers.
    port : int
        Where it will listen.
    token : str
        Without it nothing is answered.
    initial : mapping
        The state that a window begins with.
    """
    hosts = (f"127.0.0.1:{port}", f"localhost:{port}")
    guard = {"hosts": hosts, "token": token, "pool": pool, "initial": initial}
    return tornado.web.Application(
        [
            (r"/api/ask", _Ask, guard),
            (r"/api/start", _Start, guard),
            (r"/([\w.]*)", _Page, guard),
        ],
        default_handler_class=_Nothing,
        default_handler_args=guard,
        log_function=lambda handler: None,
    )


class _Nothing(_Guarded):
    """Any other address."""

    def prepare(self) -> None:
        """Look who asks, and then find nothing."""
        super().prepare()
        raise tornado.web.HTTPError(404)


def bound(port: int) -> socket.socket:
    """Return a socket of this machine alone; port 0 is any that is free.

    Raises
    ------
    InputError
        If something else listens there.
    """
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(("127.0.0.1", port))
    except OSError as error:
        listening.close()
        wanted = f"a free port ({error.strerror}); without it one is found"
        raise InputError("port", port, wanted) from None
    listening.listen(128)
    listening.setblocking(False)
    return listening


async def serve(
    listening: socket.socket, initial: Mapping[str, Any], announce: Callable[[str], None]
) -> None:
    """Answer until interrupted.

    Parameters
    ----------
    listening : socket
        As of `bound`.
    initial : mapping
        The state that a window begins with.
    announce : callable
        Called once with the page's address.
    """
    # Tornado tells of each request that it refuses; the browser is told already.
    for name in ("tornado.access", "tornado.general", "tornado.application", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    port, token = listening.getsockname()[1], secrets.token_urlsafe(24)
    pool = Pool()
    server = tornado.httpserver.HTTPServer(
        make_app(pool, port, token, initial),
        max_body_size=LARGEST,
        max_header_size=16_384,
        idle_connection_timeout=600,
        body_timeout=30,
    )
    server.add_sockets([listening])
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    for sign in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
            loop.add_signal_handler(sign, ended.set)
    announce(f"http://127.0.0.1:{port}/?token={token}")
    pool.warm(2)
    try:
        await ended.wait()
    finally:
        server.stop()
        pool.close()
        await server.close_all_connections()
