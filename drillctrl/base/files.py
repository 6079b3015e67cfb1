"""Read regular files only, and write files whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO


def check_regular(path: str | Path, limit: int) -> None:
    """Raise `OSError` unless a path leads to a regular file of at most ``limit`` bytes.

    Devices and pipes may never end.
    """
    try:
        found = os.stat(path)
    except ValueError:
        raise OSError(errno.EINVAL, "not a name of a file") from None
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "not a regular file")
    if found.st_size > limit:
        raise OSError(errno.EFBIG, f"larger than {limit / 1e6:g} MB")


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file for writing that takes its place at ``path`` only once complete.

    Parameters
    ----------
    path : str or Path
        Where the file is to be; its folder must exist.

    Yields
    ------
    file
        A binary file beside ``path``. On leaving without an exception it is flushed to
        disk and moved onto ``path``; otherwise it is removed and ``path`` is untouched.

    Raises
    ------
    OSError
        If the folder does not exist, cannot be written to, or is full, or a file that is there
        may not be written; it names ``path``.
    """
    target = Path(path)
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    descriptor, name = tempfile.mkstemp(
        prefix=f".{target.name}.", suffix=target.suffix, dir=target.parent
    )
    try:
        with os.fdopen(descriptor, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(name, 0o666 & ~umask)
        os.replace(name, target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            os.unlink(name)
        if isinstance(error, OSError):
            error.filename, error.filename2 = str(path), None
        raise


def lock(file: IO[bytes]) -> bool:
    """Keep a file for this process until it is closed; return False where another has it.

    Systems and file systems without such locks let everyone have it.
    """
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):
        pass
    return True


def write_text(path: str | Path, text: str) -> None:
    """Write a UTF-8 text file whole or not at all (see `replacing`)."""
    with replacing(path) as file:
        file.write(text.encode("utf-8"))
