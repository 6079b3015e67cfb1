"""The public names: each is what it says, and each stands in the API reference."""

import re
import subprocess
import sys
from pathlib import Path

import drillctrl

API = Path(__file__).parents[1] / "docs" / "api.md"

# A module of the same name would take a function's place in the package once it is imported.
LOADS_EVERY_HOME_FIRST = """
import importlib, types
import drillctrl
for home in drillctrl._HOME.values():
    importlib.import_module(f"drillctrl.{home}")
print([n for n in drillctrl.__all__ if isinstance(getattr(drillctrl, n), types.ModuleType)])
"""


def test_no_module_takes_the_place_of_a_public_name():
    done = subprocess.run(
        [sys.executable, "-c", LOADS_EVERY_HOME_FIRST], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_lazy_names_and_listed_names_agree():
    assert sorted(drillctrl._HOME) == sorted(drillctrl.__all__) == dir(drillctrl)


def test_every_public_name_is_in_the_api_reference():
    listed = re.findall(r"^   (\w+)$", API.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(drillctrl.__all__)
