"""Public names: each is what it says, stands in the API reference and is all the guide needs."""

import re
import subprocess
import sys
from pathlib import Path

import drillctrl

ROOT = Path(__file__).parents[1]
API = ROOT / "docs" / "api.md"

# A module of the same name would take a function's place in the package once it is imported.
LOADS_EVERY_HOME_FIRST = """
import types
import drillctrl
for name in drillctrl.__all__:
    getattr(drillctrl, name)
print([n for n in drillctrl.__all__ if isinstance(getattr(drillctrl, n), types.ModuleType)])
"""


def test_no_module_takes_the_place_of_a_public_name():
    done = subprocess.run(
        [sys.executable, "-c", LOADS_EVERY_HOME_FIRST], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_a_type_checker_sees_every_name():
    stub = (ROOT / "drillctrl" / "__init__.pyi").read_text(encoding="utf-8")
    seen = re.findall(r"^from \.[\w.]+ import (\w+) as \1$", stub, re.MULTILINE)
    assert sorted(seen) == drillctrl.__all__ == dir(drillctrl)


def test_every_public_name_is_in_the_api_reference():
    listed = re.findall(r"^   (\w+)$", API.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(drillctrl.__all__)


def test_the_guide_needs_nothing_else():
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs/guide").glob("*.md")]
    pages += (ROOT / "examples").glob("*.py")
    assert len(pages) > 15
    deeper = {
        (page.name, line)
        for page in pages
        for line in re.findall(
            r"(?:from|import) drillctrl\.\S+.*", page.read_text(encoding="utf-8")
        )
    }
    assert deeper == set()
