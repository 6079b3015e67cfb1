"""How the command line ends where it is broken off or cannot say what it has found."""

import contextlib
import os
import signal
import subprocess
import sys

import click
import pytest

from drillctrl import cli
from drillctrl.base.files import replacing
from drillctrl.cli import cli as verbs

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="a shell of another kind")
LOADING = """
import runpy, sys

class Broken:
    def find_spec(self, name, path=None, target=None):
        if name == "drillctrl.cli.table":
            raise KeyboardInterrupt

sys.meta_path.insert(0, Broken())
runpy.run_module("drillctrl", run_name="__main__")
"""


def test_an_interrupt_while_it_is_loaded_is_one_line():
    run = subprocess.run([sys.executable, "-c", LOADING], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (130, "", "drillctrl: interrupted\n")


def test_an_interrupt_that_became_another_exception_is_one(monkeypatch, capsys):
    def compiled():
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        raise RuntimeError("no compiled object yet")

    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setitem(verbs.commands, "rig", click.Command("rig", callback=compiled))
    try:
        with pytest.raises(SystemExit) as ended:
            cli.main(["rig"])
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, usual)
    assert ended.value.code == 130
    assert capsys.readouterr().err == "drillctrl: interrupted\n"
    monkeypatch.setitem(verbs.commands, "rig", click.Command("rig", callback=lambda: 1 / 0))
    with pytest.raises(ZeroDivisionError):
        cli.main(["rig"])


@POSIX
@pytest.mark.parametrize(
    ("redirected", "status", "told"),
    [
        (">&-", 2, "drillctrl: standard output = (closed): must be something"),
        (">/dev/full", 2, "drillctrl: standard output = No space left on device: must be"),
        ("--omega0=-1 2>&-", 2, ""),
        ("--omega0=-1 >&- 2>/dev/full", 2, ""),
        ("--help 2>&- >/dev/null", 0, ""),
    ],
)
def test_output_that_cannot_be_written_is_one_line(redirected, status, told):
    command = f"'{sys.executable}' -m drillctrl analyze {redirected}"
    run = subprocess.run(["sh", "-c", command], capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (status, "")
    assert run.stderr.startswith(told)
    assert run.stderr.count("\n") == (1 if told else 0)


def test_a_file_that_cannot_be_written_is_named(tmp_path, monkeypatch, capsys):
    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left") as caught, replacing(tmp_path / "a") as file:
        file.write(b"b")
    assert caught.value.filename == str(tmp_path / "a")
    with pytest.raises(SystemExit) as ended:
        cli.main(["reproduce", "equations", "--out", str(tmp_path)])
    told = capsys.readouterr().err.splitlines()[-1]
    assert ended.value.code == 2
    assert told.startswith(f"drillctrl: {tmp_path}")
    assert "must be a file that can be written (No space left on device)" in told
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write all")
def test_a_file_that_may_not_be_written_is_left(tmp_path):
    kept = tmp_path / "a"
    kept.write_text("old")
    kept.chmod(0o444)
    with pytest.raises(PermissionError), replacing(kept) as file:
        file.write(b"new")
    assert kept.read_text() == "old"
