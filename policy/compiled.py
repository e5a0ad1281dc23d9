"""How this package compiles its inner loops: by numba, once per machine.

Between two matrix products of an update lie a dozen passes over small arrays. Called one by one
from Python, by way of a tensor library, they cost a tenth of the update; compiled, next to none.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, TypeVar

import numba

# Numba's products call it; once it is loaded, thread limits hold.
importlib.import_module("scipy.linalg.blas")

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile at the first call, and keep the result on disk for the next process if possible.

    Sums may be reordered, so that they vectorise; infinities and NaN keep their meaning.
    """
    try:
        return _compiled(function, keep=True)
    except RuntimeError:  # no directory to keep it in
        return _compiled(function, keep=False)


def _compiled(function: F, keep: bool) -> F:
    reordered = {"reassoc", "contract", "nsz"}
    result: Any = numba.njit(cache=keep, error_model="numpy", fastmath=reordered)(function)
    return result
