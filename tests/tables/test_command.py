import csv
import json

import pytest

from drillctrl import cli, load_table


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main([str(a) for a in arguments])
    captured = capsys.readouterr()
    return stop.value.code, captured.out, captured.err


def test_contract(capsys, tmp_path):
    out, plot = tmp_path / "gains.csv", tmp_path / "gains.svg"
    status, text, err = run(
        capsys, "table", "--omega0", "9:11:2", "--delta0", "1:2:2", "--psi", 14,
        "--structure", "case1", "--out", out, "--plot", plot, "--json",
    )  # fmt: skip
    assert (status, err) == (0, "")
    fields = json.loads(text)
    assert fields["nodes"] == fields["stable_nodes"] == 4
    rows = list(csv.reader(line for line in out.read_text().splitlines() if line[0] != "#"))
    assert rows[0][:7] == ["omega0", "delta0", "psi", "K1_1", "K2_1", "spectral_abscissa", "stable"]
    assert [row[:3] for row in rows[1:]] == [
        [a, b, "14.0"] for a in ("9.0", "11.0") for b in ("1.0", "2.0")
    ]
    assert plot.stat().st_size > 0
    assert load_table(out).stable.all()


def test_rig_units_and_unstable_nodes(capsys, tmp_path):
    status, text, _ = run(
        capsys, "table", "--rig", "table1", "--speed", "60:150:2 rpm", "--rop", "20 m/h",
        "--structure", "p", "--require-stable",
    )  # fmt: skip
    assert status == 3
    assert "1 that nothing found stabilises: control off" in text


@pytest.mark.parametrize(
    "arguments",
    [
        ("--omega0", "4:24"),
        ("--omega0", "4:24:x", "--delta0", 1),
        ("--omega0", "4:24:5"),
        ("--omega0", "4:24:5", "--delta0", "1:2:3 m"),
        ("--omega0", "4:24:5", "--delta0", 1, "--rig", "table1"),
        ("--rig", "table1", "--speed", "60:120:3 rpm"),
        ("--rig", "table1", "--speed", "60:120:3 m", "--rop", "20 m/h"),
        ("--omega0", 9, "--delta0", 1, "--out", "gains.pkl"),
        ("--omega0", 9, "--delta0", 1, "--smooth", 100),
        ("--omega0", "1:2:1000000000", "--delta0", 1),
    ],
)
def test_bad_input_is_one_line(capsys, arguments):
    status, out, err = run(capsys, "table", *arguments)
    assert (status, out) == (2, "")
    assert err.startswith("drillctrl: ")
    assert err.count("\n") == 1
