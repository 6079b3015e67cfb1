"""Test vectors, the program that replays them, and both as PLCopen XML."""

import csv
import subprocess
from xml.etree import ElementTree

import numpy as np
import pytest

from drillctrl import InputError, cli, save_table
from drillctrl.tables.export_st import bench_name, export_st
from drillctrl.tables.reserved import is_identifier

from .exported import InC, matiec
from .iec import Block, load

GIVEN = {"period": 0.01, "limit": 3.0, "rate_limit": 40.0, "fade": 6, "watchdog": 5, "ramp": 9}
SPACE = {"p": "http://www.plcopen.org/xml/tc6_0201", "x": "http://www.w3.org/1999/xhtml"}


def rows_of(path):
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


def finished(text, cycles):
    bench = Block(load(text)["DRILL_BENCH"])
    for _ in range(cycles):
        bench()
    return bench


def test_vectors_are_what_the_c_answers_and_they_reach_everything(small, on_rig, tmp_path):
    for table, limit in ((small, 3.0), (on_rig, 2000.0)):
        options = {**GIVEN, "limit": limit, "rate_limit": 13.0 * limit}
        exported = InC(table, tmp_path, **options)
        export_st(table, tmp_path / "drill.st", **options)
        seen, u = 0, []
        outputs = table.structure.outputs
        axes = [axis.name for axis in table.grid.axes]
        for row in rows_of(tmp_path / "drill.vectors.csv"):
            value = {name: float(text) for name, text in row.items()}
            u.append(
                exported.step(
                    [value[name] for name in outputs],
                    [value[name] for name in axes],
                    value["delay"],
                    int(value["enable"]),
                    **{name: value[name] for name in ("elapsed", "other", "limit")},
                )
            )
            assert u[-1] == pytest.approx(value["u"], rel=1e-12, abs=1e-12 * limit)
            assert (exported.status, exported.vouched) == (
                int(row["status"]),
                row["vouched"] == "1",
            )
            seen |= exported.status
        assert seen == 255 - 32 or (table is on_rig and seen == 127 - 32)
        assert np.ptp(u) > 0.3 * limit


def test_the_bench_reports_the_largest_deviation(small, tmp_path):
    path = export_st(small, tmp_path / "drill.st", **GIVEN)
    rows = len(rows_of(tmp_path / "drill.vectors.csv"))
    block, bench = path.read_text(), (tmp_path / "drill_bench.st").read_text()
    run = finished(block + bench, rows)
    assert not run.FINISHED
    run = finished(block + bench, rows + 1)
    assert (run.FINISHED, run.PASSED, run.WRONGSTATES) == (True, True, 0)
    assert run.LARGESTDEVIATION < 1e-12
    wrong = block.replace("+ TrustedGains[1 + EntryIndex]", "+ 1.01 * TrustedGains[1 + EntryIndex]")
    run = finished(wrong + bench, rows + 1)
    assert not run.PASSED
    assert 1e-4 < run.LARGESTDEVIATION < 1.0
    names = bench.split("PROGRAM ")[1].split("\n")[0]
    assert names == bench_name("drill") == "drill_bench"
    words = [line.split(" : ")[0].strip() for line in bench.splitlines() if " : " in line]
    assert all(is_identifier(word) for word in words)


def test_a_recorded_motion_is_replayed(small, on_rig, tmp_path):
    motion = 0.02 * np.sin(0.1 * np.arange(50))[:, None]
    export_st(small, tmp_path / "drill.st", motion=motion, **GIVEN)
    rows = rows_of(tmp_path / "drill.vectors.csv")
    assert [float(row["theta"]) for row in rows] == motion[:, 0].tolist()
    for wrong in (motion[:, 0], np.zeros((0, 1)), motion.repeat(3, axis=1), np.nan * motion):
        with pytest.raises(InputError, match="motion = "):
            export_st(on_rig, tmp_path / "other.st", motion=wrong, **GIVEN)
    assert not list(tmp_path.glob("other*"))


def test_a_motion_from_a_file_is_replayed_where_it_was_recorded(small, tmp_path, capsys):
    """At half of the period that it was recorded with, and under the other words for time."""
    save_table(small, tmp_path / "gains.csv")
    times = 0.02 * np.arange(30)
    columns = {
        "omega0": 9.0 + times, "psi": 14.0 + 0.0 * times, "note": times, "times": times,
        "theta": 0.02 * np.sin(3.0 * times), "delta0": 2.0 + times, "delay": 0.15 + 0.01 * times,
    }  # fmt: skip
    rows = [",".join(columns), *(",".join(map(repr, row)) for row in
                                 np.column_stack([*columns.values()]).tolist())]  # fmt: skip
    (tmp_path / "motion.csv").write_text("# by hand\n" + "\n".join(rows) + "\n")
    given = ["--from", str(tmp_path / "gains.csv"), "--period", "0.01", "--limit", "3"]
    asked = ["table", *given, "--motion", str(tmp_path / "motion.csv")]
    with pytest.raises(SystemExit) as stop:
        cli.main([*asked, "--out", str(tmp_path / "drill.st")])
    assert stop.value.code == 0, capsys.readouterr()
    found = rows_of(tmp_path / "drill.vectors.csv")
    at = 0.01 * np.arange(59)
    for name in ("omega0", "delta0", "psi", "theta", "delay"):
        expected = np.interp(at, times, columns[name])
        assert [float(row[name]) for row in found] == pytest.approx(expected.tolist(), rel=1e-12)
    block, bench = ((tmp_path / f"{name}.st").read_text() for name in ("drill", "drill_bench"))
    assert finished(block + bench, len(found) + 1).PASSED
    for old, new in (("theta", "phi"), ("0.02,", "-0.02,"), ("0.02,", "nan,"), (",", ";")):
        (tmp_path / "motion.csv").write_text("\n".join(rows).replace(old, new))
        with pytest.raises(SystemExit) as stop:
            cli.main([*asked, "--out", str(tmp_path / "other.st")])
        assert stop.value.code == 2
        assert "drillctrl: --motion = " in capsys.readouterr().err
    with pytest.raises(SystemExit) as stop:
        cli.main([*asked, "--out", str(tmp_path / "other.c")])
    assert stop.value.code == 2
    assert not list(tmp_path.glob("other*"))


def test_an_iec_compiler_takes_block_and_bench(small, on_rig, tmp_path):
    if matiec() is None:
        pytest.skip("no iec2c on the path")
    command, library = matiec()
    for table in (small, on_rig):
        path = export_st(table, tmp_path / "drill.st", **GIVEN)
        both = tmp_path / "both.st"
        both.write_text(path.read_text() + (tmp_path / "drill_bench.st").read_text())
        call = [command, "-I", library, "-T", tmp_path, both]
        run = subprocess.run(call, capture_output=True, text=True, check=False)
        assert run.returncode == 0, run.stderr + run.stdout


def test_plcopen_xml_holds_the_same_block_and_bench(small, tmp_path):
    plain = export_st(small, tmp_path / "drill.st", **GIVEN)
    bench = (tmp_path / "drill_bench.st").read_text()
    path = export_st(small, tmp_path / "drill.xml", **GIVEN)
    root = ElementTree.parse(path).getroot()
    assert root.tag == f"{{{SPACE['p']}}}project"
    parts = [child.tag.split("}")[1] for child in root]
    # The order that TC6 wants.
    assert parts == ["fileHeader", "contentHeader", "types", "instances"]
    units = root.findall("p:types/p:pous/p:pou", SPACE)
    assert [(unit.get("name"), unit.get("pouType")) for unit in units] == [
        ("drill", "functionBlock"),
        ("drill_bench", "program"),
    ]
    text = "".join(written(unit) for unit in units)
    one, two = (load(t) for t in (plain.read_text() + bench, text))
    for name in ("DRILL", "DRILL_BENCH"):
        names = [*one[name].variables]
        assert names == [*two[name].variables]
        assert one[name].inputs == two[name].inputs
        assert one[name].constants == two[name].constants
        starts = [(kind.variables[n][1]) for n in names for kind in (one[name], two[name])]
        assert starts[::2] == starts[1::2]
    assert finished(text, 300).PASSED
    assert not list(tmp_path.glob("*.xml.*"))


def written(unit):
    """Return the Structured Text of an element of a project."""
    kind = {"functionBlock": "FUNCTION_BLOCK", "program": "PROGRAM"}[unit.get("pouType")]
    lines = [f"{kind} {unit.get('name')}"]
    sections = {"inputVars": "VAR_INPUT", "outputVars": "VAR_OUTPUT", "localVars": "VAR"}
    for part in unit.find("p:interface", SPACE):
        constant = " CONSTANT" if part.get("constant") == "true" else ""
        lines.append(sections[part.tag.split("}")[1]] + constant)
        for variable in part.findall("p:variable", SPACE):
            place, size = variable.find("p:type", SPACE), ""
            if (array := place.find("p:array", SPACE)) is not None:
                size = f"ARRAY[0..{array.find('p:dimension', SPACE).get('upper')}] OF "
                place = array.find("p:baseType", SPACE)
            kind_of = place[0].get("name") or place[0].tag.split("}")[1]
            values = [v.get("value") for v in variable.iterfind(".//p:simpleValue", SPACE)]
            start = f" := [{', '.join(values)}]" if size and values else ""
            start = f" := {values[0]}" if values and not size else start
            lines.append(f"{variable.get('name')} : {size}{kind_of}{start};")
        lines.append("END_VAR")
    body = unit.find("p:body/p:ST/x:p", SPACE).text
    return "\n".join([*lines, body, f"END_{kind}\n"])
