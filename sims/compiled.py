"""How this package compiles what is stepped row by row: by numba, once per machine.

Nothing is reordered, so that compiled code rounds as Python does, and a row alone as in a batch.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

F = TypeVar("F", bound=Callable[..., Any])


def inlined(function: F) -> F:
    """Compile as a part of every caller: a call that passes arrays costs more than a short loop."""
    result: Any = numba.njit(inline="always", error_model="numpy")(function)
    return result


def compiled(function: F) -> F:
    """Compile at the first call, and keep the result on disk for the next process if possible.

    The cache knows the file of a function, not those of the functions that it calls: what is
    compiled together stands in one file.
    """
    try:
        return _compiled(function, keep=True)
    except RuntimeError:  # no directory to keep it in
        return _compiled(function, keep=False)


def _compiled(function: F, keep: bool) -> F:
    result: Any = numba.njit(cache=keep, error_model="numpy")(function)
    return result


def _call_at(_: Any, address: Any, first: Any, second: Any) -> Any:
    """Inside compiled code: a C function of two doubles to a double, by its address.

    So that compiled loops can ask Python for what cannot be compiled, such as an effect of the
    user's own; see ``ctypes.CFUNCTYPE``.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        double = ir.DoubleType()
        pointer = ir.FunctionType(double, [double, double]).as_pointer()
        where, *values = arguments
        return builder.call(builder.inttoptr(where, pointer), values)

    return types.float64(types.int64, types.float64, types.float64), generate


call_at: Any = intrinsic(_call_at)
