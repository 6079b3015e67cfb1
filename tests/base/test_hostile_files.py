"""Devices, pipes and files without end are no rigs; every message is one line."""

import io
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


@pytest.mark.parametrize("encoding", ["cp1252", "cp437", "latin-1", "ascii"])
@pytest.mark.parametrize(
    "arguments",
    [("analyze",), ("analyze", "--omega0", "-1"), ("--help",), ("design", "--help")],
)
def test_nothing_is_lost_in_an_old_encoding(encoding, arguments, monkeypatch):
    from drillctrl import cli

    out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    with pytest.raises(SystemExit):
        cli.main(list(arguments))
    out.flush()
    err.flush()
    text = (out.buffer.getvalue() + err.buffer.getvalue()).decode("utf-8")
    assert "ω0" in text or "omega0" in text or "Usage" in text
    assert "Traceback" not in text


def test_a_redirect_in_an_old_encoding(tmp_path):
    environment = {**os.environ, "PYTHONIOENCODING": "cp1252"}
    done = subprocess.run(
        [sys.executable, "-m", "drillctrl", "analyze"],
        env=environment, capture_output=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0
    assert "ω0 = 10" in done.stdout.decode("utf-8")
