"""Results kept in a folder by what computed them, one file each."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from drillctrl.base.checkpoint import computed_by
from drillctrl.base.codec import decode, encode
from drillctrl.base.errors import InputError
from drillctrl.base.files import check_regular, replacing

Kept = TypeVar("Kept")
_MOST_BYTES = 100_000_000


@dataclass(frozen=True)
class Shelf:
    """A folder of results, a file each, named by a hash of all that it depends on.

    Files of other sources or library versions are never found; several processes may share it.

    Parameters
    ----------
    folder : str or Path
        Made when something is kept.
    classes : mapping
        Name → class of what is kept.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """

    folder: str | Path
    classes: dict[str, type[Any]]

    def __post_init__(self) -> None:
        nearest = Path(self.folder).absolute()
        while not nearest.exists():
            nearest = nearest.parent
        if not (nearest.is_dir() and os.access(nearest, os.W_OK)):
            raise InputError("keep", str(self.folder), "a folder that can be written")

    def get(self, depends: tuple[Any, ...], compute: Callable[[], Kept]) -> Kept:
        """Return what is kept for a key, or compute and keep it.

        Parameters
        ----------
        depends : tuple
            All that the result depends on beside the code; by its text.
        compute : callable
            Without arguments.

        Raises
        ------
        InputError
            If the folder cannot be written.
        """
        key = hashlib.sha256(f"{computed_by()}\n{depends!r}".encode()).hexdigest()
        path = Path(self.folder) / f"{key}.json"
        try:
            if path.exists():
                check_regular(path, _MOST_BYTES)
                kept: Kept = decode(json.loads(path.read_bytes()), self.classes)
                return kept
        except (OSError, ValueError, KeyError, TypeError):
            # What was cut short or written over is computed again.
            pass
        found = compute()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with replacing(path) as file:
                file.write(json.dumps(encode(found, self.classes)).encode("ascii"))
        except OSError as error:
            wanted = f"a folder that can be written ({error.strerror})"
            raise InputError("keep", str(self.folder), wanted) from None
        return found
