"""Every example runs, and shows the numbers it is about."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
SHOWN = {
    "two_designs.py": ["-0.8119", "-1.39"],
    "sticking_at_120_rpm.py": ["axially held 20 %", "settled: True", "torsional stick 0 %"],
    "sand_to_rock.py": ["α in sand -0.377, in rock -0.377", ": done"],
    "table_for_the_drive.py": ["vouched for: True", "same after reading: True"],
    "own_friction_law.py": ["α = -0.0028", "α = +0.4941", "stable=True"],
}


# Run by the build of the gallery alone, for they take long.
LONG = {"sticking_at_80_rpm.py"}
SHORT = sorted(path for path in EXAMPLES.glob("*.py") if path.name not in LONG)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("path", SHORT, ids=lambda path: path.name)
def test_example_runs(path, capsys):
    runpy.run_path(str(path), run_name="__main__")
    printed = capsys.readouterr().out
    for text in SHOWN[path.name]:
        assert text in printed
