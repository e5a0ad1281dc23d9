"""Logs of made-up measurements, in the format that ``find_gap`` reads."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simgap_files import atomic_write_text

Array = NDArray[np.floating[Any]]


def write_log(
    path: Path, names: Sequence[str], times: Array, states: Array, actions: Array
) -> None:
    """Write one run as a CSV file; it appears whole or not at all.

    Args:
        path: Where to.
        names: Of the columns after ``time``: states, then actions.
        times: shape (T + 1,), s.
        states: shape (T + 1, n_s).
        actions: shape (T, n_a).
    """
    # The last command is never applied; a log holds it all the same.
    held = np.vstack([actions, actions[-1:]])
    text = io.StringIO()
    table = np.column_stack([times, states, held])
    np.savetxt(text, table, "%.9g", ",", header=",".join(["time", *names]), comments="")
    atomic_write_text(path, text.getvalue())
