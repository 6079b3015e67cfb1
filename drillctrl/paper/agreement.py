"""Published numbers beside ours, with a verdict and its reason."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from drillctrl.base.tableio import csv_text

AGREES = "agrees"
DIFFERS = "differs"
MISPRINT = "misprint"
NOT_REPRODUCIBLE = "not reproducible"


@dataclass(frozen=True)
class Agreement:
    """One statement of the paper, checked.

    Attributes
    ----------
    where : str
        Figure, equation or section.
    what : str
        What is stated.
    published, ours : str
        The paper's and our value, as text with their digits.
    verdict : str
        One of the above.
    why : str
        The reason, or how ours was computed.
    """

    where: str
    what: str
    published: str
    ours: str
    verdict: str
    why: str


def compared(
    where: str,
    what: str,
    published: float,
    ours: float,
    why: str,
    *,
    digits: float,
    form: str = ".4g",
) -> Agreement:
    """Compare two numbers.

    Parameters
    ----------
    where, what, why : str
        As in `Agreement`.
    published, ours : float
        The numbers.
    digits : float
        Half a unit of the last digit that was published: as near is agreement.
    form : str
        How ours is written.
    """
    apart = abs(ours - published)
    verdict = AGREES if apart <= digits * (1.0 + 1e-9) else DIFFERS
    if verdict == DIFFERS:
        why = f"by {100.0 * apart / abs(published):.2g} %: {why}"
    return Agreement(where, what, f"{published:g}", format(ours, form), verdict, why)


def stated(where: str, what: str, ours: str, holds: bool, why: str) -> Agreement:
    """Check a statement that is no number."""
    return Agreement(where, what, "so", ours, AGREES if holds else DIFFERS, why)


def as_markdown(rows: Sequence[Agreement]) -> str:
    """Return a Markdown table."""
    lines = ["| where | what | the paper | ours | verdict | why |", "|---|---|---|---|---|---|"]
    lines += [
        "| " + " | ".join(value.replace("|", "\\|") for value in asdict(row).values()) + " |"
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def as_csv(rows: Sequence[Agreement]) -> str:
    """Return one line a statement."""
    return csv_text(Agreement.__dataclass_fields__, (asdict(row).values() for row in rows))


def as_json(rows: Sequence[Agreement]) -> str:
    """Return a JSON list."""
    return json.dumps([asdict(row) for row in rows], indent=2, ensure_ascii=False) + "\n"
