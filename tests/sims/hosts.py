"""The two simulators of the pendulum that host effects, and rows to step them from."""

import numpy as np
import pytest

from sims.pendulum import Pendulum
from sims.pendulum_equation import PendulumEquation

HOSTS = {"pymunk": Pendulum(), "equation": PendulumEquation()}
host = pytest.mark.parametrize("host", HOSTS)


def rows(n, seed=0):
    """States (n, 2) and voltages (n, 1)."""
    rng = np.random.default_rng(seed)
    states = np.c_[rng.uniform(-np.pi, np.pi, n), rng.uniform(-12, 12, n)]
    return states, rng.uniform(-3, 3, (n, 1))
