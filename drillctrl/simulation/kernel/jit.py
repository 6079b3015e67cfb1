"""How the functions of the kernel are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core import types

njit: Any = numba.njit


def _compiled(**options: bool) -> Callable[[Any], Any]:
    """Return a decorator that compiles a function once for all numbers of a kind.

    Numba compiles another copy for each constant that is handed on, such as the kind of an
    event, and again for what a variable starts at; here a constant is a number like others.
    """

    def decorate(function: Any) -> Any:
        dispatcher = njit(cache=True, error_model="numpy", **options)(function)
        template = dispatcher.get_call_template
        dispatcher.get_call_template = lambda args, kws: template(
            tuple(types.unliteral(arg) for arg in args),
            {name: types.unliteral(arg) for name, arg in kws.items()},
        )
        return dispatcher

    return decorate


# Called from Python.
entry = _compiled()
# Called from compiled code alone: what would let Python in takes long to compile.
inner = _compiled(no_cpython_wrapper=True, no_cfunc_wrapper=True)
