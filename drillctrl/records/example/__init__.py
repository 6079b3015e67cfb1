"""A simulated recording of twenty minutes, the rig file that its crew has, and the truth."""

from __future__ import annotations

from pathlib import Path

_FILES = {"record": "record.csv", "rig": "rig.toml", "truth": "truth.toml"}


def example_path(which: str) -> Path:
    """Return the path of a file of the example: ``"record"``, ``"rig"`` or ``"truth"``."""
    return Path(__file__).with_name(_FILES[which])
