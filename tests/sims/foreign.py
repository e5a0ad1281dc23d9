"""The true pendulum as an environment of somebody else, and a task of one."""

import gymnasium
import numpy as np

from sims.pendulum_equation import PendulumEquation
from sims.simulator import wrap
from sims.tasks import SwingUp


class Foreign(gymnasium.Env):
    """The true pendulum as somebody else wrote it: angles cut at half a turn, states hidden."""

    action_space = gymnasium.spaces.Box(-3.0, 3.0, (1,), np.float32)
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float64)

    def __init__(self, report=True, dt=0.05, ends_after=None):
        self.report, self.dt, self.ends_after = report, dt, ends_after

    def _seen(self):
        cut = np.array([wrap(self.state[0]), self.state[1]])
        return cut, {"state": cut} if self.report else {}

    def reset(self, seed=None, options=None):
        super().reset(seed=seed)
        self.state, self.steps = np.array([3.1, self.np_random.uniform(0, 0.1)]), 0
        return self._seen()

    def step(self, action):
        assert action.dtype == np.float32
        self.state = PendulumEquation.true().step(self.state[None], action[None])[0]
        self.steps += 1
        return self._seen()[0], -99.0, self.steps == self.ends_after, False, self._seen()[1]


def episode(env, steps, push):
    """States and rewards under a constant action."""
    _, info = env.reset(seed=4)
    states, rewards, ended = [info["state"]], [], False
    while len(rewards) < steps and not ended:
        _, reward, terminated, truncated, info = env.step(np.array([push]))
        ended = terminated or truncated
        states.append(info["state"])
        rewards.append(reward)
    return np.array(states), np.array(rewards)


class Up(SwingUp):
    """A task whose parts a test replaces."""

    def __init__(self, **parts):
        super().__init__()
        for name, part in parts.items():
            object.__setattr__(self, name, part)
