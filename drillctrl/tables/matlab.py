"""Tables as MATLAB 5 files: arrays of the grid's shape, read back with bounds on everything."""

from __future__ import annotations

import io
import json
import math
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.tables.document import Document, checked_layout

AXES = "axes"
_HEADER = "header"
# Of a little-endian file: its version, that of 7.3, and the types of its elements.
_VERSION, _NEWER = b"\x00\x01IM", b"\x00\x02IM"
_MATRIX, _COMPRESSED = 14, 15
_NUMBERS = {
    **{1: "<i1", 2: "<u1", 3: "<i2", 4: "<u2", 5: "<i4", 6: "<u4"},
    **{7: "<f4", 9: "<f8", 12: "<i8", 13: "<u8"},
}
_TEXTS = {1: "latin1", 2: "latin1", 4: "utf-16-le", 16: "utf-8", 17: "utf-16-le"}
# Classes of arrays.
_CELL, _CHARACTERS, _DOUBLES = 1, 4, 6
# A header with the cells of the largest table has fewer bytes; what stands before data fewer.
_LONGEST_HEADER = 200_000_000
_PREFIX = 1024


def write_mat(document: Document, file: IO[bytes]) -> None:
    """Write arrays over the axes that vary, in their order, and these axes.

    ``griddedInterpolant(axes, K1_1)`` takes them as they are: it wants at least two points
    along each axis, so an axis of one value, whose vector is there too, makes no dimension.
    """
    import scipy.io

    axes = {name: np.array(values) for name, values in document.header["axes"].items()}
    varying = [values for values in axes.values() if values.size > 1]
    cells = np.empty((1, len(varying)), dtype=object)
    for i, values in enumerate(varying):
        cells[0, i] = values[:, None]
    shape = _shape(document.header)
    fields: dict[str, Any] = {
        **{name: values.reshape(shape) for name, values in document.columns.items()},
        **{f"axis_{name}": values[:, None] for name, values in axes.items()},
        AXES: cells,
        _HEADER: json.dumps(document.header),
    }
    buffer = io.BytesIO()
    scipy.io.savemat(buffer, fields)
    content = bytearray(buffer.getvalue())
    # The description that savemat writes holds the time of day.
    content[:116] = b"MATLAB 5.0 MAT-file, drillctrl gain table".ljust(116)
    file.write(bytes(content))


def _shape(header: dict[str, Any]) -> tuple[int, ...]:
    sizes = [len(values) for values in header["axes"].values() if len(values) > 1]
    return tuple(sizes) if len(sizes) > 1 else (*sizes, 1) if sizes else (1, 1)


def read_mat(path: Path) -> Document:
    """Read what `write_mat` wrote, or what MATLAB or SciPy made of it: compressed, reordered.

    Not by scipy's `loadmat`: it takes a file's word for types and sizes, so that a wrong byte
    ends the process, and a small compressed file fills the memory.

    Raises
    ------
    ValueError
        If it is of another version, or holds other arrays than announced.
    """
    content = memoryview(path.read_bytes())
    if bytes(content[124:128]) == _NEWER or bytes(content[:8]) == b"\x89HDF\r\n\x1a\n":
        raise ValueError("MATLAB 7.3, which is HDF5: save it with save(..., '-v7') instead")
    if bytes(content[124:128]) != _VERSION:
        raise ValueError("not a MATLAB 5 file")
    places: dict[str, tuple[int, memoryview]] = {}
    for kind, data in _elements(content[128:]):
        name = _opened(kind, data, _PREFIX).name
        if name in places:
            raise ValueError(f"{name[:60]} twice")
        places[name] = kind, data
    header = json.loads(_text(_opened(*places.pop(_HEADER), _LONGEST_HEADER)))
    rows, names = checked_layout(header)
    places.pop(AXES, None)
    for name, values in header["axes"].items():
        if (place := places.pop(f"axis_{name}", None)) is not None:
            found = _doubles(_opened(*place, _bound(len(values))), (len(values), 1))
            if not np.array_equal(found, np.array(values, dtype=float)):
                raise ValueError(f"an axis {name} other than announced")
    if set(places) != set(names):
        raise ValueError("columns that were not announced")
    shape = _shape(header)
    return Document(
        header, {n: _doubles(_opened(*places[n], _bound(rows)), shape, (rows, 1)) for n in names}
    )


class _Array(NamedTuple):
    """An array of a file: its class and flags, shape, name, and what follows."""

    flags: int
    shape: tuple[int, ...]
    name: str
    data: memoryview


def _bound(count: int) -> int:
    return _PREFIX + 8 * count


def _elements(content: memoryview) -> Iterator[tuple[int, memoryview]]:
    """Yield type and bytes of the elements one after another."""
    place = 0
    while place < len(content):
        kind, size = struct.unpack_from("<II", content, place)
        start, width = place + 8, size
        if kind >> 16:  # up to four bytes stand in the tag itself
            kind, size, start, width = kind & 0xFFFF, kind >> 16, place + 4, 4
        if size > width or start + size > len(content):
            raise ValueError("an array beyond the end of the file")
        yield kind, content[start : start + size]
        end = start + width
        place = end if kind == _COMPRESSED else end + -end % 8


def _opened(kind: int, data: memoryview, most: int) -> _Array:
    """Return an array; of a compressed one at most so many bytes are made."""
    if kind == _COMPRESSED:
        made = memoryview(zlib.decompressobj().decompress(data, most + 1))
        kind, size = struct.unpack_from("<II", made)
        if most != _PREFIX and size + 8 > len(made):
            raise ValueError("an array larger than announced, or cut off")
        data = made[8 : 8 + size]
    if kind != _MATRIX:
        raise ValueError("something other than arrays")
    place, parts = 0, []
    for _ in range(3):
        number, size = struct.unpack_from("<II", data, place)
        start, width = place + 8, size
        if number >> 16:
            number, size, start, width = number & 0xFFFF, number >> 16, place + 4, 4
        if size > min(width, len(data) - start):
            raise ValueError("an array beyond the end of the file")
        parts.append((number, data[start : start + size]))
        place = start + width + -(start + width) % 8
    (_, flags), (_, shape), (_, name) = parts
    return _Array(
        struct.unpack_from("<I", flags)[0],
        struct.unpack(f"<{len(shape) // 4}i", shape),
        bytes(name).decode("ascii"),
        data[place:],
    )


def _content(array: _Array, wanted: int) -> tuple[int, memoryview]:
    """Return type and bytes of the only element of an array of a class without flags."""
    # Flags beside the class tell of complex, global and logical arrays.
    if array.flags != wanted:
        raise ValueError(f"{array.name[:60]} neither of real doubles nor a text")
    found = list(_elements(array.data))
    if len(found) != 1:
        raise ValueError(f"{array.name[:60]} of {len(found)} parts")
    return found[0]


def _text(array: _Array) -> str:
    number, data = _content(array, _CHARACTERS)
    if array.shape[:1] != (1,) or number not in _TEXTS:
        raise ValueError("a header that is no row of text")
    return bytes(data).decode(_TEXTS[number])


def _doubles(array: _Array, *shapes: tuple[int, ...]) -> FloatArray:
    """Return the numbers of an array of one of some shapes, its last axis fastest."""
    number, data = _content(array, _DOUBLES)
    # Whole numbers are stored in as few bytes as they need.
    if number not in _NUMBERS or array.shape not in shapes:
        raise ValueError(f"{array.name[:60]} not of doubles of the grid's shape")
    values = np.frombuffer(data, _NUMBERS[number]).astype(float)
    if values.size != math.prod(array.shape):
        raise ValueError(f"{array.name[:60]} of another size than its shape")
    return np.asarray(values.reshape(array.shape, order="F").ravel())
