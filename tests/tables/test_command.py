import csv
import json
import zipfile

import pytest

from drillctrl import cli, load_table


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main([str(a) for a in arguments])
    captured = capsys.readouterr()
    return stop.value.code, captured.out, captured.err


@pytest.mark.long
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


NODES = ("--omega0", "9:11:2", "--delta0", "1:2:2", "--trials", "none")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--out", "my-gains.c", "--period", 1, "--limit", 3), "--out = my-gains"),
        (("--out", "ramp.st", "--period", 1, "--limit", 3), "--out = ramp"),
        (("--out", "g.c", "--period", 1), "--limit = (missing)"),
        (("--out", "g.c", "--period", -1, "--limit", 3), "--period = -1.0"),
        (("--out", "g.c", "--period", 1e-9, "--limit", 3), "--period = 1e-09"),
        (("--out", "g.c", "--period", 1, "--limit", 3, "--real", "half"), "--real = half"),
        (("--out", "g.st", "--period", 1, "--limit", 3, "--real", "float"), "--real = float"),
        (("--out", "g.st", "--period", 1, "--limit", 3, "--ramp", -1), "--ramp = -1"),
        (("--out", "g.csv", "--period", 1), "--period = 1.0"),
        (("--out", "g.c", "--period", 1, "--limit", 3, "--fmi", "3.0"), "--fmi = 3.0"),
        (("--out", "g.fmu", "--period", 1, "--limit", 3, "--fmi", "1.0"), "--fmi = 1.0"),
        (("--out", "g.c", "--period", 1, "--limit", 3, "--outside", "full"), "--outside = full"),
        (("--out", "g.csv", "--rate-limit", 3), "--rate-limit = 3.0"),
        (("--out", "taken.csv"), "--out = taken.csv: must be a file, not a folder"),
        (("--out", "mine.c", "--period", 1, "--limit", 3), "mine.h moved"),
        (("--workers", 2, "--scheduler", "tcp://127.0.0.1:1"), "--workers = 2"),
        (("--objective", "worst-case", "--smooth", 3), "--smooth = 3.0"),
        (("--fallback", "hope"), "--fallback = hope"),
        (("--refine", 9), "--refine = 9"),
    ],
)
def test_what_cannot_be_done_is_refused_before_the_design(
    capsys, tmp_path, monkeypatch, arguments, said
):
    def design(*_, **__):
        raise AssertionError("designed")

    monkeypatch.setattr("drillctrl.tables.table.design_grid", design)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken.csv").mkdir()
    (tmp_path / "mine.h").write_text("/* mine */")
    status, out, err = run(capsys, "table", *NODES, *arguments)
    assert (status, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert {path.name for path in tmp_path.iterdir()} == {"taken.csv", "mine.h"}


@pytest.mark.long
def test_a_saved_table_is_drawn_and_exported(capsys, tmp_path):
    saved, again = tmp_path / "gains.json", tmp_path / "again.json"
    _, said, _ = run(capsys, "table", *NODES, "--refine", 1, "--out", saved)
    status, text, err = run(
        capsys, "table", "--from", saved, "--out", again, "--plot", tmp_path / "gains.png"
    )
    assert (status, text, err) == (0, said, "")
    assert again.read_bytes() == saved.read_bytes()
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    direct, later = (
        ["--out", tmp_path / n / "gains.st", "--period", 0.01, "--limit", 5] for n in "ab"
    )
    run(capsys, "table", *NODES, *direct, "--ramp", 7)
    run(capsys, "table", "--from", saved, *later, "--ramp", 7)
    assert (tmp_path / "a/gains.st").read_bytes() == (tmp_path / "b/gains.st").read_bytes()
    status, _, err = run(capsys, "table", "--from", saved, "--structure", "pd")
    assert (status, err.split(":")[1]) == (2, " --structure = pd")
    status, _, err = run(capsys, "table", "--from", tmp_path / "none.csv")
    assert (status, err.count("\n")) == (2, 1)
    assert "--from = " in err


def test_options_of_the_arithmetic_and_the_ramp_reach_the_controller(capsys, tmp_path):
    out = tmp_path / "g.c"
    options = ("--period", 0.01, "--limit", 5, "--real", "float", "--ramp", 12)
    assert run(capsys, "table", *NODES, "--out", out, *options)[0] == 0
    assert "typedef float g_real" in (tmp_path / "g.h").read_text()
    assert "#define RAMP 12\n" in out.read_text()


@pytest.mark.parametrize("ending", [".xml", ".scl"])
def test_dialects_are_chosen_by_the_ending(capsys, tmp_path, ending):
    out = tmp_path / f"gains{ending}"
    assert run(capsys, "table", *NODES, "--out", out, "--period", 0.01, "--limit", 5)[0] == 0
    text = out.read_text()
    assert ("tc6_0201" in text) == (ending == ".xml")
    assert ('FUNCTION_BLOCK "gains"' in text) == (ending == ".scl")
    assert {path.name for path in tmp_path.iterdir()} == {out.name, "gains.vectors.csv"}


def test_a_unit_for_co_simulation_and_what_it_does_beside_its_law(capsys, tmp_path):
    out = tmp_path / "g.fmu"
    options = ("--period", 0.01, "--limit", 5, "--fmi", "2.0", "--outside", "hold")
    more = ("--hold", 2, "--fade", 9, "--watchdog", 8, "--rate-limit", 30, "--release", 4)
    assert run(capsys, "table", *NODES, "--out", out, *options, *more)[0] == 0
    with zipfile.ZipFile(out) as archive:
        text = archive.read("modelDescription.xml").decode()
    assert 'fmiVersion="2.0"' in text
    for said in (
        "vouched for stay",
        "2 samples that are none",
        "over 9 samples",
        "8 equal samples",
    ):
        assert said in text
    assert "u changes by at most 0.3 a sample. Switched off, u falls to 0 over 4" in text


def test_a_table_of_a_rig_is_told_in_feet_and_pounds(capsys, tmp_path):
    axes = ("--rig", "table1", "--speed", "150:160:2 rpm", "--rop", "10:20:2 m/h")
    more = ("--structure", "p", "--trials", "none", "--plot", tmp_path / "gains.png")
    text = {
        units: run(capsys, "table", *axes, *more, "--units", units)[1] for units in ("si", "field")
    }
    assert "10 … 20 m/h" in text["si"]
    assert "60 MPa" in text["si"]
    # A foot is 0.3048 m; a ksi 6.895 MPa.
    assert f"{10 / 0.3048:.4g} … {20 / 0.3048:.4g} ft/h" in text["field"]
    assert f"{60 / 6.894757:.4g} ksi" in " ".join(text["field"].split())
    assert not any(word in text["field"] for word in ("α", "vouched", "m/h", "MPa"))
    assert all(len(line) <= 80 for line in text["field"].splitlines())


def test_units_of_a_table_need_a_rig(capsys):
    status, _, err = run(
        capsys, "table", "--omega0", "8:9:2", "--delta0", "1:2:2", "--units", "field"
    )
    assert status == 2
    assert "--units" in err
