"""Translate CasADi SX functions, instruction by instruction, into Python that numba compiles.

The physics stays where it is written; what is generated here is its arithmetic, one line for
each instruction of the expression graph. Inputs are indexable (tuples or arrays) except
scalars; outputs are a float or a tuple of floats.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import casadi as ca

_UNARY = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_NEG: "-{0}",
    ca.OP_EXP: "math.exp({0})",
    ca.OP_LOG: "math.log({0})",
    ca.OP_SQRT: "math.sqrt({0})",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "2.0 * {0}",
    ca.OP_SIN: "math.sin({0})",
    ca.OP_COS: "math.cos({0})",
    ca.OP_TAN: "math.tan({0})",
    ca.OP_TANH: "math.tanh({0})",
    ca.OP_FABS: "abs({0})",
    ca.OP_INV: "1.0 / {0}",
    ca.OP_NOT: "(1.0 if {0} == 0.0 else 0.0)",
    ca.OP_SIGN: "(1.0 if {0} > 0.0 else (-1.0 if {0} < 0.0 else 0.0))",
}
_BINARY = {
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_POW: "{0} ** {1}",
    ca.OP_CONSTPOW: "{0} ** {1}",
    ca.OP_LT: "(1.0 if {0} < {1} else 0.0)",
    ca.OP_LE: "(1.0 if {0} <= {1} else 0.0)",
    ca.OP_EQ: "(1.0 if {0} == {1} else 0.0)",
    ca.OP_NE: "(1.0 if {0} != {1} else 0.0)",
    ca.OP_AND: "(1.0 if {0} != 0.0 and {1} != 0.0 else 0.0)",
    ca.OP_OR: "(1.0 if {0} != 0.0 or {1} != 0.0 else 0.0)",
    ca.OP_FMIN: "min({0}, {1})",
    ca.OP_FMAX: "max({0}, {1})",
    ca.OP_IF_ELSE_ZERO: "({1} if {0} != 0.0 else 0.0)",
}


def translate(function: Any) -> str:
    """Return the source of a Python function that computes what an SX function computes.

    Parameters
    ----------
    function : casadi.Function
        An SX function with dense inputs and one dense output.

    Returns
    -------
    str
        ``def name(i0, i1, ...)``; an input of one element is a float, any other is indexed.

    Raises
    ------
    NotImplementedError
        If the function uses an operation that has no translation.
    """
    sizes = [function.nnz_in(i) for i in range(function.n_in())]
    outputs = ["0.0"] * function.nnz_out(0)
    lines = []
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        sources, targets = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            outputs[targets[1]] = f"w{sources[0]}"
            lines.append(f"    o{targets[1]} = w{sources[0]}")
            continue
        if operation == ca.OP_INPUT:
            argument, element = sources
            value = f"i{argument}" if sizes[argument] == 1 else f"i{argument}[{element}]"
        elif operation == ca.OP_CONST:
            value = repr(float(function.instruction_constant(k)))
        elif operation in _UNARY:
            value = _UNARY[operation].format(f"w{sources[0]}")
        elif operation in _BINARY:
            value = _BINARY[operation].format(f"w{sources[0]}", f"w{sources[1]}")
        else:
            raise NotImplementedError(f"CasADi operation {operation} in {function.name()}")
        lines.append(f"    w{targets[0]} = {value}")
    # Work places are used again after an output is taken, hence the o-variables.
    result = ", ".join(f"o{i}" if value != "0.0" else "0.0" for i, value in enumerate(outputs))
    arguments = ", ".join(f"i{i}" for i in range(len(sizes)))
    if len(outputs) > 1:
        result = f"({result})"
    return "\n".join([f"def {function.name()}({arguments}):", *lines, f"    return {result}"])


def module_of(functions: Iterable[str]) -> str:
    """Return the source of a module of compiled functions, given that of each."""
    decorator = "@numba.njit(cache=True, error_model='numpy')"
    parts = [f"{decorator}\n{function}\n" for function in functions]
    return "\n\n".join(["import math\n\nimport numba\n", *parts])
