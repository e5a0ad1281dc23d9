"""Commands of switches, as programs write them."""

import numpy as np
import pytest

from residual.logs import read_logs
from sims.simulator import Channel

STATES = (Channel("level", "1", "other"),)
ACTIONS = (Channel("pump", "1", "input"),)


@pytest.mark.parametrize(("on", "off"), [("True", "False"), ("on", "off"), ("TRUE", "FALSE")])
def test_true_and_on_are_one(tmp_path, on, off):
    duty = np.random.default_rng(0).integers(0, 2, 30)
    lines = [f"{i * 0.1:.1f},{i % 7},{on if value else off}" for i, value in enumerate(duty)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,level,pump", *lines]))
    (run,) = read_logs(path, STATES, ACTIONS).trajectories
    assert run.actions[:, 0].tolist() == duty[:-1].tolist()
