"""A simulated recording of twenty minutes, the rig file that its crew has, and the truth."""

from __future__ import annotations

from pathlib import Path

from drillctrl.base.errors import InputError

_FILES = {"record": "record.csv", "rig": "rig.toml", "truth": "truth.toml"}


def example_path(which: str) -> Path:
    """Return the path of a file of the recording that ships with drillctrl.

    Parameters
    ----------
    which : {"record", "rig", "truth"}
        The recording, the rig file that its crew has, or what it was made with.

    Raises
    ------
    InputError
        If it is none of these.
    """
    if which not in _FILES:
        raise InputError("which", which, f"one of {', '.join(_FILES)}")
    return Path(__file__).with_name(_FILES[which])
