"""The loop on a system of which sensors do not tell the state, through the command line."""

import json

import numpy as np
import pytest
import quick_gap

from residual.trajectories import Transitions
from simgap_files.npz import write_npz

TINY = [
    "--estimator", "residual.Linear",
    "--budget.true_samples", "40",
    "--budget.iterations", "1",
    "--budget.idealised_steps", "300",
    "--budget.difference_steps", "300",
    "--ddpg.hidden", "16", "16",
    "--ddpg.warm_up", "200",
]  # fmt: skip


@pytest.mark.parametrize(
    "sensors",
    [
        pytest.param(["--measure.noise", "0.01", "0.2"], marks=pytest.mark.long),
        pytest.param(
            ["--measure.noise", "0.01", "0.2", "--measure.unmeasured", "rate"],
            marks=pytest.mark.long,
        ),
        ["--measure.steps", "0.0015", "0", "--measure.unmeasured", "rate", "--measure.delay", "1"],
    ],
    ids=["noise", "no rate", "steps, late, no rate"],
)
def test_a_run_ends_and_runs_on_from_what_it_kept(sensors, tmp_path, capsys):
    for _ in range(2):
        quick_gap.main([*TINY, *sensors, "--output", str(tmp_path / "run")])
        found = json.loads((tmp_path / "run" / "results.json").read_text())
        (accuracy,) = found["accuracy"]
        assert np.isfinite(accuracy["visited"]["one_step"]["rate"])
        (tmp_path / "run" / "results.json").unlink()
    assert "Linear, update 1" in capsys.readouterr().out


def test_a_channel_without_a_sensor_is_kept_and_holes_are_refused(tmp_path):
    states = np.column_stack([np.arange(4.0), np.full(4, np.nan)])
    whole = Transitions(states, np.zeros((4, 1)), states + np.array([1, 0]), np.zeros(4, int))
    whole.save(tmp_path / "a.npz")
    again = Transitions.load(tmp_path / "a.npz")
    np.testing.assert_array_equal(again.states, states)
    states[2, 0] = np.nan
    says = r"b\.npz: states holds values that are not finite, first in row 2"
    with pytest.raises(ValueError, match=says):
        whole.save(tmp_path / "b.npz")
    assert not (tmp_path / "b.npz").exists()
    write_npz(tmp_path / "b.npz", vars(whole))
    with pytest.raises(ValueError, match=says):
        Transitions.load(tmp_path / "b.npz")
