"""Refuse an argument of another kind than a public function's or class's annotations name."""

from __future__ import annotations

import collections.abc
import functools
import inspect
import types
import typing
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from drillctrl.base.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
# Of kinds that are not ours, those whose values can be told at once: numbers and arrays are read
# later, with the range that is permitted, and what other libraries do their work with may be any
# object that does the same.
_TOLD = (str, types.NoneType, Path, collections.abc.Mapping, collections.abc.Callable)
_SEQUENCES = (collections.abc.Sequence, tuple, list)


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
    def kinds() -> dict[str, _Kind]:
        # At the first call: modules that annotations name have been imported by then.
        return {name: kind for name in names if (kind := _annotated(function, name)) is not None}

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        wanted = kinds()
        for name, value in (*zip(names, args, strict=False), *kwargs.items()):
            kind = wanted.get(name)
            if kind is not None and not kind.fits(value):
                raise InputError(name, _told(value), kind.wanted())
        return function(*args, **kwargs)

    return checked


def makes_of_kinds(made: type[R]) -> type[R]:
    """Return a class whose maker looks at the kinds of its arguments before anything else."""
    made.__init__ = checks_kinds(made.__init__)  # type: ignore[method-assign]
    return made


@dataclass(frozen=True)
class _Kind:
    """Alternatives, of which a value is to be one."""

    classes: tuple[type, ...]
    # A list does where a tuple is asked for, an array too.
    sequence: bool

    def fits(self, value: object) -> bool:
        if isinstance(value, self.classes):
            return True
        # A word is no sequence of words.
        return (
            self.sequence
            and isinstance(value, collections.abc.Iterable)
            and not isinstance(value, str | bytes)
        )

    def wanted(self) -> str:
        """Say it as the end of "must be ...", and where one gets it from if its class knows."""
        *others, last = dict.fromkeys(_named(part) for part in self.classes)
        named = f"{', '.join(others)} or {last}" if others else last
        hints = [part.made_by for part in self.classes if hasattr(part, "made_by")]
        return f"{named}, such as {hints[0]}" if hints else named


def _annotated(function: Callable[..., Any], name: str) -> _Kind | None:
    """Return the kind that an annotation names, or None where it names none that binds."""
    parameter = inspect.signature(function).parameters[name]
    if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
        return None
    if parameter.annotation is parameter.empty:
        return None
    try:
        parts = _parts(eval(parameter.annotation, function.__globals__))
    except NameError:
        # Named for the type checker alone: of a library that is not imported here.
        return None
    if not all(_binds(part) for part in parts):
        return None
    return _Kind(parts, any(part in _SEQUENCES for part in parts))


def _parts(kind: Any) -> tuple[Any, ...]:
    """Return the alternatives of a kind, each without what it is a sequence or mapping of."""
    if isinstance(kind, types.UnionType) or typing.get_origin(kind) is typing.Union:
        return tuple(part for one in typing.get_args(kind) for part in _parts(one))
    return (types.NoneType if kind is None else typing.get_origin(kind) or kind,)


def _binds(part: Any) -> bool:
    """Whether values can be told to be of a kind."""
    if not isinstance(part, type) or hasattr(part, "_is_protocol"):
        return False
    return part in _TOLD or part in _SEQUENCES or part.__module__.startswith("drillctrl.")


_WORDS: dict[Any, str] = {
    str: "a name",
    types.NoneType: "None",
    collections.abc.Sequence: "a sequence",
    tuple: "a sequence",
    list: "a sequence",
    collections.abc.Mapping: "a mapping",
    collections.abc.Callable: "a function",
}


def _named(part: type) -> str:
    name = part.__name__
    return _WORDS.get(part) or f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _told(value: object) -> str:
    """Name a value in few letters: a number or a word as it is, else its class."""
    if value is None or isinstance(value, str | int | float):
        return repr(value)[:60]
    return type(value).__name__
