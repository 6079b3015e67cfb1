"""Every option and every file with what people and machines put there by mistake.

Whatever is typed, the answer is a result (status 0 or 3) or one line and status 2: no traceback,
no hang, and no output beside the message. Draws are the same in each run; with
``DRILLCTRL_FUZZ=20000`` in the environment there are so many more, which take about an hour.
"""

import io
import os
import signal

import click
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drillctrl import (
    InputError,
    OperatingPoint,
    analyze,
    cli,
    dimensionless_grid,
    linear_axis,
    load_result,
    load_rig,
    load_table,
    read_tally,
    save_result,
    save_rig,
    save_table,
    string_preset,
    table,
    table1,
)

MORE = int(os.environ.get("DRILLCTRL_FUZZ", "0"))
LONGEST = 120

NUMBERS = [
    "0", "-0", "1", "-1", "2", "0.1", "1e-300", "1e300", "1e308", "-1e308", "5e-324", "1e400",
    "nan", "inf", "-inf", "١", "1_000", "0x10", "1,5", "1e", "--1", "+", "9" * 400, "10**9",
]  # fmt: skip
TEXTS = [
    "", " ", "\t", "\x00", "ω", "🛢", "a", "K1", "=", ":", ",", ",,", "a=b", "K1=:", "K1=1:",
    "K1=nan:inf", "K1=-1:1:1:1", "../..", "/dev/zero", "/dev/stdin", "/", ".", "~", "-", "--json",
    "%s%n", "{0}", "$(id)", "';--", "\\", "x" * 5000, "None", "True", "[]", "(1,2)", "lambda: 1",
]  # fmt: skip
QUANTITIES = [
    "1 rpm", "-1 rpm", "0 rpm", "1e300 rpm", "nan rpm", "20 m/h", "1 m", "1 s", "-5 s", "0 s",
    "5 kN", "5 kN*m", "1 N*m/rad", "1 N*m/rad,2", "60 MPa", "1 parsec", "1 ton", "12 1/4 in",
    "1 1/0 in", "1/0 s", "10**10**10 s", "1 s**999", "1 s s s", "1 (s", "1 s)", "1 %", "1 degC",
]  # fmt: skip
NAMES = [
    "p", "case1", "pd", "case2", "stiff", "soft-torque", "dynamic-2", "dynamic-99", "table1",
    "paper-string", "kick", "all", "none", "drilling", "exact", "omega0=5:9", "omega0=9:5:0",
    "delta0=nan:1", "psi=1:1", "speed=50:180 rpm", "rop=5:50:3 m/h", "t=1,psi=9", "t=1,t=2",
    "dx=1", "dx=1,dx=2", "theta=nan", "1:2:3", "4:24:1000000000", "0:0:0", "1:2:-3", "1:2:1.5",
]  # fmt: skip
# No system passes a zero byte on, nor half a character.
_ANY = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=8)
VALUES = st.sampled_from([*NUMBERS, *TEXTS[:3], *TEXTS[4:], *QUANTITIES, *NAMES]) | _ANY

RIG = ("--rig", "table1", "--speed", "150 rpm", "--rop", "20 m/h")
# Verb → what makes it quick when all else is right.
BASES = {
    ("analyze",): (),
    ("design",): ("--structure", "p", "--trials", "none"),
    ("chart",): ("--x", "omega0=5:9", "--y", "delta0=0:2"),
    ("simulate",): ("--duration", "1"),
    ("table",): ("--omega0", "8:9:2", "--delta0", "1:2:2", "--structure", "p", "--trials", "none"),
    ("rig", "check"): ("table1",),
    ("bit",): RIG,
    ("compare",): ("--structures", "p", "--no-charts", "--trials", "none"),
    ("map",): ("--starts", "kick"),
    ("record",): ("example",),
    ("report",): (*RIG, "--out", "report.html"),
    ("reproduce",): ("fig8",),
    ("explore",): ("--no-browser",),
    ("bench",): ("--duration", "0.1", "--wait", "0.05 s", "--port", "0"),
}
# What takes seconds of work once all is read is not done.
WORK = (
    "motion.swing.drilling_motion",
    "motion.band.bit_band",
    "studies.compare.compare",
    "studies.vibration.vibration_map",
    "studies.rig_report.rig_report",
    "paper.reproduce.reproduce",
    "records.study.study_record",
    "explorer.server.serve",
)


def _options(path):
    command = cli.cli
    for name in path:
        command = command.commands[name]
    flags = [p for p in command.params if isinstance(p, click.Option)]
    return [(p.opts[0], p.is_flag) for p in flags if p.name not in ("help", "workers", "scheduler")]


OPTIONS = {path: _options(path) for path in BASES}


@st.composite
def commands(draw):
    """A verb with one or two of its options, and something after each."""
    path = draw(st.sampled_from(sorted(BASES)))
    base = [*BASES[path]]
    with_rig = ("analyze", "design", "simulate", "compare", "bench")
    if path[0] in with_rig and draw(st.booleans()):
        base = [*(("--duration", "0.5 s") if path == ("simulate",) else base), *RIG]
    added = []
    for _ in range(draw(st.integers(1, 2))):
        option, is_flag = draw(st.sampled_from(OPTIONS[path]))
        added += [option] if is_flag else [option, draw(VALUES)]
    return [*path, *base, *added]


@pytest.fixture
def no_hang():
    def told(*_):
        raise TimeoutError(f"no answer in {LONGEST} s")

    before = signal.signal(signal.SIGALRM, told)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def _left_out(*_, **__):
    raise InputError("work", "all that was typed", "left out here")


def _budget(count):
    return settings(
        max_examples=max(count, MORE),
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
        database=None,
    )


@_budget(150)
@given(arguments=commands())
def test_every_option_is_answered(arguments, capsys, tmp_path, monkeypatch, no_hang):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO())
    for work in WORK:
        monkeypatch.setattr(f"drillctrl.{work}", _left_out)
    signal.alarm(LONGEST)
    with pytest.raises(SystemExit) as stop:
        cli.main(arguments)
    signal.alarm(0)
    out, err = capsys.readouterr()
    assert stop.value.code in (0, 2, 3), (arguments, err)
    assert "Traceback" not in err
    if stop.value.code == 2:
        assert out == "", arguments
        lines = [line for line in err.splitlines() if not line.startswith("drillctrl: note:")]
        lines = [line for line in lines if "compiling the simulator" not in line]
        assert len(lines) == 1, (arguments, err)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Sound files of every kind that is read, and their readers."""
    folder = tmp_path_factory.mktemp("files")
    save_rig(table1(), folder / "rig.toml")
    save_rig(string_preset("paper-string"), folder / "string.toml")
    grid = dimensionless_grid(linear_axis("omega0", 8, 9, 2), linear_axis("delta0", 1, 2, 2))
    gains = table(grid, "p", trials=False)
    made = {"rig.toml": load_rig, "string.toml": load_rig}
    for ending in ("csv", "json", "mat", "nc", "parquet"):
        save_table(gains, folder / f"gains.{ending}")
        made[f"gains.{ending}"] = load_table
    save_result(analyze(OperatingPoint(10.0, 1.75, 14.0)), folder / "result.json")
    made["result.json"] = load_result
    (folder / "tally.csv").write_text(
        "name,type,length [m],outer_diameter [mm],inner_diameter [mm]\n"
        "collar,collar,100,171,71\npipe,drill pipe,1000,127,108\n"
    )
    made["tally.csv"] = read_tally
    return {name: ((folder / name).read_bytes(), reader) for name, reader in made.items()}


@st.composite
def damages(draw):
    """How a file is damaged: cut, a piece doubled, bytes changed, words put in."""
    kind = draw(st.sampled_from(["cut", "double", "bytes", "word"]))
    place, length = draw(st.floats(0.0, 1.0)), draw(st.integers(1, 40))
    word = draw(st.sampled_from([*NUMBERS, *TEXTS, *QUANTITIES, "[", "{" * 2000, "\n", "#", '"']))
    return kind, place, length, word


@_budget(120)
@given(name=st.integers(0, 8), damage=damages())
def test_every_damaged_file_is_answered(files, tmp_path, name, damage, no_hang):
    which = sorted(files)[name % len(files)]
    content, reader = files[which]
    kind, place, length, word = damage
    at = int(place * len(content))
    spoilt = {
        "cut": content[:at],
        "double": content[: at + length] + content[at:],
        "bytes": content[:at] + bytes((b * 7 + length) % 256 for b in content[at : at + length])
        + content[at + length :],
        "word": content[:at] + word.encode("utf-8") + content[at + min(length, 3) :],
    }[kind]  # fmt: skip
    (tmp_path / which).write_bytes(spoilt)
    signal.alarm(LONGEST)
    try:
        reader(tmp_path / which)
    except InputError as error:
        assert "\n" not in str(error)
    signal.alarm(0)
