"""Refuse an argument of another kind than a public function's annotations name."""

from __future__ import annotations

import collections.abc
import functools
import inspect
import os
import types
import typing
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

from drillctrl.base.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
# What is looked at when it is read as a number or an array, with the range that is permitted.
_READ_LATER = (bool, int, float, complex, object)


def checks_kinds(function: Callable[P, R]) -> Callable[P, R]:
    """Return a function that looks at the kinds of its arguments before anything else.

    An annotation binds where it is a class, a mapping, a sequence, a function, or one of several
    of these. Numbers and arrays are left to the function, which knows their range.

    Raises
    ------
    InputError
        From the function returned, if an argument is of another kind.
    """
    names = tuple(inspect.signature(function).parameters)

    @functools.cache
    def kinds() -> dict[str, Any]:
        # At the first call: modules that annotations name have been imported by then.
        return {name: kind for name in names if (kind := _annotated(function, name)) is not None}

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        wanted = kinds()
        for name, value in (*zip(names, args, strict=False), *kwargs.items()):
            if name in wanted and not _is(value, wanted[name]):
                raise InputError(name, _told(value), f"{_named(wanted[name])}{_hint(wanted[name])}")
        return function(*args, **kwargs)

    return checked


def _annotated(function: Callable[..., Any], name: str) -> Any:
    """Return the kind that an annotation names, or None where it names none that binds."""
    parameter = inspect.signature(function).parameters[name]
    if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
        return None
    try:
        kind = eval(parameter.annotation, function.__globals__)
    except NameError:
        # Named for the type checker alone: of a library that is not imported here.
        return None
    return kind if all(_binds(part) for part in _parts(kind)) else None


def _parts(kind: Any) -> tuple[Any, ...]:
    """Return the alternatives of a kind."""
    if isinstance(kind, types.UnionType) or typing.get_origin(kind) is typing.Union:
        return tuple(part for one in typing.get_args(kind) for part in _parts(one))
    return (types.NoneType if kind is None else _base(kind),)


def _base(kind: Any) -> Any:
    """Return the class of a generic kind."""
    return typing.get_origin(kind) or kind


def _binds(part: Any) -> bool:
    """Whether values can be told to be of a kind."""
    unclear = part in _READ_LATER or not isinstance(part, type)
    return not unclear and not getattr(part, "_is_protocol", False)


def _is(value: object, kind: Any) -> bool:
    return any(_fits(value, part) for part in _parts(kind))


def _fits(value: object, part: Any) -> bool:
    if part in (collections.abc.Sequence, tuple, list):
        # A list does where a tuple is asked for, an array too; a word is no sequence of words.
        return isinstance(value, collections.abc.Iterable) and not isinstance(value, str | bytes)
    if part is os.PathLike:
        return isinstance(value, str | os.PathLike)
    return isinstance(value, part)


_WORDS: dict[Any, str] = {
    str: "a name",
    types.NoneType: "None",
    collections.abc.Sequence: "a sequence",
    tuple: "a sequence",
    list: "a sequence",
    collections.abc.Mapping: "a mapping",
    collections.abc.Callable: "a function",
}


def _named(kind: Any) -> str:
    """Say a kind as the end of "must be ..."."""
    parts = dict.fromkeys(_WORDS.get(part) or _with_article(part.__name__) for part in _parts(kind))
    *others, last = parts
    return f"{', '.join(others)} or {last}" if others else last


def _with_article(name: str) -> str:
    return f"an {name}" if name[0] in "AEIOU" else f"a {name}"


def _hint(kind: Any) -> str:
    """Say where one gets it from, where its class knows."""
    hints = [part.made_by for part in _parts(kind) if hasattr(part, "made_by")]
    return f", such as {hints[0]}" if hints else ""


def _told(value: object) -> str:
    """Name a value in few letters: a number or a word as it is, else its class."""
    if value is None or isinstance(value, str | int | float):
        return repr(value)[:60]
    return type(value).__name__
