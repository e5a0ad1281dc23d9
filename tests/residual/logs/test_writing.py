"""What is written as a log is read again as it was."""

import numpy as np
import pytest
from swings import ACTIONS, STATES, swing

from residual.logs import read_logs
from residual.logs.writing import write_log
from residual.trajectories import Trajectory


@pytest.mark.parametrize("unmeasured", [[], [1]])
def test_a_run_that_was_written_is_read_again(tmp_path, unmeasured):
    columns = swing()
    states = np.column_stack([columns["angle"], columns["rate"]])
    states[:, unmeasured] = np.nan
    path = tmp_path / "run.csv"
    run = Trajectory("run", columns["time"], states, columns["voltage"][:-1, None])
    write_log(path, run, STATES, ACTIONS)
    (found,) = read_logs([str(path)], STATES, ACTIONS).trajectories
    assert ("rate" in path.read_text()) == (not unmeasured)
    for name in ("times", "states", "actions"):
        np.testing.assert_allclose(getattr(found, name), getattr(run, name), rtol=1e-8, atol=1e-9)
