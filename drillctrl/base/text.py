"""Numbers as other programs read them, and texts as people do."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Sequence

# Columns of a terminal.
WIDTH = 80
_TOGETHER = re.compile(
    r" (?==)|(?<==) |(?<=\d) (?=(?:rpm|m/h|k?N·m\S*|k?N|MPa|mm|Hz|s)\b)|(?<=\d) (?=%)"
)


def finite_or_none(value: float) -> float | None:
    """Return a float that JSON can hold; None for what is not finite."""
    return float(value) if math.isfinite(value) else None


def wrapped(text: str, indent: int = 0) -> str:
    """Return a text in lines that fit a terminal, all but the first indented.

    Words stay whole, and so do ``x = 3`` and numbers with their units.
    """
    lines = textwrap.wrap(
        _TOGETHER.sub("\N{NO-BREAK SPACE}", text),
        WIDTH,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines).replace("\N{NO-BREAK SPACE}", " ")


def set_out(lines: Sequence[tuple[str, str]]) -> str:
    """Return labels and texts side by side; what is too long goes on below its beginning."""
    width = max(len(label) for label, _ in lines) + 2
    return "\n".join(wrapped(f"{label:<{width}}{text}", width) for label, text in lines)
