"""A task with which nothing could be learnt is refused in one line before anything runs."""

import numpy as np
import pytest

from sims.pendulum import Pendulum
from sims.simulator import wrap
from sims.system import System
from sims.tasks import SwingUp


class Up(SwingUp):
    """A task whose parts a test replaces."""

    def __init__(self, **parts):
        super().__init__()
        for name, part in parts.items():
            object.__setattr__(self, name, part)


def wild(states, actions, next_states):
    return np.full(len(states), np.nan)


def greedy(states, actions, next_states):
    next_states[:, 0] = wrap(next_states[:, 0])
    return -next_states[:, 0]


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"horizon": 0}, r"horizon is 0, expected a whole number of steps from 2"),
        ({"horizon": 1}, r"horizon is 1, expected a whole number of steps from 2"),
        ({"horizon": 2.5}, r"horizon is 2.5"),
        ({"horizon": None}, r"horizon is None"),
        ({"start": lambda rng: np.zeros(1)}, r"start returned shape \(1,\), expected \(2,\).*rate"),
        ({"start": lambda rng: np.zeros(4)}, r"start returned shape \(4,\)"),
        ({"start": lambda rng: np.array([np.nan, 0.0])}, "expected finite numbers"),
        ({"reward": lambda s, a, n: -n[0, :1]}, r"reward returned shape \(1,\) for 8 rows"),
        ({"reward": lambda s, a, n: -n}, r"reward returned shape \(8, 2\).*next_states\[:, 0\]"),
        ({"reward": lambda s, a, n: n[:, 0] - n[:, 0].max()}, "for a row alone.*among 8"),
        ({"reward": wild}, "reward is nan one step after a start state.*reached was angle"),
        ({"reward": greedy}, "overwrites its arguments"),
        ({"reward": lambda s, a, n: n[:, 7]}, r"does not fit pendulum \(angle, rate\).*IndexError"),
        (
            {"terminal": lambda n: np.sin(n[:, 0])},
            r"terminal returned -?0\.\d+ at angle.*expected",
        ),
        ({"terminal": lambda n: n[:, 0] * np.nan}, r"terminal returned nan at angle"),
        (
            {"terminal": lambda n: n[:, 0] > 2},
            r"Up.terminal is true of 20 of 20 states that Up.start gives, such as angle 3.14\d*, "
            r"rate 0 \(it is angle\): every episode would end",
        ),
        ({"terminal": lambda n: n[0, 0] > 8}, r"terminal returned shape \(\) for 8 rows"),
    ],
)
def test_a_task_that_breaks_its_contract_is_refused_before_anything_runs(parts, says):
    system = System("mine", Pendulum(), Pendulum.true(), Up(**parts))
    with pytest.raises(ValueError, match=f"(?s)system mine: .*{says}"):
        system.check()
    System("mine", Pendulum(), Pendulum.true(), Up()).check()


@pytest.mark.parametrize(
    "terminal",
    [
        lambda n: (n[:, 0] > 9).astype(float),
        lambda n: (n[:, 0] > 9).astype(int),
        lambda n: n[:, 0] > 3.9,  # A third of the starts below.
    ],
)
def test_a_task_that_ends_few_episodes_at_once_is_let_pass(terminal):
    parts = {"terminal": terminal, "start": lambda rng: np.array([rng.uniform(3.0, 4.3), 0.0])}
    System("mine", Pendulum(), Pendulum.true(), Up(**parts)).check()
