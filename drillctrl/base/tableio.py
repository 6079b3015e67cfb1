"""Tables as text: comments, a header and rows, separated by commas."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable


def csv_text(
    header: Iterable[object], rows: Iterable[Iterable[object]], comments: Iterable[str] = ()
) -> str:
    """Return a table as CSV, floats to the last digit, an empty field for None.

    Parameters
    ----------
    header : iterable
        Names of the columns.
    rows : iterable of iterable
        As many entries each.
    comments : iterable of str
        Lines before the header, each set off by ``# ``.
    """
    text = io.StringIO()
    text.writelines(f"# {line}\n" for line in comments)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()
