"""A MuJoCo model as a Gymnasium environment, with pictures where there is an OpenGL context."""

import os
import subprocess
import sys
from pathlib import Path

import gymnasium.utils.env_checker
import numpy as np
import pytest

from sims.environment import SimulatorEnv
from sims.tasks import Task
from tests.sims.mujoco.robots import robot

DRAW = """
import numpy as np
from sims.render import renderer_for
from tests.sims.mujoco.robots import robot
draw = renderer_for(robot("arm2"))
a, b = draw.frame(np.zeros(4)), draw.frame(np.array([1.0, 0.5, 0, 0]))
assert a.shape == (240, 320, 3) and a.dtype == np.uint8, a.shape
assert (a != b).any() and (a == draw.frame(np.zeros(4))).all()
"""


class Rest(Task):
    horizon = 20

    def start(self, rng):
        return rng.normal(0, 0.1, 4)

    def reward(self, states, actions, next_states):
        return -(next_states**2).sum(axis=1)


@pytest.mark.filterwarnings("ignore:.*WARN")
def test_it_is_a_gymnasium_environment():
    env = SimulatorEnv(robot("arm2"), Rest())
    gymnasium.utils.env_checker.check_env(env, skip_render_check=True)
    first = [env.reset(seed=1)[0], *(env.step(np.ones(2))[0] for _ in range(3))]
    again = [env.reset(seed=1)[0], *(env.step(np.ones(2))[0] for _ in range(3))]
    assert np.array_equal(first, again)


def test_it_is_drawn_by_mujoco():
    done = subprocess.run(
        [sys.executable, "-c", DRAW],
        cwd=Path(__file__).parents[3],
        env={**os.environ, "MUJOCO_GL": os.environ.get("MUJOCO_GL", "egl"), "PYTHONPATH": "."},
        capture_output=True,
        text=True,
    )
    if done.returncode and "AssertionError" not in done.stderr:
        pytest.skip("no OpenGL context on this machine")
    assert done.returncode == 0, done.stderr
