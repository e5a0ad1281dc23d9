"""A policy can be trained on what find_gap corrected."""

import json

import numpy as np

from sims.effects import Delay, ParameterChange
from sims.environment import SimulatorEnv
from sims.loading import corrected_settings, simulator_settings
from sims.pendulum import Pendulum
from sims.tasks import SwingUp
from studies import pendulum_gap
from studies.learning.trial import build_parser


def test_the_difference_study_takes_a_corrected_simulator(tmp_path):
    effects = [ParameterChange("mass", 0.1 / 3), Delay("voltage", 0.03)]
    path = tmp_path / "corrected.yaml"
    path.write_text(json.dumps(corrected_settings(simulator_settings(
        "sims.pendulum.Pendulum"), effects)))  # fmt: skip
    parser = build_parser(pendulum_gap.STUDY)
    chosen = parser.instantiate(parser.parse_args(["--simulator", str(path)])).simulator
    assert chosen.effects == tuple(effects)
    mine, plain = (SimulatorEnv(s, SwingUp()) for s in (chosen, Pendulum()))
    assert mine.observation_space == plain.observation_space
    arguments = [
        "--simulator", str(path), "--budget.iterations", "0", "--budget.idealised_steps", "300",
        "--ddpg.hidden", "[16, 16]", "--ddpg.warm_up", "100", "--output", str(tmp_path / "policy"),
    ]  # fmt: skip
    pendulum_gap.main(arguments)
    config = json.loads((tmp_path / "policy" / "results.json").read_text())["config"]
    assert config["simulator"] == json.loads(path.read_text())
    observation, _ = mine.reset(seed=0)
    assert mine.observation_space.contains(observation)
    assert mine.observation_space.contains(mine.step(np.array([1.0]))[0])
