"""Runs as log files, in the format that ``read_logs`` and ``find_gap`` take."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simgap_files.atomic import atomic_write_text

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
    columns = np.column_stack([times, states, np.vstack([actions, actions[-1:]])])
    table = pd.DataFrame(columns, columns=["time", *names])
    atomic_write_text(path, table.to_csv(index=False, float_format="%.9g"))
