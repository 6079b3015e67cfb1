"""A page's server in a process of its own, as a user starts it."""

import contextlib
import http.client
import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass

import pytest

from tests.interrupts import hears_interrupts


@dataclass
class Server:
    """A running `drillctrl explore`."""

    address: str
    process: subprocess.Popen

    @property
    def host(self):
        return self.address.split("/")[2]

    @property
    def token(self):
        return self.address.partition("token=")[2]

    def request(self, method, path, body=None, **headers):
        """Return status, headers and text of what is answered."""
        connection = http.client.HTTPConnection(self.host, timeout=120)
        connection.putrequest(method, path, skip_host="Host" in headers)
        if body is not None:
            headers.setdefault("Content-Length", str(len(body)))
        for name, value in headers.items():
            connection.putheader(name.replace("_", "-"), value)
        with contextlib.closing(connection):
            connection.endheaders(body)
            response = connection.getresponse()
            text = response.read().decode()
        return response.status, dict(response.getheaders()), text

    def send(self, question, **headers):
        """Send a question, a text, with all that it needs."""
        given = {"X_Token": self.token, "Content_Type": "application/json", **headers}
        return self.request("POST", "/api/ask", question.encode(), **given)

    def ask(self, view, state, **options):
        """Return the last line that is answered."""
        status, _, text = self.send(json.dumps({"view": view, "state": state, "options": options}))
        assert status == 200, text
        return json.loads(text.splitlines()[-1])


@pytest.fixture(scope="session")
def server():
    command = [sys.executable, "-m", "drillctrl", "explore", "--no-browser", "--rig", "table1"]
    process = subprocess.Popen(
        [*command, "--speed", "120 rpm", "--rop", "20 m/h"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        preexec_fn=hears_interrupts,
    )
    yield Server(process.stdout.readline().strip(), process)
    process.send_signal(signal.SIGINT)
    rest, errors = process.communicate(timeout=60)
    assert (rest, errors, process.returncode) == ("", "", 0)
