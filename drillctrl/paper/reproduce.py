"""`reproduce`: figures and the agreement table, into a folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drillctrl.base.errors import InputError
from drillctrl.base.figure import save_figure
from drillctrl.base.files import write_text
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.tableio import csv_text
from drillctrl.paper import controlled, uncontrolled
from drillctrl.paper.agreement import Agreement, as_csv, as_json, as_markdown
from drillctrl.paper.campaign import campaign
from drillctrl.paper.equations import equations
from drillctrl.paper.panels import Reproduced

if TYPE_CHECKING:
    from drillctrl.base.workers import Progress

PARTS: dict[str, Callable[[], Reproduced]] = {
    "equations": equations,
    "fig4": uncontrolled.figure_4,
    "fig5": uncontrolled.figure_5,
    "fig6": uncontrolled.figure_6,
    "fig7": uncontrolled.figure_7,
    "fig8": uncontrolled.figure_8,
    "fig9": uncontrolled.figure_9,
    "fig11": controlled.figure_11,
    "fig12": controlled.figure_12,
    "fig13": controlled.figure_13,
    "fig14": controlled.figure_14,
    "fig15": controlled.figure_15,
    "campaign": campaign,
}


def part_names(names: Sequence[str]) -> list[str]:
    """Return the parts that are meant, in the order of the paper.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    wanted = {name.lower().replace(" ", "") for name in names} or {"all"}
    wanted = {f"fig{name}" if name.isdigit() else name for name in wanted}
    for name in sorted(wanted - {"all"}):
        if name not in PARTS:
            raise InputError("figure", name, f"all or one of {', '.join(PARTS)}")
    return [name for name in PARTS if "all" in wanted or name in wanted]


@checks_kinds
def reproduce(
    names: Sequence[str] = ("all",),
    out: str | Path = "reproduction",
    progress: Progress | None = None,
) -> list[Agreement]:
    """Draw the paper's figures again and check its numbers.

    Parameters
    ----------
    names : sequence of str
        ``"fig4"`` … ``"fig15"`` (or their numbers), ``"equations"``, ``"campaign"``, or
        ``"all"``.
    out : path
        Folder for the figures (PNG), the agreement table (Markdown, CSV, JSON) and the rows of
        the campaign; made if it does not exist.
    progress : callable, optional
        Called with the part, parts done and parts in all.

    Returns
    -------
    list of Agreement
        One for each statement that was checked.

    Raises
    ------
    InputError
        If a name is unknown, or the folder cannot be made.
    """
    parts = part_names(names)
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("out", str(out), f"a folder that can be made ({error.strerror})") from None
    rows: list[Agreement] = []
    for done, name in enumerate(parts):
        if progress is not None:
            progress(name, done, len(parts))
        made = PARTS[name]()
        if made.figure is not None:
            save_figure(made.figure, folder / f"{name}.png")
        if made.table:
            rows_of_part = (row.values() for row in made.table)
            write_text(folder / f"{name}.csv", csv_text(made.table[0], rows_of_part))
        rows += made.agreements
    for ending, text in ((".md", as_markdown), (".csv", as_csv), (".json", as_json)):
        write_text(folder / f"agreement{ending}", text(rows))
    if progress is not None:
        progress("done", len(parts), len(parts))
    return rows
