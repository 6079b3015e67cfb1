"""Lowest versions: what pyproject.toml allows is what constraints/lowest.txt tests."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]


def _key(version):
    return tuple(int(part) for part in re.sub(r"(\.0)+$", "", version).split("."))


def test_the_lowest_versions_are_the_ones_that_are_tested():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    wanted = [*project["dependencies"]]
    for extra in extras.keys() - {"docs", "lint"}:
        wanted += [text for text in extras[extra] if not text.startswith("drillctrl[")]
    allowed = dict(re.fullmatch(r"([\w-]+)>=([\d.]+)", text).groups() for text in wanted)
    pinned = dict(
        re.findall(r"^([\w-]+)==([\d.]+)$", (ROOT / "constraints/lowest.txt").read_text(), re.M)
    )
    assert len(allowed) >= 15
    assert {name: _key(pinned[name]) for name in allowed} == {
        name: _key(version) for name, version in allowed.items()
    }


def test_the_extra_for_tests_installs_every_other_that_they_use():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    own = re.fullmatch(r"drillctrl\[(.*)\]", extras["test"][0])[1].split(",")
    assert set(own) == extras.keys() - {"test", "lint", "docs"}
