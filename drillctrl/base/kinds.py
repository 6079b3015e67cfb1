"""Refuse an argument of another kind than a public function's or class's annotations name."""

from __future__ import annotations

import collections.abc
import functools
import inspect
import numbers
import reprlib
import types
import typing
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np
import numpy.typing as npt

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
    of these. Numbers and arrays are left to the function, which knows their range; where it fails
    on them, an argument that is not of its kind down to each number is named.

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
        try:
            return function(*args, **kwargs)
        except InputError:
            raise
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            for name, value in (*zip(names, args, strict=False), *kwargs.items()):
                wish = _wish(_annotation(function, name), value)
                if wish is not None:
                    raise InputError(name, reprlib.repr(value), wish) from None
            raise

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
    annotation = _annotation(function, name)
    if annotation is None:
        return None
    parts = _parts(annotation)
    if not all(_binds(part) for part in parts):
        return None
    return _Kind(parts, any(part in _SEQUENCES for part in parts))


class _Arrays:
    """Names in annotations: whatever an array can be made of is one kind."""

    ArrayLike = np.ndarray
    NDArray = npt.NDArray


def _annotation(function: Callable[..., Any], name: str) -> Any:
    """Return what a parameter is annotated with, None where that cannot be told."""
    parameter = inspect.signature(function).parameters.get(name)
    if parameter is None or parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
        return None
    if parameter.annotation is parameter.empty:
        return None
    try:
        return eval(parameter.annotation, {**function.__globals__, "npt": _Arrays})
    except NameError:
        # Named for the type checker alone: of a library that is not imported here.
        return None


def _wish(kind: Any, value: object) -> str | None:
    """Return what a value is to be where it is not of a kind, down to each number; else None."""
    if isinstance(kind, types.UnionType) or typing.get_origin(kind) is typing.Union:
        wishes = [_wish(part, value) for part in typing.get_args(kind)]
        return None if None in wishes else " or ".join(dict.fromkeys(map(str, wishes)))
    base = typing.get_origin(kind) or kind
    while hasattr(base, "__value__"):
        # An alias by a type statement, as of numpy 2.5's arrays.
        base = typing.get_origin(base.__value__) or base.__value__
    if base in (float, int, complex):
        return None if _is_number(base, value) else _NUMBERS[base]
    if base is bool:
        return None if isinstance(value, bool | np.bool_) else "True or False"
    if base is np.ndarray:
        return None if _is_array(value, "complex" in str(kind)) else "an array of finite numbers"
    if base in (*_SEQUENCES, collections.abc.Iterable):
        return _wish_of_each(typing.get_args(kind), value)
    if base is collections.abc.Mapping and isinstance(value, base):
        return None if _wish_of_each(typing.get_args(kind)[:1], [*value]) is None else "by name"
    return _named(base) if _binds(base) and not isinstance(value, base) else None


_NUMBERS = {float: "a finite number", int: "a whole number", complex: "a finite number"}


def _is_number(kind: type, value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, numbers.Complex):
        return False
    if kind is not complex and not isinstance(value, numbers.Real):
        return False
    try:
        number = complex(value)
    except OverflowError:
        return False
    return bool(np.isfinite(number)) and (kind is not int or number.real.is_integer())


def _is_array(value: object, is_complex: bool) -> bool:
    try:
        array = np.asarray(value, dtype=complex if is_complex else float)
    except (TypeError, ValueError, OverflowError):
        return False
    return not isinstance(value, str) and array.size > 0 and bool(np.isfinite(array).all())


def _wish_of_each(kinds: tuple[Any, ...], value: object) -> str | None:
    """Return what a sequence is to be where it, or one of its members, is not of its kind."""
    is_flat = not isinstance(value, np.ndarray) or value.ndim == 1
    unordered = (str, bytes, collections.abc.Mapping, collections.abc.Set)
    if (
        isinstance(value, unordered)
        or not is_flat
        or not isinstance(value, collections.abc.Iterable)
    ):
        return "a sequence"
    members = list(value)
    if kinds and kinds[-1] is not Ellipsis and len(kinds) > 1:
        if len(members) != len(kinds):
            return f"a sequence of {len(kinds)}"
    else:
        kinds = kinds[:1] * len(members)
    wishes = [_wish(kind, member) for kind, member in zip(kinds, members, strict=False)]
    told = next((wish for wish in wishes if wish is not None), None)
    return None if told is None else f"a sequence, each {told}"


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
