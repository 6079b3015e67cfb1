"""The string behind a socket: the motion of the simulator, whatever comes over the line."""

import json
import math
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from drillctrl import (
    Change,
    Controller,
    InputError,
    OperatingPoint,
    RigPoint,
    Scenario,
    answer_bench,
    bench,
    cli,
    dimensionless_grid,
    drive_control,
    linear_axis,
    load_recording,
    replay,
    save_table,
    simulate,
    string_preset,
    table,
    table1,
)
from drillctrl.hardware.client import table_law
from drillctrl.hardware.wire import MAGIC, pack_answer, unpack_sample
from drillctrl.simulation.stepping import SteppedRun
from tests.interrupts import hears_interrupts
from tests.simulation.speed_loop import speed_loop

from ..tables.exported import InC

POINT = OperatingPoint(10.0, 2.5, 14.0)
PERIOD, LIMIT = POINT.delay / 16, 1.0
KICK = {"dx": 1.0, "dtheta": 1.0}


@pytest.fixture(scope="module")
def small():
    axes = linear_axis("omega0", 9, 11, 2), linear_axis("delta0", 2, 3, 2)
    return table(dimensionless_grid(*axes, 14.0), "case1", trials=False)


def answered(law, count=1, **options):
    """A run whose samples are answered from another thread."""
    threads = []

    def listening(address):
        given = {"outputs": count, "patience": 3.0}
        threads.append(threading.Thread(target=answer_bench, args=(address, law), kwargs=given))
        threads[0].start()

    try:
        return bench(listening=listening, **{"where": POINT, **options})
    finally:
        threads[0].join()


def apart(run, other, duration, names):
    at = np.linspace(0.0, duration, 2001)
    first, second = run.at(at, names), other.at(at, names)
    return max(abs(getattr(first, name) - getattr(second, name)).max() for name in names)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("language", ["Python", "C"])
def test_an_exported_controller_on_the_line_is_the_simulators(small, tmp_path, language):
    """A kick that takes the whole limit, and is caught."""
    K1, K2 = small.gains_at(10.0, 2.5, 14.0)
    control = Controller("case1", K1[0], K2[0], period=PERIOD, limit=LIMIT)
    expected = simulate(POINT, control, duration=12.0, initial=KICK)
    options = {"period": PERIOD, "limit": LIMIT, "ramp": 0}
    if language == "Python":
        law = table_law(small, **options)
    else:
        compiled = InC(small, tmp_path, **options)

        def law(sample):
            return [compiled.step(sample.outputs, sample.points, sample.delay)]

    found = answered(
        law, period=PERIOD, duration=12.0, outputs=["theta"], limit=LIMIT, initial=KICK,
        speedup=math.inf,
    )  # fmt: skip
    assert (found.ended, found.recording.missed, found.counts.total) == ("duration", 0, 0)
    assert abs(expected.motion.torque).max() == LIMIT
    assert apart(expected, found.simulation, 12.0, ("x", "dx", "theta", "dtheta")) < 1e-9
    half = (np.arange(len(found.recording)) + 0.5) * PERIOD
    held = found.simulation.at(half[:-1], ("torque",)).torque
    assert abs(held - found.recording.answers[:-1, 0]).max() < 1e-12


def test_the_client_of_the_guide_closes_the_loop_in_a_process_of_its_own(small, tmp_path, capsys):
    page = (Path(__file__).parents[2] / "docs/guide/bench.md").read_text(encoding="utf-8")
    (tmp_path / "client.c").write_text(page.split("```c\n")[1].split("```")[0])
    save_table(small, tmp_path / "gains.csv")
    options = ("--period", "0.05", "--limit", "5")
    gains, out = str(tmp_path / "gains.csv"), str(tmp_path / "run.csv")
    with pytest.raises(SystemExit):
        cli.main(["table", "--from", gains, "--out", str(tmp_path / "gains.c"), *options])
    flags = ("-std=gnu99", "-Wall", "-Wextra", "-Werror", "-O2")
    build = ["gcc", *flags, "client.c", "gains.c", "-o", "client"]
    subprocess.run(build, cwd=tmp_path, check=True)
    started = []

    def listening(address):
        started.append(subprocess.Popen([tmp_path / "client", str(address[1])]))

    asked = {"period": 0.05, "duration": 5.0, "limit": 5.0, "outputs": ["theta"], "initial": KICK}
    found = bench(POINT, speedup=math.inf, listening=listening, **asked)
    assert started[0].wait(10.0) == 0
    assert (found.ended, found.counts.total) == ("duration", 0)
    twin = answered(table_law(small, 0.05, 5.0), speedup=math.inf, **asked)
    assert apart(twin.simulation, found.simulation, 5.0, ("x", "theta")) < 1e-9
    found.recording.save(out)
    assert run(capsys, "--replay", out, "--limit", "5", "--table", gains)[0] == 0


def test_stick_slip_goes_on_from_sample_to_sample_as_in_one_run():
    """Through stick, release and loss of contact, under a torque that nobody asked for."""
    point = RigPoint(table1(), 6.0, 0.008).operating_point()
    stepped = SteppedRun(
        point, ("theta",), ("torque",), period=0.05, duration=30.0, initial={"dtheta": -1.0},
        actuator_lag=0.2, rate_limit=1.5, limit=2.0, measurement_delay=0.02,
    )  # fmt: skip
    gain = -0.5
    while stepped.goes_on:
        stepped.hold(gain * stepped.outputs())
        stepped.advance()
    control = Controller(
        "p", [gain], period=0.05, actuator_lag=0.2, rate_limit=1.5, limit=2.0,
        measurement_delay=0.02,
    )  # fmt: skip
    expected = simulate(point, control, duration=30.0, initial={"dtheta": -1.0})
    assert {event.name for event in expected.events} >= {"stick", "release"}
    assert apart(expected, stepped.result(), 30.0, ("x", "theta")) < 1e-7


def test_a_top_drive_is_turned_by_its_software_in_si():
    rig = string_preset("vertical-3000")
    where, unit = RigPoint(rig, 12.0, 10.0 / 3600.0), rig.time_scale
    control = drive_control("soft-torque", rig)
    proportional, integral = control.speed.numerator
    common = {"duration": 1.0 / unit, "initial": {"dtheta": 1.0}, "rtol": 1e-6}
    found = answered(
        lambda sample: [-integral * sample.outputs[0] - proportional * sample.outputs[1]],
        count=2, where=where, period=0.02 / unit, speedup=math.inf, **common,
    )  # fmt: skip
    expected = simulate(where, speed_loop(where, control, period=0.02), **common)
    assert found.recording.units == "SI"
    assert found.recording.times[-1] == pytest.approx(0.98)
    assert apart(expected, found.simulation, 1.0 / unit, ("theta", "phi", "drive")) < 1e-9


def test_set_points_follow_what_changes_in_the_units_of_the_table():
    where = RigPoint(table1(), 16.0, 20.0 / 3600.0)
    unit = where.rig.time_scale
    seen = []

    def law(sample):
        seen.append((sample.time, *sample.points, sample.delay))
        return [0.0]

    changes = (Change(1.0 / unit, 1.0 / unit, omega0=18.0 * unit), Change(2.2 / unit, psi=10.0))
    scenario = Scenario(changes=changes)
    answered(
        law, count=2, where=where, period=0.1 / unit, duration=2.5 / unit, scenario=scenario,
        speedup=math.inf,
    )  # fmt: skip
    rows = np.array(seen)
    expected = np.interp(rows[:, 0], [1.0, 2.0], [16.0, 18.0])
    assert rows[:, 1] == pytest.approx(expected, rel=1e-6)
    assert rows[:, 2] == pytest.approx(np.full(len(rows), 20.0 / 3600.0), rel=1e-6)
    groups = where.operating_point()
    strength = where.rig.rock_strength * np.where(rows[:, 0] < 2.15, 1.0, 10.0 / groups.psi)
    assert rows[:, 3] == pytest.approx(strength, rel=1e-9)
    assert rows[:, 4] == pytest.approx(2.0 * math.pi / (4.0 * expected), rel=1e-6)


def test_late_answers_are_counted_as_missed_and_the_inputs_before_stand():
    slow = []

    def law(sample):
        if sample.sequence % 5 == 0:
            slow.append(sample.sequence)
            time.sleep(0.1)
        return [float(sample.sequence)]

    found = answered(law, period=0.05, duration=1.0, outputs=["theta"], speedup=1.0)
    answers, came = found.recording.answers[:, 0], found.recording.answered
    assert len(found.recording) == 20
    assert found.recording.missed >= len(slow) >= 2
    assert not came[[k - 1 for k in slow]].any()
    sequence = np.arange(1.0, 21.0)
    assert (answers[came] == sequence[came]).all()
    for k in np.flatnonzero(~came):
        assert answers[k] == (answers[k - 1] if k else 0.0)
    assert found.counts.late >= 2
    told = found.to_dict()
    assert told["missed"] == found.recording.missed
    assert told["jitter"]["max"] >= told["jitter"]["median"] >= 0.0
    # It took as long as the motion.
    assert found.wall_seconds > 0.9
    assert "without an answer in time" in found.summary()


def hostile(address, law):
    """Answer each sample, among all that is not an answer."""
    rng = np.random.default_rng(5)
    bad = (math.nan, math.inf, -math.inf)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        line.settimeout(3.0)
        line.sendto(b"", address)
        line.sendto(MAGIC * 1000, address)
        line.sendto(pack_answer(7, [1.0]), address)
        line.sendto(pack_answer(0, [math.nan]), address)
        while True:
            sample = unpack_sample(line.recv(4096), 1)
            if sample.sequence == 0:
                return
            k = sample.sequence
            line.sendto(rng.bytes(int(rng.integers(0, 60))), address)
            line.sendto(b"dcb1" + pack_answer(k, [9.0])[4:], address)
            line.sendto(pack_answer(k, [bad[k % 3]]), address)
            line.sendto(pack_answer(k + 1, [9.0]), address)
            line.sendto(pack_answer(k - 1, [9.0]), address)
            line.sendto(struct.pack("<4sI2d", MAGIC, k, 9.0, 9.0), address)
            stranger.sendto(pack_answer(k, [9.0]), address)
            line.sendto(pack_answer(k, law(sample)), address)


def test_hostile_datagrams_are_counted_and_change_nothing():
    def law(sample):
        return [-0.5 * sample.outputs[0]]

    threads = []

    def listening(address):
        threads.append(threading.Thread(target=hostile, args=(address, law)))
        threads[0].start()

    options = {"period": 0.1, "duration": 5.0, "outputs": ["theta"], "initial": KICK}
    found = bench(POINT, speedup=math.inf, listening=listening, **options)
    threads[0].join()
    clean = answered(law, speedup=math.inf, **options)
    counts, samples = found.counts, len(found.recording)
    assert samples == 50
    assert (found.recording.answers == clean.recording.answers).all()
    assert apart(clean.simulation, found.simulation, 5.0, ("theta",)) == 0.0
    # Random bytes, another magic, and a number too many; and two before the first sample.
    assert counts.malformed == 3 * samples + 2
    assert counts.not_finite == counts.strangers == counts.repeated == samples
    assert counts.ahead == samples + 1
    assert counts.late == 0


def test_infinite_demands_end_the_run_in_words():
    found = answered(
        lambda sample: [1e300 * (-1.0) ** sample.sequence], period=0.1, duration=5.0,
        outputs=["theta"], speedup=math.inf,
    )  # fmt: skip
    assert found.ended not in ("duration", "no answer")
    json.dumps(found.to_dict(), allow_nan=False)
    found.summary()


def test_a_controller_that_goes_silent_ends_lock_step(tmp_path):
    def listening(address):
        line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        line.sendto(pack_answer(0, [0.0]), address)
        line.close()

    options = {"period": 0.1, "duration": 5.0, "outputs": ["theta"]}
    found = bench(POINT, speedup=math.inf, listening=listening, patience=0.1, **options)
    assert (found.ended, len(found.recording), found.recording.missed) == ("no answer", 1, 1)
    with pytest.raises(InputError, match="none came"):
        bench(POINT, wait=0.05, **options)


def test_a_recording_comes_back_and_replays(tmp_path):
    def law(factor):
        return lambda sample: [-0.5 * sample.outputs[0] * (factor if sample.time > 2.0 else 1.0)]

    options = {"period": 0.1, "duration": 4.0, "outputs": ["theta"], "initial": KICK}
    recorded = answered(law(1.0), speedup=math.inf, **options).recording
    recorded.save(tmp_path / "run.csv")
    back = load_recording(tmp_path / "run.csv")
    for name, value in vars(recorded).items():
        assert np.array_equal(getattr(back, name), value), name

    def replayed(factor):
        def listening(address):
            given = {"outputs": 1}
            threading.Thread(target=answer_bench, args=(address, law(factor)), kwargs=given).start()

        return replay(back, listening=listening)

    same, other = replayed(1.0), replayed(1.01)
    assert same.deviation[0] == 0.0
    late = np.where(recorded.times > 2.0, abs(recorded.answers[:, 0]), 0.0)
    assert other.deviation == (pytest.approx(0.01 * late.max()), int(late.argmax()) + 1)
    text = (tmp_path / "run.csv").read_text()
    for spoilt in ("", "x", text.replace("->", "-"), text.replace("time", "tame"),
                   text.replace("\n0.0,", "\nnan,"), text.replace("\n0.0,", "\n"),
                   text[: text.index("\n0.0")], text.replace("dimensionless", "SI")):  # fmt: skip
        (tmp_path / "bad.csv").write_text(spoilt)
        with pytest.raises(InputError, match="replay"):
            load_recording(tmp_path / "bad.csv")
    for name in ("absent.csv", ".", "\0"):
        with pytest.raises(InputError, match="replay"):
            load_recording(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("period", 0.0), ("duration", math.inf), ("speedup", -1.0), ("speedup", math.nan),
        ("host", "localhost"), ("host", "8.8.8.8"), ("port", 70000), ("wait", 0.0),
        ("outputs", ["depth of despair"]), ("inputs", []), ("inputs", ["torque", "torque"]),
    ],
)  # fmt: skip
def test_what_is_out_of_range_is_named(name, value):
    with pytest.raises(InputError, match="port" if value == "8.8.8.8" else name):
        bench(POINT, **{"period": 0.1, "wait": 0.05, name: value})


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main(["bench", "--port", "0", *arguments])
    return stop.value.code, *capsys.readouterr()


def test_the_command_answers_itself_records_and_replays(small, tmp_path, capsys):
    save_table(small, tmp_path / "gains.csv")
    gains, out = str(tmp_path / "gains.csv"), str(tmp_path / "run.csv")
    asked = ("--delta0", "2.5", "--limit", "5", "--table", gains)
    status, told, err = run(
        capsys, *asked, "--duration", "3", "--speedup", "max", "--out", out, "--json",
    )  # fmt: skip
    assert status == 0
    assert "listening on 127.0.0.1:" in err
    fields = json.loads(told)
    assert (fields["samples"], fields["missed"], fields["ended"]) == (60, 0, "duration")
    status, told, _ = run(capsys, "--replay", out, "--limit", "5", "--table", gains)
    assert status == 0
    assert "every answer is the same" in told
    for bad, option in (
        (("--replay", out, "--delta0", "2"), "--delta0"),
        (("--table", gains), "--limit"),
        (("--limit", "5", "--table", gains, "--outputs", "theta,dtheta"), "--table"),
        (("--speedup", "fast"), "--speedup"),
        (("--out", "run.txt"), "--out"),
        (("--host", "nowhere"), "--host"),
        (("--wait", "20 ms"), "--wait"),
    ):
        status, told, err = run(capsys, *bad)
        assert (status, told) == (2, "")
        assert f"drillctrl: {option} = " in err


@pytest.mark.long
def test_control_c_ends_it_with_a_report():
    """Also while nothing but the clock runs."""
    command = ["bench", "--port", "0", "--json", "--duration", "1e4", "--outputs", "theta"]
    with subprocess.Popen(
        [sys.executable, "-m", "drillctrl", *command],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"}, preexec_fn=hears_interrupts,
    ) as process:  # fmt: skip
        address = ("127.0.0.1", int(process.stderr.readline().rsplit(":", 1)[1].split()[0]))
        seen = threading.Event()

        def law(sample):
            if sample.sequence == 4:
                seen.set()
            return [0.0]

        thread = threading.Thread(target=answer_bench, args=(address, law), kwargs={"outputs": 1})
        thread.start()
        assert seen.wait(60.0)
        process.send_signal(signal.SIGINT)
        told, _ = process.communicate(timeout=60.0)
        thread.join()
    assert process.returncode == 0
    fields = json.loads(told)
    assert fields["ended"] == "interrupted"
    assert fields["samples"] >= 3
