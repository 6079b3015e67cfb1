"""A simulated recording of twenty minutes, the rig file that its crew has, and the truth."""

from __future__ import annotations

from pathlib import Path

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds

_FILES = {"record": "record.csv", "rig": "rig.toml", "truth": "truth.toml"}


@checks_kinds
def example_path(which: str) -> Path:
    """Return the path of a file of the recording that ships as an example.

    Parameters
    ----------
    which : str
        ``"record"``, the ``"rig"`` that its crew has, or the ``"truth"`` that was simulated.

    Raises
    ------
    InputError
        If it is another.
    """
    if which not in _FILES:
        raise InputError("which", which, f"one of {', '.join(_FILES)}")
    return Path(__file__).with_name(_FILES[which])
