import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from drillctrl import InputError, cli, dimensionless_grid, linear_axis, load_table, table
from drillctrl.base.checkpoint import Checkpoint
from tests.interrupts import hears_interrupts

GRID = dimensionless_grid(linear_axis("omega0", 8, 14, 3), linear_axis("delta0", 1, 6, 3), 14.0)
# Trials are no part of a checkpoint.
QUICK = ["table", "--omega0", "6:22:4", "--delta0", "1:11:3", "--trials", "none", "--out"]
# Many nodes, the first of them soon done.
MANY = ["table", "--omega0", "6:22:17", "--delta0", "1:11:9", "--trials", "none", "--out"]


def same(one, other):
    return (one.gains == other.gains).all() and (
        one.spectral_abscissa == other.spectral_abscissa
    ).all()


@pytest.mark.long
def test_known_designs_are_taken_and_change_nothing(small, tmp_path):
    path = tmp_path / "half.checkpoint"
    first = Checkpoint(path)
    assert same(table(GRID, "case1", trials=False, checkpoint=first), small)
    first.close()
    lines = path.read_bytes().splitlines(keepends=True)
    # What a kill leaves: some lines, and one cut short.
    path.write_bytes(b"".join(lines[:4]) + lines[4][:37])
    seen = []
    second = Checkpoint(path)
    again = table(
        GRID, "case1", trials=False, checkpoint=second, progress=lambda *a: seen.append(a)
    )
    second.close()
    assert same(again, small)
    # The first line is the header.
    assert sum(stage == "design" for stage, _, _ in seen) == len(lines) - 4
    assert path.read_bytes().count(b"\n") == len(lines)
    # Another seed is another task.
    third = Checkpoint(path)
    fresh = []
    table(
        GRID, "case1", trials=False, seed=1, checkpoint=third, progress=lambda *a: fresh.append(a)
    )
    assert sum(stage == "design" for stage, _, _ in fresh) >= 9
    # What is done is taken out; the file goes with the last of it.
    assert third.remove() == len(lines) - 1
    fourth = Checkpoint(path)
    assert same(table(GRID, "case1", trials=False, checkpoint=fourth), small)
    assert fourth.remove() == 0
    assert not path.exists()


def test_rubbish_in_a_checkpoint_is_dropped(tmp_path):
    path = tmp_path / "bad.checkpoint"
    with Checkpoint(path) as checkpoint:
        checkpoint.keep("a", {"b": 1})
    header, line = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(header + line + b'{"task": 1}\nnot json\n')
    with Checkpoint(path) as checkpoint:
        assert checkpoint.find("a") == {"b": 1}
    assert path.read_bytes() == header + line
    # A kill in the first line leaves nothing to know, and what knows nothing leaves no file.
    path.write_bytes(header[:9])
    Checkpoint(path).close()
    assert not path.exists()
    with pytest.raises(InputError, match="checkpoint"):
        Checkpoint(tmp_path / "no" / "folder")


@pytest.mark.parametrize("content", [b"K1,K2\n-3.8,3.6\n", b'{"drillctrl checkpoint": "0.0"}\n'])
def test_a_file_that_is_no_checkpoint_is_refused_and_left_alone(content, tmp_path):
    path = tmp_path / "gains.csv"
    path.write_bytes(content)
    with pytest.raises(InputError, match="a checkpoint of drillctrl"):
        Checkpoint(path)
    assert path.read_bytes() == content


@pytest.mark.long
def test_a_killed_command_goes_on_and_ends_with_the_same_bytes(tmp_path):
    whole, broken = tmp_path / "whole.csv", tmp_path / "broken.csv"
    program = [sys.executable, "-m", "drillctrl", *QUICK]
    subprocess.run([*program, str(whole)], check=True, capture_output=True)
    checkpoint = tmp_path / "broken.csv.checkpoint"
    run = subprocess.Popen([*program, str(broken)], stdout=subprocess.DEVNULL)
    while not checkpoint.exists() or checkpoint.read_bytes().count(b"\n") < 5:
        assert run.poll() is None
        time.sleep(0.02)
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    assert not broken.exists()
    assert checkpoint.exists()
    subprocess.run([*program, str(broken)], check=True, capture_output=True)
    assert broken.read_bytes() == whole.read_bytes()
    assert {path.name for path in tmp_path.iterdir()} == {"whole.csv", "broken.csv"}


@pytest.mark.long
def test_a_cluster_that_loses_a_worker_gives_the_same_table(small, tmp_path):
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with (
        distributed.LocalCluster(
            **options, host="127.0.0.1", local_directory=str(tmp_path)
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        processes = list(client.run(os.getpid).values())
        killed = []

        def kill_once(stage, done, total):
            if done == 2 and not killed:
                killed.append(processes[0])
                os.kill(processes[0], signal.SIGKILL)

        found = table(
            GRID,
            "case1",
            trials=False,
            executor=client.get_executor(pure=False),
            progress=kill_once,
        )
    assert killed
    assert same(found, small)


@pytest.mark.long(but=1)
@pytest.mark.skipif(sys.platform == "win32", reason="no limits on the size of files")
@pytest.mark.parametrize(
    ("room", "refused"), [(10, "checkpoint = "), (200, "checkpoint = "), (2000, "--out = ")]
)
def test_a_disk_without_room_is_one_line_and_leaves_the_old_file(room, refused, tmp_path):
    import resource

    out = tmp_path / "gains.json"
    out.write_text("old")
    # Without bytecode, which would be cut short for all that run later.
    program = [sys.executable, "-B", "-m", "drillctrl", "table", "--omega0", "9:11:2"]
    program += ["--delta0", "1:2:2", "--trials", "none", "--out", str(out)]

    # The system itself refuses to write files on, as on a full disk.
    def little_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    run = subprocess.run(program, capture_output=True, text=True, preexec_fn=little_room)
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.startswith(f"drillctrl: {refused}")
    assert run.stderr.count("\n") == 1
    assert out.read_text() == "old"
    # What was designed before is not lost; where nothing was, nothing is left.
    kept = {"gains.json.checkpoint"} if refused.startswith("--out") else set()
    assert {path.name for path in tmp_path.iterdir()} == {"gains.json"} | kept
    subprocess.run(program, check=True, capture_output=True)
    assert load_table(out).stable.all()
    assert {path.name for path in tmp_path.iterdir()} == {"gains.json"}


@pytest.mark.long(but=1)
@pytest.mark.parametrize("address", ["nowhere", "foo://127.0.0.1:1"])
def test_a_scheduler_that_does_not_answer_is_refused(address, tmp_path):
    options = ["--omega0", "8:14:2", "--delta0", "1:6:2", "--scheduler", address]
    program = [sys.executable, "-m", "drillctrl", "table", *options, "--out", "gains.csv"]
    run = subprocess.run(program, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.startswith(f"drillctrl: --scheduler = {address}")
    assert run.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_controllers_on_the_command_line(capsys, tmp_path):
    base = ["table", "--omega0", "8:14:2", "--delta0", "1:6:2", "--trials", "none"]
    for name in ("gains.c", "gains.st"):
        out = str(tmp_path / name)
        with pytest.raises(SystemExit) as stop:
            cli.main([*base, "--out", out, "--period", "0.01", "--limit", "5"])
        assert stop.value.code == 0
        with pytest.raises(SystemExit) as stop:
            cli.main([*base, "--out", out])
        assert stop.value.code == 2
    beside = {"gains_bench.st", "gains.vectors.csv"}
    assert {p.name for p in tmp_path.iterdir()} == {"gains.c", "gains.h", "gains.st", *beside}
    assert "--period = (missing)" in capsys.readouterr().err


def test_the_result_does_not_depend_on_the_order_of_nodes(small):
    class Backwards:
        def submit(self, work, *arguments):
            from concurrent.futures import Future

            future = Future()
            future.set_result(list(reversed(work(*arguments))))
            return future

    assert same(table(GRID, "case1", trials=False, executor=Backwards()), small)
    assert np.isfinite(small.gains).all()


@pytest.fixture
def two_workers(tmp_path):
    """A command with two processes, and the processes, once both are at work."""
    program = [sys.executable, "-m", "drillctrl", *MANY, "gains.csv", "--workers", "2"]

    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    run = subprocess.Popen(
        program, cwd=tmp_path, start_new_session=True, preexec_fn=hears_interrupts, **pipes
    )
    children = Path(f"/proc/{run.pid}/task/{run.pid}/children")
    checkpoint = tmp_path / "gains.csv.checkpoint"
    while not checkpoint.exists() or checkpoint.read_bytes().count(b"\n") < 3:
        assert run.poll() is None
        time.sleep(0.02)
    # The other child watches over what they share.
    pids = [int(pid) for pid in children.read_text().split()]
    lines = {pid: Path(f"/proc/{pid}/cmdline").read_text() for pid in pids}
    yield run, [pid for pid, line in lines.items() if "spawn_main" in line]
    run.kill()
    run.communicate()


on_linux = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="no /proc")


def gone(pid):
    end = time.monotonic() + 20.0
    while Path(f"/proc/{pid}").exists() and time.monotonic() < end:
        time.sleep(0.05)
    return not Path(f"/proc/{pid}").exists()


@pytest.mark.long
@on_linux
def test_a_worker_that_is_killed_is_one_line(two_workers, tmp_path):
    run, pids = two_workers
    assert len(pids) == 2
    os.kill(pids[0], signal.SIGKILL)
    out, err = run.communicate(timeout=60)
    assert (run.returncode, out) == (2, "")
    assert err.startswith("drillctrl: --workers = 2")
    assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["gains.csv.checkpoint"]


@pytest.mark.long
@on_linux
def test_workers_end_with_the_command_and_an_interrupt_is_one_line(two_workers):
    run, pids = two_workers
    os.killpg(run.pid, signal.SIGINT)
    out, err = run.communicate(timeout=60)
    assert (run.returncode, out, err.strip()) == (130, "", "drillctrl: interrupted")
    assert all(gone(pid) for pid in pids)


@on_linux
def test_workers_end_when_the_command_is_killed(two_workers):
    run, pids = two_workers
    run.kill()
    assert all(gone(pid) for pid in pids)


@pytest.mark.long
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_standard_output_without_room_is_one_line():
    program = [sys.executable, "-m", "drillctrl", "table", "--omega0", "9", "--delta0", "1"]
    program += ["--trials", "none"]
    with open("/dev/full", "w") as full:
        run = subprocess.run(program, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert run.returncode == 2
    assert run.stderr.startswith("drillctrl: standard output = No space left")
    assert run.stderr.count("\n") == 1
