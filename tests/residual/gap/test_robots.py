"""find_gap on MuJoCo models: ours, and one that another package ships."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest

from residual.gap import find_gap
from sims.mujoco import MujocoSimulator
from studies.robots.cases import Case, ask
from studies.robots.truth import Sensors, Truth

PUBLIC = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / "inverted_pendulum.xml"


@pytest.mark.long
@pytest.mark.parametrize(
    ("robot", "hidden"),
    [
        ("arm2", ("frictionloss of joint elbow",)),
        ("arm2", ("frictionloss of joint elbow", "mass of body fore")),
        ("cart_pole", ("mass of body pole",)),
    ],
)
def test_what_is_hidden_in_a_robot_is_named(robot, hidden):
    answer = ask(Case(robot, hidden, 0))
    assert answer["right"], answer["named"]
    assert not answer["confirmed_wrong"]


@pytest.mark.long
def test_a_public_model_is_searched_as_it_is():
    truth = Truth(PUBLIC, {"damping of joint hinge": 0.4})
    rng = np.random.default_rng(0)

    # Balanced: a pole that lies at its stop says nothing of damping.
    def balance(phase):
        def command(t, q, v):
            sway = 0.15 * np.sin(5 * t + phase) + 0.1 * np.sin(13 * t)
            return np.array([3 * q[1] + 0.6 * v[1] + 0.3 * q[0] + 0.4 * v[0] + sway])

        return command

    sensors = Sensors(period=0.02)
    logs = [
        truth.run(balance(a), 5.0, sensors, rng, (np.array([0, 0.1 * a]), np.zeros(2)), f"run {a}")
        for a in (0.5, -0.8, 1.2, -1.4)
    ]
    simulator = MujocoSimulator(str(PUBLIC), dt=0.02)
    result = find_gap(simulator, logs, minutes=2.0)
    named = [verdict for verdict in result.verdicts if verdict.effect]
    assert named[0].effect == "damping of joint hinge"
