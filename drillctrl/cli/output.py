"""Where results go: standard output, and files that appear whole or not at all."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from drillctrl.base.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Where the context of a command keeps how figures look.
STYLE = "drillctrl.style"
# Whether theory is told for a rig too, and the labels of what that is.
VERBOSE = "drillctrl.verbose"
_THEORY = ("Point", "Dimensionless", "Result", "Dominant roots", "Checked by", "Optimal by",
           "Minimised", "Multipliers", "Effort", "Theory",
           "Other modes")  # fmt: skip


def plain(text: str) -> str:
    """Return a summary as people on a rig want it, without theory unless they ask for that."""
    context = click.get_current_context()
    units = context.params.get("units")
    if context.meta.get(VERBOSE) or not context.params.get("rig") or units == "dimensionless":
        return text
    kept, theory = [], False
    for line in text.splitlines():
        if not line.startswith("  "):
            theory = line.startswith(tuple(f"{label}  " for label in _THEORY))
        if not theory:
            kept.append(line)
    return "\n".join(kept)


def json_text(fields: dict[str, Any]) -> str:
    """Return the JSON object that a verb prints; NaN and Infinity are our fault."""
    return json.dumps(fields, indent=2, allow_nan=False, ensure_ascii=False)


def check_folder(parameter: str, path: str | None) -> None:
    """Refuse a file that cannot be written where it is to be, before any work is done."""
    if path is None:
        return
    folder = Path(path).absolute().parent
    try:
        # Names that are too long are refused by the system only when it looks.
        there, taken = folder.is_dir(), Path(path).is_dir()
    except OSError as error:
        wanted = f"a file that can be written ({error.strerror})"
        raise InputError(parameter, path, wanted) from None
    if not there:
        raise InputError(parameter, path, "in a folder that exists")
    if not os.access(folder, os.W_OK):
        raise InputError(parameter, path, "in a folder that can be written to")
    if taken:
        raise InputError(parameter, path, "a file, not a folder")


def check_figure(plot: str | None) -> None:
    """Refuse a bad name of a figure before any work is done."""
    check_folder("--plot", plot)
    if plot is not None:
        from drillctrl.base.figure import check_figure_path, check_style

        check_figure_path(plot)
        check_style(click.get_current_context().meta.get(STYLE, "screen"))


def check_json(out: str | None) -> None:
    """Refuse a bad name of a JSON file before any work is done."""
    check_ending(out, ".json")


def check_ending(out: str | None, ending: str) -> None:
    """Refuse a file of another kind than the one that can be written."""
    check_folder("--out", out)
    if out is not None and Path(out).suffix.lower() != ending:
        raise InputError("--out", out, f"a file that ends in {ending}")


def writing(parameter: str, path: str, write: Callable[[], None]) -> None:
    """Write a file, turning what the system refuses into a message about the option."""
    try:
        write()
    except OSError as error:
        raise InputError(
            parameter, path, f"a file that can be written ({error.strerror})"
        ) from None


def write_json(out: str, fields: dict[str, Any]) -> None:
    """Write what ``--json`` would print to a file."""
    from drillctrl.base.files import write_text

    writing("--out", out, lambda: write_text(out, json_text(fields) + "\n"))


def write_figure(plot: str, drawn: Figure | Axes) -> None:
    """Write a figure by the file's ending."""
    from drillctrl.base.figure import save_figure

    style = click.get_current_context().meta.get(STYLE, "screen")
    writing("--plot", plot, lambda: save_figure(drawn, plot, style))


def deliver(
    fields: dict[str, Any],
    text: Callable[[], str],
    draw: Callable[[], Figure | Axes],
    *,
    as_json: bool,
    out: str | None,
    plot: str | None,
) -> None:
    """Print a result as text or JSON, and write the files asked for."""
    if out is not None:
        write_json(out, fields)
    if plot is not None:
        write_figure(plot, draw())
    click.echo(json_text(fields) if as_json else plain(text()))
