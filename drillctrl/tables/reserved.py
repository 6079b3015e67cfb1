"""Words that no identifier of Structured Text may be, in any case."""

from __future__ import annotations

import re
from pathlib import Path

# Words of the language and of common libraries, with where they are from.
_LINES = (Path(__file__).with_suffix(".txt")).read_text(encoding="ascii").splitlines()
RESERVED = frozenset(word for line in _LINES if line[:1] != "#" for word in line.split())
# Conversions such as DINT_TO_LREAL, variants by type such as RAMP_REAL, absolute addresses.
_TYPE = "BOOL|[SUL]?S?U?INT|L?REAL|[DL]?WORD|BYTE|W?STRING|L?TIME|L?DATE|L?DT|L?TOD"
_FORMED = re.compile(rf"\w+_TO_\w+|TO_(?:{_TYPE})|[IQMAEPT][BWDLX]?\d+")


def is_identifier(name: str) -> bool:
    """Tell whether compilers of Structured Text take a name.

    Letters, digits and single underscores between them, at most 32 characters, and none of the
    words that the language or a common library has.
    """
    return (
        re.fullmatch(r"[A-Za-z](?:_?[A-Za-z0-9])*", name) is not None
        and len(name) <= 32
        and name.upper() not in RESERVED
        and _FORMED.fullmatch(name.upper()) is None
    )
