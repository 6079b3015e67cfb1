"""What pyproject.toml says is what is tested, cited and told."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]


def _key(version):
    return tuple(int(part) for part in re.sub(r"(\.0)+$", "", version).split("."))


def test_the_lowest_versions_are_the_ones_that_are_tested():
    wanted = [*PROJECT["dependencies"]]
    for extra in EXTRAS.keys() - {"docs", "lint"}:
        wanted += [text for text in EXTRAS[extra] if not text.startswith("drillctrl[")]
    allowed = dict(re.fullmatch(r"([\w-]+)>=([\d.]+)", text).groups() for text in wanted)
    pinned = dict(
        re.findall(r"^([\w-]+)==([\d.]+)$", (ROOT / "constraints/lowest.txt").read_text(), re.M)
    )
    assert len(allowed) >= 15
    assert {name: _key(pinned[name]) for name in allowed} == {
        name: _key(version) for name, version in allowed.items()
    }


def test_the_extra_for_tests_installs_every_other_that_they_use():
    own = re.fullmatch(r"drillctrl\[(.*)\]", EXTRAS["test"][0])[1].split(",")
    assert set(own) == EXTRAS.keys() - {"test", "lint", "docs"}


def test_the_version_is_cited_and_its_changes_are_told_with_their_date():
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    told = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    dated = [
        re.fullmatch(r"(\d+\.\d+\.\d+) \((\d{4}-\d\d-\d\d)\)", entry).groups() for entry in told
    ]
    assert dated[0][0] == PROJECT["version"]
    assert f"version: {dated[0][0]}\ndate-released: {dated[0][1]}\n" in cited
    assert dated == sorted(dated, key=lambda entry: _key(entry[0]), reverse=True)
