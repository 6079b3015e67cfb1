"""Results kept in a file as they come, so that a run that was killed goes on where it was."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

from drillctrl.base.errors import InputError
from drillctrl.base.files import check_regular, lock, replacing
from drillctrl.base.kinds import makes_of_kinds

_MOST_BYTES = 4_000_000_000
_LIBRARIES = ("casadi", "numba", "numpy", "scipy")
# What no result in a checkpoint comes from.
_ASIDE = ("charts", "cli", "interop", "paper")


@makes_of_kinds
class Checkpoint:
    """An append-only file of finished results.

    The first line is a hash of what computed the results, the package's own sources and the
    versions of the libraries, for others may find other results. Each further line names its
    task by a key, a hash of everything that the result depends on, so lines of another task are
    never taken for this one's. A line that was cut short is dropped.

    Parameters
    ----------
    path : str or Path
        The file; made if it does not exist.

    Raises
    ------
    InputError
        If the file cannot be read or written, is no checkpoint of the same code and libraries,
        or another process is at it: it is left as it is.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._known: dict[str, dict[str, Any]] = {}
        self._used: set[str] = set()
        try:
            if self._path.exists():
                check_regular(self._path, _MOST_BYTES)
            self._file = self._path.open("a+b")
        except OSError as error:
            raise self._refused(error) from None
        try:
            if not lock(self._file):
                raise InputError("checkpoint", str(path), "one that no other run is at")
            self._take_up()
        except InputError:
            self._file.close()
            raise
        except OSError as error:
            self.close()
            raise self._refused(error) from None

    def _take_up(self) -> None:
        """Read what is there, and cut off what is not whole."""
        header = _header()
        self._file.seek(0)
        first = self._file.readline()
        # A kill may have cut the first line short.
        if not header.startswith(first):
            raise InputError("checkpoint", str(self._path), f"a checkpoint of {_own()}")
        if first != header:
            self._file.truncate(0)
            self._file.write(header)
            self._file.flush()
            return
        kept = len(first)
        for line in self._file:
            entry = _read_line(line)
            if entry is None:
                break
            self._known[entry["task"]] = entry["result"]
            kept += len(line)
        self._file.truncate(kept)

    def __enter__(self) -> Checkpoint:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def path(self) -> Path:
        """Where the file is."""
        return self._path

    def _refused(self, error: OSError) -> InputError:
        return InputError(
            "checkpoint", str(self._path), f"a file that can be written ({error.strerror})"
        )

    def find(self, key: str) -> dict[str, Any] | None:
        """Return the result of a task if it is known."""
        if key in self._known:
            self._used.add(key)
        return self._known.get(key)

    def keep(self, key: str, result: dict[str, Any]) -> None:
        """Append a result of JSON types.

        Raises
        ------
        InputError
            If the disk is full or the file is gone.
        """
        try:
            self._file.write(_line(key, result))
            self._file.flush()
            self._known[key] = result
            self._used.add(key)
        except OSError as error:
            raise self._refused(error) from None

    def remove(self) -> int:
        """Take out what was found or kept, which has served; without more the file is deleted.

        Returns
        -------
        int
            How many results of other runs the file still holds.
        """
        self._file.close()
        others = {key: result for key, result in self._known.items() if key not in self._used}
        if not others:
            self._path.unlink(missing_ok=True)
            return 0
        lines = [_header(), *(_line(key, result) for key, result in others.items())]
        try:
            with replacing(self._path) as file:
                file.writelines(lines)
        except OSError as error:
            raise self._refused(error) from None
        return len(others)

    def close(self) -> None:
        """Close the file and leave it for the next run, unless there is nothing in it."""
        if self._file.closed:
            return
        # What could not be written has been told; closing would tell it again.
        with contextlib.suppress(OSError):
            self._file.close()
        if not self._known:
            self._path.unlink(missing_ok=True)


def _own() -> str:
    libraries = ", ".join(f"{name} {version(name)}" for name in _LIBRARIES)
    return f"drillctrl {version('drillctrl')} as it is installed, with {libraries}"


@functools.cache
def source_digest(package: Path = Path(__file__).parents[1]) -> str:
    """Return a hash of the sources that results are computed by."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        place = path.relative_to(package)
        if place.parts[0] not in _ASIDE and not place.stem.endswith("figure"):
            digest.update(place.as_posix().encode("utf-8") + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def computed_by() -> str:
    """Return a hash of sources and libraries."""
    return hashlib.sha256(f"{source_digest()} {_own()}".encode()).hexdigest()[:16]


def _header() -> bytes:
    origin = computed_by()
    return json.dumps({"drillctrl checkpoint": origin}).encode("ascii") + b"\n"


def _line(key: str, result: dict[str, Any]) -> bytes:
    return json.dumps({"task": key, "result": result}).encode("ascii") + b"\n"


def _read_line(line: bytes) -> dict[str, Any] | None:
    """Return an entry, or None where the line is not whole."""
    try:
        entry = json.loads(line)
        whole = isinstance(entry["task"], str) and isinstance(entry["result"], dict)
    except (ValueError, KeyError, TypeError):
        return None
    return entry if whole and line.endswith(b"\n") else None
