"""Values as JSON and back: dataclasses of known names, tuples, mappings, numbers and arrays.

What is read is only ever put into classes that the reader listed, with exactly their fields;
nothing in a file names code.
"""

from __future__ import annotations

import dataclasses
import enum
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

# Nesting of what is written here stays far below it.
_DEEPEST = 40
_KINDS = {"float64": float, "int64": int, "bool": bool, "str": str, "complex128": complex}
_SCALARS = {
    "bool": (bool,),
    "int": (int,),
    "float": (float, int),
    "complex": (complex, float, int),
    "str": (str,),
    "None": (type(None),),
}

Special = Callable[[Any], Any]


def encode(value: Any, classes: Mapping[str, type[Any]], special: Special = lambda v: None) -> Any:
    """Return a value as JSON.

    Parameters
    ----------
    value : object
        Of the listed classes, or built in.
    classes : mapping
        Name → dataclass, named tuple or enumeration.
    special : callable, optional
        What stands for a value that has a form of its own; None for all others.

    Raises
    ------
    TypeError
        If something is of a class that is not listed.
    """
    names = {kind: name for name, kind in classes.items()}

    def inner(value: Any) -> Any:
        own = special(value)
        if own is not None:
            return own
        name = names.get(type(value))
        if name is not None:
            if isinstance(value, enum.Enum):
                return {"is": name, "value": value.value}
            return {"is": name, **{item: inner(getattr(value, item)) for item in _fields(value)}}
        if value is None or isinstance(value, bool | str):
            return value
        if isinstance(value, np.ndarray):
            kind = "str" if value.dtype.kind == "U" else value.dtype.name
            if kind not in _KINDS:
                raise TypeError(f"an array of {value.dtype}")
            flat = [_number(item) for item in value.ravel().tolist()]
            return {"array": kind, "shape": list(value.shape), "values": flat}
        if isinstance(value, int | float | complex | np.number):
            return _number(value.item() if isinstance(value, np.number) else value)
        if isinstance(value, tuple | list):
            return [inner(item) for item in value]
        if isinstance(value, Mapping):
            return {"map": {str(k): inner(v) for k, v in value.items()}}
        raise TypeError(f"a {type(value).__name__}")

    return inner(value)


def _fields(kind: Any) -> tuple[str, ...]:
    """Return the names of the fields of a dataclass or named tuple, or of one of its values."""
    if hasattr(kind, "_fields"):
        return tuple(kind._fields)
    return tuple(field.name for field in dataclasses.fields(kind))


def decode(
    data: Any,
    classes: Mapping[str, type[Any]],
    special: Mapping[str, Special] | None = None,
    depth: int = 0,
) -> Any:
    """Return what `encode` wrote.

    Parameters
    ----------
    data : object
        JSON.
    classes : mapping
        As in `encode`.
    special : mapping, optional
        Key of a form of its own → what makes a value of it.

    Raises
    ------
    Exception
        If it is nothing that `encode` writes: a `ValueError`, or whatever the classes raise.
    """
    if depth > _DEEPEST:
        raise ValueError("nested too deeply")

    def inner(value: Any) -> Any:
        return decode(value, classes, special, depth + 1)

    if isinstance(data, list):
        return tuple(inner(item) for item in data)
    if not isinstance(data, dict):
        return data
    for key, make in (special or {}).items():
        if set(data) == {key}:
            return make(data[key])
    if set(data) == {"number"}:
        return _read_number(data)
    if set(data) == {"map"}:
        return {str(key): inner(value) for key, value in data["map"].items()}
    if set(data) == {"array", "shape", "values"}:
        return _array(data)
    kind: Any = classes[data["is"]]
    rest = {key: value for key, value in data.items() if key != "is"}
    if issubclass(kind, enum.Enum):
        return kind(rest["value"])
    types = dict.fromkeys(_fields(kind), "object")
    later: set[str] = set()
    if dataclasses.is_dataclass(kind):
        types = {field.name: str(field.type) for field in dataclasses.fields(kind)}
        # What came later has a default.
        later = {f.name for f in dataclasses.fields(kind) if f.default is not dataclasses.MISSING}
    if not set(types) - later <= set(rest) <= set(types):
        raise ValueError(f"a {data['is']} with other entries than {', '.join(sorted(types))}")
    values = {name: inner(value) for name, value in rest.items()}
    for name, value in values.items():
        if not _is_scalar(value, types[name]):
            raise ValueError(f"{name} = {str(value)[:60]!r} in a {data['is']}, not {types[name]}")
    return kind(**values)


def _is_scalar(value: Any, annotation: str) -> bool:
    """Whether a value is of an annotated type, as far as that is built of plain ones."""
    parts = annotation.split(" | ")
    if not {*parts} <= {*_SCALARS}:
        return True
    return any(type(value) in _SCALARS[part] for part in parts)


def _number(value: Any) -> Any:
    """Return a number as JSON has it: no NaN, no infinity, nothing complex."""
    if isinstance(value, complex):
        return {"number": [_number(value.real), _number(value.imag)]}
    if isinstance(value, float) and not math.isfinite(value):
        return {"number": repr(value)}
    return value


def _read_number(data: Any) -> Any:
    if not isinstance(data, dict):
        return data
    given = data["number"]
    if isinstance(given, list):
        real, imag = (_read_number(part) for part in given)
        return complex(real, imag)
    if given not in ("nan", "inf", "-inf"):
        raise ValueError(f"a number {str(given)[:20]!r}")
    return float(given)


def _array(data: Mapping[str, Any]) -> Any:
    kind, shape = data["array"], tuple(data["shape"])
    wanted = _KINDS[kind]
    if not all(type(size) is int and size >= 0 for size in shape):
        raise ValueError(f"an array of shape {str(shape)[:40]}")
    values = [_read_number(item) for item in data["values"]]
    # A bool is an int in Python, and an int serves as a float.
    allowed = {float: (float, int), complex: (complex, float, int)}.get(wanted, (wanted,))
    if not all(type(item) in allowed for item in values):
        raise ValueError(f"an array of {kind} with something else in it")
    if len(values) != math.prod(shape):
        raise ValueError(f"{len(values)} values in an array of shape {shape}")
    return np.array(values, dtype=wanted).reshape(shape)
