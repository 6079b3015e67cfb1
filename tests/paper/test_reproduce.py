import csv
import json

import pytest

from drillctrl import InputError, cli, reproduce
from drillctrl.paper.agreement import Agreement, as_markdown, compared
from drillctrl.paper.equations import printed_sign, singular_depth
from drillctrl.paper.reproduce import PARTS, part_names


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The quick parts."""
    folder = tmp_path_factory.mktemp("paper") / "deep" / "folder"
    return folder, reproduce(["equations", "fig4", "fig7", "13", "fig15"], folder)


def verdict(rows, where, what):
    return next(row for row in rows if row.where == where and what in row.what).verdict


@pytest.mark.long
def test_every_part_is_drawn_and_tabled(made):
    folder, rows = made
    names = {path.name for path in folder.iterdir()}
    tables = {"agreement.md", "agreement.csv", "agreement.json"}
    assert names == {"fig4.png", "fig7.png", "fig13.png", "fig15.png", *tables}
    assert (folder / "fig4.png").read_bytes().startswith(b"\x89PNG")
    assert len(json.loads((folder / "agreement.json").read_text())) == len(rows)
    with (folder / "agreement.csv").open() as file:
        assert [line["what"] for line in csv.DictReader(file)] == [row.what for row in rows]
    assert (folder / "agreement.md").read_text().count("\n") == len(rows) + 2


def test_verdicts_are_those_of_an_independent_check(made):
    _, rows = made
    assert verdict(rows, "Eqs. 20, 22, 33", "sign") == "misprint"
    assert verdict(rows, "Fig. 13", "case1: max |x|") == "differs"
    assert verdict(rows, "Fig. 13b", "best p") == "agrees"
    assert verdict(rows, "Fig. 13b", "cannot stabilise") == "agrees"
    assert verdict(rows, "Fig. 13", "optimal gains of case2") == "differs"
    assert verdict(rows, "Fig. 15", "to rest") == "agrees"
    assert verdict(rows, "Fig. 4b", "unstable") == "agrees"
    # At δ0 = 1 the stable range of speeds ends before 24.
    assert verdict(rows, "Fig. 4a", "becomes stable") == "differs"


def test_the_printed_sign_contradicts_the_papers_own_points():
    """B and D are stable in Fig. 8, and are not with the minus sign."""
    assert printed_sign(10.0, 1.0) > 0
    assert printed_sign(5.1, 1.75) > 0


def test_a1_is_singular_where_the_formula_says():
    assert singular_depth() == pytest.approx((1 + 4 * 14 / 1.6**2) / 4, rel=1e-12)


def test_a_number_agrees_to_its_own_digits():
    assert compared("", "", 0.979, 0.97933, "", digits=0.0005).verdict == "agrees"
    apart = compared("", "", 36.0, 33.47, "no reason", digits=0.5)
    assert apart.verdict == "differs"
    assert apart.why == "by 7 %: no reason"
    assert "a \\| b" in as_markdown([Agreement("a | b", "", "", "", "", "")])


def test_parts_come_in_the_order_of_the_paper():
    assert part_names(["15", "Fig 4"]) == ["fig4", "fig15"]
    assert part_names(["all"]) == list(PARTS)
    with pytest.raises(InputError, match="figure = fig10"):
        part_names(["fig10"])


def test_the_command(capsys, tmp_path):
    with pytest.raises(SystemExit) as stop:
        cli.main(["reproduce", "equations", "--out", str(tmp_path / "out"), "--json"])
    assert stop.value.code == 0
    assert len(json.loads(capsys.readouterr().out)) == 4
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit) as stop:
        cli.main(["reproduce", "equations", "--out", str(tmp_path / "file" / "x")])
    captured = capsys.readouterr()
    assert stop.value.code == 2
    assert captured.err.startswith("drillctrl: --out = ")
