"""How the functions of the kernel are compiled."""

from __future__ import annotations

from typing import Any

import numba

njit: Any = numba.njit
# Called from Python.
entry = njit(cache=True, error_model="numpy")
# Called from compiled code alone: what would let Python in takes long to compile.
inner = njit(cache=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
