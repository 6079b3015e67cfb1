"""Devices, pipes and files without end are no rigs; every message is one line."""

import io
import itertools
import os
import subprocess
import sys

import pytest

from drillctrl import InputError, load_rig, load_table
from drillctrl.base.files import check_regular


@pytest.fixture
def strange(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    os.symlink("/dev/zero", tmp_path / "link.toml")
    (tmp_path / "deep.toml").write_text("a = " + 5000 * "[")
    (tmp_path / "long.toml").write_text("# " + 2_000_000 * "x")
    (tmp_path / "folder.toml").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    "name", ["pipe.toml", "link.toml", "deep.toml", "long.toml", "folder.toml", "/dev/zero"]
)
def test_no_rig_is_read_from_it(strange, name):
    with pytest.raises(InputError, match="rig = ") as caught:
        load_rig(strange / name)
    assert "\n" not in str(caught.value)


def test_no_table_is_read_from_a_pipe(strange):
    os.mkfifo(strange / "pipe.json")
    with pytest.raises(InputError, match="not a regular file"):
        load_table(strange / "pipe.json")


def test_a_regular_file_may_have_its_limit(tmp_path):
    (tmp_path / "some").write_bytes(b"12345")
    check_regular(tmp_path / "some", 5)
    with pytest.raises(OSError, match="larger"):
        check_regular(tmp_path / "some", 4)


RIG = ("--rig", "table1", "--speed", "150 rpm", "--rop", "20 m/h")
# Every verb, so that it has something to say with letters that the encodings lack.
VERBS = {
    "analyze": (*RIG, "--structure", "p", "--K1", "-2 kN*m/rad"),
    "design": ("--structure", "p", "--trials", "none"),
    "chart": ("--x", "omega0=5:9", "--y", "delta0=0:2"),
    "map": ("--x", "omega0=8:9:2", "--y", "delta0=1:2:2", "--duration", "1", "--starts", "kick",
            "--workers", "1"),
    "compare": ("--structures", "p", "--no-charts", "--trials", "none", "--duration", "1"),
    "simulate": ("--duration", "2"),
    "bit": RIG,
    "table": ("--omega0", "8:9:2", "--delta0", "1:2:2", "--structure", "p", "--trials", "none",
              "--out", "gains.csv"),
    "reproduce": ("equations",),
    "report": (*RIG, "--structure", "p", "--no-map", "--workers", "1", "--out", "report.html"),
    "rig": ("check", "table1"),
    "record": ("example", "--to", "60 s", "--no-fit"),
}  # fmt: skip
# Verbs that serve until they are stopped; their own tests run them in processes.
SERVING = {"bench", "explore"}


def _told(encoding, arguments, monkeypatch):
    from drillctrl import cli

    out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    with pytest.raises(SystemExit) as stop:
        cli.main(list(arguments))
    out.flush()
    err.flush()
    # A stream is either what it was, or UTF-8 where that lacks letters.
    return stop.value.code, [
        stream.buffer.getvalue().decode(stream.encoding) for stream in (out, err)
    ]


def test_all_verbs_are_there():
    from drillctrl import cli

    assert set(VERBS) | SERVING == set(cli.cli.commands)


# What an encoding lacks does not depend on the verb: each is run in one of them.
@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("verb", "encoding"),
    [*zip(VERBS, itertools.cycle(["cp1252", "cp437", "latin-1"]), strict=False)],
)
def test_no_verb_loses_anything_in_an_old_encoding(verb, encoding, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    status, (out, err) = _told(encoding, (verb, *VERBS[verb]), monkeypatch)
    assert status == 0, err
    assert "Traceback" not in err
    assert not out.isascii()
    assert "\\u" not in out
    assert "?" not in out
    assert _told(encoding, (verb, "--nonsense"), monkeypatch)[0] == 2
    assert _told(encoding, (verb, "--help"), monkeypatch)[0] == 0


@pytest.mark.parametrize("encoding", ["cp1252", "cp437", "latin-1", "ascii"])
@pytest.mark.parametrize("arguments", [("analyze",), ("analyze", "--omega0", "-1"), ("--help",)])
def test_nothing_is_lost_in_an_old_encoding(encoding, arguments, monkeypatch):
    text = "".join(_told(encoding, arguments, monkeypatch)[1])
    assert "ω0" in text or "omega0" in text
    assert "Traceback" not in text


def test_a_redirect_in_an_old_encoding(tmp_path):
    environment = {**os.environ, "PYTHONIOENCODING": "cp1252"}
    done = subprocess.run(
        [sys.executable, "-m", "drillctrl", "analyze"],
        env=environment, capture_output=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0
    assert "ω0 = 10" in done.stdout.decode("utf-8")
