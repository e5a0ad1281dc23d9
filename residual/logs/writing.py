"""Runs as log files, in the format that ``read_logs`` and ``find_gap`` take."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from residual.trajectories import Trajectory
from simgap_files.atomic import atomic_write_text
from sims.simulator import Channel


def write_log(
    path: Path, run: Trajectory, states: Sequence[Channel], actions: Sequence[Channel]
) -> None:
    """Write one run as a CSV file whose columns are named as the channels are.

    The file appears whole or not at all. Channels that were not measured have no column.

    Args:
        path: Where to.
        run: What was recorded.
        states: Channels of its states.
        actions: Channels of its actions.
    """
    import pandas as pd  # half a second to load, for who writes logs

    measured = np.asarray(np.isfinite(run.states).any(axis=0))
    seen = [channel.name for channel, there in zip(states, measured, strict=True) if there]
    # The last command is never applied; a log holds it all the same.
    held = np.vstack([run.actions, run.actions[-1:]])
    columns = np.column_stack([run.times, run.states[:, measured], held])
    table = pd.DataFrame(columns, columns=["time", *seen, *(c.name for c in actions)])
    atomic_write_text(path, table.to_csv(index=False, float_format="%.9g"))
