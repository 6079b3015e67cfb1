"""The program that replays test vectors through a function block and reports the deviation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy.typing as npt

from drillctrl.base.templates import filled


def bench_name(name: str) -> str:
    """Return the name of the program that tests a block."""
    return f"{name[:26].rstrip('_')}_bench"


def bench_text(
    name: str,
    columns: Mapping[str, npt.NDArray[Any]],
    arrays: Mapping[str, str],
    inputs: Mapping[str, str],
    command: str,
    limit: float,
    unit: str,
) -> str:
    """Return the program.

    Parameters
    ----------
    name : str
        Of the block.
    columns : mapping
        Name of an array → its entries, a row a sample, (n,) or (n, k): what goes in, and
        ``WantedCommands``, ``WantedVouched`` and ``WantedStates``.
    arrays, inputs : mapping
        Inputs of the block that are arrays, and others → their column.
    command : str
        Its output.
    limit : float
        Of the command; a billionth of it may be missed.
    unit : str
        Of the command.
    """
    kinds = {"b": "BOOL", "i": "DINT", "f": "LREAL"}
    listed = [
        (label, kinds[values.dtype.kind], [_literal(v) for v in values.ravel().tolist()])
        for label, values in columns.items()
    ]
    filling = [
        (target, label, columns[label].shape[1], k)
        for target, label in arrays.items()
        for k in range(columns[label].shape[1])
    ]
    return filled(
        "drillctrl.tables",
        "bench.st.j2",
        name=name,
        bench=bench_name(name),
        filling=filling,
        inputs=inputs,
        command=command,
        rows=len(columns["WantedCommands"]),
        columns=listed,
        tolerance=_literal(1e-9 * limit),
        command_unit=unit,
    )


def _literal(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.17E}"
    return str(value).upper()
