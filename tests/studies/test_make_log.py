"""Walks become logs that find_gap can read."""

import json

import numpy as np
import pytest

from policy import Algorithm
from policy.ddpg import DDPG
from residual.logs import read_logs
from sims.environment import SimulatorEnv
from sims.leo import Leo, Walking
from studies import make_log


@pytest.fixture(scope="module")
def agent(tmp_path_factory):
    """Untrained: it stands for half a second before it falls."""
    env = SimulatorEnv(Leo(), Walking())
    path = tmp_path_factory.mktemp("policy") / "agent.safetensors"
    DDPG(env.observation_space, env.action_space, seed=0).save(path)
    return path


def test_walks_are_cut_at_falls_and_have_encoders_only(agent, tmp_path):
    options = ["--system", "leo", "--policy", str(agent), "--output", str(tmp_path)]
    make_log.main([*options, "--walk.transitions", "80"])
    leo = Leo()
    files = sorted(str(path) for path in tmp_path.glob("walk-*.csv"))
    runs = read_logs(files, leo.physical_channels, leo.action_channels).trajectories
    assert 0 < sum(len(run.actions) for run in runs) <= 80
    for run in runs:
        assert np.isnan(run.states[:, 9:]).all()
        assert not Walking().terminal(run.states[:-2]).any()
        # Noise of 0.002 rad on what hardly moves at first.
        assert 1e-4 < np.abs(np.diff(run.states[:3, 2])).max() < 0.1


def test_a_walk_needs_a_policy(tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        make_log.main(["--system", "leo", "--output", str(tmp_path)])
    assert stopped.value.code == 2
    assert "--policy" in capsys.readouterr().err


def test_a_policy_of_another_algorithm_walks_too(tmp_path, capsys):
    options = {"policy_kwargs": {"net_arch": [8, 8]}}
    env = SimulatorEnv(Leo(), Walking())
    file = tmp_path / "sac.safetensors"
    Algorithm("stable_baselines3.SAC", options=options).make(env, 0).save(file)
    command = ["--system", "leo", "--policy", str(file), "--output", str(tmp_path / "walks")]
    command += ["--walk.transitions", "60"]
    named = [*command, "--learner", "stable_baselines3.SAC"]
    for wrong, says in ((command, "--learner"), (named, "options that they were learnt with")):
        with pytest.raises(SystemExit, match="2"):
            make_log.main(wrong)
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and "sac.safetensors" in said and says in said
    make_log.main([*named, "--learner_options", json.dumps(options)])
    assert list((tmp_path / "walks").glob("walk-*.csv"))


@pytest.mark.parametrize(
    ("option", "says"),
    [
        ("delay=-0.1", "truth.delay is -0.1, expected 0 or more"),
        ("mass=-1", "truth.mass is -1, expected more than -1"),
    ],
)
def test_what_no_pendulum_can_have_is_refused(tmp_path, capsys, option, says):
    with pytest.raises(SystemExit, match="2"):
        make_log.main(["--output", str(tmp_path / "logs"), f"--truth.{option}"])
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and says in said
    assert not (tmp_path / "logs").exists()
