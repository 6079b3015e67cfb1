"""The exception that bad input raises, with its kin, and the checks that raise it."""

from __future__ import annotations

import contextlib
import math
import numbers
from collections.abc import Iterator, Mapping
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


class InputError(ValueError):
    """Input outside what is permitted.

    Parameters
    ----------
    parameter : str
        Name of the offending parameter, as the user typed or called it.
    value : object
        The value that was given.
    permitted : str
        What would have been accepted, as the end of "must be ...".

    Notes
    -----
    The message is a single line that names all three.
    """

    def __init__(self, parameter: str, value: object, permitted: str) -> None:
        plain = float(value) if isinstance(value, float) else value
        shown = plain if isinstance(plain, str) else repr(plain)
        super().__init__(" ".join(f"{parameter} = {shown}: must be {permitted}".split()))
        self.parameter = parameter
        self.value = value
        self.permitted = permitted

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.parameter, self.value, self.permitted)


@contextlib.contextmanager
def blamed_on(source: str, typed: Mapping[str, tuple[str, object]]) -> Iterator[None]:
    """Name where a value stands, and how it is written there, in messages about it.

    Parameters
    ----------
    source : str
        A file, or a part of one.
    typed : mapping
        Parameter → what it is called there and what is written, in units of its own.
    """
    try:
        yield
    except InputError as error:
        if error.parameter not in typed:
            raise
        (key, value), permitted = typed[error.parameter], error.permitted
        # What was refused as a text has its unit.
        if isinstance(value, str) and not isinstance(error.value, str):
            permitted = f"{permitted} in SI units"
        raise InputError(f"{key} in {source}", value, permitted) from None


class UndecidedError(InputError):
    """Input that is permitted, but beyond what could be decided of it.

    Parameters are those of `InputError`; ``permitted`` says what was tried.
    """


def interval_text(low: float = -math.inf, high: float = math.inf, *, open_low: bool = False) -> str:
    """Say an interval in words that follow "must be"."""
    if low == -math.inf and high == math.inf:
        return "a finite number"
    left = "(" if open_low or low == -math.inf else "["
    right = ")" if high == math.inf else "]"
    return f"a finite number in {left}{low:g}, {high:g}{right}"


def checked_number(
    parameter: str,
    value: object,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    open_low: bool = False,
    unit: str = "",
) -> float:
    """Return ``value`` as a float, or raise if it is no finite number in the interval.

    Parameters
    ----------
    parameter : str
        Name for the message.
    value : object
        Anything; booleans and strings are refused.
    low, high : float
        The closed interval of permitted values.
    open_low : bool
        Exclude ``low`` itself.
    unit : str
        Of the value and the interval, for the message.

    Raises
    ------
    InputError
        If ``value`` is not a finite real number in the interval.
    """
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        value = number = _as_float(value)
        if low <= number <= high and math.isfinite(number) and not (open_low and number == low):
            return number
    permitted = interval_text(low, high, open_low=open_low)
    if not unit:
        raise InputError(parameter, value, permitted)
    shown = f"{value:g} {unit}" if isinstance(value, float) else value
    raise InputError(parameter, shown, f"{permitted} {unit}")


def checked_integer(parameter: str, value: object, low: int, high: int) -> int:
    """Return ``value`` as an int, or raise if it is no whole number in ``[low, high]``.

    Raises
    ------
    InputError
        If ``value`` is not an integer in the interval; 4.0 counts as 4.
    """
    permitted = f"a whole number in [{low}, {high}]"
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise InputError(parameter, value, permitted)
    number = _as_float(value)
    if not math.isfinite(number) or number != int(number) or not low <= number <= high:
        raise InputError(parameter, value, permitted)
    return int(number)


def _as_float(value: numbers.Real) -> float:
    """Return a number as a float: −0 as 0, a whole number without a float as infinite."""
    try:
        return float(value) + 0.0
    except OverflowError:
        return math.inf
