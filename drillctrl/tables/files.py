"""Tables to files and back, by the file's ending, without loss."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.extras import required
from drillctrl.base.files import check_regular, replacing
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.tableio import csv_text
from drillctrl.drilling.plant import Plant, paper_plant
from drillctrl.tables.document import Document, checked_layout, from_document, to_document
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.grid import Axis
from drillctrl.tables.matlab import read_mat, write_mat

# Beyond this no table of at most a million nodes is meant.
MAX_BYTES = 1_000_000_000
_DIMENSIONLESS = "dimensionless"
_WHOLE = ("stable", "certified", "refused")
# Under this name pandas keeps what else than columns a file holds.
_ATTRIBUTES = b"PANDAS_ATTRS"


@checks_kinds
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


@checks_kinds
def load_table(path: str | Path, plant: Plant | None = None) -> GainTable:
    """Read a table that `save_table` wrote.

    Nothing in a file is ever executed. What is announced is compared with limits before
    anything that large is read.

    Parameters
    ----------
    path : str or Path
        The file.
    plant : Plant, optional
        What the gains were designed for, which a file names but cannot hold; by default the
        paper's.

    Raises
    ------
    InputError
        If there is no such file, it is truncated, changed, or no table at all, or its gains
        were designed for another plant.
    """
    check_table_path(path)
    source = Path(path)
    try:
        check_regular(source, MAX_BYTES)
        document = _FORMATS[source.suffix.lower()][1](source)
        return from_document(document, paper_plant() if plant is None else plant)
    except OSError as error:
        reason = error.strerror or "not in the format of its ending"
        raise InputError("table", str(path), f"a readable file ({reason})") from None
    except Exception as error:
        # The readers of other packages raise whatever a broken file makes them raise.
        reason = " ".join(f"{type(error).__name__} {error}".split())[:400]
        raise InputError("table", str(path), f"an intact gain table ({reason})") from None


def check_table_path(path: str | Path) -> None:
    """Raise `InputError` if a table cannot be written to or read from this name."""
    ending = Path(path).suffix.lower()
    if ending not in _FORMATS:
        raise InputError("table", str(path), f"a file that ends in {', '.join(_FORMATS)}")
    needs = {".parquet": "pyarrow", ".nc": "xarray"}.get(ending)
    if needs is not None:
        required(needs, "tables")


def _write_csv(document: Document, file: IO[bytes]) -> None:
    plain = [name for name, unit in document.header["units"].items() if unit == "1"]
    words = {**document.header, _DIMENSIONLESS: plain}
    header = [f"{name}: {json.dumps(value)}" for name, value in words.items()]
    shown = _shown(document.header)
    lists = [
        [str(bool(v)).lower() for v in values]
        if name in _WHOLE
        else map(repr, (shown.get(name, (name, 1.0))[1] * values).tolist())
        for name, values in document.columns.items()
    ]
    names = [shown.get(name, (name, 1.0))[0] for name in document.columns]
    file.write(csv_text(names, zip(*lists, strict=True), header).encode("ascii"))


def _shown(header: dict[str, Any]) -> dict[str, tuple[str, float]]:
    """Return for axes in SI under what name, and times what, they stand in a CSV file."""
    found = {}
    for name, values in header["axes"].items():
        unit, factor = Axis(name, tuple(values)).field_unit
        if unit and name in header["units"]:
            found[name] = f"{name}_{unit.replace('/', '_per_')}", factor
    return found


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
        header.pop(_DIMENSIONLESS, None)
        rows, names = checked_layout(header)
        shown = _shown(header)
        typed = line.rstrip("\r\n").split(",")
        # Files of earlier versions have all in SI.
        in_field = typed == [shown.get(name, (name, 1.0))[0] for name in names]
        if not in_field and typed != names:
            raise ValueError("columns that were not announced")
        values = np.zeros((len(names), rows))
        count = 0
        for count, row in enumerate(csv.reader(file), 1):
            if count > rows or len(row) != len(names):
                raise ValueError(f"row {count} has {len(row)} fields, or is one too many")
            words = {"true": "1", "false": "0"}
            values[:, count - 1] = [float(words.get(field, field)) for field in row]
    if count != rows:
        raise ValueError(f"{count} rows instead of the {rows} announced")
    columns = dict(zip(names, values, strict=True))
    if in_field:
        mesh = np.meshgrid(*header["axes"].values(), indexing="ij")
        for name, exact in zip(header["axes"], mesh, strict=True):
            if name in shown:
                if not np.allclose(columns[name], shown[name][1] * exact.ravel(), 1e-12, 0.0):
                    raise ValueError(f"a {name} that does not follow from the axes")
                # Units round the last bit.
                columns[name] = exact.ravel()
    return Document(header, columns)


def _write_json(document: Document, file: IO[bytes]) -> None:
    columns = {name: values.tolist() for name, values in document.columns.items()}
    text = json.dumps({**document.header, "columns": columns}, allow_nan=False, indent=1)
    file.write(text.encode("ascii") + b"\n")


def _read_json(path: Path) -> Document:
    data = json.loads(path.read_text(encoding="utf-8"))
    columns = data.pop("columns")
    _, names = checked_layout(data)
    if list(columns) != names:
        raise ValueError("columns that were not announced")
    return Document(data, {name: np.array(columns[name], dtype=float) for name in names})


def _write_parquet(document: Document, file: IO[bytes]) -> None:
    import pyarrow
    import pyarrow.parquet

    columns = {k: v != 0.0 if k in _WHOLE else v for k, v in document.columns.items()}
    table = pyarrow.table(columns)
    text = json.dumps(document.header)
    words = {"drillctrl": text, _ATTRIBUTES: json.dumps({"drillctrl": text})}
    pyarrow.parquet.write_table(table.replace_schema_metadata(words), file)


def _read_parquet(path: Path) -> Document:
    import pyarrow.parquet

    with pyarrow.parquet.ParquetFile(path) as file:
        words = file.schema_arrow.metadata or {}
        if b"drillctrl" not in words and _ATTRIBUTES not in words:
            raise ValueError(
                "its header is lost: write the frame with its attrs, as pandas 2.1 and later read "
                "and write them"
            )
        kept = words.get(b"drillctrl") or json.loads(words[_ATTRIBUTES])["drillctrl"]
        header = json.loads(kept)
        rows, names = checked_layout(header)
        if file.metadata.num_rows != rows:
            raise ValueError(f"{file.metadata.num_rows} rows, which were not announced")
        kinds = {name: "bool" if name in _WHOLE else "double" for name in names}
        if {field.name: str(field.type) for field in file.schema_arrow} != kinds:
            raise ValueError("columns that were not announced")
        data = file.read()
    return Document(header, {n: np.array(data[n].to_numpy(), dtype=float) for n in names})


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
        rows, names = checked_layout(header)
        axes = list(header["axes"])
        shape = tuple(len(values) for values in header["axes"].values())
        if tuple(data.sizes[name] for name in axes) != shape:
            raise ValueError("dimensions that were not announced")
        mesh = np.meshgrid(*(data[name].values for name in axes), indexing="ij")
        columns = {n: m.ravel() for n, m in zip(axes, mesh, strict=True) if n in names}
        if [*columns, *data.data_vars] != [*columns, *(n for n in names if n not in axes)]:
            raise ValueError("variables that were not announced")
        for name in map(str, data.data_vars):
            if data[name].dtype.kind != "f":
                raise ValueError(f"{name} not of doubles")
            columns[name] = np.array(data[name].values, dtype=float).reshape(rows)
    return Document(header, columns)


_Writer = Callable[[Document, IO[bytes]], None]
_Reader = Callable[[Path], Document]
_FORMATS: dict[str, tuple[_Writer, _Reader]] = {
    ".csv": (_write_csv, _read_csv),
    ".json": (_write_json, _read_json),
    ".parquet": (_write_parquet, _read_parquet),
    ".mat": (write_mat, read_mat),
    ".nc": (_write_netcdf, _read_netcdf),
}
ENDINGS = tuple(_FORMATS)
