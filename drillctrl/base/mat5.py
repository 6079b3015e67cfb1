"""Arrays of MATLAB 5 files, read with bounds on everything.

Not by scipy's `loadmat`: it takes a file's word for types and sizes, so that a wrong byte
ends the process, and a small compressed file fills the memory.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import FloatArray

# Of a little-endian file: its version, that of 7.3, and the types of its elements.
_VERSION, _NEWER = b"\x00\x01IM", b"\x00\x02IM"
_MATRIX, _COMPRESSED = 14, 15
_NUMBERS = {
    **{1: "<i1", 2: "<u1", 3: "<i2", 4: "<u2", 5: "<i4", 6: "<u4"},
    **{7: "<f4", 9: "<f8", 12: "<i8", 13: "<u8"},
}
_TEXTS = {1: "latin1", 2: "latin1", 4: "utf-16-le", 16: "utf-8", 17: "utf-16-le"}
# Classes of arrays.
_CHARACTERS, _DOUBLES = 4, 6
# What stands before the data of an array has fewer bytes.
PREFIX = 1024


def mat_places(path: Path) -> dict[str, tuple[int, memoryview]]:
    """Return where the arrays of a file stand, by name.

    Raises
    ------
    ValueError
        If the file is of another version, damaged, or names an array twice.
    """
    content = memoryview(path.read_bytes())
    if bytes(content[124:128]) == _NEWER or bytes(content[:8]) == b"\x89HDF\r\n\x1a\n":
        raise ValueError("MATLAB 7.3, which is HDF5: save it with save(..., '-v7') instead")
    if bytes(content[124:128]) != _VERSION:
        raise ValueError("not a MATLAB 5 file")
    places: dict[str, tuple[int, memoryview]] = {}
    for kind, data in mat_elements(content[128:]):
        name = opened(kind, data, PREFIX).name
        if name in places:
            raise ValueError(f"{name[:60]} twice")
        places[name] = kind, data
    return places


class MatArray(NamedTuple):
    """An array of a file: its class and flags, shape, name, and what follows."""

    flags: int
    shape: tuple[int, ...]
    name: str
    data: memoryview


def bound(count: int) -> int:
    """Return the most bytes that an array of so many numbers takes."""
    return PREFIX + 8 * count


def mat_elements(content: memoryview) -> Iterator[tuple[int, memoryview]]:
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


def opened(kind: int, data: memoryview, most: int) -> MatArray:
    """Return an array; of a compressed one at most so many bytes are made."""
    if kind == _COMPRESSED:
        made = memoryview(zlib.decompressobj().decompress(data, most + 1))
        kind, size = struct.unpack_from("<II", made)
        if most != PREFIX and size + 8 > len(made):
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
    return MatArray(
        struct.unpack_from("<I", flags)[0],
        struct.unpack(f"<{len(shape) // 4}i", shape),
        bytes(name).decode("ascii"),
        data[place:],
    )


def _content(array: MatArray, wanted: int) -> tuple[int, memoryview]:
    """Return type and bytes of the only element of an array of a class without flags."""
    # Flags beside the class tell of complex, global and logical arrays.
    if array.flags != wanted:
        raise ValueError(f"{array.name[:60]} neither of real doubles nor a text")
    found = list(mat_elements(array.data))
    if len(found) != 1:
        raise ValueError(f"{array.name[:60]} of {len(found)} parts")
    return found[0]


def text(array: MatArray) -> str:
    """Return a row of characters."""
    number, data = _content(array, _CHARACTERS)
    if array.shape[:1] != (1,) or number not in _TEXTS:
        raise ValueError("a header that is no row of text")
    return bytes(data).decode(_TEXTS[number])


def doubles(array: MatArray, *shapes: tuple[int, ...]) -> FloatArray:
    """Return the numbers of an array of one of some shapes, its last axis fastest."""
    number, data = _content(array, _DOUBLES)
    # Whole numbers are stored in as few bytes as they need.
    if number not in _NUMBERS or array.shape not in shapes:
        raise ValueError(f"{array.name[:60]} not of doubles of the grid's shape")
    values = np.frombuffer(data, _NUMBERS[number]).astype(float)
    if values.size != math.prod(array.shape):
        raise ValueError(f"{array.name[:60]} of another size than its shape")
    return np.asarray(values.reshape(array.shape, order="F").ravel())
