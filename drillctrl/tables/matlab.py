"""Tables as MATLAB 5 files: arrays of the grid's shape, read back with bounds on everything."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import IO, Any

import numpy as np

from drillctrl.base.mat5 import bound, doubles, mat_places, opened, text
from drillctrl.tables.document import Document, checked_layout

AXES = "axes"
_HEADER = "header"
# A header with the cells of the largest table has fewer bytes.
_LONGEST_HEADER = 200_000_000


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

    Raises
    ------
    ValueError
        If it is of another version, or holds other arrays than announced.
    """
    places = mat_places(path)
    header = json.loads(text(opened(*places.pop(_HEADER), _LONGEST_HEADER)))
    rows, names = checked_layout(header)
    places.pop(AXES, None)
    for name, values in header["axes"].items():
        if (place := places.pop(f"axis_{name}", None)) is not None:
            found = doubles(opened(*place, bound(len(values))), (len(values), 1))
            if not np.array_equal(found, np.array(values, dtype=float)):
                raise ValueError(f"an axis {name} other than announced")
    if set(places) != set(names):
        raise ValueError("columns that were not announced")
    shape = _shape(header)
    return Document(
        header, {n: doubles(opened(*places[n], bound(rows)), shape, (rows, 1)) for n in names}
    )
