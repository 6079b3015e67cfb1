"""The columns of a file as they stand there, whatever its format."""

from __future__ import annotations

import contextlib
import logging
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.extras import required
from drillctrl.base.files import check_regular
from drillctrl.base.mat5 import PREFIX, bound, doubles, mat_places, opened
from drillctrl.records.text import split_text

# An hour of twenty columns at 100 Hz is 70 MB of text.
MAX_BYTES = 500_000_000
_MOST_ROWS = 20_000_000
_NANOSECONDS = 1e-9


@dataclass(frozen=True, eq=False)
class Column:
    """A column of a file.

    Attributes
    ----------
    name : str
        As in the file, with what stands behind it in brackets.
    unit : str or None
        Where the format or a row of units says it.
    cells : array or list of str
        Numbers, NaN where none; instants as seconds since 1970 if ``unit`` is ``"epoch"``; or
        texts, as of CSV.
    """

    name: str
    unit: str | None
    cells: FloatArray | Sequence[str]


def read_columns(path: str | Path) -> list[Column]:
    """Return the columns of a file by its ending.

    Raises
    ------
    InputError
        If the file cannot be read, or not as what its ending says.
    """
    source = Path(path)
    ending = source.suffix.lower()
    if ending not in _READERS:
        wanted = f"a file that ends in {', '.join(_READERS)}"
        raise InputError("record", str(path), wanted)
    reader, needs = _READERS[ending]
    if needs is not None:
        required(*needs)
    try:
        check_regular(source, MAX_BYTES)
        return reader(source)
    except InputError:
        raise
    except OSError as error:
        reason = error.strerror or "not in the format of its ending"
        raise InputError("record", str(path), f"a readable file ({reason})") from None
    except Exception as error:
        # The readers of other packages raise whatever a broken file makes them raise.
        reason = " ".join(f"{type(error).__name__} {error}".split())[:200]
        raise InputError("record", str(path), f"an intact file ({reason})") from None


def _read_text(path: Path) -> list[Column]:
    split = split_text(path.read_bytes(), str(path))
    return [
        Column(name, unit, cells)
        for name, unit, cells in zip(split.names, split.units, split.columns, strict=True)
    ]


def _read_parquet(path: Path) -> list[Column]:
    import pyarrow
    import pyarrow.parquet

    with pyarrow.parquet.ParquetFile(path) as file:
        if file.metadata.num_rows > _MOST_ROWS:
            raise ValueError(f"more than {_MOST_ROWS} rows")
        table = file.read()
    found = []
    for field, data in zip(table.schema, table.columns, strict=True):
        kind = field.type
        words = field.metadata or {}
        unit = words.get(b"unit") or words.get(b"units")
        told = None if unit is None else unit.decode("utf-8")
        if pyarrow.types.is_timestamp(kind):
            nanoseconds = data.cast(pyarrow.timestamp("ns")).cast(pyarrow.int64())
            found.append(Column(field.name, "epoch", _NANOSECONDS * _numbers(nanoseconds)))
        elif pyarrow.types.is_floating(kind) or pyarrow.types.is_integer(kind):
            found.append(Column(field.name, told, _numbers(data)))
        elif pyarrow.types.is_string(kind) or pyarrow.types.is_large_string(kind):
            texts = ["" if cell is None else cell for cell in data.to_pylist()]
            found.append(Column(field.name, told, texts))
    return found


def _numbers(data: Any) -> FloatArray:
    import pyarrow

    whole = data.combine_chunks() if hasattr(data, "combine_chunks") else data
    return np.array(whole.cast(pyarrow.float64(), safe=False).to_numpy(zero_copy_only=False), float)


def _read_mat(path: Path) -> list[Column]:
    found = []
    for name, (kind, data) in mat_places(path).items():
        array = opened(kind, data, PREFIX)
        size = max(array.shape, default=0)
        if size > _MOST_ROWS:
            raise ValueError(f"{name[:60]} of more than {_MOST_ROWS} rows")
        if array.flags != _PLAIN or sorted(array.shape) != [1, size]:
            continue
        values = doubles(opened(kind, data, bound(size)), array.shape)
        found.append(Column(name, None, values))
    if not found:
        wanted = f"a vector of numbers a column; {', '.join(mat_places(path))[:80]} is none"
        raise InputError("record", str(path), wanted)
    return found


# Flags of a real array of doubles.
_PLAIN = 6


def _read_las(path: Path) -> list[Column]:
    lasio = required("lasio", "las")
    with _silent("lasio"):
        file = lasio.read(str(path))
    found = []
    for curve in file.curves:
        data: npt.NDArray[Any] = np.asarray(curve.data)
        name, unit = str(curve.mnemonic), str(curve.unit).strip() or None
        if data.dtype.kind in "if":
            found.append(Column(name, unit, data.astype(float)))
        else:
            found.append(Column(name, unit, [str(cell) for cell in data.tolist()]))
    return found


@contextlib.contextmanager
def _silent(logger: str) -> Any:
    """Let a package say nothing beside what is raised."""
    spoken = logging.getLogger(logger)
    before, spoken.disabled = spoken.disabled, True
    level = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(level)
        spoken.disabled = before


_Reader = Callable[[Path], list[Column]]
_READERS: dict[str, tuple[_Reader, tuple[str, str] | None]] = {
    ".csv": (_read_text, None),
    ".txt": (_read_text, None),
    ".tsv": (_read_text, None),
    ".las": (_read_las, ("lasio", "las")),
    ".parquet": (_read_parquet, ("pyarrow", "tables")),
    ".mat": (_read_mat, None),
}
ENDINGS = tuple(_READERS)
