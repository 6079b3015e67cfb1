"""Tables to files and back, by the file's ending, without loss."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import numpy as np

from drillctrl.errors import InputError
from drillctrl.files import replacing
from drillctrl.tables.document import Document, announced_rows, from_document, to_document
from drillctrl.tables.table import GainTable

# Beyond this no table of at most a million nodes is meant.
MAX_BYTES = 2_000_000_000
_WHOLE = ("stable", "certified")


def save_table(table: GainTable, path: str | Path) -> None:
    """Write a table, whole or not at all.

    Parameters
    ----------
    table : GainTable
        Of `table` or `load_table`.
    path : str or Path
        ``.csv``, ``.json``, ``.parquet`` (pyarrow), ``.mat`` (MATLAB 5) or ``.nc`` (NetCDF 3,
        xarray). All hold the same numbers and header, and `load_table` reads all of them.

    Raises
    ------
    InputError
        If the ending is none of these, or a package for it is missing.
    OSError
        If the file cannot be written; an existing one is then left as it was.
    """
    check_table_path(path)
    document = to_document(table)
    with replacing(path) as file:
        _FORMATS[Path(path).suffix.lower()][0](document, file)


def load_table(path: str | Path) -> GainTable:
    """Read a table that `save_table` wrote.

    Nothing in a file is ever executed. What is announced is compared with limits before
    anything that large is read.

    Raises
    ------
    InputError
        If there is no such file, or it is truncated, changed, or no table at all.
    """
    check_table_path(path)
    source = Path(path)
    try:
        if source.stat().st_size > MAX_BYTES:
            raise ValueError("a file of more than 2 GB")
        document = _FORMATS[source.suffix.lower()][1](source)
    except OSError as error:
        reason = error.strerror or "not in the format of its ending"
        raise InputError("table", str(path), f"a readable file ({reason})") from None
    except Exception as error:
        # The readers of other packages raise whatever a broken file makes them raise.
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError("table", str(path), f"an intact gain table ({reason})") from None
    return from_document(document)


def check_table_path(path: str | Path) -> None:
    """Raise `InputError` if a table cannot be written to or read from this name."""
    ending = Path(path).suffix.lower()
    if ending not in _FORMATS:
        raise InputError("table", str(path), f"a file that ends in {', '.join(_FORMATS)}")
    needs = {".parquet": "pyarrow", ".nc": "xarray"}.get(ending)
    if needs is not None:
        from importlib.util import find_spec

        if find_spec(needs) is None:
            raise InputError("table", str(path), f"a .csv or .json file, or {needs} installed")


def _write_csv(document: Document, file: IO[bytes]) -> None:
    text = io.StringIO()
    for name, value in document.header.items():
        text.write(f"# {name}: {json.dumps(value)}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(document.columns)
    lists = [
        [str(bool(v)).lower() for v in values] if name in _WHOLE else map(repr, values.tolist())
        for name, values in document.columns.items()
    ]
    writer.writerows(zip(*lists, strict=True))
    file.write(text.getvalue().encode("ascii"))


def _read_csv(path: Path) -> Document:
    header: dict[str, Any] = {}
    with open(path, encoding="ascii", newline="") as file:
        for line in file:
            if not line.startswith("#"):
                break
            name, _, value = line[1:].partition(":")
            header[name.strip()] = json.loads(value)
        else:
            raise ValueError("no rows")
        rows = announced_rows(header)
        names = line.rstrip("\r\n").split(",")
        values = np.zeros((len(names), rows))
        count = 0
        for count, row in enumerate(csv.reader(file), 1):
            if count > rows or len(row) != len(names):
                raise ValueError(f"row {count} has {len(row)} fields, or is one too many")
            words = {"true": "1", "false": "0"}
            values[:, count - 1] = [float(words.get(field, field)) for field in row]
    if count != rows:
        raise ValueError(f"{count} rows instead of the {rows} announced")
    return Document(header, dict(zip(names, values, strict=True)))


def _write_json(document: Document, file: IO[bytes]) -> None:
    columns = {name: values.tolist() for name, values in document.columns.items()}
    text = json.dumps({**document.header, "columns": columns}, allow_nan=False, indent=1)
    file.write(text.encode("ascii") + b"\n")


def _read_json(path: Path) -> Document:
    data = json.loads(path.read_text(encoding="utf-8"))
    columns = data.pop("columns")
    announced_rows(data)
    return Document(data, {k: np.array(v, dtype=float) for k, v in columns.items()})


def _write_parquet(document: Document, file: IO[bytes]) -> None:
    import pyarrow
    import pyarrow.parquet

    columns = {k: v != 0.0 if k in _WHOLE else v for k, v in document.columns.items()}
    table = pyarrow.table(columns)
    text = json.dumps(document.header).encode()
    pyarrow.parquet.write_table(table.replace_schema_metadata({"drillctrl": text}), file)


def _read_parquet(path: Path) -> Document:
    import pyarrow.parquet

    with pyarrow.parquet.ParquetFile(path) as file:
        header = json.loads(file.schema_arrow.metadata[b"drillctrl"])
        if file.metadata.num_rows != announced_rows(header):
            raise ValueError(f"{file.metadata.num_rows} rows, which were not announced")
        data = file.read()
    columns = {n: np.array(data[n].to_numpy(), dtype=float) for n in data.column_names}
    return Document(header, columns)


def _write_mat(document: Document, file: IO[bytes]) -> None:
    import scipy.io

    buffer = io.BytesIO()
    fields: dict[str, Any] = {name: v[:, None] for name, v in document.columns.items()}
    scipy.io.savemat(buffer, {**fields, "header": json.dumps(document.header)})
    content = bytearray(buffer.getvalue())
    # The description that savemat writes holds the time of day.
    content[:116] = b"MATLAB 5.0 MAT-file, drillctrl gain table".ljust(116)
    file.write(bytes(content))


def _read_mat(path: Path) -> Document:
    import scipy.io

    content = path.read_bytes()
    sizes = {name: shape for name, shape, _ in scipy.io.whosmat(io.BytesIO(content))}
    if any(math.prod(shape) > MAX_BYTES // 8 for shape in sizes.values()):
        raise ValueError("arrays that belong to no table")
    data = scipy.io.loadmat(io.BytesIO(content))
    header = json.loads(str(data["header"][0]))
    announced_rows(header)
    names = [name for name in data if not name.startswith("__") and name != "header"]
    return Document(header, {name: np.array(data[name][:, 0], dtype=float) for name in names})


def _write_netcdf(document: Document, file: IO[bytes]) -> None:
    import xarray

    header = document.header
    axes = list(header["axes"])
    shape = [len(values) for values in header["axes"].values()]
    # The axes are coordinates; a dimensionless grid has them as columns too.
    coordinates = {
        name: (name, np.array(values), {"units": header["units"].get(name, "1")})
        for name, values in header["axes"].items()
    }
    variables = {
        name: (axes, values.reshape(shape), {"units": header["units"][name], "long_name": name})
        for name, values in document.columns.items()
        if name not in axes
    }
    attributes = {
        "Conventions": "CF-1.8",
        "title": "drillctrl gain table",
        "comment": header["sign_convention"],
        "source": f"drillctrl {header['drillctrl']}",
        "drillctrl_header": json.dumps(header),
    }
    data = xarray.Dataset(variables, coordinates, attributes)
    # Nothing is missing, so no value stands for that.
    encoding = {name: {"_FillValue": None} for name in data.variables}
    file.write(bytes(data.to_netcdf(None, engine="scipy", encoding=encoding)))


def _read_netcdf(path: Path) -> Document:
    import xarray

    content = io.BytesIO(path.read_bytes())
    with xarray.open_dataset(content, engine="scipy", decode_cf=False) as data:
        header = json.loads(data.attrs["drillctrl_header"])
        rows = announced_rows(header)
        axes = list(header["axes"])
        shape = tuple(len(values) for values in header["axes"].values())
        if tuple(data.sizes[name] for name in axes) != shape:
            raise ValueError("dimensions that were not announced")
        mesh = np.meshgrid(*(data[name].values for name in axes), indexing="ij")
        columns = {n: m.ravel() for n, m in zip(axes, mesh, strict=True) if n in header["units"]}
        for name in data.data_vars:
            columns[str(name)] = np.array(data[name].values, dtype=float).reshape(rows)
    return Document(header, columns)


_Writer = Callable[[Document, IO[bytes]], None]
_Reader = Callable[[Path], Document]
_FORMATS: dict[str, tuple[_Writer, _Reader]] = {
    ".csv": (_write_csv, _read_csv),
    ".json": (_write_json, _read_json),
    ".parquet": (_write_parquet, _read_parquet),
    ".mat": (_write_mat, _read_mat),
    ".nc": (_write_netcdf, _read_netcdf),
}
ENDINGS = tuple(_FORMATS)
